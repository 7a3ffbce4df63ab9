"""The phase `sinusoid`: a sine about a centre."""

from __future__ import annotations

from typing import ClassVar, Literal

from etb_hil.diagnosis.phase_use import Use
from etb_hil.scenario.sines import SinePhase


class SinusoidPhase(SinePhase):
    """A sinusoidal position reference about a centre."""

    use: ClassVar = Use.FITTED

    kind: Literal["sinusoid"]


PHASE = SinusoidPhase
