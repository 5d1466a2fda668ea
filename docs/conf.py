"""The website of the documentation: ``sphinx-build -W docs build/docs``; it needs no network."""

import sys
from importlib.util import find_spec
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

from study_app import __version__

project = "Liquid Study"
author = "The liquid-study authors"
copyright = f"2026, {author}"
version = release = __version__

NOTEBOOKS = find_spec("myst_nb") is not None  # of the extra docs: else notebooks are files to download
extensions = ["myst_nb" if NOTEBOOKS else "myst_parser", "sphinx.ext.autodoc", "numpydoc", "pages"]
source_suffix = {".md": "myst-nb", ".ipynb": "myst-nb"} if NOTEBOOKS else {".md": "markdown"}
nb_execution_mode, nb_execution_raise_on_error, nb_execution_timeout = "force", True, 600
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
html_js_files = [("search.js", {"defer": "defer"})]
html_theme_options = {"show_prev_next": False, "navigation_with_keys": False, "show_nav_level": 2}
html_show_sourcelink = False

linkcheck_timeout = 10
linkcheck_ignore = [r"tcp://", r"tls://", r"http://localhost", r"https://doi\.org/…"]
