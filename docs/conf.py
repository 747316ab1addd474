"""Settings of the documentation site: `make docs`."""

from importlib.metadata import version as version_of

project = "pbcs_ompl"
author = "The pbcs_ompl developers"
copyright = "2026, the pbcs_ompl developers"
version = release = version_of("pbcs-ompl")

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.viewcode", "sphinx_copybutton"]
exclude_patterns = ["_build", "paper"]
html_theme = "furo"
html_title = "pbcs_ompl"
html_static_path = []

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
napoleon_google_docstring = True
napoleon_use_rtype = False
napoleon_use_ivar = True
default_role = "code"
