"""The website of the documentation: ``sphinx-build -W docs build/docs``; it needs no network."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

from study_app import __version__

project = "Liquid Study"
author = "The liquid-study authors"
copyright = f"2026, {author}"
version = release = __version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "numpydoc", "pages"]
source_suffix = {".md": "markdown"}
exclude_patterns = ["examples", "_ext"]
myst_heading_anchors = 4
myst_enable_extensions = ["strikethrough", "tasklist"]

autosummary_generate = False
autodoc_member_order = "bysource"
autodoc_typehints = "none"
numpydoc_show_class_members = False

html_theme = "pydata_sphinx_theme"
html_title = "Liquid Study"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_theme_options = {"show_prev_next": False, "navigation_with_keys": False, "show_nav_level": 2}
html_show_sourcelink = False

linkcheck_timeout = 10
linkcheck_ignore = [r"tcp://", r"tls://", r"http://localhost", r"https://doi\.org/…"]
