"""The seed paper's section IV from end to end: runs, pictures, one table.

The page lists what of the paper had to be read.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from etb_hil.base.outcome import UnitVerdict
from etb_hil.diagnosis.result import DiagnosisResult
from etb_hil.observer.estimate import FrictionEstimate
from etb_hil.paper import figures
from etb_hil.paper.estimation import Numbers, estimate, numbers_of
from etb_hil.paper.production import diagnosed
from etb_hil.paper.properties import BoundedBristles, Passage, SlowEnough, bounded_bristles, passage, slow_enough
from etb_hil.paper.readings import Reading, readings
from etb_hil.paper.setups import HOLD_S, STEPS, Motion, controlled, driven, faulty, healthy, sinusoid, steps
from etb_hil.paper.trade import Trade, trade
from etb_hil.plant.integrator import TICK
from etb_hil.report.drawing import save_png

_SINE_S = 4.0
_SPANS = {"sinusoid": (1.0, 1.5), "step": (0.55, 2.55)}
_VOLTS_PER_SECOND = 40.0
_RISE_S = 0.3
_ACCELERATIONS = (5.0, 50.0, 500.0)  # rad/s^2
_FACTORS = (0.25, 0.5, 1.0, 2.0)  # on omega_s
_STARTS = (-1.0, 0.0, 0.5, 1.0)  # times T_st / sigma_0


@dataclass(frozen=True, slots=True)
class SetUp:
    """One of figures 4 to 7: what happened, and how it is estimated.

    The figure has the paper's estimate with its numbers, and this project's diagnosis.
    """

    figure: int
    title: str
    kind: str
    motion: Motion
    found: FrictionEstimate
    numbers: Numbers
    diagnosis: DiagnosisResult

    @property
    def picture(self) -> str:
        """The name of its picture."""
        return f"fig{self.figure}_{'faulty' if self.figure > 5 else 'normal'}_{self.kind}"


@dataclass(frozen=True, slots=True)
class Properties:
    """Properties 1 to 3 in numbers, for the healthy and the faulty unit.

    `passages` and `slow` are the faulty one's.
    """

    healthy: BoundedBristles
    faulty: BoundedBristles
    passages: Sequence[Passage]
    slow: Sequence[SlowEnough]
    slow_healthy: SlowEnough


@dataclass(frozen=True, slots=True)
class Reproduction:
    """Everything that the paper's section IV and its properties come to."""

    set_ups: Sequence[SetUp]
    trades: dict[str, Trade]
    properties: Properties
    readings: Sequence[Reading]


def reproduce(folder: Path) -> Reproduction:
    """Run everything and write the pictures into an existing folder."""
    set_ups = [
        _set_up(4, "normal unit, sinusoid", "sinusoid", faulty_unit=False),
        _set_up(5, "normal unit, steps", "step", faulty_unit=False),
        _set_up(6, "faulty unit, sinusoid", "sinusoid", faulty_unit=True),
        _set_up(7, "faulty unit, steps", "step", faulty_unit=True),
    ]
    trades = {"sinusoid": trade(set_ups[2].motion), "step": trade(set_ups[3].motion)}
    properties = _properties()
    for name, figure in _pictures(set_ups, trades, properties).items():
        save_png(figure, folder / f"{name}.png")
    return Reproduction(set_ups, trades, properties, readings(set_ups[0].motion, set_ups[2].motion))


def _set_up(number: int, title: str, kind: str, *, faulty_unit: bool) -> SetUp:
    unit = faulty() if faulty_unit else healthy()
    reference, duration = (sinusoid(), _SINE_S) if kind == "sinusoid" else (steps, HOLD_S * len(STEPS))
    motion = controlled(unit, reference, duration)
    found = estimate(motion)
    return SetUp(number, title, kind, motion, found, numbers_of(motion, found), diagnosed(motion, kind))


def _properties() -> Properties:
    good, bad = healthy(), faulty()
    rng = np.random.default_rng(1)
    return Properties(
        bounded_bristles(good, rng),
        bounded_bristles(bad, rng),
        [passage(bad, start, _ACCELERATIONS[0]) for start in _STARTS],
        [slow_enough(bad, factor) for factor in _FACTORS],
        slow_enough(good, 1.0),
    )


def _pictures(set_ups: Sequence[SetUp], trades: dict[str, Trade], properties: Properties) -> dict[str, Figure]:
    good, bad = healthy(), faulty()
    voltage = np.arange(round(_RISE_S / TICK), dtype=np.float64) * (_VOLTS_PER_SECOND * TICK)
    one_input = [
        (f"T_st = {unit.stiction:.3f}, T_c = {unit.coulomb:.3f} N·m", driven(unit, voltage, unit.limp_home))
        for unit in (good, bad)
    ]
    pictures = {
        "fig2_friction": figures.friction_under_one_input(one_input, _VOLTS_PER_SECOND),
        "fig3_spring": figures.spring_over_angle(good),
        "trade_sinusoid": figures.trade_of_filter("Faulty unit, sinusoid", trades["sinusoid"]),
        "trade_steps": figures.trade_of_filter("Faulty unit, steps", trades["step"]),
        "property3": figures.passages(bad, _ACCELERATIONS, properties.slow),
    }
    for one in set_ups:
        title = f"Fig. {one.figure}: {one.title}"
        pictures[one.picture] = figures.estimated_friction(title, one.motion, one.found, one.numbers, _SPANS[one.kind])
    return pictures


def is_as_the_paper_says(done: Reproduction) -> list[str]:
    """Return what of the paper's claims (section IV) the runs do not bear out.

    Nothing where all hold.
    """
    by_figure = {one.figure: one for one in done.set_ups}
    missing = []
    for kind, normal, fault in (("sinusoid", 4, 6), ("step", 5, 7)):
        small, large = (_difference(by_figure[number].numbers) for number in (normal, fault))
        if large < 3.0 * small:
            missing.append(f"{kind}: the difference of T_st and T_c grows from {small:.3f} to {large:.3f} N·m only")
        if by_figure[fault].numbers.underestimated <= 0.0:
            missing.append(f"{kind}: T_st of the faulty unit is not underestimated")
        if by_figure[fault].diagnosis.verdict is not UnitVerdict.FAIL:
            missing.append(f"{kind}: the faulty unit does not fail")
    return missing


def _difference(numbers: Numbers) -> float:
    return numbers.stiction - (numbers.coulomb or 0.0)
