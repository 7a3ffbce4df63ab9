"""The report of an explanation: one HTML page, and its plots.

A technician understands it at a glance.
"""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from markupsafe import Markup

from etb_hil import __version__
from etb_hil.base.files import write_text
from etb_hil.discrepancy.answer.folder import WRITTEN
from etb_hil.discrepancy.answer.pictures import Pictures
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.report import explain_plots
from etb_hil.report.drawing import figure_of, save_png
from etb_hil.report.page_template import ours, render
from etb_hil.report.svg import svg_of
from etb_hil.report.what_is_left import what_is_left
from etb_hil.results.explanation import (
    LAST_FIT,
    BenchNumber,
    Calibrated,
    Cause,
    DataQuality,
    Errors,
    ExplanationResult,
    Gain,
    JudgedNumber,
    Size,
    Suspect,
    Wanted,
)

REPORT_NAME = "explanation.html"

_TONES = {
    "adequate": "good",
    "explained": "good",
    "ambiguous": "unsure",
    "unexplained": "bad",
    "insufficient_data": "unsure",
}
_REASONS = {
    "adequate": "The model describes these data within the noise of the sensors.",
    "explained": "The causes below explain the errors of the model.",
    "ambiguous": "These data cannot distinguish some causes: each of those named together is possible.",
    "unexplained": "The model lacks an effect that no known cause explains.",
    "insufficient_data": "These data do not suffice to judge the model.",
}
_CUT_SHORT = "The search was interrupted: causes that were not tried yet remain possible."
_IN_PART = "The causes below explain a part of the errors; no known cause explains the rest."
_BY_RUNS = (
    "These data are sampled too slowly to name causes. The model was fitted to some runs and simulated on the others "
    "from the voltage alone. Its error there exceeds the sensor's noise: the model lacks an effect."
)
_ADEQUATE_BY_RUNS = (
    "Simulated from the voltage alone, the model follows runs that were not used in the fit within the sensor's noise."
)
_NO_TEST = (
    "No stock test distinguishes further: no two candidates explain half of the residual each. Look for an effect that "
    "acts as shown below."
)
_MOST = 0.5  # of the squared error
_MODELS = ("nominal", "calibrated", "extended", "followed", "noise_floor")
_CALLED = {
    "nominal": "reference model",
    "calibrated": "calibrated model",
    "extended": "extended model",
    "followed": "extended model, fitted in free run",
    "noise_floor": "noise floor",
}
_SMALL = 0.01  # m: where all numbers of a line are smaller, they are in millimetres
_PICTURES = (
    "before_and_after",
    "over_runs",
    *(
        f"{balance}_over_{over}"
        for balance in ("torque", "force", "voltage", "angle")
        for over in ("position", "motor_turn", "velocity", "time", "temperature", "current")
    ),
)
REPORT_FILES = (REPORT_NAME, *(f"{name}.png" for name in _PICTURES))
_KINDS = {"one_step": "10 ms ahead", "free_run": "free run"}


def write_explanation(
    found: ExplanationResult, series: Pictures | None, folder: Path, inputs: Sequence[Path] = ()
) -> Path:
    """Write `explanation.html` and its plots as PNG; return the page's path.

    The folder exists.

    `inputs` are the files and sessions that it was made from.
    """
    for name in _PICTURES:  # an earlier answer's are not of these data
        (folder / f"{name}.png").unlink(missing_ok=True)
    drawn = []
    if series is not None:
        plots = {"before_and_after": explain_plots.before_and_after(series)}
        for left in series.left:
            plots[f"{left.balance}_over_{left.over}".replace(" ", "_")] = explain_plots.left_over(left)
        if series.runs is not None:
            plots["over_runs"] = explain_plots.over_runs(series.runs)
        for name, chart in plots.items():
            save_png(figure_of(chart), folder / f"{name}.png")
            drawn.append((name, ours(svg_of(chart, name))))
    return write_text(folder / REPORT_NAME, _page(found, drawn, folder, inputs))


def _page(found: ExplanationResult, drawn: list[tuple[str, Markup]], folder: Path, inputs: Sequence[Path]) -> str:
    verdict = found.verdict
    return render(
        "explain.html.jinja",
        headline=verdict.replace("_", " ").upper(),
        tone=_TONES[verdict],
        named=_named(found),
        reason=_reason(found),
        further=_further(found),
        next_test=_next_test(found),
        causes=[row for cause in found.causes for row in _cause(cause, is_followed=_is_followed(found))],
        model_file=_model_file(found),
        drawn=drawn,
        models=[_CALLED.get(name, name) for name in _shown(found)],
        errors=_errors(found),
        gain=_gain(found),
        variance=_variance(found),
        candidates=[_candidate(one, found.causes) for one in found.suspects],
        moved=_moved(found),
        runs=_runs(found),
        friction=_friction(found),
        judged=_judged(found),
        quality=[_quality(one) for one in found.data_quality],
        limits=_limits(found),
        written=f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC",
        version=__version__,
        inputs=[(path.name, _hash(path)) for path in inputs],
        links=[name for name in WRITTEN if (folder / name).is_file()],
    )


def _hash(path: Path) -> str:
    """Return the SHA-256 of a file, or of a session's description."""
    file = path / "session.json" if path.is_dir() else path
    return hashlib.sha256(file.read_bytes()).hexdigest() if file.is_file() else ""


def _named(found: ExplanationResult) -> str:
    """Return the causes that an answer names, each with all that it may be.

    An answer that names none gives an empty text.
    """
    if found.verdict not in ("explained", "ambiguous"):
        return ""
    groups: dict[tuple[str, ...], list[str]] = {}
    for one in found.causes:
        groups.setdefault(one.indistinguishable, []).append(_words(one.id))
    names = "; ".join(" or ".join((" and ".join(ids), *map(_words, others))) for others, ids in groups.items())
    return f"{one_component(found)} {names[:1].upper()}{names[1:]}.".lstrip()


def one_component(found: ExplanationResult) -> str:
    """Return in a sentence the component that all indistinguishable causes sit in."""
    if found.verdict != "ambiguous" or not found.component:
        return ""
    return f"All possible causes sit in one component: {found.component}."


def _reason(found: ExplanationResult) -> str:
    if found.interrupted:
        return _CUT_SHORT
    if found.runs and found.verdict != "insufficient_data":
        return _BY_RUNS if found.verdict == "unexplained" else _ADEQUATE_BY_RUNS
    return _IN_PART if found.verdict == "unexplained" and found.causes else _REASONS[found.verdict]


def _further(found: ExplanationResult) -> list[str]:
    sentences = []
    if found.interrupted:
        sentences.append(f"It was interrupted while {_words(found.interrupted)}; the answer is what was known then.")
        sentences.append(f"{found.stages[0].upper()}{found.stages[1:]}.")
    sentences += filter(None, [what_is_left(found)])
    sentences += [
        f"Residual of the {where.balance} balance, {where.regime}: {where.rms_over_floor:.1f} times its noise floor."
        for where in found.unexplained.where[:3]
    ]
    for says in filter(None, (found.unexplained.says, found.errors.says if found.errors else "")):
        sentences.append(f"{says[0].upper()}{says[1:]}.")
    if known := [_known(one) for one in found.measured]:
        sentences.append(f"Measured at the bench, and so no candidate: {'; '.join(known)}.")
    sentences += [
        f"{one.recording} distinguishes {_words(one.effect)} from {', '.join(map(_words, one.tells_from))}."
        for one in found.told_apart_by_others
    ]
    sentences += [f"{one.effect} in {one.recording}: {one.says}." for one in found.transfer]
    return sentences + [f"{one.these}: {one.says}" for one in found.confounded]


def _known(one: BenchNumber) -> str:
    """Return a number that was measured.

    What the model file states without it is added where that is off.
    """
    unit = "" if one.unit == "1" else f" {one.unit}"
    off = f", {one.stated:.3g} stated within {one.tolerance:.2g}" if one.is_cause else ""
    name = one.name.replace("_", " ").replace(".", ": ")
    return f"{name} {one.value:.4g} +- {one.uncertainty:.2g}{unit}{_at(one.shaft)}{off}"


def _cause(cause: Cause, *, is_followed: bool) -> list[dict[str, Any]]:
    """Return a row of a fitted cause, and one of each indistinguishable from it."""
    sizes = [_size(name.replace("_", " "), p, is_followed=is_followed) for name, p in cause.sizes.items()]
    finer = cause.finer_in_model.items()
    sizes += [f"{name.replace('_', ' ')}: {value:.3g} in the model file alone" for name, value in finer]
    *most, last = map(_words, (cause.id, *cause.indistinguishable))
    group = f"{', '.join(most)} and {last}" if most else ""
    first = _row(cause.id) | {"share": f"{100.0 * cause.share:.0f} %", "sizes": sizes, "group": group}
    others = [_row(id_) | {"share": "", "sizes": [], "group": ""} for id_ in cause.indistinguishable]
    return [first, *(other | {"name": f"or {other['name']}"} for other in others)]


def _row(id_: str) -> dict[str, Any]:
    effect = CATALOGUE.get(id_)
    return {
        "name": _words(id_),
        "looks_like": effect.looks_like if effect else "a number of the model is outside its tolerance",
        "check": effect.check if effect else "the number and its tolerance in the model file",
    }


def _size(name: str, p: Size, *, is_followed: bool) -> str:
    """Return a size with its interval, with as many digits as the interval leaves."""
    low, high = p.interval
    digits = _digits(0.5 * (high - low), p.value)
    times, unit = _scale((), p.unit)
    value, least, most = (f"{times * one:.{digits}g}" for one in (p.value, low, high))
    unit = "" if unit == "1" else f" {unit}"
    flags = "".join(f", {one}" for one in p.flags)
    said = f"{name}: {value}{unit} ({least} to {most}){flags}"
    if not is_followed or p.in_model is None:
        return said
    return f"{said}; in the model file {times * p.in_model:.{digits}g}{unit}"


def _digits(half: float, value: float) -> int:
    """Return the significant digits of a value that is known to `half`.

    Two of the unsure ones are among them.
    """
    if not half > 0.0 or value == 0.0:
        return 3
    return min(max(2 + math.floor(math.log10(abs(value))) - math.floor(math.log10(half)), 2), 6)


def _is_followed(found: ExplanationResult) -> bool:
    return found.model_file is not None and found.model_file.numbers_of == LAST_FIT


def _model_file(found: ExplanationResult) -> str:
    says = found.model_file.says if found.model_file is not None and _is_followed(found) else ""
    return f"{says[:1].upper()}{says[1:]}." if says else ""


def _words(id_: str) -> str:
    return re.sub(r"^parameter:(.*)", r"parametric fault of \1", id_).replace("_", " ")


def _errors(found: ExplanationResult) -> list[dict[str, Any]]:
    rows = []
    for kind, signals in found.errors.holdout.items() if found.errors else ():
        for signal, models in signals.items():
            rms = {name: getattr(models, name) for name in _MODELS}
            times, unit = _scale([one for one in rms.values() if one is not None], models.unit)
            numbers = ["-" if rms[name] is None else f"{times * rms[name]:.3g} {unit}" for name in _shown(found)]
            rows.append({"signal": signal.replace("_", " "), "kind": _KINDS[kind], "numbers": numbers})
    return rows


def _scale(values: Iterable[float], unit: str) -> tuple[float, str]:
    """Return the factor of numbers that stand together, and their unit with it."""
    if unit in {"rad", "rad/s"}:
        return math.degrees(1.0), unit.replace("rad", "deg")
    return (1e3, "mm") if unit == "m" and max(values, default=1.0) < _SMALL else (1.0, unit)


def _shown(found: ExplanationResult) -> list[str]:
    """Return the models that any of the errors is of."""
    rows = [models for signals in found.errors.holdout.values() for models in signals.values()] if found.errors else []
    return [name for name in _MODELS if any(getattr(models, name) is not None for models in rows)]


def _gain(found: ExplanationResult) -> str:
    gain = found.gain
    if gain is None or not (found.causes or found.runs):
        return ""
    if found.runs:
        starts = found.starts.says.capitalize() if found.starts else ""
        return f"Fitted to other runs, the error is {_less(gain)} than the reference model's. {starts}."
    return (
        "Free run on parts of the record that no fit used: the extended model's error is "
        f"{_less(gain.over_stated or gain)} than the reference model's, and {_less(gain)} than the calibrated model's."
    )


def _less(gain: Gain) -> str:
    """Return by how much something errs less, or more, with the interval."""
    low, high = (_by(end) for end in gain.interval)
    return f"{_by(gain.value)} ({low} to {high})"


def _by(gain: float) -> str:
    return f"{abs(100.0 * gain):.0f} % {'smaller' if gain >= 0.0 else 'larger'}"


def _variance(found: ExplanationResult) -> str:
    """Return the range of the noise floor in free run.

    An error inside it does not speak against a model.
    """
    if found.errors is None or found.errors.noise_floor_range is None:
        return ""
    least, most = found.errors.noise_floor_range
    signal, models = next(iter(found.errors.holdout["free_run"].items()))
    times, unit = _scale([most], models.unit)
    return (
        f"In free run, noise alone causes an error of {times * least:.3g} to {times * most:.3g} {unit} in the "
        f"{_words(signal)}. It varies because noise decides whether the plate just breaks away."
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
    times, unit = _scale([worst.error, most], models.unit)
    return (
        f" Most of the extended model's error is between {worst.from_s:.4g} and {worst.to_s:.4g} s: "
        f"{times * worst.error:.3g} {unit}, against {times * worst.others:.3g} {unit} elsewhere. Noise alone "
        f"causes {times * least:.3g} to {times * most:.3g} {unit} there."
    )


def _candidate(one: Suspect, causes: Sequence[Cause]) -> dict[str, Any]:
    """Return a candidate of a search.

    One of an ambiguity group has no probability of its own.
    """
    groups = [{cause.id, *cause.indistinguishable} for cause in causes if cause.indistinguishable]
    is_of_group = one.probability > 0.0 and any(one.effect in group for group in groups)
    return {
        "search": one.search,
        "effect": _words(one.effect),
        "probability": "not distinguished" if is_of_group else f"{100.0 * one.probability:.0f} %",
        "leaves": f"{100.0 * one.leaves:.1f} %",
        "decision": ", but ".join(filter(None, ["in the model" if one.taken_in else "", one.refused])) or "-",
    }


def _moved(found: ExplanationResult) -> list[dict[str, Any]]:
    return [
        {
            "name": _words(name),
            "numbers": [_with_unit(value, p.unit) for value in _of_models(p)],
            "flags": "; ".join(p.flags),
        }
        for name, p in found.calibrated.items()
        if p.flags
    ]


def _of_models(p: Calibrated) -> list[float]:
    """Return a parameter in each model that there is.

    They are reference, calibrated and, with causes, extended.
    """
    return [p.nominal, p.value] if p.without_causes is None else [p.nominal, p.without_causes, p.value]


def _with_unit(value: float, unit: str) -> str:
    times, unit = _scale((), unit)
    return f"{times * value:.4g}" if unit == "1" else f"{times * value:.4g} {unit}"


def _runs(found: ExplanationResult) -> list[dict[str, str]]:
    def volts(value: float | None) -> str:
        return "-" if value is None else f"{value:.2f} V"

    times, unit = _scale([run.rms_rad for run in found.runs], "rad")
    return [
        {
            "name": f"{_words(run.condition)} {run.value:g} {run.unit}" if run.condition else f"run {number}",
            "begins": f"{run.begins_s:.0f} s",
            "use": "fitted" if run.seen_by_the_fit else "predicted",
            "r_squared": f"{run.r_squared:.3f}",
            "rms": f"{times * run.rms_rad:.3g} {unit}",
            "measured": volts(run.breaks_away.measured),
            "model": volts(run.breaks_away.model),
        }
        for number, run in enumerate(found.runs, 1)
    ]


def _friction(found: ExplanationResult) -> list[dict[str, Any]]:
    names = {"stiction": "break-away", "coulomb": "sliding"}
    models = ("nominal", "calibrated", "extended") if found.causes else ("nominal", "calibrated")
    return [
        {"name": names[name], "numbers": [f"{getattr(p, key):.4g} {p.unit}" for key in models]}
        for name, p in found.friction.items()
    ]


def next_steps(found: ExplanationResult) -> list[str]:
    """Return what to do about what is open, a sentence a step."""
    return list(_next_test(found)["steps"])


def _next_test(found: ExplanationResult) -> dict[str, Any]:
    """Return what to do about what is open.

    What to measure, the scenario, what both tell, and what stays open.
    """
    test = found.next_test
    if test is None:
        is_open = found.verdict == "unexplained" and found.suspects
        return {"steps": [], "says": _NO_TEST if is_open else ""}
    if test.expected_separation is None:
        return {"steps": [], "says": test.says}
    expected = test.expected_separation
    parts, leaves = (", ".join(map(_words, ids)) for ids in (expected.parts, expected.leaves))
    steps = []
    if test.by_hand:
        steps = [f"{one.do} ({', '.join(map(_wanted, one.gives))})" for one in test.by_hand]
        steps.append("write these numbers into the model file under 'measured'")
    if test.scenario:
        run = f"run {test.scenario} (next_test.yaml) on the same unit and explain its record and then these "
        steps.append(f"{run}(etb-hil explain NEW THESE --same-unit)")
    else:
        steps.append("explain these data again")
    says = f"They distinguish {_words(test.pair[0])} from {parts}."
    says = f"{says} Not distinguished: {leaves}; {test.says}." if leaves else says
    return {"steps": steps, "says": says}


def _wanted(number: Wanted) -> str:
    unit = "" if number.unit == "1" else f" {number.unit}"
    return f"{number.name} within {number.uncertainty:.2g}{unit}{_at(number.shaft)}"


def _at(shaft: str | None) -> str:
    """Return the shaft at which a rotary number holds.

    A gauge reads at the plate what a motor's data sheet has at the motor.
    """
    return f" at the {'plate' if shaft == 'throttle' else 'motor'} (shaft: {shaft})" if shaft else ""


def _judged(found: ExplanationResult) -> list[str]:
    """Return what the diagnosis makes of these data under both models."""
    diagnosis = found.diagnosis
    if diagnosis is None:
        return []
    sentences = []
    extended = "extended model" if found.causes else "calibrated model"
    for one, model in ((diagnosis.stated, "reference model"), (diagnosis.extended, extended)):
        if one is None:
            continue
        numbers = [_with_interval(id_, number) for id_, number in one.measurements.items()]
        sentences.append(f"Diagnosis with the {model}: {', '.join(numbers) or 'no friction found'}; {one.verdict}.")
    return [*sentences, f"{diagnosis.says.capitalize()}."]


def _with_interval(name: str, number: JudgedNumber) -> str:
    said = f"{name} {number.value:.3g} {number.unit}"
    low, high = number.interval
    return said if low is None or high is None else f"{said} (95 %: {low:.3g} to {high:.3g})"


def _quality(one: DataQuality | str) -> dict[str, Any]:
    if isinstance(one, str):
        return {"what": one, "flags": []}
    return {
        "what": f"{one.origin}: {one.seconds:.1f} s at {one.rate_hz:.0f} Hz",
        "flags": one.flags,
    }


def _limits(found: ExplanationResult) -> str:
    limits = dict(sorted(found.detection_limits.items()))
    seen = ", ".join(
        f"{_words(name)} from {one.limit:.2g}{'' if one.unit == '1' else ' ' + one.unit} ({one.parameter})"
        for name, one in limits.items()
        if one.limit is not None
    )
    unseen = ", ".join(_words(name) for name, one in limits.items() if one.judged and not one.within_bounds)
    others = ", ".join(f"{_words(name)} ({one.says})" for name, one in limits.items() if not one.judged)
    sentences = [f"Smallest effects that these data detect: {seen}." if seen else ""]
    of_place = [name for name, one in limits.items() if one.where]
    if of_place:
        its = ", ".join(map(_words, of_place))
        sentences.append(f"These hold where the record went ({limits[of_place[0]].where}) alone: {its}.")
    sentences.append(f"These data cannot detect: {unseen}." if unseen else "")
    sentences.append(f"Not judged: {others}." if others else "")
    if seen and found.verdict == "unexplained":
        sentences.append("A listed effect may be a part of the unexplained residual.")
    return " ".join(filter(None, sentences))
