"""Errors and free runs on the page of an explanation."""

from __future__ import annotations

from typing import Any

from etb_hil.report.explain_values import scale, words
from etb_hil.results.explained.errors import Errors, Gain
from etb_hil.results.explanation import ExplanationResult

_MOST = 0.5  # of the squared error
_MODELS = ("reference", "calibrated", "extended", "fitted_in_free_run", "noise_floor")
CALLED = {
    "reference": "reference model",
    "calibrated": "calibrated model",
    "extended": "extended model",
    "fitted_in_free_run": "extended model, fitted in free run",
    "noise_floor": "noise floor",
}
_KINDS = {"one_step": "10 ms ahead", "free_run": "free run"}


def error_rows(found: ExplanationResult) -> list[dict[str, Any]]:
    """Return the error of each signal with each model."""
    rows = []
    for kind, signals in found.errors.holdout.items() if found.errors else ():
        for signal, models in signals.items():
            rms = {name: getattr(models, name) for name in _MODELS}
            times, unit = scale([one for one in rms.values() if one is not None], models.unit)
            numbers = ["-" if rms[name] is None else f"{times * rms[name]:.3g} {unit}" for name in shown_models(found)]
            rows.append({"signal": signal.replace("_", " "), "kind": _KINDS[kind], "numbers": numbers})
    return rows


def shown_models(found: ExplanationResult) -> list[str]:
    """Return the models that any of the errors is of."""
    rows = [models for signals in found.errors.holdout.values() for models in signals.values()] if found.errors else []
    return [name for name in _MODELS if any(getattr(models, name) is not None for models in rows)]


def gain_text(found: ExplanationResult) -> str:
    """Return by how much the error is smaller than that of the other models."""
    gain = found.gain
    if gain is None or not (found.causes or found.runs):
        return ""
    if found.runs:
        starts = found.starts.text.capitalize() if found.starts else ""
        return f"Fitted to other runs, the error is {_less(gain)} than the reference model's. {starts}."
    return (
        "Free run on parts of the record that no fit used: the extended model's error is "
        f"{_less(gain.over_reference or gain)} than the reference model's, "
        f"and {_less(gain)} than the calibrated model's."
    )


def _less(gain: Gain) -> str:
    """Return by how much something errs less, or more, with the interval."""
    low, high = gain.interval
    if low * high <= 0.0:
        return f"{_by(gain.value)} ({_by(low)} to {_by(high)})"
    least, most = sorted(abs(100.0 * end) for end in gain.interval)
    return f"{_by(gain.value)} ({least:.0f} to {most:.0f} %)"


def _by(gain: float) -> str:
    return f"{abs(100.0 * gain):.0f} % {'smaller' if gain >= 0.0 else 'larger'}"


def variance_text(found: ExplanationResult) -> str:
    """Return the range of the noise floor in free run.

    An error inside it does not speak against a model.
    """
    if found.errors is None or found.errors.noise_floor_range is None:
        return ""
    least, most = found.errors.noise_floor_range
    signal, models = next(iter(found.errors.holdout["free_run"].items()))
    times, unit = scale([most], models.unit)
    return (
        f"In free run, noise alone causes an error of {times * least:.3g} to {times * most:.3g} {unit} in the "
        f"{words(signal)}. It varies because noise decides whether it just breaks away."
        f"{_in_one_part(found.errors)}"
    )


def _in_one_part(errors: Errors) -> str:
    """Return where most of a free run's error is, if that is one segment.

    What noise alone left there stands beside it.
    """
    worst = errors.free_run_worst
    if worst is None or worst.share < _MOST:
        return ""
    least, most = worst.noise_floor_range
    _, models = next(iter(errors.holdout["free_run"].items()))
    times, unit = scale([worst.error, most], models.unit)
    return (
        f" Most of the extended model's error is between {worst.from_s:.4g} and {worst.to_s:.4g} s: "
        f"{times * worst.error:.3g} {unit}, against {times * worst.others:.3g} {unit} elsewhere. Noise alone "
        f"causes {times * least:.3g} to {times * most:.3g} {unit} there."
    )


def run_rows(found: ExplanationResult) -> list[dict[str, str]]:
    """Return the free runs of slow data."""

    def volts(value: float | None) -> str:
        return "-" if value is None else f"{value:.2f} V"

    times, unit = scale([run.rms_rad for run in found.runs], "rad")
    return [
        {
            "name": f"{words(run.condition)} {run.value:g} {run.unit}" if run.condition else f"run {number}",
            "begins": f"{run.start_s:.0f} s",
            "use": "fitted" if run.used_in_fit else "predicted",
            "r_squared": f"{run.r_squared:.3f}",
            "rms": f"{times * run.rms_rad:.3g} {unit}",
            "measured": volts(run.break_away_voltage.measured_v),
            "model": volts(run.break_away_voltage.model_v),
        }
        for number, run in enumerate(found.runs, 1)
    ]
