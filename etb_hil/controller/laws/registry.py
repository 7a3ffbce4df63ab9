"""The position laws by name: every file in `kinds` declares one as `LAW`.

Plug-ins add theirs.
"""

from __future__ import annotations

from etb_hil.base.named_parts import NamedParts
from etb_hil.base.plugins import Part
from etb_hil.controller.laws import kinds
from etb_hil.controller.laws.interface import ControlLaw

DEFAULT = "pd"


def _check(part: Part) -> None:
    law: ControlLaw = part.value
    part.require_text("summary", law.summary)
    part.require_function("gains", law.gains, "nominal")
    part.require_function("torque", law.torque, "gain", "memory", "error", "rate")


LAWS = NamedParts("laws", kinds, "control law", ControlLaw, _check)
