"""Template of all pages: one file with style and script, all values escaped.

No other script is allowed.
"""

from __future__ import annotations

import hashlib
from base64 import b64encode
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

_HERE = Path(__file__).parent


def render(
    template: str,
    filters: Mapping[str, Callable[..., Any]] | None = None,
    finalize: Callable[[object], object] | None = None,
    **values: Any,  # noqa: ANN401 (whatever a template shows)
) -> str:
    """Return the page that a template makes of values.

    The template also gets `style`, `zoom`, and `zoom_hash` for its policy.
    """
    environment = Environment(
        loader=FileSystemLoader(_HERE),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        finalize=finalize,
    )
    environment.filters.update(filters or {})
    zoom = (_HERE / "zoom.js").read_text(encoding="utf-8")
    digest = b64encode(hashlib.sha256(zoom.encode()).digest()).decode()
    return environment.get_template(template).render(
        zoom=ours(zoom),
        zoom_hash=ours(f"'sha256-{digest}'"),
        style=ours((_HERE / "report.css").read_text(encoding="utf-8")),
        **values,
    )


def ours(text: str) -> Markup:
    """Mark what the project made, with all names escaped already, as safe."""
    return Markup(text)  # noqa: S704 (style sheet, script and plots; those who draw escape the texts)
