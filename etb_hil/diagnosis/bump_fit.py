"""The fit of a unit with a local bump: without it, the bump draws the curve towards itself.

Slow windows in a bump are left out. Fast ones smear over more than it, and there are few of them: they are kept, with
the friction that slow windows have shown at each place on their way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from etb_hil.diagnosis.friction_map import CELL, FASTEST, Bump, find_bumps, friction_map
from etb_hil.diagnosis.friction_model import steady_level
from etb_hil.diagnosis.local_friction import local_means
from etb_hil.diagnosis.prior import CONSTANT, Prior
from etb_hil.diagnosis.stribeck_fit import Evidence, StribeckFit, refit
from etb_hil.diagnosis.ticks import Ticks
from etb_hil.diagnosis.windows import Windows
from etb_hil.recording.samples import Float64

_TURNS = 3  # the curve falls without the bump, and more of the bump stands out of it
_MOST = 0.3  # share of the way that bumps may take: beyond it they are how the unit is


def excess_of(evidence: Evidence, fit: StribeckFit) -> Float64:
    """Return by what share friction lies above the fit at each window (m), in the direction of motion."""
    along = np.where(evidence.velocity > 0.0, fit.residual, -fit.residual) * (1.0 + fit.parameters[CONSTANT])
    return along / steady_level(evidence.velocity, fit.parameters)


def without_bumps(ticks: Ticks, windows: Windows, evidence: Evidence, prior: Prior, fit: StribeckFit) -> StribeckFit:
    """Return the fit with its bumps taken out; the same one where it has none, or where they are all over."""
    for _ in range(_TURNS):
        bumps = _bumps(evidence, fit)
        if not bumps:
            return fit
        slow = np.abs(evidence.velocity) < FASTEST
        inside = _inside(evidence.position, bumps)
        if np.count_nonzero(inside & slow) > _MOST * np.count_nonzero(slow):
            return fit
        known = replace(evidence, local=_factor(ticks.angle, evidence, fit, bumps), counts=~(inside & slow))
        better = refit(ticks, windows, known, prior, fit.parameters)
        if better is None:
            return fit
        fit = better
    return fit


def _bumps(evidence: Evidence, fit: StribeckFit) -> list[Bump]:
    slow = np.abs(evidence.velocity) < FASTEST
    if not np.any(slow):
        return []
    columns = {
        "point_angle": evidence.position[slow],
        "point_velocity": evidence.velocity[slow],
        "point_excess": excess_of(evidence, fit)[slow],
        "point_temperature": np.full(int(np.count_nonzero(slow)), np.nan),  # one run is one temperature
    }
    return find_bumps(friction_map([columns]))


def _inside(angle: Float64, bumps: Sequence[Bump]) -> NDArray[np.bool_]:
    """Return which angles (n) lie in a bump, or in the cell beside it that it may reach into."""
    inside = np.zeros(len(angle), np.bool_)
    for bump in bumps:
        inside |= (angle > bump.start - CELL) & (angle < bump.end + CELL)
    return inside


def _factor(angle: Float64, evidence: Evidence, fit: StribeckFit, bumps: Sequence[Bump]) -> Float64:
    """Return the factor on friction at angles (n): in bumps what slow windows show there, 1 elsewhere."""
    slow = np.abs(evidence.velocity) < FASTEST
    share = np.where(evidence.velocity > 0.0, 1.0, -1.0) * excess_of(evidence, fit)
    middle, odd, _, _ = local_means(evidence.position[slow], evidence.velocity[slow], share[slow])
    factor = np.where(_inside(middle, bumps), 1.0 + odd, 1.0)
    found: Float64 = np.interp(angle, middle, factor)
    return found
