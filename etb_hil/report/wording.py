"""What a technician reads: one reason in a sentence and one thing to do next, for every reason id.

In a reason, `{T_st}` stands for the number of that id with its unit, `{T_st.limit}` for its limit.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from etb_hil.base.outcome import BenchOutcome, UnitVerdict
from etb_hil.report import show
from etb_hil.report.model import Number, Results

_REPLACE = "Replace the throttle body, or clean it and test again. Keep this report with the unit."


@dataclass(frozen=True, slots=True)
class Wording:
    """A reason in a sentence, and what to do next."""

    reason: str
    next_step: str


UNIT_REASONS = {
    "within_limits": Wording(
        "Friction is within its limits: break-away {T_st} (limit {T_st.limit}), sliding {T_c} (limit {T_c.limit}).",
        "Release the unit.",
    ),
    "marginal": Wording(
        "Friction is within its limits but inside the marginal band: break-away {T_st} (limit {T_st.limit}), "
        "sliding {T_c} (limit {T_c.limit}).",
        "Test the unit once more after it has stood for ten minutes; have an engineer look where it stays marginal.",
    ),
    "stiction_above_limit": Wording("Break-away friction is {T_st}; the limit is {T_st.limit}.", _REPLACE),
    "coulomb_above_limit": Wording("Sliding friction is {T_c}; the limit is {T_c.limit}.", _REPLACE),
    "return_margin_low": Wording(
        "The return spring has only {return_margin} left over friction; at least {return_margin.limit} is needed for "
        "the plate to come back without power.",
        "Do not fit this unit. " + _REPLACE,
    ),
    "plate_did_not_return": Wording(
        "Without power the plate did not come back to limp-home.",
        "Do not fit this unit. " + _REPLACE,
    ),
    "curve_not_fitted": Wording(
        "No friction curve could be fitted to this run, so that nothing is said of the limits.",
        "Repeat the test. Where it happens again, check the model file and have an engineer look at the plots.",
    ),
    "speed_not_reached": Wording(
        "The plate never moved fast enough to measure sliding friction far above the Stribeck velocity.",
        "Check the supply voltage, then repeat the test with a scenario that has a dash.",
    ),
    "too_few_samples": Wording(
        "Too few good samples arrived to judge the unit.",
        "Check the CAN wiring and the bus load, then repeat the test.",
    ),
    "interval_spans_limit": Wording(
        "The measurement is not exact enough to tell on which side of the limit the unit is.",
        "Repeat the test. Where it happens again, have an engineer check the model's tolerances.",
    ),
    "run_not_finished": Wording("The run ended before the unit could be judged.", "Repeat the test."),
}

BENCH_REASONS = {
    "no_answer": Wording(
        "The controller did not answer.", "Check its supply, the CAN plug and the bench's bit rate, then repeat."
    ),
    "frames_stopped": Wording(
        "The controller's frames stopped arriving.", "Check the CAN plug, the supply and the termination, then repeat."
    ),
    "bus_fault": Wording("The CAN interface failed.", "Check the adapter, its driver and the CAN plug, then repeat."),
    "duration_limit": Wording(
        "The bench stopped the run: it took longer than the bench allows.",
        "Have an engineer check the scenario against the bench's limits.",
    ),
    "bus_off": Wording(
        "The CAN interface went bus-off.", "Check wiring, termination and bit rate of the bench, then repeat."
    ),
    "safe_state_not_verified": Wording(
        "The bench could not see that the drive is off.",
        "Switch the supply off before you touch the unit. Then check the CAN plug and repeat.",
    ),
    "current_limit": Wording(
        "The bench stopped the run: the motor current passed the bench's limit.",
        "Check that the plate moves freely by hand with the supply off, then repeat.",
    ),
    "velocity_limit": Wording(
        "The bench stopped the run: the plate passed the bench's speed limit.",
        "Have an engineer check the scenario against the bench's limits.",
    ),
    "angle_limit": Wording(
        "The bench stopped the run: the plate left the range of angles that the bench allows.",
        "Check the homing and the mounting of the unit, then repeat.",
    ),
    "temperature_limit": Wording(
        "The bench stopped the run: the housing is hotter than the bench allows.", "Let the unit cool, then repeat."
    ),
    "controller_fault": Wording(
        "The controller reported a fault and left the run.", "Switch the controller off and on, then repeat."
    ),
    "frames_lost": Wording(
        "Frames were lost on the bus, more than the test allows.", "Check the bus load and the host, then repeat."
    ),
    "host_late": Wording(
        "The computer of the bench was too late with its commands.", "Close other programs on it, then repeat."
    ),
    "stopped_by_user": Wording("Somebody stopped the run.", "Repeat the test when the bench is clear."),
}

_UNIT_DEFAULTS = {
    UnitVerdict.PASS: Wording("The unit is within its limits.", "Release the unit."),
    UnitVerdict.FAIL: Wording("The unit is outside its limits.", _REPLACE),
    UnitVerdict.INCONCLUSIVE: Wording("The run does not tell whether the unit is good.", "Repeat the test."),
}
_BENCH_DEFAULTS = {
    BenchOutcome.OK: Wording("The bench worked as it should.", ""),
    BenchOutcome.FAULT: Wording("The bench failed; this says nothing of the unit.", "Check the bench, then repeat."),
    BenchOutcome.ABORTED: Wording("The run was ended before it was done.", "Repeat the test."),
}

TIMESTAMP_GRADES = {
    "sample counter": "samples carry the controller's own counter: exact to its clock",
    "receive stamps": "samples are dated by their arrival: late by the bus and the host",
    "time column of a table": "samples carry the time of a table, as it was written",
}


def unit_wording(results: Results) -> Wording:
    """Return why the unit got its verdict and what to do; words in the results outrank those of this file."""
    unit = results.unit
    default = _UNIT_DEFAULTS.get(unit.verdict, UNIT_REASONS["run_not_finished"]) if unit.verdict else None
    known = UNIT_REASONS.get(unit.reason_id) or default or UNIT_REASONS["run_not_finished"]
    words = Wording(_filled(known.reason, results), known.next_step)
    return _outranked(words, unit.reason, unit.next_step)


def bench_wording(results: Results) -> Wording:
    """Return why the bench ended as it did and what to do; what the bench measured stands behind it in brackets."""
    bench = results.bench
    known = BENCH_REASONS.get(bench.reason_id, _BENCH_DEFAULTS[bench.outcome])
    if not bench.reason or bench.reason.startswith(known.reason):
        return _outranked(known, bench.reason, bench.next_step)
    return _outranked(known, f"{known.reason} ({bench.reason})", bench.next_step)


def further_reasons(results: Results) -> list[str]:
    """Return the sentences of the reasons beside the first one."""
    known = (UNIT_REASONS.get(reason_id) for reason_id in results.unit.also)
    return [_filled(wording.reason, results) for wording in known if wording is not None]


def spring_or_friction(results: Results) -> str:
    """Return what P2119 (throttle body range/performance) would mean for this unit, or an empty text.

    The code's two official causes are a failed return spring and a rise of friction; a controller cannot tell which.
    """
    margin = results.number("return_margin")
    friction = [n for n in (results.number("T_st"), results.number("T_c")) if n is not None]
    springs = [n for n in (results.number("preload_open"), results.number("preload_close")) if n is not None]
    high = any(n.verdict == "fail" for n in friction)
    weak = any(n.verdict == "fail" for n in springs)
    short = margin is not None and margin.verdict == "fail"
    if not (high or weak or short):
        return ""
    opening = "A vehicle may set P2119 (throttle body range/performance) for this unit. The code does not say whether "
    opening += "the return spring failed or friction rose. Here "
    if high and weak:
        return opening + "it is both: friction is above its limit and the return spring is weak."
    if weak:
        return opening + "it is the return spring: its torque is outside its limits, friction is not."
    if high and springs:
        return opening + "it is friction: it is above its limit, the return spring is within its limits."
    if high:
        return opening + "it is friction: it is above its limit. The spring's torque was not measured on its own."
    return opening + "the spring has too little margin over friction, though friction is within its limits."


def with_words(results: Results) -> Results:
    """Return the results with every reason and next step written out, as `results.json` holds them."""
    unit, bench = unit_wording(results), bench_wording(results)
    return replace(
        results,
        unit=replace(results.unit, reason=unit.reason, next_step=unit.next_step),
        bench=replace(results.bench, reason=bench.reason, next_step=bench.next_step),
    )


def _outranked(words: Wording, reason: str, next_step: str) -> Wording:
    return Wording(reason or words.reason, next_step or words.next_step)


class _Shown:
    """A number in a sentence: `{T_st}` gives the value, `{T_st.limit}` the limit, both with units."""

    def __init__(self, number: Number | None) -> None:
        self._value = "not measured"
        self.limit = "none"
        if number is not None:
            if number.value is not None:
                self._value = show.quantity(number.value, number.unit)
            limit = number.limit_high if number.limit_high is not None else number.limit_low
            if limit is not None:
                self.limit = show.quantity(limit, number.unit)

    def __str__(self) -> str:
        return self._value

    def __format__(self, _: str) -> str:
        return self._value


class _Numbers(dict[str, _Shown]):
    def __init__(self, results: Results) -> None:
        super().__init__((number.id, _Shown(number)) for number in results.numbers)

    def __missing__(self, _: str) -> _Shown:
        return _Shown(None)


def _filled(sentence: str, results: Results) -> str:
    return sentence.format_map(_Numbers(results))
