# SPDX-License-Identifier: MIT
"""The documentation site: python -m sphinx -W --keep-going -b html docs build/site (extra `docs`).

The Markdown files are written for a forge and stay as they are; the extensions in `_ext` adapt them to the site.
"""

import sys
from pathlib import Path

import sdftrack

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

project = "sdftrack"
copyright = "the sdftrack contributors"
version = release = sdftrack.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_copybutton",
    "sphinxcontrib.mermaid",
    "repository",
    "contents",
    "api",
    "command_line",
    "options",
]
root_doc = "index"
exclude_patterns = ["_ext", "images/*.py"]
suppress_warnings = ["myst.header"]  # pages may skip a level of heading

# Markdown. Anchors of headings as a forge makes them, so that links with #anchors work in both places.
myst_heading_anchors = 6
myst_enable_extensions = ["colon_fence"]
myst_fence_as_directive = ["mermaid"]  # drawn by the browser; without a network its text is shown
nb_execution_mode = "off"  # notebooks are stored with their outputs; .ci/run executes them
nb_merge_streams = True

# The API reference. Types in numpy-style docstrings are prose, so only references to our own names are checked.
autodoc_default_options = {"members": True, "member-order": "bysource"}
autodoc_typehints = "none"  # signatures stay short; docstrings state types with shapes and units
autodoc_preserve_defaults = True
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True
default_role = "code"  # `name` in a docstring
nitpicky = True
nitpick_ignore_regex = [
    ("py:(class|obj|exc|data)", r"(?!sdftrack\b).*"),
    ("py:class", r".*\.[A-Z]"),
]  # others' names, type variables

html_theme = "furo"
html_title = f"sdftrack {version}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sphinx = False
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True
