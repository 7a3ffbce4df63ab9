"""What a technician reads: a sentence and a next step for each reason id.

Screen, report, log and `results.json` have them from here.

In a reason, `{T_st}` stands for the measurement of that id with its unit, `{T_st.limit}` for its limit. Reasons that a
limit gives are made from the declaration of the measurement.
"""

from __future__ import annotations

from dataclasses import dataclass

from etb_hil.base.outcome import BenchOutcome, UnitVerdict
from etb_hil.diagnosis.measurement_registry import kind_of
from etb_hil.results import shown
from etb_hil.results.measurement import Measurement
from etb_hil.results.run_result import RunResult

_REPLACE = "Replace the throttle body, or clean it and test again. Keep this report with the unit."
_NOT_FITTED = "Do not fit this unit to a vehicle. " + _REPLACE
_SENSORS = "Check the unit's plug and the sensor's wiring, then repeat. This says nothing of the unit's friction."
_OTHER = "Check that model file, bench file and unit belong together, then repeat."
_ADD_SIGNAL = "Have an engineer add the signal to the bench file, or take the limit out of the limits file."
_NO_LIMIT = "Have an engineer take the limit out of the limits file."
_AGAIN_WITH = "Check the CAN wiring, then repeat."
_SHOW_IT = "Run a scenario that shows it, as friction_check and end_of_line do."
_AGAIN = "Repeat the test. Where it happens again, have an engineer look at the plots."


@dataclass(frozen=True, slots=True)
class Wording:
    """A reason in a sentence, and what to do next.

    `with_detail` puts the given text behind it, in brackets.
    """

    reason: str
    next_step: str
    with_detail: bool = False


UNIT_REASONS = {
    "T_st_exceeded": Wording("The plate sticks at one place: friction there is above the limit.", _REPLACE, True),
    "plate_stuck": Wording("The plate is stuck: the motor pushed and it did not move.", _NOT_FITTED, True),
    "T_st_unexplained": Wording("Friction seemed above the limit for a while, and nothing says why.", _AGAIN, True),
    "T_c_unexplained": Wording(
        "Friction seemed above the limit while the plate moved fast, and nothing says why.", _AGAIN, True
    ),
    "resistance_contradicts": Wording("The motor's resistance is not what the model says.", _OTHER, True),
    "back_emf_contradicts": Wording("The motor is not what the model says.", _OTHER, True),
    "angle_reversed": Wording(
        "The angle moves against the motor: the sign of the angle or of the current is reversed, or the motor's leads "
        "are.",
        "Check the signs of angle, current and voltage in the bench's DBC file and roles, and the wiring of sensors "
        "and motor, then repeat. This says nothing of the unit's friction.",
        True,
    ),
    "spring_elsewhere": Wording("Springs or stops are not where the model says.", _OTHER, True),
    "motor_hot": Wording(
        "The motor differs from the model as if much warmer than its housing. Worn brushes look the same.",
        "Let the unit cool for 10 minutes, then repeat. If this remark stays, check the brushes.",
        True,
    ),
    "another_friction_law": Wording(
        "Friction does not follow the law of the model. The intervals of the numbers hold that.", "Nothing to do.", True
    ),
    "model_contradicted": Wording("The unit differs from the model in more than friction.", _OTHER, True),
    "uneven_way": Wording(
        "Friction is uneven along the way: {friction_least} at {friction_least_at}, {friction_most} at "
        "{friction_most_at} in slow motion. The intervals of the numbers hold that.",
        "Have an engineer look at the friction over angle in the report; repeating the test does not help.",
    ),
    "friction_drifts": Wording(
        "Friction changed while the test ran. The intervals of the numbers hold that.",
        "Let the unit come to a steady temperature, or run it in, as warm_check does; then repeat.",
        True,
    ),
    "too_few_windows": Wording(
        "The samples have too many gaps, or come too slowly, to measure friction.",
        "Check the CAN wiring and the rate that the bench asks for, then repeat.",
        True,
    ),
    "T_st_local_undecided": Wording(
        "Friction at one place of the way is too close to the limit of break-away friction to tell.",
        "Have an engineer look at the friction over angle in the report.",
        True,
    ),
    "direction_undecided": Wording(
        "Friction may be above its limit in one direction of motion, or the springs are not what the model says.",
        "Measure the springs' preloads, or have an engineer correct the model's; repeating the test does not help.",
        True,
    ),
    "temperature_unknown": Wording(
        "The limits follow the temperature, and none was measured.",
        "Check that the bench reads a temperature and that the scenario has a current_zero, then repeat.",
        True,
    ),
    "limits_not_judged": Wording(
        "Some limits were not judged: this run has no phase that shows them.",
        "Run a scenario that has those phases, as end_of_line has them.",
        True,
    ),
    "T_c_not_reached": Wording(
        "The plate never moved fast enough to tell sliding friction.",
        "Run a scenario with fast dashes through limp-home, as friction_check has them.",
        True,
    ),
    "places_not_seen": Wording(
        "The plate did not slide slowly over a wide part of its way; break-away friction may be another there.",
        "Run a scenario with slow ramps over the whole way, as friction_check has them. Where this one has them, check "
        "the CAN wiring for lost frames.",
        True,
    ),
    "one_way": Wording(
        "The plate was measured in one direction only; which does not distinguish springs from friction.",
        "Run a scenario that opens and closes the plate, as friction_check does.",
        True,
    ),
    "read_too_seldom": Wording(
        "The unit is asked for its motor current or angle, and too seldom to tell.",
        "Have an engineer shorten 'every' in the bench file's 'uds' section, or map a cyclic frame; repeating the test "
        "does not help.",
        True,
    ),
    "read_by_request": Wording(
        "The unit was asked for its motor current or angle; intervals hold what that costs.",
        "Where they are too wide, have an engineer map a cyclic frame.",
    ),
    "samples_lost": Wording(
        "Too many samples were lost to judge the unit.", "Check the CAN wiring and the bus load, then repeat.", True
    ),
    "no_samples": Wording(
        "No phase of this run moved the plate and measured current and angle.",
        "Run a scenario that does, as friction_check. Where this one should have, check its measurement request and "
        "the CAN wiring.",
    ),
    "too_little_motion": Wording(
        "The plate moved too little to measure friction.",
        "Check that the plate moves by hand with the supply off, the supply voltage, and that the scenario has ramps "
        "and dashes; then repeat.",
        True,
    ),
    "tracks_disagree": Wording("The two tracks of the plate sensor contradict each other.", _SENSORS, True),
    "angles_disagree": Wording("Plate sensor and motor encoder contradict each other.", _SENSORS, True),
    "angle_jumps": Wording("The motor angle jumps as no motor can move it.", _SENSORS, True),
    "current_frozen": Wording("The current reading stands still.", _SENSORS, True),
    "current_zero_moves": Wording("The current reading with the drive off moves.", _SENSORS, True),
    "motor_balance": Wording("Voltage, current and speed of the motor contradict each other.", _SENSORS, True),
    "samples_missing": Wording(
        "Too many samples are missing to judge the unit.", "Check the CAN wiring and the bus load, then repeat.", True
    ),
    "not_as_asked": Wording(
        "The controller measured otherwise than it was asked to.",
        "Check that no other tool sends measurement requests on this bus, then repeat.",
        True,
    ),
    "clocks_disagree": Wording(
        "The controller's clock and the computer's part.",
        "Repeat the test. Where it happens again, check the controller's clock.",
        True,
    ),
    "frames_corrupted": Wording(
        "Too many frames were corrupted to trust the others.",
        "Check CAN wiring, termination and shielding, then repeat.",
        True,
    ),
    "run_not_finished": Wording("The run ended before the unit could be judged.", "Repeat the test."),
}

BENCH_REASONS = {
    "no_answer": Wording(
        "The controller did not answer.", "Check its supply, the CAN plug and the bench's bit rate, then repeat."
    ),
    "wrong_unit": Wording(
        "The unit reports another identity than the station expects.",
        "Check the label and the part that was chosen, then scan again.",
        True,
    ),
    "uds_no_answer": Wording(
        "The unit did not answer the bench's diagnostic request in time.",
        "Check the identifiers of the bench file's 'uds' section and the unit's supply, then repeat.",
        True,
    ),
    "uds_bad_answer": Wording(
        "The unit's diagnostic answer breaks the protocol.",
        "Check the CAN wiring and that no other tool talks to the unit, then repeat.",
        True,
    ),
    "uds_refused": Wording(
        "The unit refused a diagnostic request.",
        "Have an engineer check session, security access and identifiers of the bench file's 'uds' section.",
        True,
    ),
    "uds_second_tester": Wording(
        "Another diagnostic tester sends requests to the unit.", "Unplug the other tester, then repeat.", True
    ),
    "uds_routine": Wording(
        "A routine of the unit did not end.", "Check with the supply off that the plate moves freely.", True
    ),
    "controller_overcurrent": Wording(
        "The run ended early: the controller took the drive off because of too much current.",
        "Check with the supply off whether the plate moves freely by hand.",
    ),
    "cut_short": Wording(
        "The run was cut short: its end was never written.", "Check that the drive is off, then repeat the test."
    ),
    "frames_stopped": Wording(
        "The controller's frames stopped arriving.", "Check the CAN plug, the supply and the termination, then repeat."
    ),
    "answers_late": Wording(
        "The controller answers late, or does not do as it is told.",
        "Check what lies between the bench and the controller (gateways, adapters), and whether the controller's own "
        "release is given, then repeat.",
    ),
    "clock_stepped": Wording(
        "The computer's clock was set while the test ran.", "Repeat the test while the clock is left alone."
    ),
    "not_recorded": Wording(
        "The bench could not write what it measured.", "Make room on its disk, then repeat the test.", True
    ),
    "stopped_by_operator": Wording("The operator stopped the run.", "Repeat the test when the bench is clear."),
    "aborted_by_operator": Wording("The operator aborted the run.", "Repeat the test when the bench is clear."),
    "time_out": Wording(
        "The run ended: it took longer than its time-out.",
        "Find out what it waited for, or give it more time; then repeat.",
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
    "golden_unit_wrong": Wording(
        "The golden unit did not come out as expected: this bench may judge no unit.",
        "Judge no unit on this bench. Find out why, then measure the golden unit again.",
        True,
    ),
    "set_point_limit": Wording(
        "The bench stopped the run before it sent a set-point outside its limits.",
        "Have an engineer check the scenario against the bench's limits.",
    ),
    "current_limit": Wording(
        "The bench stopped the run: the motor current passed the bench's limit.",
        "Check that the plate moves freely by hand with the supply off, then repeat.",
    ),
    "voltage_limit": Wording(
        "The bench stopped the run: the motor voltage passed the bench's limit.",
        "Check the supply against the bench file, then repeat.",
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
    "host_late": Wording(
        "The computer was not in time with its commands, and the controller's watchdog took the drive off.",
        "Close what else runs on this computer, then repeat. This says nothing of the unit.",
        True,
    ),
    "interlock_open": Wording(
        "The interlock was open, so that the drive was switched off.", "Close the guard, then repeat the test."
    ),
    "interlock_silent": Wording(
        "The bench stopped the run: nothing was heard of the interlock.",
        "Check the device that reports the guard, and its message in the bench file, then repeat.",
        True,
    ),
    "supply_window": Wording(
        "The bench stopped the run: the supply left the scenario's window.",
        "Check the supply and its cables, then repeat.",
    ),
    "condition_never_true": Wording(
        "A phase timed out: its condition was never met.",
        "Check what the scenario waits for, then repeat.",
    ),
    "stopped_by_answer": Wording(
        "The run was ended by the operator's answer.", "Put right what was asked for, then repeat."
    ),
    "nobody_answered": Wording("Nobody answered the scenario's question.", "Repeat the test with somebody at it."),
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

_BEYOND, _UNDECIDED = "_beyond_limit", "_undecided"
_NOT_MEASURED, _WITHOUT_SIGNAL, _WITHOUT_INTERVAL = "_not_measured", "_without_signal", "_without_interval"
_UNSAFE, _UNEVEN = f"return_margin{_BEYOND}", "uneven_way"
_MOST_NAMED = 3  # measurements in the sentence of a pass
_STICKS = {"T_st_exceeded", "plate_stuck"}


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
    if _UNSAFE in unit.also:  # a plate that may stay open outranks whatever else is to be done
        known = _known(_UNSAFE, results) or known
    elif _UNEVEN in unit.also and _is_undecided_by_friction(unit.reason_id):  # repeating narrows nothing there
        known = UNIT_REASONS[_UNEVEN]
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
    named = [f"{_plain(one.id)} {shown.measured(one)} (limit {shown.limit(one)})" for one in results.judged]
    more = f" and {len(named) - _MOST_NAMED} more" if len(named) > _MOST_NAMED else ""
    return f"Every measured value is within its limits: {', '.join(named[:_MOST_NAMED])}{more}."


def _of_limit(reason_id: str, results: RunResult) -> Wording | None:
    """Return the words for a measurement beyond, or too close to, its limit.

    None of any other reason.
    """
    for ending in (_BEYOND, _UNDECIDED, _NOT_MEASURED, _WITHOUT_SIGNAL, _WITHOUT_INTERVAL):
        of = reason_id.removesuffix(ending)
        kind = kind_of(of) if reason_id.endswith(ending) else None
        if kind is None:
            continue
        name = _sentence(_plain(of))
        one = _Shown(results.measurements.get(of))
        if ending == _BEYOND:
            todo = kind.too_high if one.is_high else kind.too_low
            return Wording(f"{name} is {one}; the limit is {one.limit}.", _sentence(todo, ".") or _REPLACE)
        if ending == _UNDECIDED:
            return Wording(f"{name} {one} is too close to its limit {one.limit} to tell.", _AGAIN)
        if ending == _WITHOUT_INTERVAL:
            unknown = f"Its uncertainty is unknown: the limit of {one.limit} was not applied."
            return Wording(f"{name} is {one}. {unknown}", _NO_LIMIT)
        if ending == _WITHOUT_SIGNAL:
            return Wording(f"{name} needs a signal that this bench does not have.", _ADD_SIGNAL, True)
        return _not_measured(name, results.measurements.get(of), _AGAIN_WITH if kind.phases else _SHOW_IT)
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


def _plain(measurement_id: str) -> str:
    kind = kind_of(measurement_id)
    if kind is None:
        return measurement_id
    words = measurement_id.removeprefix(kind.id).strip("_").replace("_", ", ")
    return f"{kind.plain or kind.name} ({words})" if words else kind.plain or kind.name


def bench_wording(results: RunResult) -> Wording:
    """Return why the bench ended as it did and what to do.

    What the bench measured stands behind it in brackets.
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

    It is the code of throttle body range/performance.

    The code's two official causes are a failed return spring and a rise of friction; a controller cannot tell which.
    """
    if results.unit.verdict is not UnitVerdict.FAIL:
        return ""
    standing = {one.id: one.verdict for one in results.measurements.values()}
    reasons = {results.unit.reason_id, *results.unit.also}
    high = UnitVerdict.FAIL in (standing.get("T_st"), standing.get("T_c")) or reasons & _STICKS
    good = standing.get("T_st") == standing.get("T_c") == UnitVerdict.PASS
    short = standing.get("return_margin") == UnitVerdict.FAIL
    if not (high or short):
        return ""
    stiction, margin = (results.measurements.value(name) for name in ("T_st", "return_margin"))
    preload = ""
    if stiction is not None and margin is not None:
        preload = f" The weaker spring's preload came out as {shown.quantity(margin + stiction, 'N·m')}."
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
    return f"{sentence} ({detail})" if detail else sentence


class _Shown:
    """A measurement in a sentence.

    `{T_st}` gives the value, `{T_st.limit}` the limit, both with units.
    """

    def __init__(self, one: Measurement | None) -> None:
        self._value = "not measured" if one is None or one.value is None else shown.measured(one)
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
