"""Friction that drifts along the record, by temperature or by use."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.candidates.nonparametric import filtered
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import Calibration
from etb_hil.discrepancy.fitting.cross_validation import FOLDS, fold_of, held_out
from etb_hil.discrepancy.fitting.unknowns import Unknown
from etb_hil.plant.effects import ports
from etb_hil.plant.effects.effect import REFERENCE
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.physics import COULOMB, Vector

Float64 = NDArray[np.float64]

DRIFTS = "friction changes along the record, but does not follow the temperature"
WEARS = "friction falls while it cools, as in running-in: repeat the record at the first temperature"

# Decision 0032. Rates by these thresholds: benchmarks/explain_study.py, kinds `strong` and `outside`.
_KNOTS = 9
# What is held out comes from all over the record: of a tenth in one piece a curve over time would know nothing.
_PIECES = 4 * FOLDS
_TURNS = 0.05  # rad/s about a reversal; above it the plate slides
_LEAST = 0.02  # of the rest
_LEAST_WITH_OTHERS = 0.25  # likewise beside other causes, whose own shapes leave something, too
_LEAST_T = 1.5  # over the held-out tenths
_COMES_BACK = 0.5  # of what friction fell by: use gives nothing back


def drifts(found: Calibration, balances: Sequence[Balances], *, is_alone: bool) -> bool:
    """Tell whether friction over time explains part of the residual.

    `is_alone`: given one cause, not several.
    """
    share, t = over_time(found, balances)
    return share > (_LEAST if is_alone else _LEAST_WITH_OTHERS) and t > _LEAST_T


def wears(whole: Vector, stated: Vector, balances: Sequence[Balances]) -> bool:
    """Tell whether a law of `whole` lets friction fall monotonically as it cools.

    That is beside the `stated` law. Use does that, too. A lubricant changes the other way; where friction falls as it
    warms that comes first.
    """
    temperatures = np.concatenate([b.spectrum.picked(b.measured.temperature) for b in balances])
    warm = np.array([REFERENCE - 1.0, REFERENCE + 1.0])
    shares, ways = (_shares(at, whole[:EXTENDED]) - _shares(at, stated[:EXTENDED]) for at in (temperatures, warm))
    risen = float((shares - np.minimum.accumulate(shares)).max())
    fallen = float((np.maximum.accumulate(shares) - shares).max())
    return bool(ways[1] > ways[0]) and risen < _COMES_BACK * fallen


def _shares(temperatures: Float64, p: Vector) -> Float64:
    return np.array([ports.friction_heat(float(one), p) - 1.0 for one in temperatures])


def over_time(found: Calibration, balances: Sequence[Balances]) -> tuple[float, float]:
    """Return the share of the residual that friction over time explains, and its t.

    Both are cross-validated. Base parameters stay within their tolerances: outside of them a wrong friction would mask
    the drift.
    """
    fit = found.fit
    friction = float(fit.whole[COULOMB])
    splines = _splines(balances, fit.whole[:EXTENDED]) * friction
    # Each stands for the Coulomb friction at its knot, which is not negative.
    knots = [Unknown(f"coulomb.{k}", COULOMB, friction, friction, low=-1.0, high=1.0) for k in range(_KNOTS)]
    segment = fold_of(balances, _PIECES) % FOLDS
    without = held_out(fit, found.jacobian, found.unknowns, segment)
    with_splines = held_out(fit, np.column_stack([found.jacobian, splines]), [*found.unknowns, *knots], segment)
    return float(np.sum(without.cost - with_splines.cost)) / fit.cost, with_splines.t_against(without)


def _splines(balances: Sequence[Balances], p: Vector) -> Float64:
    """Return the Jacobian (n, knots) of a friction force about each knot of time."""
    times = [b.measured.start_s + np.arange(len(b.measured)) * b.measured.dt for b in balances]
    velocities = [b.motion(p)[1] for b in balances]
    knots = _knots(np.concatenate(times), np.abs(np.concatenate(velocities)))
    found = []
    for b, seconds, velocity in zip(balances, times, velocities, strict=True):
        hats = np.column_stack([np.interp(seconds, knots, sample) for sample in np.eye(_KNOTS)])
        found.append(filtered(b, -hats * np.tanh(velocity / _TURNS)[:, None], 0))
    return np.concatenate(found)


def _knots(seconds: Float64, speed: Float64) -> Float64:
    """Return the knots in s, with equal sliding between any two."""
    slides = speed > min(_TURNS, 0.5 * float(speed.max()))
    return np.asarray(np.quantile(seconds[slides], np.linspace(0.0, 1.0, _KNOTS)))
