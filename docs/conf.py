"""How the documentation is built: `sphinx-build -W docs build/docs`; the reference is made from the code first."""

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

import reference  # noqa: E402 (it stands beside this file)

reference.write(HERE / "reference")

project = "etb_hil"
extensions = ["myst_parser"]
myst_heading_anchors = 3
html_theme = "alabaster"
html_theme_options = {
    "description": "A hardware-in-the-loop bench for electronic throttle bodies",
    "page_width": "70rem",
}
html_show_copyright = False
highlight_language = "none"
exclude_patterns = ["examples"]
