"""What is said of a search: adequate, explained, ambiguous, unexplained.

Balances that know their own noise well (angle, voltage) blame; the torque nearly at rest and on the stops varies so
much between devices that it never blames alone.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.fitting.floor import LEAST_ROWS
from etb_hil.discrepancy.search.drifting import DRIFTS, WEARS
from etb_hil.discrepancy.search.findings import Findings, Round
from etb_hil.discrepancy.suspects import candidates

Float64 = NDArray[np.float64]

# Mean square over the noise floor that a healthy case may show: torque, voltage, angle; each on a stop, slow, sliding.
# Healthy units: benchmarks/explain_study.py, kind `nothing`. Decision 0030.
BAND = np.array([10.0, 3.0, 1.6, 6.0, 1.25, 2.0, 1.6, 1.25, 1.35])
# What varies so much between healthy devices that it blames alone only where it is this many times its band.
LOOSE = np.array([True, True, False, True, False, False, False, False, False])
ALONE = 6.0
ACCUSING = np.where(LOOSE, ALONE * BAND, BAND)
_OWN = 0.6  # of the samples are independent readings: 60 to 90 Hz pass, at 250 Hz
_SURE = 3.0  # standard deviations; from 1200 samples on every band is wider
EXPLAINED_SHARE = 0.93  # of the excess over the noise floor
PARAMETER_SHARE = 0.98  # likewise: a parametric fault has no other shape that might leave something
CLASS_MARGIN = 0.05
CLASS_SHARE = 0.15  # of what the winner gains
PLACEHOLDER = 0.3  # share of the rest that a nameless spline may take after a true cause
UNTOUCHED = 0.5  # of what a group has over its band: where as much stays, it is no cause's to leave
TRIFLE = 0.005  # of the whole excess: a spline that takes less blames nobody


def parameter_id(name: str) -> str:
    """Return the id under which a base parameter is a cause; nothing for nuisances and effects' own."""
    if name.endswith(("_skew", "_zero")) or "." in name:
        return ""
    return candidates.parameter_id(name)


def class_margin(found: Round) -> float:
    """Return how close in log cost a competing hypothesis has to come to be in the winner's class."""
    gained = float(np.log(found.before.fit.cost / found.winner.fit.cost))
    return min(CLASS_MARGIN, CLASS_SHARE * max(gained, 0.0))


def excess(groups: Float64, rows: NDArray[np.int64]) -> Float64:
    """Return what each group has over its band, in samples of the noise floor."""
    judged = rows >= LEAST_ROWS
    return np.where(judged, rows * np.maximum(groups - BAND, 0.0), 0.0)


def is_more_missing(findings: Findings) -> bool:
    """Tell whether the last cause left more than its noise floor."""
    return bool(excess(findings.final_groups, findings.rows).sum() > 0.0)


def verdict(findings: Findings) -> str:
    """Return the verdict of a search."""
    first = excess(findings.first_groups, findings.rows).sum()
    last = excess(findings.final_groups, findings.rows).sum()
    accepted = findings.accepted
    is_accused = accuses(findings.final_groups, beyond_chance(findings.final_groups, findings.rows))
    if findings.is_cut_short:
        return "unexplained" if first > 0.0 else "insufficient_data"
    if any(r.refused in (DRIFTS, WEARS) for r in findings.rounds) or any(r.refused for r in accepted):
        return "unexplained"  # it is there, or it would not have been a cause, whatever band it is in
    if not accepted:
        return "unexplained" if is_accused else "adequate"
    has_effects = any(r.winner.candidate.effect for r in accepted)
    # An error of a cause's shape has no shape of its own; a spline that explains it shows something else.
    left = last / max(first, 1e-12)
    # An effect that is any curve over its coordinate has a chosen form (of springs: a knee, coils that touch).
    effects = [r.winner.candidate.effect for r in accepted]
    own = [(one.balance.name.lower(), one.curve_over, one.parity) for one in effects if one and one.curve_over]
    strangers = [spline for spline in findings.rest if (spline.balance, spline.over, spline.parity) not in own]
    is_shapeless = all(spline.share <= max(PLACEHOLDER, TRIFLE / max(left, 1e-12)) for spline in strangers)
    share = EXPLAINED_SHARE if has_effects else PARAMETER_SHARE
    is_their_shape = left <= 1.0 - share and is_shapeless and not _is_untouched(findings)
    explained = not is_accused or is_their_shape
    if not explained:
        return "unexplained"
    if any(r.alike for r in accepted):
        return "ambiguous"
    # What numbers stand for has a curve, which shows inside the bands, too.
    return "explained" if has_effects or findings.curve <= 1.0 - PARAMETER_SHARE else "unexplained"


def _is_untouched(findings: Findings) -> bool:
    """Tell whether a group blames still that the causes have hardly touched: what their shapes leave is less."""
    judged = findings.rows >= LEAST_ROWS
    first, last = (np.maximum(groups - BAND, 0.0) for groups in (findings.first_groups, findings.final_groups))
    return bool((judged & (findings.final_groups > ACCUSING) & (last > UNTOUCHED * first)).any())


def beyond_chance(groups: Float64, rows: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which groups are farther over the floor than two mean squares of as few samples are apart by chance."""
    apart = np.sqrt(4.0 / (_OWN * np.maximum(rows, LEAST_ROWS)))
    return np.asarray((rows >= LEAST_ROWS) & (groups > 1.0 + _SURE * apart))


def accuses(groups: Float64, judged: NDArray[np.bool_]) -> bool:
    """Tell whether a group is over its band that may blame alone, or so far over it that even a loose one may."""
    return bool((judged & (groups > ACCUSING)).any())
