"""Every reason has words, and what is said of P2119 follows the numbers."""

import math
from dataclasses import replace

import pytest
import sample_run

from etb_hil.base.outcome import BenchOutcome, UnitVerdict
from etb_hil.bench.bench_reasons import BENCH_REASONS
from etb_hil.bench.unit_reasons import UNIT_REASONS
from etb_hil.bench.wording import (
    bench_wording,
    further_reasons,
    spring_or_friction,
    unit_wording,
)
from etb_hil.diagnosis.measurement_registry import measurement_kinds, name_of
from etb_hil.recording.recording import ClockGrade
from etb_hil.report.grades import timing_facts
from etb_hil.report.html_report import write_report
from etb_hil.report.verdict import verdict_text
from etb_hil.results import shown
from etb_hil.results.measurement import Measurement, Measurements
from etb_hil.results.run_result import Bench, Clock, Unit


@pytest.mark.parametrize("reason_id", UNIT_REASONS)
def test_unit_reasons_are_sentences_with_their_numbers_filled_in(reason_id):
    results = sample_run.results(
        unit=Unit(UnitVerdict.FAIL, reason_id),
        measurements=Measurements((*sample_run.numbers(sample_run.T_ST), *sample_run.UNEVEN)),
    )
    words = unit_wording(results)
    for sentence in (words.reason, words.next_step):
        assert sentence.endswith(".")
        assert "{" not in sentence
    assert "not measured" not in words.reason


@pytest.mark.parametrize("reason_id", BENCH_REASONS)
def test_bench_reasons_say_what_was_measured_and_what_to_do(reason_id):
    results = sample_run.results(bench=Bench(BenchOutcome.FAULT, reason_id, "12.3 A"))
    words = bench_wording(results)
    assert words.reason == f"{BENCH_REASONS[reason_id].reason[:-1]} (12.3 A)."
    assert words.next_step.endswith(".")


def test_numbers_that_are_missing_are_said_to_be():
    results = sample_run.results(unit=Unit(UnitVerdict.FAIL, "T_st_beyond_limit"), measurements=Measurements())
    assert unit_wording(results).reason == "Break-away friction is not measured; the limit is none."


def test_details_stand_at_the_end_of_the_sentence():
    results = sample_run.results(unit=Unit(UnitVerdict.INCONCLUSIVE, "samples_lost", "7.0% of the samples are lost"))
    assert unit_wording(results).reason.endswith("to judge the unit (7.0% of the samples are lost).")


@pytest.mark.parametrize("verdict", UnitVerdict)
def test_unknown_reasons_still_say_what_to_do(verdict):
    words = unit_wording(sample_run.results(unit=Unit(verdict, "invented_later")))
    assert words.reason
    assert words.next_step
    given = unit_wording(sample_run.results(unit=Unit(verdict, "invented_later", "Because.", "Do this.")))
    assert (given.reason, given.next_step) == ("Because.", "Do this.")


def test_further_reasons_come_after_the_first():
    unit = Unit(UnitVerdict.FAIL, "T_st_beyond_limit", also=("return_margin_beyond_limit", "invented_later"))
    results = sample_run.results(0.567, unit=unit)
    (sentence,) = further_reasons(results)
    assert "-0.217 N·m" in sentence
    assert unit_wording(results).next_step.startswith("Do not fit this unit to a vehicle")


def test_an_uneven_way_is_said_beside_any_verdict_on_screen_and_page(tmp_path):
    results = sample_run.results(
        unit=Unit(UnitVerdict.PASS, "within_limits", also=("uneven_way",)),
        measurements=Measurements((*sample_run.numbers(sample_run.T_ST), *sample_run.UNEVEN)),
    )
    words = "Friction is uneven along the way: 0.150 N·m at 11.46 deg, 0.220 N·m at 45.84 deg in slow motion."
    assert words in " ".join(verdict_text(results).split())
    assert words in write_report(results, sample_run.series(), tmp_path).read_text(encoding="utf-8")


def test_what_an_uneven_way_leaves_undecided_is_not_to_be_repeated():
    unit = Unit(UnitVerdict.INCONCLUSIVE, "T_st_undecided", also=("uneven_way",))
    assert "repeating the test does not help" in unit_wording(sample_run.results(unit=unit)).next_step
    assert unit_wording(sample_run.results(unit=replace(unit, also=()))).next_step.startswith("Repeat the test.")
    of_phase = next(kind.id for kind in measurement_kinds().values() if kind.phases)
    other = replace(unit, reason_id=f"{of_phase}_undecided")
    assert unit_wording(sample_run.results(unit=other)).next_step.startswith("Repeat the test.")


@pytest.mark.parametrize("reason_id", ["T_c_undecided", "viscous_undecided", "omega_s_not_measured"])
def test_what_only_a_law_of_friction_tells_is_not_to_be_repeated_where_there_is_none(reason_id):
    unit = Unit(UnitVerdict.INCONCLUSIVE, reason_id, also=("friction_by_no_law",))
    assert "repeating the test does not help" in unit_wording(sample_run.results(unit=unit)).next_step
    other = replace(unit, reason_id="T_st_undecided")
    assert unit_wording(sample_run.results(unit=other)).next_step.startswith("Repeat the test.")


def test_what_was_not_measured_is_repeated_where_the_run_has_its_phase_and_shown_by_another_scenario_where_not():
    kinds = measurement_kinds().values()
    for has_phase, step in ((True, "Check the CAN wiring"), (False, "Run a scenario that shows it")):
        kind = next(kind.id for kind in kinds if bool(kind.phases) is has_phase)
        unit = Unit(UnitVerdict.INCONCLUSIVE, f"{kind}_not_measured")
        assert unit_wording(sample_run.results(unit=unit)).next_step.startswith(step)


def test_grades_say_what_is_known_of_time():
    unknown = sample_run.results(timestamp_grade="", clock=Clock(), bench=Bench(BenchOutcome.OK))
    assert timing_facts(unknown) == [
        ("Timestamps", "grade unknown"),
        ("Age of the newest sample", "unknown"),
        ("From command to status", "unknown"),
        ("Set-points on the bus, jitter", "unknown"),
    ]
    for grade in ClockGrade:
        name, fact = timing_facts(sample_run.results(timestamp_grade=grade.value))[0]
        assert (name, fact.partition(": ")[0]) == ("Timestamps", grade.value)
        assert fact.partition(": ")[2]


def standing(reason_id="", **verdicts):
    marks = {"T_st": "pass", "T_c": "pass", "return_margin": "pass"} | verdicts
    numbers = tuple(Measurement(i, i, 0.15, "N·m", verdict=UnitVerdict(mark)) for i, mark in marks.items())
    return sample_run.results(unit=Unit(UnitVerdict.FAIL, reason_id), measurements=Measurements(numbers))


@pytest.mark.parametrize(
    ("results", "said"),
    [
        (
            standing(T_st="fail"),
            "here it is friction, which is above its limit. The preload of the weaker return",
        ),
        (standing(T_c="fail", return_margin="fail"), "here it is friction"),
        (standing("T_st_exceeded"), "here it is friction"),
        (standing(return_margin="fail"), "here it is the return spring: friction is within its limits"),
        (standing(return_margin="fail", T_st="inconclusive"), "which of the two is at fault, this run does not tell"),
    ],
)
def test_p2119_names_spring_or_friction(results, said):
    sentence = spring_or_friction(results)
    assert "P2119" in sentence
    assert said in sentence
    assert sentence.endswith("0.300 N·m.")


def test_p2119_is_not_spoken_of_for_a_good_unit():
    assert spring_or_friction(standing()) == ""
    assert spring_or_friction(replace(standing(), measurements=Measurements())) == ""


def test_nothing_is_shown_as_minus_zero():
    assert shown.plain(-1e-5, "A") == "0.000"
    assert shown.plain(-0.0123, "A") == "-0.012"


def worded(reason_id, one):
    unit = Unit(UnitVerdict.FAIL, reason_id)
    return unit_wording(sample_run.results(unit=unit, measurements=Measurements([one])))


def test_one_of_several_values_is_said_with_its_place():
    one = Measurement(
        "step_delay_small_opening",
        name_of("step_delay_small_opening"),
        0.035,
        "s",
        0.034,
        0.036,
        None,
        0.031,
        UnitVerdict.FAIL,
    )
    found = worded("step_delay_small_opening_beyond_limit", one)
    assert found.reason == "Step delay (small opening) is 0.0350 s; the limit is 0.0310 s."
    assert found.next_step == "Look at friction, winding resistance and the supply."


@pytest.mark.parametrize(("value", "limit"), [(6.5, "7.00 deg"), (9.5, "9.00 deg")])
def test_the_limit_that_is_said_is_the_one_that_was_passed(value, limit):
    edges = (math.radians(value - 0.1), math.radians(value + 0.1), math.radians(7.0), math.radians(9.0))
    one = Measurement("default_position", "default position", math.radians(value), "rad", *edges, UnitVerdict.FAIL)
    assert f"the limit is {limit}." in worded("default_position_beyond_limit", one).reason


def test_a_bound_is_said_as_one():
    one = Measurement("T_c", name_of("T_c"), None, "N·m", 0.0, 0.21, None, 0.2, UnitVerdict.INCONCLUSIVE)
    expected = "Sliding friction is at most 0.210 N·m, not known well enough for its limit 0.200 N·m."
    assert worded("T_c_undecided", one).reason == expected
    assert (shown.measured(one), shown.interval(one)) == ("at most 0.210 N·m", "")


@pytest.mark.parametrize(("high", "limit"), [(0.04, 0.05), (0.13, 0.05), (0.19, 0.05), (0.21, 0.2)])
def test_a_bound_that_keeps_the_upper_limit_is_held_against_the_lower_one(high, limit):
    one = Measurement("T_c", name_of("T_c"), None, "N·m", 0.0, high, 0.05, 0.2, UnitVerdict.INCONCLUSIVE)
    assert shown.nearer_limit(one) == limit


def test_a_value_without_an_interval_is_not_too_close_to_its_limit():
    one = Measurement("temperature", "temperature", 40.0, "degC", None, None, None, 10.0, UnitVerdict.INCONCLUSIVE)
    found = worded("temperature_without_interval", one)
    assert "40.0 °C" in found.reason
    assert "too close" not in found.reason
    assert "limits file" in found.next_step
