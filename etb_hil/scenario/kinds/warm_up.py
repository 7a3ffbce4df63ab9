"""The phase `warm_up`: motion until a signal has settled."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from etb_hil.scenario.condition import Until
from etb_hil.scenario.sines import SinePhase


class WarmUpPhase(SinePhase):
    """Move the plate until a signal has settled.

    The signal is the temperature or the current, for example; nothing of the phase is judged.
    """

    kind: Literal["warm_up"]
    until: Annotated[Until, Field(description="what ends the warm-up; `duration` is the longest that it may take")]


PHASE = WarmUpPhase
