"""Sentence about the residual of an answer without a cause.

The sentence says what the residual follows, and how it acts.
"""

from __future__ import annotations

from etb_hil.results.explanation import ExplanationResult

_MOST = 0.5  # of the rest
_FRICTION, _TORQUE = "friction that changes {}, against the motion whichever way", "a {force} that changes {}"
_EITHER_WAY = f"{_TORQUE}, the same whichever way it moves"
_SINCE = "as time goes on"
_LOOKS_LIKE = {
    ("torque", "angle", "odd"): _FRICTION.format("with the {angle}"),
    ("torque", "angle", "even"): _EITHER_WAY.replace("{}", "with the {angle}"),
    ("torque", "velocity", "odd"): _TORQUE.replace("{}", "with the speed and its direction, as friction or drag does"),
    ("torque", "time", "odd"): _FRICTION.format(_SINCE),
    ("torque", "time", "even"): _EITHER_WAY.replace("{}", _SINCE),
    ("torque", "angle, times velocity", "odd"): "drag that grows with the speed and changes with the {angle}",
    ("voltage", "current", "odd"): "a voltage in the motor's circuit that changes with the current",
    ("voltage", "time, times current", "odd"): f"a resistance that changes {_SINCE}",
    ("voltage", "time, times velocity", "odd"): f"a motor constant that changes {_SINCE}",
    ("voltage", "angle", "even"): "a voltage in the motor's circuit that changes with the {angle}",
    ("angle", "angle", "even"): "a difference between the two angles that changes along the way",
    ("angle", "angle", "odd"): "a difference between the two angles that turns round with the direction, as play does",
}


def residual_text(found: ExplanationResult) -> str:
    """Return what most of the residual looks like.

    The text is empty unless an answer is `unexplained` and one curve takes that much.
    """
    greediest = max(found.unexplained.nonparametric_terms, key=lambda one: one.explained_share, default=None)
    if found.verdict != "unexplained" or greediest is None or greediest.explained_share < _MOST:
        return ""
    share = f"{100.0 * greediest.explained_share:.0f} %"
    if greediest.balance == "all":
        wrong = "numbers of the model file that are wrong by more than their tolerances allow"
        return f"{share} of the residual looks like {wrong}: is it the right model file?"
    looks_like = _LOOKS_LIKE[greediest.balance, greediest.over, greediest.parity]
    is_linear = any(one.unit == "N" for one in found.friction.values())
    words = {"force": "force", "angle": "position"} if is_linear else {"force": "torque", "angle": "angle"}
    return f"{share} of the residual looks like {looks_like.format(**words)}."
