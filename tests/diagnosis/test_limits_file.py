"""Limits files: read, refused, and held against numbers."""

import pytest

from etb_hil.base.errors import InputError
from etb_hil.base.outcome import UnitVerdict
from etb_hil.base.stock import find
from etb_hil.diagnosis.limits_file import load_limits
from etb_hil.diagnosis.measurement_registry import kind_of, measurement_kinds
from etb_hil.diagnosis.measuring import stand

TEXT = """\
schema: etb_hil/limits/1
part_number: A-1
revision: "2"
stiction: {max: 0.0144 N·m, shaft: motor, source: chosen}
coulomb: {max: 0.20 N·m, shaft: throttle, source: chosen}
return_margin: {min: 0.05 N·m, shaft: throttle, source: chosen}
marginal_band: 3 %
"""


def test_shaft_is_stated_and_heeded(tmp_path):
    path = tmp_path / "limits.yaml"
    path.write_text(TEXT)
    limits = load_limits(path)
    assert limits.most("T_st", 18.0) == pytest.approx(0.2592)
    assert limits.most("T_c", 18.0) == 0.20
    assert limits.marginal_band == pytest.approx(0.03)


def test_limit_follows_the_temperature_within_its_range(tmp_path):
    path = tmp_path / "limits.yaml"
    law = "temperature: {coefficient: -0.3 %/K, reference: 20 degC, between: [0 degC, 80 degC]}"
    path.write_text(TEXT.replace("{max: 0.20 N·m,", "{max: 0.20 N·m, " + law + ","))
    limit = load_limits(path).by_id["T_c"]
    assert limit.at_throttle(18.0, 20.0)[1] == pytest.approx(0.20)
    assert limit.at_throttle(18.0, 70.0)[1] == pytest.approx(0.17)
    assert limit.at_throttle(18.0, 200.0) == limit.at_throttle(18.0, 80.0)
    assert limit.at_throttle(18.0)[1] == 0.20


@pytest.mark.parametrize(
    ("coefficient", "between"), [("-2 %/K", "[0 degC, 80 degC]"), ("-0.3 %/K", "[80 degC, 0 degC]")]
)
def test_impossible_temperature_laws_are_refused(tmp_path, coefficient, between):
    path = tmp_path / "limits.yaml"
    law = f"temperature: {{coefficient: {coefficient}, reference: 20 degC, between: {between}}}"
    path.write_text(TEXT.replace("{max: 0.20 N·m,", "{max: 0.20 N·m, " + law + ","))
    with pytest.raises(InputError):
        load_limits(path)


def test_limits_that_were_exchanged_are_refused(tmp_path):
    path = tmp_path / "limits.yaml"
    path.write_text(TEXT.replace("0.0144 N·m, shaft: motor", "0.19 N·m, shaft: throttle"))
    with pytest.raises(InputError, match=r"yaml:5: coulomb.max: the limit of T_c .*it is '0.2 N·m'.* up to 0.19 N·m"):
        load_limits(path)
    path.write_text(TEXT)  # T_st for the motor, T_c for the throttle shaft
    assert load_limits(path, 18.0).by_id["T_c"].high == 0.20
    with pytest.raises(InputError, match=r"up to 0.144 N·m"):
        load_limits(path, 10.0)


@pytest.mark.parametrize(
    ("old", "new", "line", "key"),
    [
        ("0.20 N·m", "0.20 V", 5, "coulomb.max"),
        ("0.20 N·m", "-0.20 N·m", 5, "coulomb.max"),
        ("0.05 N·m", "-0.05 N·m", 6, "return_margin.min"),
        ("shaft: motor, ", "", 4, "stiction.shaft"),
        ("marginal_band: 3 %", "marginal_band: 60 %", 7, "marginal_band"),
        ("part_number", "part_nummer", 2, "part_nummer"),
    ],
)
def test_what_is_wrong_is_named_with_its_line(tmp_path, old, new, line, key):
    path = tmp_path / "limits.yaml"
    path.write_text(TEXT.replace(old, new, 1))
    with pytest.raises(InputError) as caught:
        load_limits(path)
    places = [p.place for p in caught.value.problems]
    assert any(place.line == line and place.key == key for place in places)


@pytest.mark.parametrize(
    ("band", "says"),
    [
        ("60 %", r"out of range \(it is '60 %'\); allowed: below 50 %$"),
        ("0.6", r"out of range .*; allowed: below 0\.5$"),
        ("-3 %", r"out of range .*; allowed: at least 0 %$"),
        ("wide", r"is expected, for instance '1' "),
    ],
)
def test_a_share_is_said_without_a_unit(tmp_path, band, says):
    path = tmp_path / "limits.yaml"
    path.write_text(TEXT.replace("marginal_band: 3 %", f"marginal_band: {band}"))
    with pytest.raises(InputError, match=says):
        load_limits(path)


def test_stock_limits_let_the_healthy_pass_and_say_where_they_come_from():
    limits = load_limits(find("limits", "default"))
    assert limits.most("T_st", 18.0) > 0.171 * 1.3
    assert limits.most("T_c", 18.0) > 0.144 * 1.3
    assert limits.most("T_st", 18.0) < 0.567
    assert all(limit.source.startswith("chosen") for limit in limits.by_id.values())


@pytest.mark.parametrize(
    ("low", "high", "verdict"),
    [
        (0.8, 0.9, UnitVerdict.PASS),
        (0.8, 0.951, UnitVerdict.INCONCLUSIVE),
        (0.96, 0.99, UnitVerdict.INCONCLUSIVE),
        (0.8, 1.3, UnitVerdict.INCONCLUSIVE),
        (1.04, 1.3, UnitVerdict.INCONCLUSIVE),
        (1.06, 1.3, UnitVerdict.FAIL),
    ],
)
def test_interval_against_an_upper_limit_with_a_band_of_5_percent(low, high, verdict):
    assert stand(0.5 * (low + high), low, high, None, 1.0, 0.05) is verdict


@pytest.mark.parametrize(
    ("low", "high", "verdict"),
    [
        (1.06, 1.3, UnitVerdict.PASS),
        (0.9, 1.3, UnitVerdict.INCONCLUSIVE),
        (-0.3, -0.2, UnitVerdict.FAIL),
    ],
)
def test_interval_against_a_lower_limit(low, high, verdict):
    assert stand(0.5 * (low + high), low, high, 1.0, None, 0.05) is verdict


def test_a_value_that_is_no_number_decides_nothing():
    nan = float("nan")
    assert stand(nan, nan, nan, None, 1.0, 0.05) is UnitVerdict.INCONCLUSIVE


def written(tmp_path, limits):
    path = tmp_path / "limits.yaml"
    path.write_text(f'schema: etb_hil/limits/2\npart_number: A\nrevision: "1"\nlimits: {limits}\nmarginal_band: 3 %\n')
    return path


def test_a_limit_may_name_one_of_several_values(tmp_path):
    limits = load_limits(written(tmp_path, "{step_delay: {max: 31 ms}, step_delay_large_opening: {max: 20 ms}}"))
    kind = measurement_kinds()["step_delay"]
    assert limits.of(kind, "_large_opening").high == pytest.approx(0.020)
    assert limits.of(kind, "_small_opening").high == pytest.approx(0.031)
    assert kind_of("step_delay_large_opening") is kind
    assert kind_of("T_st_local") is None
    with pytest.raises(InputError, match="step_delay_large: no measurement has this id"):
        load_limits(written(tmp_path, "{step_delay_large: {max: 31 ms}}"))


def test_a_unit_that_no_dimension_has_is_that_of_the_measurement(tmp_path):
    assert load_limits(written(tmp_path, "{friction_drift: {max: 0.1 1/s}}")).by_id["friction_drift"].high == 0.1
    for wrong in ("10 %", "0.1 s", "0.1"):
        with pytest.raises(InputError, match="write the value in 1/s"):
            load_limits(written(tmp_path, f"{{friction_drift: {{max: {wrong}}}}}"))


@pytest.mark.parametrize("text", ["- a list\n", "a text\n", "", "schema: etb_hil/limits/3\n"])
def test_a_file_of_another_form_is_refused(tmp_path, text):
    path = tmp_path / "limits.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match=r"limits\.yaml"):
        load_limits(path)


DWELL = "{per_decade: 10 %, reference: 1 s, between: [0.1 s, 100 s]}"
HEAT = "{coefficient: -0.3 %/K, reference: 20 degC, between: [0 degC, 80 degC]}"


@pytest.mark.parametrize(
    ("limits", "says"),
    [
        ("{T_stt: {max: 0.2 N·m}}", "no measurement has this id .*did you mean 'T_st'"),
        ("{zzzz: {max: 0.2 N·m}}", "no measurement has this id .*see docs/reference/measurements.md"),
        ("{T_st: {source: chosen}}", "states no limit; add 'max' or 'min' in N·m"),
        ("{T_st: {max: 0 N·m}}", r"limits\.T_st\.max: out of range .*allowed: above 0 N·m"),
        ("{return_margin: {min: -0.01 N·m}}", r"return_margin\.min: out of range .*allowed: from 0 N·m"),
        ("{T_st: {min: 0.2 N·m, max: 0.2 N·m}}", r"T_st\.min: min must be less than max .*allowed: below 0.2 N·m, "),
        (
            "{step_delay: {min: 40 ms, max: 31 ms}}",
            r"\.min: .*it is '40 ms'\); allowed: below 0.031 s, the value of max; ",
        ),
        ("{friction_drift: {min: 0.2 1/s, max: 0.1 1/s}}", r"min: min must .*allowed: below 0.1 1/s, the value of max"),
        ("{step_delay: {max: 31 ms, shaft: motor}}", r"step_delay\.shaft: only a torque can be stated"),
        ("{step_delay: {max: 31 ms, dwell: DWELL}}", r"step_delay\.dwell: only a limit of break-away"),
        ("{T_c: {max: 0.2 N·m, dwell: DWELL}}", r"T_c\.dwell: only a limit of break-away"),
        ("{step_delay: {max: 31 ms, temperature: HEAT}}", r"step_delay\.temperature: only a limit of friction"),
        ("{windows: {min: 5}}", r"windows: windows behind the fit comes without an interval.*take it out"),
    ],
)
def test_a_limit_that_cannot_be_meant_is_refused(tmp_path, limits, says):
    for name, law in (("DWELL", DWELL), ("HEAT", HEAT)):
        limits = limits.replace(name, law)
    with pytest.raises(InputError, match=says):
        load_limits(written(tmp_path, limits))


def test_a_limit_may_lie_on_the_least_that_makes_sense(tmp_path):
    free = next(kind for kind in measurement_kinds().values() if kind.least_limit is not None and kind.unit == "N·m")
    found = load_limits(written(tmp_path, f"{{{free.id}: {{min: {free.least_limit} N·m}}}}")).by_id[free.id]
    assert (found.low, found.high, found.source) == (free.least_limit, None, "")
    warm = written(tmp_path, f"{{T_st: {{min: 0.1 N·m, max: 0.2 N·m, temperature: {HEAT}}}}}")
    assert load_limits(warm).by_id["T_st"].low == 0.1


@pytest.mark.parametrize("id_", ["T_st", "T_st_break_away"])
def test_a_limit_of_break_away_follows_the_rest(tmp_path, id_):
    limits = load_limits(written(tmp_path, f"{{{id_}: {{max: 0.2 N·m, dwell: {DWELL}}}}}"))
    assert limits.dwell is limits.by_id[id_].dwell
    assert limits.dwell.factor(10.0) == pytest.approx(1.1)


@pytest.mark.parametrize(
    ("limits", "gear_ratio", "says"),
    [
        ("{T_st: {max: 0.2 N·m}, T_c: {max: 0.2 N·m}}", None, None),
        ("{T_st: {min: 0.1 N·m}, T_c: {max: 0.2 N·m}}", 18.0, None),
        ("{T_st: {max: 0.1 N·m}, T_c: {min: 0.2 N·m}}", 18.0, None),
        ("{T_c: {max: 0.2 N·m}}", 18.0, None),
        ("{T_st: {max: 0.1 N·m}}", 18.0, None),
        ("{T_st: {max: 0.1 N·m}, T_c: {max: 0.02 N·m, shaft: motor}}", None, None),
        (
            "{T_st: {max: 0.1 N·m}, T_c: {max: 0.02 N·m, shaft: motor}}", 10.0,
            r"T_c\.max: .*it is '0.02 N·m'.* up to 0.01 N·m, the limit of T_st",
        ),
        (
            "{T_st: {max: 0.01 N·m, shaft: motor}, T_c: {max: 0.02 N·m, shaft: motor}}", None,
            "it is '0.02 N·m'.* up to 0.01 N·m",
        ),
    ],
)  # fmt: skip
def test_no_throttle_slides_harder_than_it_breaks_away(tmp_path, limits, gear_ratio, says):
    path = written(tmp_path, limits)
    if says is None:
        assert load_limits(path, gear_ratio)
    else:
        with pytest.raises(InputError, match=says):
            load_limits(path, gear_ratio)


def test_a_missing_key_hides_no_other_problem(tmp_path):
    path = written(tmp_path, "{T_st: {max: 0.2 V}, T_s: {max: 1 N·m}}")
    path.write_text(path.read_text("utf-8").replace("marginal_band: 3 %\n", ""), "utf-8")
    with pytest.raises(InputError) as refused:
        load_limits(path)
    assert [one.place.key for one in refused.value.problems] == ["marginal_band", "limits.T_st.max", "limits.T_s"]


@pytest.mark.parametrize("limits", ["{T_c: 1, T_st: {max: 0.2 V}}", "{T_st: {max: 0.2 V}, T_c: 1}"])
def test_an_entry_of_another_form_hides_no_problem_of_the_others(tmp_path, limits):
    with pytest.raises(InputError) as refused:
        load_limits(written(tmp_path, limits))
    assert sorted(one.place.key for one in refused.value.problems) == ["limits.T_c", "limits.T_st.max"]


@pytest.mark.parametrize(("letters", "is_read"), [(0, False), (1, True), (2000, True), (2001, False)])
def test_a_source_has_one_to_two_thousand_letters(tmp_path, letters, is_read):
    path = written(tmp_path, f"{{T_st: {{max: 0.2 N·m, source: '{'a' * letters}'}}}}")
    if is_read:
        assert load_limits(path).by_id["T_st"].source == "a" * letters
    else:
        with pytest.raises(InputError, match=r"limits\.T_st\.source"):
            load_limits(path)
