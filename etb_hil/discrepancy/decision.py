"""What is said of a search: adequate, explained, ambiguous, unexplained; and when a suspect is taken in.

Balances that know their own noise well (angle, voltage) accuse; the torque nearly at rest and on the stops varies so
much between devices that it never accuses alone.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.candidates import MODEL_FILE_NAME
from etb_hil.discrepancy.findings import Findings, Round
from etb_hil.discrepancy.floor import LEAST_ROWS
from etb_hil.discrepancy.refining import Refined

Float64 = NDArray[np.float64]

# Mean square over the floor that a healthy case may show: torque, voltage, angle; each on a stop, slow, sliding.
BAND = np.array([10.0, 3.0, 1.6, 6.0, 1.25, 2.0, 1.6, 1.25, 1.35])
# What varies so much between healthy devices that it accuses alone only where it is this many times its band.
LOOSE = np.array([True, True, False, True, False, False, False, False, False])
ALONE = 6.0
EXPLAINED_SHARE = 0.93  # of the excess over the floor
PARAMETER_SHARE = 0.98  # likewise: a wrong number has no other shape that might leave something
LEAST_GAIN = 0.04  # of the squared residual, beyond what the suspect takes of the model's own simulation
HEALTHY_TIMES = 2.0
LATER_GAIN = 0.25
LATER_T = 4.0
LOCAL = 0.3  # of the range of the motion: what is wider is not at one place
LATER_CERTAIN = 0.8  # of what is left: what takes as much is a cause, whatever else might take it
LATER_PARAMETER = 0.5  # a parameter that leaves its tolerance after an effect may be no more than the effect's shape
GROUP_GAIN = np.array([4.0, 1.0, 0.25, 1.2, 0.12, 0.35, 0.4, 0.12, 0.2])  # of a group's floor, likewise
CERTAIN_GAIN = 0.5
CONCENTRATED = 0.33
NEARLY_FLOOR = 1.2
LEAST_T = 1.5  # over the held-out segments
LEAST_BEYOND = 1.2  # tolerances off its nominal value that a parameter must be before it is a cause
CLASS_MARGIN = 0.05
CLASS_SHARE = 0.15  # of what the winner gains
PLACEHOLDER = 0.3  # share of the rest that a nameless spline may take after a true cause
TRIFLE = 0.005  # of the whole excess: a spline that takes less accuses nobody


def parameter_id(name: str) -> str:
    """Return the id under which a base parameter is a cause; nothing for nuisances and effects' own."""
    if name.endswith(("_skew", "_zero")) or "." in name:
        return ""
    return f"parameter:{MODEL_FILE_NAME.get(name, name)}"


def class_margin(found: Round) -> float:
    """Return how close in log cost a rival has to come to be in the winner's class."""
    gained = float(np.log(found.before.fit.cost / found.winner.fit.cost))
    return min(CLASS_MARGIN, CLASS_SHARE * max(gained, 0.0))


def excess(groups: Float64, rows: NDArray[np.int64]) -> Float64:
    """Return what each group has over its band, in rows of the floor."""
    judged = rows >= LEAST_ROWS
    return np.where(judged, rows * np.maximum(groups - BAND, 0.0), 0.0)


def refusal(found: Round, findings: Findings) -> str:
    """Return why the winner is no cause, nothing where it is: suspects gain where nothing is missing, too."""
    judged = findings.rows >= LEAST_ROWS
    least = LEAST_GAIN + HEALTHY_TIMES * found.healthy_gain
    if findings.accepted:
        if reason := _refusal_after_others(found, findings):
            return reason
        # After one cause, what another takes may be no more than that the first one's shape is not quite ours.
        least = max(least, LATER_GAIN if found.t < LATER_T else 2.0 * LEAST_GAIN)
        if found.winner.candidate.frees:
            least = max(least, LATER_PARAMETER)
    if not found.gain > least:
        return f"takes {100.0 * found.gain:.1f} % of what is left; a cause takes {100.0 * least:.1f} %"
    if not (found.before_groups - found.after_groups > GROUP_GAIN)[judged].any():
        return "brings no balance down by more than chance does"
    # What sits in few segments scores low over all of them although it is certain: t guards small gains only, and none
    # that bring a group which was over its band back into it, to a fraction or the floor.
    down = np.minimum(np.maximum(CONCENTRATED * found.before_groups, NEARLY_FLOOR), BAND)
    is_concentrated = (found.before_groups > BAND) & (found.after_groups < down)
    if found.t <= LEAST_T and found.gain <= CERTAIN_GAIN and not (is_concentrated & judged).any():
        return f"does not hold on segments that the fit did not see: t is {found.t:.1f}"
    return _refusal_by_size(found, findings, judged)


def _refusal_by_size(found: Round, findings: Findings, judged: NDArray[np.bool_]) -> str:
    # Nothing calls for a cause, and this one would be as strong as can be: it fits what differs between devices.
    if _is_on_bound(found.winner) and not _accuses(found.before_groups, judged):
        return "its strength is on a bound where nothing was over its band"
    if _is_no_wave(found.winner):
        return "its period is longer than the range it was seen in: it stands for something else"
    if _is_everywhere(found.winner, findings):
        return "its width is a good part of the range it was seen in: it stands for something else"
    return "" if _is_beyond(found.winner) else "inside its tolerance, or next to it"


def _refusal_after_others(found: Round, findings: Findings) -> str:
    if found.gain < LATER_CERTAIN and _is_on_bound(found.winner):
        return "its strength is on a bound: it stands for something else"
    if {r.winner.id for r in findings.accepted} & set(found.alike):
        return "cannot be told from a cause that was found before"
    # What base parameters imitate but for a fifth trades with them once something else stands in for them.
    if found.gain < LATER_CERTAIN and any(name.startswith("parameter:") for name in found.alike):
        return "base parameters do nearly the same: it would trade with them"
    return ""


def _is_beyond(winner: Refined) -> bool:
    """Tell whether a base parameter, where it is the winner, lies well outside its tolerance."""
    frees = winner.candidate.frees
    return not frees or any(abs(u.x_of(winner.fit.whole)) > LEAST_BEYOND for u in winner.unknowns if u.name == frees)


def _is_on_bound(winner: Refined) -> bool:
    """Tell whether a strength of the winner lies on its bound: it stands for something else, then."""
    effect = winner.candidate.effect
    if effect is None:
        return False
    strengths = {effect.indices[k] for k in effect.strengths}
    own = [(u, u.x_of(winner.fit.whole)) for u in winner.unknowns if u.place in strengths]
    return any(x <= u.low + 1e-6 or x >= u.high - 1e-6 for u, x in own)


def _is_no_wave(winner: Refined) -> bool:
    """Tell whether a periodic winner's order lies on its lower bound: a part of a wave is any curve."""
    orders = [u for u in winner.unknowns if u.name == f"{winner.id}.order"]
    return any(u.x_of(winner.fit.whole) <= u.low + 1e-6 for u in orders)


def _is_everywhere(winner: Refined, findings: Findings) -> bool:
    """Tell whether a local winner is as wide as much of the motion: so wide a bump is any curve, too."""
    range_seen = max(float(np.ptp(b.measured.angle)) for b in findings.balances)
    widths = [float(winner.fit.whole[u.place]) for u in winner.unknowns if u.name == f"{winner.id}.width"]
    return any(width > LOCAL * range_seen for width in widths)


def is_more_missing(findings: Findings) -> bool:
    """Tell whether the last cause left more than its floor."""
    return bool(excess(findings.final_groups, findings.rows).sum() > 0.0)


def verdict(findings: Findings) -> str:
    """Return the verdict of a search."""
    first = excess(_first_groups(findings), findings.rows).sum()
    last = excess(findings.final_groups, findings.rows).sum()
    accepted = findings.accepted
    accuses = _accuses(findings.final_groups, findings.rows >= LEAST_ROWS)
    if findings.is_cut_short:
        return "unexplained" if first > 0.0 else "insufficient_data"
    if not accepted:
        return "unexplained" if accuses else "adequate"
    # What is left of a cause's shape has no shape of its own; a spline that takes it tells of something else.
    left = last / max(first, 1e-12)
    is_shapeless = all(spline.share <= max(PLACEHOLDER, TRIFLE / max(left, 1e-12)) for spline in findings.rest)
    share = EXPLAINED_SHARE if any(r.winner.candidate.effect for r in accepted) else PARAMETER_SHARE
    explained = not accuses or (left <= 1.0 - share and is_shapeless)
    if not explained:
        return "unexplained"
    return "ambiguous" if any(r.alike for r in accepted) else "explained"


def _accuses(groups: Float64, judged: NDArray[np.bool_]) -> bool:
    """Tell whether a group is over its band that may accuse alone, or so far over it that even a loose one may."""
    return bool((judged & (groups > np.where(LOOSE, ALONE * BAND, BAND))).any())


def _first_groups(findings: Findings) -> Float64:
    return findings.rounds[0].before_groups if findings.rounds else findings.final_groups
