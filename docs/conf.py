"""How the documentation is built: `sphinx-build -W docs build/docs`; the reference is made from the code first."""

import os
import re
import shutil
import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

import reference  # noqa: E402 (it stands beside this file)

reference.write(HERE / "reference")

# Tables of results stand beside the commands that make them; the pages show copies.
RESULTS = HERE / "explanation" / "results"
shutil.copytree(HERE.parent / "benchmarks" / "results", RESULTS, dirs_exist_ok=True)


def _to_copies(_, page, source):
    """Lead links to results, pages and source to where a build has them."""
    copies, made = (os.path.relpath(folder, (HERE / page).parent) for folder in (RESULTS, HERE / "reference"))
    text = re.sub(r"(?:\.\./)+benchmarks/results/", f"{copies}/", source[0])
    text = re.sub(r"\((?:\.\./)+docs/", f"({os.path.relpath(HERE, (HERE / page).parent)}/", text)
    text = re.sub(r"\((?:\.\./)+etb_hil/api/\)", f"({made}/python.md)", text)
    source[0] = re.sub(r"\((?:\.\./)+etb_hil/(\w+)/[\w/]*(?:\.py)?\)", rf"({made}/packages/\1.md)", text)


def setup(app):
    app.connect("source-read", _to_copies)


project = "etb_hil"
extensions = ["myst_nb", "sphinx.ext.autodoc"]
myst_heading_anchors = 3

# Every build runs the notebooks, each in a temporary folder, by its own interpreter; one that fails stops it.
nb_execution_mode = "force"
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 900  # seconds for a cell; a machine that has not run the package yet compiles for minutes
nb_merge_streams = True
html_theme = "furo"
html_title = "etb_hil"
html_show_copyright = False
html_static_path = ["static"]
html_css_files = ["pages.css"]
highlight_language = "none"
default_role = "literal"  # single backticks in docstrings
autodoc_typehints = "signature"
autodoc_member_order = "bysource"
exclude_patterns = ["examples"]
