"""How the site is built: `sphinx-build -W -n --keep-going -b html docs build/docs`."""

import sys
from pathlib import Path

import bench

sys.path.append(str(Path(__file__).parent / "extensions"))

project = "plannerbench"
author = "The plannerbench developers"
project_copyright = author
release = bench.__version__

extensions = [
    "myst_nb",  # pages in Markdown, notebooks
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_click",
    "repository_pages",
    "registry_entries",
    "reference_names",
    "offline_check",
]
exclude_patterns = ["extensions"]

html_theme = "furo"
html_title = f"plannerbench {release}"
html_copy_source = False
html_show_sphinx = False

# Headings can be linked to, as they can on the repository's page.
myst_heading_anchors = 3

# A notebook is stored without outputs and run at each build, so that what it shows is true.
nb_execution_mode = "force"
nb_execution_timeout = 300
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_output_stderr = "remove"  # the bars of progress
nb_ipywidgets_js = {}  # else loaded from the network

# Of other projects, whose lists of names would have to come from the network.
nitpick_ignore_regex = [("py:class", r"(collections|enum|numpy|pandas|pathlib)\..+")]

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
# Written out, these would hide everything else.
autodoc_type_aliases = {
    name: name for name in ("Array", "Allowed", "Clearance", "LowerBounds", "Pose")
}
napoleon_numpy_docstring = False
napoleon_use_ivar = True  # attributes as a list, not as entries beside those of the class
napoleon_attr_annotations = False  # docstrings say types, with shapes
napoleon_use_rtype = False  # what is returned in one piece
napoleon_custom_sections = [("Class attributes", "Attributes")]
