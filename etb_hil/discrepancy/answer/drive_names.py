"""Names of a drive's own model file, where ours are a throttle's."""

from __future__ import annotations

from etb_hil.plant.parameters import Model
from etb_hil.results.explanation import ExplanationResult
from etb_hil.results.explanation_file import explanation_as_dict, explanation_from_dict

_IN_A_DRIVES_FILE = {
    "preload_open": "constant_load",
    "motor_inertia": "inertia",
    "stribeck_velocity": "settled_speed",
    "slope_open": "stiffness_above_rest",
    "slope_close": "stiffness_below_rest",
    "limp_home": "spring_rest",
    "throttle_angle": "position",
}


def as_in_its_file(answer: ExplanationResult, model: Model) -> ExplanationResult:
    """Return an answer with a drive's own names of parameters and angle."""
    if model.device.is_throttle:
        return answer
    plain = explanation_as_dict(answer)
    return explanation_from_dict({key: _renamed(value) for key, value in plain.items()})


def _renamed(value: object) -> object:
    if isinstance(value, dict):
        return {_called(key): _renamed(one) for key, one in value.items()}
    if isinstance(value, list):
        return [_renamed(one) for one in value]
    return _called(value) if isinstance(value, str) else value


def _called(text: str) -> str:
    if text in _IN_A_DRIVES_FILE:
        return _IN_A_DRIVES_FILE[text]
    for ours, its in _IN_A_DRIVES_FILE.items():
        text = text.replace(f"parameter:{ours}", f"parameter:{its}")
    return text.replace("throttle angle", "position")
