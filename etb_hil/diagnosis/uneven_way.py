"""Friction that differs along the way by more than chance.

Then T_st and T_c of the curve are those of no place.

Slow windows that slide tell it, both directions' mean, where the bumps that are left out of the curve are left out here
too. What friction would be without whatever raises or lowers it along the way lies somewhere between its lower and
higher places, or a little beyond them where it nowhere levels off. What is finer than a cell is seen where passes
repeat it. Windows in which bristles may still bend do not count: they begin at the same places in every pass.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from etb_hil.diagnosis.bump_fit import by_place, excess_of
from etb_hil.diagnosis.evidence import Evidence
from etb_hil.diagnosis.friction_map import FASTEST
from etb_hil.diagnosis.friction_model import steady_level
from etb_hil.diagnosis.result import Reason
from etb_hil.diagnosis.ripple import pass_of, shared_by_passes
from etb_hil.diagnosis.stribeck_fit import StribeckFit
from etb_hil.recording.samples import Float64

# False and missed ones: benchmarks/interval_coverage.py, without --bump and with each of its kinds.
_LEAST = 0.02  # share of friction: less than that from place to place is as little as the current's gain is known
_CHANCE = 5.0  # standard errors of a place: noise alone has 3.3 between its 5 % and 95 % quantiles
_LEAST_RIPPLE = 0.006  # share of friction, root of the mean square: what spans 2 % between those quantiles
_REPEATS = 0.3  # share of its variance that a ripple repeats at least: a friction check's noise repeats 0.06 by chance
_SMOOTHED = 2.0  # times what is seen of a ripple: bristles and windows smooth one of 0.02 rad to three fifths


@dataclass(frozen=True, slots=True)
class Place:
    """A place at `angle` rad, where slow friction is `torque` N·m.

    `excess` is the share by which that is above the fitted curve.
    """

    angle: float
    torque: float
    excess: float


@dataclass(frozen=True, slots=True)
class UnevenWay:
    """The places of least and most friction along an uneven way.

    T_st and T_c may lie above and below the curve by the shares `above` and `below`. `is_fine` where friction goes up
    and down within a cell: the plate slows down where it is high, and so it passes for friction that falls with speed.
    """

    least: Place
    most: Place
    below: float
    above: float
    is_fine: bool = False


def uneven_way(evidence: Evidence, fit: StribeckFit) -> UnevenWay | None:
    """Return how friction differs along the way of the fitted windows.

    None where that is chance or too little to matter.
    """
    shown = (np.abs(evidence.velocity) < FASTEST) & evidence.counts & evidence.slides
    fine, coarse = _fine(evidence, fit, shown), _coarse(evidence, fit, shown)
    if fine is None or coarse is None:
        return fine or coarse
    wider = fine if fine.most.torque - fine.least.torque > coarse.most.torque - coarse.least.torque else coarse
    return replace(wider, below=max(fine.below, coarse.below), above=max(fine.above, coarse.above), is_fine=True)


def _fine(evidence: Evidence, fit: StribeckFit, shown: NDArray[np.bool_]) -> UnevenWay | None:
    """Return a way that is uneven within cells; None where passes do not repeat it."""
    number = pass_of(evidence.velocity)
    angle, speed, excess = evidence.position[shown], evidence.velocity[shown], excess_of(evidence, fit)[shown]
    shared, whole = shared_by_passes(angle, speed, number[shown], excess)
    if shared <= max(_LEAST_RIPPLE * _LEAST_RIPPLE, _REPEATS * whole):
        return None
    lowest, highest = np.quantile(excess, (0.05, 0.95)).tolist()
    least, most = (int(np.argmin(np.abs(excess - share))) for share in (lowest, highest))
    below, above = max(-_SMOOTHED * lowest, 0.0), max(_SMOOTHED * highest, 0.0)
    return _way(evidence, fit, shown, (angle[[least, most]], excess[[least, most]]), (below, above), is_fine=True)


def _coarse(evidence: Evidence, fit: StribeckFit, shown: NDArray[np.bool_]) -> UnevenWay | None:
    """Return a way that is uneven from cell to cell.

    None where that is chance or too little to matter.
    """
    angle, excess, error = by_place(evidence, fit, shown)
    if not len(angle):
        return None
    lowest, low, high, highest = np.quantile(excess, (0.05, 0.25, 0.75, 0.95)).tolist()
    if highest - lowest <= max(_LEAST, _CHANCE * float(np.median(error))):
        return None
    # As far again as the outer quarter of the places spans: where friction levels off that is next to nothing.
    below, above = max(low - 2.0 * lowest, 0.0), max(2.0 * highest - high, 0.0)
    ends = [int(np.argmin(excess)), int(np.argmax(excess))]
    return _way(evidence, fit, shown, (angle[ends], excess[ends]), (below, above), is_fine=False)


def _way(
    evidence: Evidence,
    fit: StribeckFit,
    shown: NDArray[np.bool_],
    ends: tuple[Float64, Float64],
    reach: tuple[float, float],
    *,
    is_fine: bool,
) -> UnevenWay:
    """Return the way between places of least and most friction.

    `ends` are their angles in rad, and their shares off the curve. `reach` are the shares below and above the curve,
    there where slow windows are. Where the curve falls before their speeds, T_st is nowhere seen, and may as well be
    what they show.
    """
    stiction, _ = fit.stiction
    seen = float(np.median(steady_level(evidence.velocity[shown], fit.parameters))) / stiction
    least, most = (Place(float(a), stiction * seen * (1.0 + float(e)), float(e)) for a, e in zip(*ends, strict=True))
    below = 1.0 - max(1.0 - reach[0], 0.0) * min(seen, 1.0)
    return UnevenWay(least, most, below, (1.0 + reach[1]) * max(seen, 1.0) - 1.0, is_fine)


def uneven_remarks(way: UnevenWay | None) -> list[Reason]:
    """Return the remark on an uneven way, none on an even one.

    The remark is made whatever the verdict.
    """
    if way is None:
        return []
    least, most = way.least, way.most
    text = (
        f"friction differs along the way: it is {least.excess:+.1%} off the fitted curve at "
        f"{math.degrees(least.angle):.1f} deg and "
        f"{most.excess:+.1%} at {math.degrees(most.angle):.1f} "
        f"deg{', up and down within a degree' if way.is_fine else ''}; T_st and "
        "T_c are means over it, and their intervals hold what they may be without that"
    )
    return [Reason("uneven_way", text)]
