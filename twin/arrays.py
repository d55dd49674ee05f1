"""The type of the arrays in signatures; docstrings say shape, unit and kind of number."""

from typing import Any

from numpy.typing import NDArray

Array = NDArray[Any]
