"""Names, shares and texts as people read them.

Values of measurements are in `results.shown`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from etb_hil.results.shown import UNKNOWN

if TYPE_CHECKING:
    from etb_hil.results.run_result import Phase


def share(value: float | None) -> str:
    """Return a share of 1 in per cent."""
    return UNKNOWN if value is None or not math.isfinite(value) else f"{100.0 * value:.1f} %"


def printable(text: str, longest: int = 200) -> str:
    """Return a text without control characters, cut to a length.

    No name can steer a terminal or flood a page.
    """
    clean = "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text)
    return clean if len(clean) <= longest else clean[: longest - 3] + "..."


def phase_name(phase: Phase) -> str:
    """Return the name of a phase as its scenario's author knows it."""
    return (phase.id or phase.name).replace("_", " ")
