"""A baseline: what it expects, what it is held against, and what it is made of."""

import re

import pytest

from etb_hil.base.errors import InputError
from etb_hil.base.outcome import BenchOutcome, UnitVerdict
from etb_hil.results.measurement import Measurement, Measurements
from etb_hil.results.run_result import Bench, Phase, RunResult, Unit
from etb_hil.session.baseline import baseline_text, compare, load_baseline

RAMP = Phase("ramp", "ramp", 0.0)
LOG = Phase("log", "log", 0.0)


def run_of(*measurements, phases=(RAMP,), verdict=UnitVerdict.PASS):
    bench = Bench(BenchOutcome.OK)
    return RunResult("run", Unit(verdict), bench, measurements=Measurements(measurements), phases=phases)


@pytest.fixture
def baseline(tmp_path):
    def read(numbers, head=""):
        path = tmp_path / "baseline.yaml"
        path.write_text(f"schema: etb_hil/baseline/1\n{head}numbers: {numbers}\n")
        return load_baseline(path)

    return read


def t_st(value, unit="N·m", interval=(None, None)):
    return Measurement("T_st", "break-away friction", value, unit, *interval)


@pytest.mark.parametrize(
    ("value", "tolerance", "agrees"),
    [
        (0.2099, "5 %", True),
        (0.2101, "5 %", False),
        (0.1901, "5 %", True),
        (0.1899, "5 %", False),
        (0.2099, "10 mN·m", True),
        (0.2101, "10 mN·m", False),
        (0.25, "0.05 N·m", True),  # at the edge
        (float("nan"), "5 %", False),
        (None, "5 %", False),
    ],
)
def test_a_value_agrees_within_its_tolerance(baseline, value, tolerance, agrees):
    (found,) = compare(baseline(f"{{T_st: {{value: 0.2 N·m, tolerance: {tolerance}}}}}"), run_of(t_st(value)))
    assert found.agrees is agrees


@pytest.mark.parametrize(("value", "agrees"), [(-0.2099, True), (-0.2101, False), (-0.1901, True), (-0.1899, False)])
def test_a_share_of_a_negative_value_is_a_distance_too(baseline, value, agrees):
    (found,) = compare(baseline("{T_st: {value: -0.2 N·m, tolerance: 5 %}}"), run_of(t_st(value)))
    assert found.agrees is agrees


@pytest.mark.parametrize(("value", "agrees"), [(0.24, True), (0.26, False), (0.16, True), (0.14, False)])
def test_per_cent_of_a_ratio_are_points(baseline, value, agrees):
    (found,) = compare(
        baseline("{share: {value: 20 %, tolerance: 5 %}}"), run_of(Measurement("share", "x", value, "1"))
    )
    assert found.agrees is agrees


@pytest.mark.parametrize("unit", ["degC", "K"])
def test_temperatures_have_tolerances_as_differences(baseline, unit):
    expected = baseline(f"{{temperature: {{value: 20 degC, tolerance: 2 {unit}}}}}")
    for value, agrees in ((21.9, True), (22.1, False)):
        (found,) = compare(expected, run_of(Measurement("temperature", "temperature", value, "degC")))
        assert found.agrees is agrees


def test_bare_numbers_and_shares_are_read(baseline):
    expected = baseline("{windows: {value: 4, tolerance: 1}}")
    assert [compare(expected, run_of(Measurement("windows", "windows", n, "1")))[0].agrees for n in (5, 5.1)] == [
        True,
        False,
    ]


@pytest.mark.parametrize(
    ("value", "tolerance"),
    [("0.2 N·m", "0 %"), ("0.2 N·m", "-5 %"), ("0.2 N·m", "0 N·m"), ("0 N·m", "5 %"), (".inf", "1"), (".nan", "1"),
     ("0.2 smoots", "5 %"), ("true", "1"), ("'1,5 ohm'", "5 %"), ("0.2 N·m", "1 ohm")],
)  # fmt: skip
def test_what_is_no_expectation_is_refused_with_its_place(baseline, value, tolerance):
    with pytest.raises(InputError, match=r"baseline\.yaml:2: numbers\.T_st"):
        baseline(f"{{T_st: {{value: {value}, tolerance: {tolerance}}}}}")


@pytest.mark.parametrize(
    "entry",
    ["{value: true, tolerance: 5 %}", "{value: [0.2], tolerance: 5 %}", "{value: {a: 1}, tolerance: 5 %}"],
)
def test_a_value_that_is_neither_text_nor_number_is_refused_as_such(baseline, entry):
    with pytest.raises(InputError, match=r"baseline\.yaml:2: numbers\.T_st\.value: must be a text"):
        baseline(f"{{T_st: {entry}}}")


@pytest.mark.parametrize("unit", ["ohm", "1", "smoots"])
def test_a_value_in_another_unit_than_expected_does_not_agree(baseline, unit):
    (found,) = compare(baseline("{T_st: {value: 0.2 N·m, tolerance: 5 %}}"), run_of(t_st(0.2, unit)))
    assert (found.found, found.agrees) == (f"0.2 {unit}".removesuffix(" 1"), False)
    assert str(found) == f"T_st: expected 0.2 N·m within 5 %, found {found.found}"


def test_what_was_not_measured_does_not_agree(baseline):
    expected = baseline("{T_st: {value: 0.2 N·m, tolerance: 5 %}}")
    bound = Measurement("T_st", "T_st", None, "N·m", 0.0, 0.2)
    for measured, said in (((), "not measured"), ((bound,), "at most 0.200 N·m")):
        (found,) = compare(expected, run_of(*measured))
        assert (found.found, found.agrees) == (said, False)


@pytest.mark.parametrize("name", ["return_time_open", "step_rise_small_opening"])
@pytest.mark.parametrize(("phases", "agrees"), [((RAMP,), False), ((LOG,), None), ((LOG, RAMP), False), ((), False)])
def test_what_single_phases_measure_is_not_compared_with_a_bare_log(baseline, name, phases, agrees):
    (found,) = compare(baseline(f"{{{name}: {{value: 0.2 s, tolerance: 5 %}}}}"), run_of(phases=phases))
    assert found.agrees is agrees
    assert found.found == ("not measured" if agrees is False else "not compared: a log has no phases")


def test_a_bare_log_is_expected_to_have_what_whole_logs_measure(baseline):
    (found,) = compare(baseline("{T_st: {value: 0.2 N·m, tolerance: 5 %}}"), run_of(phases=(LOG,)))
    assert (found.name, found.agrees) == ("T_st", False)


def test_what_single_phases_measure_is_compared_where_a_bare_log_has_it(baseline):
    expected = baseline("{return_time_open: {value: 0.2 s, tolerance: 5 %}}")
    found = Measurement("return_time_open", "return time", 0.3, "s")
    assert compare(expected, run_of(found, phases=(LOG,)))[0].agrees is False


def test_a_number_that_no_measurement_has_is_missing_in_a_bare_log_too(baseline):
    (found,) = compare(baseline("{of_nothing: {value: 4, tolerance: 1}}"), run_of(phases=(LOG,)))
    assert (found.found, found.agrees) == ("not measured", False)


@pytest.mark.parametrize(
    ("verdict", "shown", "agrees"),
    [(UnitVerdict.FAIL, "fail", True), (UnitVerdict.PASS, "pass", False), (None, "none", False)],
)
def test_the_verdict_is_compared_first(baseline, verdict, shown, agrees):
    expected = baseline("{T_st: {value: 0.2 N·m, tolerance: 5 %}}", head="verdict: fail\n")
    first, _ = compare(expected, run_of(t_st(0.2), verdict=verdict))
    assert (first.name, first.found, first.agrees) == ("verdict", shown, agrees)


@pytest.mark.parametrize(
    ("interval", "tolerance"),
    [((0.19, 0.21), "0.02"), ((0.199, 0.201), "0.004"), ((0.17, 0.21), "0.06"), ((0.19, 0.23), "0.06")],
)
def test_a_new_baseline_has_twice_the_wider_half_of_the_interval_and_two_per_cent(interval, tolerance):
    text = baseline_text(run_of(t_st(0.2, interval=interval)), "made here")
    assert f"  T_st: {{value: 0.2 N·m, tolerance: {tolerance} N·m}}\n" in text
    assert "verdict: pass\n" in text
    low, high = interval
    assert f"value: -0.2 N·m, tolerance: {tolerance} N·m" in baseline_text(
        run_of(t_st(-0.2, interval=(-high, -low))), ""
    )


def test_values_without_interval_width_or_known_unit_are_not_expected():
    others = (
        t_st(0.2),
        Measurement("T_c", "T_c", None, "N·m", 0.1, 0.2),
        Measurement("omega_s", "omega_s", 0.0, "rad/s", 0.0, 0.0),
        Measurement("viscous", "viscous", 1.0, "smoots", 0.9, 1.1),
    )
    with pytest.raises(InputError, match="no value with an interval"):
        baseline_text(run_of(*others), "made here")
    text = baseline_text(run_of(*others, Measurement("windows", "windows", 10.0, "1", 9.0, 11.0), verdict=None), "x")
    assert text.endswith("numbers:\n  windows: {value: 10, tolerance: 2}\n")
    assert "verdict:" not in text


def test_another_unit_than_a_measurement_has_is_refused_before_a_run(baseline):
    with pytest.raises(InputError) as caught:
        baseline("{T_st: {value: 0.2 V, tolerance: 5 %}, friction_drift: {value: 0.1 V, tolerance: 5 %}}")
    torque, drift = map(str, caught.value.problems)
    assert re.search(r"baseline\.yaml:2: numbers\.T_st\.value: T_st is measured in N·m .*; correct the unit", torque)
    assert "friction_drift is measured in 1/s" in drift
    assert drift.endswith("leave it out: nothing is expected in this unit")


def test_a_value_that_is_infinite_in_si_units_is_refused(baseline):
    with pytest.raises(InputError, match="a tolerance above 0 is expected"):
        baseline("{rate: {value: 1e308 kHz, tolerance: 1 kHz}}")
