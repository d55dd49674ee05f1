"""How Sphinx builds the site: ``sphinx-build -W -j auto docs build/site``, after ``pip install ".[docs]"``.

The pages are the Markdown of this folder and the README; the notebooks run when it is built.
"""

from __future__ import annotations

import os
from importlib.metadata import version as version_of

project = "Virtual test rig"
author = "The virtual test rig authors"
version = release = version_of("virtual-test-rig")
html_title = f"{project} {version}"
html_theme = "furo"

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["**/*.py"]
suppress_warnings = ["ref.python"]  # names of attributes that several classes have
default_role = "code"
autodoc_default_options = {"members": True, "show-inheritance": True}
autodoc_member_order = "bysource"
napoleon_use_ivar = True

nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 600  # of one cell, s
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does: the matrices are small
