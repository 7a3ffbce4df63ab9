"""The verdict of a search: adequate, explained, ambiguous or unexplained.

Balances with a well-known noise (angle, voltage) are evidence. Torque nearly at rest and on the stops varies so much
between devices that it is evidence alone only far above its threshold.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.candidates import candidate
from etb_hil.discrepancy.fitting.noise_floor import LEAST_SAMPLES
from etb_hil.discrepancy.search.findings import Findings, SelectionStep
from etb_hil.discrepancy.search.friction_drift import DRIFTS, WEARS

Float64 = NDArray[np.float64]

# Mean square over the noise floor that a healthy case may show: torque, voltage, angle; each on a stop, slow, sliding.
# Healthy units: benchmarks/explain_study.py, kind `nothing`. Decision 0030.
THRESHOLD = np.array([10.0, 3.0, 1.6, 6.0, 1.25, 2.0, 1.6, 1.25, 1.35])
# Groups that vary so much between healthy devices that they reject alone only at REJECTS_ALONE times the threshold.
LOOSE = np.array([True, True, False, True, False, False, False, False, False])
REJECTS_ALONE = 6.0
REJECTING = np.where(LOOSE, REJECTS_ALONE * THRESHOLD, THRESHOLD)
_OWN = 0.6  # share of independent readings among the samples: 60 to 90 Hz pass, at 250 Hz
_SURE = 3.0  # standard deviations; from 1200 samples on every threshold is wider
EXPLAINED_SHARE = 0.93  # of the excess over the noise floor
PARAMETER_SHARE = 0.98  # likewise: a parametric fault has no shape that may differ from the unit's
AMBIGUITY_MARGIN = 0.05
AMBIGUITY_SHARE = 0.15  # of what the winner gains
NONPARAMETRIC_SHARE = 0.3  # largest share of the residual that a spline explains after a true cause
UNTOUCHED = 0.5  # share of a group's excess over its threshold: where more remains, no cause has reduced the group
TRIFLE = 0.005  # of the whole excess: a spline that explains less rejects nothing


def parameter_id(name: str) -> str:
    """Return a base parameter's id as a cause; empty for nuisances and effects."""
    if name.endswith(("_time_offset", "_zero")) or "." in name:
        return ""
    return candidate.parameter_id(name)


def ambiguity_margin(found: SelectionStep) -> float:
    """Return the margin in log cost within which a hypothesis is ambiguous."""
    gained = float(np.log(found.before.fit.cost / found.winner.fit.cost))
    return min(AMBIGUITY_MARGIN, AMBIGUITY_SHARE * max(gained, 0.0))


def excess(groups: Float64, samples: NDArray[np.int64]) -> Float64:
    """Return each group's excess over its threshold, in samples of the noise floor."""
    judged = samples >= LEAST_SAMPLES
    return np.where(judged, samples * np.maximum(groups - THRESHOLD, 0.0), 0.0)


def is_more_missing(findings: Findings) -> bool:
    """Tell whether a group exceeds its threshold with all causes."""
    return bool(excess(findings.final_groups, findings.samples).sum() > 0.0)


def verdict(findings: Findings) -> str:
    """Return the verdict of a search."""
    first = excess(findings.first_groups, findings.samples).sum()
    last = excess(findings.final_groups, findings.samples).sum()
    accepted = findings.accepted
    is_rejected = rejects(findings.final_groups, beyond_chance(findings.final_groups, findings.samples))
    if findings.is_interrupted:
        return "unexplained" if first > 0.0 else "insufficient_data"
    if any(r.rejection in (DRIFTS, WEARS) for r in findings.selection_steps) or any(r.rejection for r in accepted):
        return "unexplained"  # it is there, or it would not have been a cause, whatever threshold it is in
    if not accepted:
        return "unexplained" if is_rejected else "adequate"
    has_effects = any(r.winner.candidate.effect for r in accepted)
    # An error of a cause's shape has no shape of its own; a spline that explains it shows something else.
    left = last / max(first, 1e-12)
    # An effect that is any curve over its coordinate has a chosen form (of springs: a knee, coils that touch).
    effects = [r.winner.candidate.effect for r in accepted]
    own = [(one.balance.name.lower(), one.curve_over, one.parity) for one in effects if one and one.curve_over]
    unmodelled = [spline for spline in findings.rest if (spline.balance, spline.over, spline.parity) not in own]
    is_shapeless = all(spline.share <= max(NONPARAMETRIC_SHARE, TRIFLE / max(left, 1e-12)) for spline in unmodelled)
    share = EXPLAINED_SHARE if has_effects else PARAMETER_SHARE
    is_their_shape = left <= 1.0 - share and is_shapeless and not _is_untouched(findings)
    explained = not is_rejected or is_their_shape
    if not explained:
        return "unexplained"
    if any(r.ambiguity_group for r in accepted):
        return "ambiguous"
    # What numbers stand for has a curve, which shows inside the thresholds, too.
    return "explained" if has_effects or findings.curve <= 1.0 - PARAMETER_SHARE else "unexplained"


def _is_untouched(findings: Findings) -> bool:
    """Tell whether a group still rejects the model and the causes hardly changed it."""
    judged = findings.samples >= LEAST_SAMPLES
    first, last = (np.maximum(groups - THRESHOLD, 0.0) for groups in (findings.first_groups, findings.final_groups))
    return bool((judged & (findings.final_groups > REJECTING) & (last > UNTOUCHED * first)).any())


def beyond_chance(groups: Float64, samples: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which groups exceed the noise floor significantly for their sample count."""
    apart = np.sqrt(4.0 / (_OWN * np.maximum(samples, LEAST_SAMPLES)))
    return np.asarray((samples >= LEAST_SAMPLES) & (groups > 1.0 + _SURE * apart))


def rejects(groups: Float64, judged: NDArray[np.bool_]) -> bool:
    """Tell whether a group exceeds the level at which it rejects the model alone."""
    return bool((judged & (groups > REJECTING)).any())
