"""The steel rig as a dense structure, which several of these tests compare with."""

from dense_steel import build, other_base, steel_dense, steel_model  # noqa: F401
