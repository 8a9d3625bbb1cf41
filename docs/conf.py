"""How Sphinx builds the documentation: ``python -m sphinx -E -W --keep-going -b html docs build/docs``."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from sphinx.ext.autodoc.mock import MockFinder

DOCS = Path(__file__).parent

# the tree beside this file is documented, whatever is installed
sys.path[:0] = [str(DOCS / "_ext"), str(DOCS.parent / "src")]
# compiled functions hide their signatures; nothing is computed here but the figures
os.environ["NUMBA_DISABLE_JIT"] = "1"
# what these are is not documented here, and they are larger than all else together
sys.meta_path.insert(0, MockFinder(["stable_baselines3", "torch"]))

project = "Tickwise"
author = "The Tickwise developers"
copyright = "the Tickwise developers"

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "commands",
    "figures",
    "markdown",
    "modules",
    "papermap",
    "session",
    "sourcelines",
]
exclude_patterns = ["_ext", "_static", "images"]
suppress_warnings: list[str] = []
# a name in backticks in a docstring is linked where it is one of ours
default_role = "py:obj"

myst_enable_extensions = ["attrs_block", "attrs_inline", "colon_fence", "deflist"]
myst_heading_anchors = 3

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_default_options = {"members": True, "no-value": True, "ignore-module-all": True}
autodoc_class_signature = "mixed"
add_module_names = False
maximum_signature_line_length = 90
python_use_unqualified_type_names = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
napoleon_attr_annotations = False
napoleon_use_rtype = False
# only what a module defines itself is documented, so nothing is to be followed
viewcode_follow_imported_members = False
toc_object_entries_show_parents = "hide"

html_theme = "furo"
html_title = "Tickwise"
html_static_path = ["_static"]
html_css_files = ["tickwise.css"]
html_show_sourcelink = False
html_copy_source = False
html_show_copyright = False
html_use_index = True
html_theme_options = {
    "top_of_page_buttons": [],
    "light_css_variables": {"color-brand-primary": "#00618f", "color-brand-content": "#00618f"},
    "dark_css_variables": {"color-brand-primary": "#56b4e9", "color-brand-content": "#6fc0ee"},
}
pygments_style = "friendly"
pygments_dark_style = "github-dark"
