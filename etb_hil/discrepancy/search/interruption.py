"""The answer after an interrupt: a calibration without intervals, and stages done."""

from __future__ import annotations

from etb_hil.discrepancy.fitting.calibration import Calibration
from etb_hil.discrepancy.fitting.unknowns import FIELDS
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import PARAMETERS
from etb_hil.plant.value_units import value_unit
from etb_hil.results.explained.models import CalibratedParameter
from etb_hil.results.explanation import ExplanationResult


class Interrupted(KeyboardInterrupt):
    """An interrupt before the search began, with the calibration known by then."""

    def __init__(self, calibration: Calibration) -> None:
        super().__init__()
        self.calibration = calibration


def calibrated_so_far(calibration: Calibration, model: Model) -> dict[str, CalibratedParameter]:
    """Return the calibrated base parameters without intervals."""
    return {
        unknown.name: CalibratedParameter(
            unit=value_unit(unknown.name, is_linear=model.device.is_linear),
            nominal=float(getattr(model.values, unknown.name)),
            value=float(calibration.fit.whole[unknown.place]),
            interval=None,
            tolerance=model.tolerance(unknown.name),
            flags=("interrupted before its interval was known",),
        )
        for unknown in calibration.unknowns
        if unknown.place < PARAMETERS and unknown.name in FIELDS
    }


def stages(answer: ExplanationResult, *, is_read: bool, is_searched: bool) -> str:
    """Say which stages were done and which were not."""
    works = {
        "reading the data": is_read,
        "calibrating": bool(answer.calibrated),
        "looking for causes": is_searched,
        "errors on held-out segments": answer.errors is not None,
    }
    done, not_done = ([name for name, is_done in works.items() if is_done == wanted] for wanted in (True, False))
    said = [f"done: {', '.join(done)}"] if done else []
    said += [f"not done: {', '.join(not_done)}, and what follows from it"] if not_done else ["not done: what follows"]
    return "; ".join(said)
