"""Models and limits as people name them.

A path, the name of a stock file, or one that was read or found before.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from etb_hil.diagnosis.limits import Limits
    from etb_hil.plant.parameters import Model


def as_model(model: Model | str | Path) -> Model:
    """Return a throttle's or a drive's model; InputError where the file is wrong."""
    from etb_hil.plant.parameters import Model

    return Model.load(model) if isinstance(model, str | Path) else model


def as_throttle(model: Model | str | Path) -> Model:
    """Return a throttle's model; InputError where the file is wrong, or a drive's."""
    from etb_hil.base.errors import InputError, Problem

    found = as_model(model)
    if not found.device.is_throttle:
        remedy = "give a throttle's model file (schema etb_hil/model/1)"
        raise InputError(Problem(f"the model '{found.name}' is a drive's, and throttles are simulated", remedy=remedy))
    return found


def as_limits(limits: Limits | str | Path) -> Limits:
    """Return limits; InputError where the file is wrong."""
    from etb_hil.base.stock import find
    from etb_hil.scenario.judged_limits import load_judged_limits

    return load_judged_limits(find("limits", str(limits))) if isinstance(limits, str | Path) else limits
