"""Friction that differs along the way by more than chance: then T_st and T_c of the curve are those of no place.

Slow windows tell it, both directions' mean, where the bumps that are left out of the curve are left out here too. What
friction would be without whatever raises or lowers it along the way lies somewhere between its lower and higher places,
or a little beyond them where it nowhere levels off.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from etb_hil.diagnosis.bump_fit import by_place
from etb_hil.diagnosis.friction_map import FASTEST
from etb_hil.diagnosis.result import Number, Reason
from etb_hil.diagnosis.stribeck_fit import Evidence, StribeckFit

_LEAST = 0.02  # share of friction: less than that from place to place is as little as the current's gain is known
_CHANCE = 5.0  # standard errors of a place: noise alone has 3.3 between its 5 % and 95 % quantiles


@dataclass(frozen=True, slots=True)
class Place:
    """A place at `angle` rad, where slow friction is `torque` N·m: `excess` (a share) above the fitted curve."""

    angle: float
    torque: float
    excess: float


@dataclass(frozen=True, slots=True)
class UnevenWay:
    """The places of least and most friction, and by which shares T_st and T_c may lie `below` and `above` the curve."""

    least: Place
    most: Place
    below: float
    above: float


def uneven_way(evidence: Evidence, fit: StribeckFit) -> UnevenWay | None:
    """Return how friction differs along the way of the fitted windows; None where chance or too little to matter."""
    shown = (np.abs(evidence.velocity) < FASTEST) & evidence.counts
    angle, excess, error = by_place(evidence, fit, shown)
    if not len(angle):
        return None
    lowest, low, high, highest = np.quantile(excess, (0.05, 0.25, 0.75, 0.95)).tolist()
    if highest - lowest <= max(_LEAST, _CHANCE * float(np.median(error))):
        return None
    stiction, _ = fit.stiction
    least, most = (
        Place(float(angle[k]), stiction * (1.0 + float(excess[k])), float(excess[k]))
        for k in (int(np.argmin(excess)), int(np.argmax(excess)))
    )
    return UnevenWay(
        least,
        most,
        # As far again as the outer quarter of the places spans: where friction levels off that is next to nothing.
        below=min(max(low - 2.0 * lowest, 0.0), 1.0),
        above=max(2.0 * highest - high, 0.0),
    )


def uneven_remarks(way: UnevenWay | None) -> list[Reason]:
    """Return what is said of an uneven way, whatever the verdict; nothing of an even one."""
    if way is None:
        return []
    least, most = way.least, way.most
    text = (
        f"friction differs along the way: it is {least.excess:+.1%} off the fitted curve at {least.angle:.3f} rad and "
        f"{most.excess:+.1%} at {most.angle:.3f} rad; T_st and T_c are means over it, and their intervals hold what "
        "they may be without that"
    )
    return [Reason("uneven_way", text, "see the friction over angle for the places")]


def uneven_numbers(way: UnevenWay | None) -> tuple[Number, ...]:
    """Return where friction is least and most along an uneven way, and how much it is there.

    Without intervals: they are the extremes of many places.
    """
    if way is None:
        return ()
    return tuple(
        number
        for number_id, words, place in (
            ("friction_least", "least slow friction along the way", way.least),
            ("friction_most", "most slow friction along the way", way.most),
        )
        for number in (
            Number(number_id, words, place.torque, "N·m", note=f"{place.excess:+.1%} off the curve"),
            Number(f"{number_id}_at", f"place of the {words}", place.angle, "rad"),
        )
    )
