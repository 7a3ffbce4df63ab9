"""Add the types that only the Python interface takes to the checks of arguments."""

from __future__ import annotations

from etb_hil.base.arguments import TYPES, checked

__all__ = ["checked"]


def _is_model(value: object) -> bool:
    from etb_hil.plant.parameters import Model

    return isinstance(value, Model)


def _is_limits(value: object) -> bool:
    from etb_hil.diagnosis.limits import Limits

    return isinstance(value, Limits)


def _is_recording(value: object) -> bool:
    from etb_hil.recording.recording import Recording

    return isinstance(value, Recording)


TYPES.update({
    "Model": ("a Model", _is_model),
    "Limits": ("Limits", _is_limits),
    "Recording": ("a Recording", _is_recording),
})  # fmt: skip
