"""The fit of a unit with a local bump.

A bump that stayed in the fit would draw the curve towards itself.

Windows that pass a bump are left out, fast ones too: they smear over more than it. Friction that differs from place to
place and is no bump makes the fit less sure: fast windows pass other places than slow ones, and their difference passes
for speed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from etb_hil.diagnosis.evidence import Evidence
from etb_hil.diagnosis.friction_map import CELL, FASTEST, Bump, find_bumps, friction_map
from etb_hil.diagnosis.friction_model import steady_level
from etb_hil.diagnosis.local_friction import local_means
from etb_hil.diagnosis.prior import CONSTANT, Prior
from etb_hil.diagnosis.stribeck_fit import StribeckFit, fit_stribeck, widened_by
from etb_hil.recording.samples import Float64

_TURNS = 3  # the curve falls without the bump, and more of the bump stands out of it
_MOST = 0.3  # share of the way that bumps may take: beyond it they are how the unit is


def excess_of(evidence: Evidence, fit: StribeckFit) -> Float64:
    """Return by what share friction lies above the fit at each window (m).

    Friction counts in the direction of motion.
    """
    along = np.where(evidence.velocity > 0.0, fit.residual, -fit.residual) * (1.0 + fit.parameters[CONSTANT])
    return along / steady_level(evidence.velocity, fit.parameters)


def by_place(evidence: Evidence, fit: StribeckFit, shown: NDArray[np.bool_]) -> tuple[Float64, Float64, Float64]:
    """Return the excess of friction over the fit, cell by cell.

    The results are the middles of the cells (b) in rad, the excess as a share (b), and its standard error (b). The
    windows `shown` (m) are used.
    """
    share = np.where(evidence.velocity > 0.0, 1.0, -1.0) * excess_of(evidence, fit)
    middle, odd, _, error = local_means(
        evidence.position[shown], evidence.velocity[shown], share[shown], evidence.overlap
    )
    return middle, odd, error


def without_bumps(evidence: Evidence, prior: Prior, fit: StribeckFit) -> tuple[Evidence, StribeckFit]:
    """Return the evidence and the fit with bumps taken out.

    Bumps that are all over stay in it; so does what is too low, too broad or too near an end to be a bump.
    """
    known, slow = evidence, np.abs(evidence.velocity) < FASTEST
    for _ in range(_TURNS):
        bumps = _bumps(evidence, fit)
        inside = _inside(evidence.position, bumps) & slow
        if not bumps or np.count_nonzero(inside) > _MOST * np.count_nonzero(slow):
            break
        tried = replace(evidence, counts=~_passing(evidence, bumps))
        better = fit_stribeck(tried, prior)  # anew: a bump leads into a valley of its own
        if better is None:
            break
        known, fit = tried, better
    return known, fit


def unsure_by_place(evidence: Evidence, prior: Prior, fit: StribeckFit) -> StribeckFit:
    """Return a fit as unsure as what friction has left by place makes it."""
    shown = (np.abs(evidence.velocity) < FASTEST) & evidence.counts & evidence.slides
    middle, odd, _ = by_place(evidence, fit, shown)
    if not len(middle):
        return fit
    uneven = evidence.over_time * (1.0 + np.interp(evidence.ticks.angle, middle, odd))
    return widened_by(evidence, prior, fit, uneven)


def _bumps(evidence: Evidence, fit: StribeckFit) -> list[Bump]:
    slow = np.abs(evidence.velocity) < FASTEST
    if not np.any(slow):
        return []
    columns = {
        "point_angle": evidence.position[slow],
        "point_velocity": evidence.velocity[slow],
        "point_excess": excess_of(evidence, fit)[slow],
        "point_temperature": np.full(int(np.count_nonzero(slow)), np.nan),  # one run is one temperature
        "point_overlap": np.full(int(np.count_nonzero(slow)), evidence.overlap),
    }
    return find_bumps(friction_map([columns]))


def _inside(angle: Float64, bumps: Sequence[Bump]) -> NDArray[np.bool_]:
    """Return which angles (n) lie in a bump or in the cell beside it.

    A bump may reach into that cell.
    """
    inside = np.zeros(len(angle), np.bool_)
    for bump in bumps:
        inside |= (angle > bump.start - CELL) & (angle < bump.end + CELL)
    return inside


def _passing(evidence: Evidence, bumps: Sequence[Bump]) -> NDArray[np.bool_]:
    """Return which windows (m) hold angles of ticks (n) in a bump."""
    ticks_inside = np.concatenate([[0], np.cumsum(_inside(evidence.ticks.angle, bumps))])
    centre, half = evidence.windows.centre, evidence.windows.shape.half
    return ticks_inside[centre + half + 1] > ticks_inside[centre - half]
