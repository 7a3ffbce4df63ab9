"""The text of a verdict for a technician: reasons and next steps.

Screen, report, log and `results.json` have them from here.

In a reason, `{T_st}` stands for the measurement of that id with its unit, `{T_st.limit}` for its limit. Reasons that a
limit gives are made from the declaration of the measurement.
"""

from __future__ import annotations

from etb_hil.base.outcome import BenchOutcome, UnitVerdict
from etb_hil.bench.bench_reasons import BENCH_REASONS
from etb_hil.bench.reason_text import REPLACE, Wording
from etb_hil.bench.unit_reasons import AGAIN, UNIT_REASONS
from etb_hil.diagnosis.measurement_registry import kind_of, name_of
from etb_hil.results import shown
from etb_hil.results.measurement import Measurement
from etb_hil.results.run_result import RunResult

_ADD_SIGNAL = "Have an engineer add the signal to the bench file, or take the limit out of the limits file."
_NO_LIMIT = "Have an engineer take the limit out of the limits file."
_AGAIN_WITH = "Check the CAN wiring, then repeat."
_SHOW_IT = "Run a scenario that shows it, as friction_check and end_of_line do."
_UNIT_DEFAULTS = {
    UnitVerdict.PASS: Wording("The unit is within its limits.", "Release the unit."),
    UnitVerdict.FAIL: Wording("The unit is outside its limits.", REPLACE),
    UnitVerdict.INCONCLUSIVE: Wording("The run does not tell whether the unit is good.", "Repeat the test."),
}
_BENCH_DEFAULTS = {
    BenchOutcome.OK: Wording("The bench worked as it should.", ""),
    BenchOutcome.FAULT: Wording("The bench failed; this says nothing of the unit.", "Check the bench, then repeat."),
    BenchOutcome.ABORTED: Wording("The run was ended before it was done.", "Repeat the test."),
}

_BEYOND, _UNDECIDED = "_beyond_limit", "_undecided"
_NOT_MEASURED, _WITHOUT_SIGNAL, _WITHOUT_INTERVAL = "_not_measured", "_without_signal", "_without_interval"
_LOCAL_MARGIN, _UNEVEN, _NO_LAW = "return_margin_local", "uneven_way", "friction_by_no_law"
_UNSAFE = (f"return_margin{_BEYOND}", _LOCAL_MARGIN)
_MOST_NAMED = 3  # measurements in the sentence of a pass
_STICKS = {"T_st_exceeded", "plate_stuck"}

# What only a law of friction tells.
_BY_THE_LAW = {"T_c_undecided", "viscous_undecided", "omega_s_not_measured"}


def unit_wording(results: RunResult) -> Wording:
    """Return why the unit got its verdict and what to do.

    Of an unknown reason, the words that came with it.
    """
    unit = results.unit
    if unit.verdict is None:
        return UNIT_REASONS["run_not_finished"]
    known = _known(unit.reason_id, results)
    if known is None:
        default = _UNIT_DEFAULTS[unit.verdict]
        return Wording(unit.reason or default.reason, unit.next_step or default.next_step)
    reason = _detailed(_filled(known.reason, results), unit.reason if known.with_detail else "")
    unsafe = next((reason_id for reason_id in unit.also if reason_id in _UNSAFE), None)
    if unsafe is not None:  # a plate that may stay open outranks whatever else is to be done
        known = _known(unsafe, results) or known
    elif _UNEVEN in unit.also and _is_undecided_by_friction(unit.reason_id):  # repeating narrows nothing there
        known = UNIT_REASONS[_UNEVEN]
    elif _NO_LAW in unit.also and unit.reason_id in _BY_THE_LAW:  # nor does it here
        known = UNIT_REASONS[_NO_LAW]
    return Wording(reason, known.next_step)


def _is_undecided_by_friction(reason_id: str) -> bool:
    """Return whether an undecided limit applies to the whole motion.

    Others apply to phases of their own.
    """
    kind = kind_of(reason_id.removesuffix(_UNDECIDED))
    return reason_id.endswith(_UNDECIDED) and (kind is None or not kind.phases)


def _known(reason_id: str, results: RunResult) -> Wording | None:
    if reason_id == "within_limits":
        return Wording(_within(results), "Release the unit.")
    return UNIT_REASONS.get(reason_id) or _of_limit(reason_id, results)


def _within(results: RunResult) -> str:
    named = [f"{one.name} {shown.measured(one)} (limit {shown.limit(one)})" for one in results.judged]
    more = f" and {len(named) - _MOST_NAMED} more" if len(named) > _MOST_NAMED else ""
    return f"Every measured value is within its limits: {', '.join(named[:_MOST_NAMED])}{more}."


def _of_limit(reason_id: str, results: RunResult) -> Wording | None:
    """Return the words for a measurement beyond, or too close to, its limit.

    The result is None for any other reason.
    """
    for ending in (_BEYOND, _UNDECIDED, _NOT_MEASURED, _WITHOUT_SIGNAL, _WITHOUT_INTERVAL):
        of = reason_id.removesuffix(ending)
        kind = kind_of(of) if reason_id.endswith(ending) else None
        if kind is None:
            continue
        found = results.measurements.get(of)
        name = _sentence(name_of(of) if found is None else found.name)
        one = _Shown(found)
        if ending == _BEYOND:
            todo = kind.too_high if one.is_high else kind.too_low
            return Wording(f"{name} is {one}; the limit is {one.limit}.", _sentence(todo, ".") or REPLACE)
        if ending == _UNDECIDED:
            return Wording(f"{name} is {one}, not known well enough for its limit {one.limit}.", AGAIN)
        if ending == _WITHOUT_INTERVAL:
            unknown = f"Its uncertainty is unknown: the limit of {one.limit} was not applied."
            return Wording(f"{name} is {one}. {unknown}", _NO_LIMIT)
        if ending == _WITHOUT_SIGNAL:
            return Wording(f"{name} needs a signal that this bench does not have.", _ADD_SIGNAL, True)
        return _not_measured(name, found, _AGAIN_WITH if kind.phases else _SHOW_IT)
    return None


def _not_measured(name: str, one: Measurement | None, todo: str) -> Wording:
    """Return the words for a measurement that has a limit and no value."""
    if one is None or not one.note:
        return Wording(f"{name} could not be measured in this run.", todo, True)
    return Wording(
        f"{name} could not be measured in this run: {one.note}.", "Correct what is named, then repeat.", True
    )


def _sentence(text: str, end: str = "") -> str:
    """Return a text with a capital at its begin, and `end` behind it once."""
    return text[:1].upper() + text[1:].removesuffix(end) + end if text else ""


def bench_wording(results: RunResult) -> Wording:
    """Return why the bench ended as it did and what to do.

    What the bench measured stands at its end, in brackets.
    """
    bench = results.bench
    default = _BENCH_DEFAULTS[bench.outcome]
    known = BENCH_REASONS.get(bench.reason_id, default)
    return Wording(_detailed(known.reason, bench.reason), bench.next_step if known is default else known.next_step)


def further_reasons(results: RunResult) -> list[str]:
    """Return the sentences of the reasons beside the first one."""
    known = (_known(reason_id, results) for reason_id in results.unit.also)
    return [_filled(wording.reason, results) for wording in known if wording is not None]


def attempts_sentence(results: RunResult) -> str:
    """Return which attempt counts and what came of those before it, or an empty text."""
    if not results.attempts:
        return ""
    before = "; ".join(
        f"attempt {a.number}: {a.verdict.value if a.verdict and a.outcome is BenchOutcome.OK else 'bench ' + a.outcome}"
        f" ({a.reason_id.replace('_', ' ')})"
        for a in results.attempts
    )
    return f"Attempt {len(results.attempts) + 1} counts. Kept in the session: {before}."


def spring_or_friction(results: RunResult) -> str:
    """Return what P2119 would mean for this unit, or an empty text.

    P2119 is the code of throttle body range/performance.

    The code's two official causes are a failed return spring and a rise of friction; a controller cannot tell which.
    """
    if results.unit.verdict is not UnitVerdict.FAIL:
        return ""
    verdicts = {one.id: one.verdict for one in results.measurements.values()}
    reasons = {results.unit.reason_id, *results.unit.also}
    high = UnitVerdict.FAIL in (verdicts.get("T_st"), verdicts.get("T_c")) or reasons & _STICKS
    is_local = _LOCAL_MARGIN in reasons
    good = verdicts.get("T_st") == verdicts.get("T_c") == UnitVerdict.PASS and not is_local
    short = verdicts.get("return_margin") == UnitVerdict.FAIL or is_local
    if not (high or short):
        return ""
    stiction, margin = (results.measurements.value(name) for name in ("T_st", "return_margin"))
    preload = ""
    if stiction is not None and margin is not None:
        preload = f" The preload of the weaker return spring is {shown.quantity(margin + stiction, 'N·m')}."
    if high:
        cause = "it is friction, which is above its limit."
    elif good:
        cause = "it is the return spring: friction is within its limits, and the spring has too little margin over it."
    else:
        cause = "the spring has too little margin over friction; which of the two is at fault, this run does not tell."
    diagnostics = results.unit_diagnostics
    if diagnostics is not None and diagnostics.codes_after is not None:  # then nobody has to guess the code
        if not any(code.code == "P2119" for code in diagnostics.codes_after):
            return ""
        return f"P2119 does not say whether the return spring failed or friction rose: here {cause}{preload}"
    return (
        "A vehicle may set P2119 (throttle body range/performance) for this unit. The code does not say whether the "
        f"return spring failed or friction rose: here {cause}{preload}"
    )


def _detailed(sentence: str, detail: str) -> str:
    """Return a sentence with a detail in brackets, where it does not say that already."""
    return f"{sentence.removesuffix('.')} ({detail})." if detail and detail not in sentence else sentence


class _Shown:
    """A measurement in a sentence.

    `{T_st}` gives the value, `{T_st.limit}` the limit, both with units.
    """

    def __init__(self, one: Measurement | None) -> None:
        self._value = shown.measured(one) if one is not None and one.is_known else "not measured"
        stated = shown.UNKNOWN if one is None else shown.limit(one)
        self.limit = "none" if stated == shown.UNKNOWN else stated
        self.is_high = one is None or (one.limit_high is not None and (one.value or 0.0) > one.limit_high)

    def __str__(self) -> str:
        return self._value

    def __format__(self, _: str) -> str:
        return self._value


class _Numbers(dict[str, _Shown]):
    def __init__(self, results: RunResult) -> None:
        super().__init__((one.id, _Shown(one)) for one in results.measurements.values())

    def __missing__(self, _: str) -> _Shown:
        return _Shown(None)


def _filled(sentence: str, results: RunResult) -> str:
    return sentence.format_map(_Numbers(results))
