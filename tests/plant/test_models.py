"""Model files: what is read, warned of and refused, and the values that come of them."""

import dataclasses
import subprocess
import sys
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from etb_hil.base.errors import InputError
from etb_hil.base.stock import find, stock_names
from etb_hil.plant.model_check import ParameterRangeWarning
from etb_hil.plant.parameters import load_model
from etb_hil.plant.table_one import KINDS

DEFAULT = find("model", "default").read_text()


def write(tmp_path, *changes):
    """A copy of the default model, with pieces of its text replaced."""
    text = DEFAULT
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    path = tmp_path / "model.yaml"
    path.write_text(text)
    return path


def line_of(path, text):
    return next(n for n, line in enumerate(path.read_text().splitlines(), 1) if text in line)


def problem(path):
    with pytest.raises(InputError) as caught:
        load_model(path)
    assert len(caught.value.problems) == 1
    return caught.value.problems[0]


def test_stock_models_are_there_and_warn_of_nothing():
    assert set(stock_names("model")) >= {"default", "faulty", "literal", "dv_e5"}
    for name in stock_names("model"):
        load_model(find("model", name))


def test_the_default_throttle_is_the_papers():
    values = load_model(find("model", "default")).values
    assert values.inertia == pytest.approx(1.336e-3)
    assert values.coulomb == pytest.approx(18 * 0.008)
    assert values.stiction == pytest.approx(18 * 0.0095)
    assert values.stribeck_velocity == pytest.approx(140 / 18)
    assert values.torque_per_ampere == values.back_emf == pytest.approx(0.36)
    assert values.return_margin == pytest.approx(0.35 - 0.171)


def test_the_faulty_throttle_differs_in_stiction_alone():
    healthy, faulty = (load_model(find("model", name)).values for name in ("default", "faulty"))
    assert faulty.stiction == pytest.approx(18 * 0.0315)
    assert dataclasses.replace(faulty, stiction=healthy.stiction) == healthy
    assert faulty.return_margin < 0.0


def test_the_literal_reading_takes_friction_at_the_throttle():
    values = load_model(find("model", "literal")).values
    assert (values.coulomb, values.stiction) == (0.008, 0.0095)
    assert values.stribeck_velocity == pytest.approx(140 / 18)


def test_the_real_throttle_is_that_of_loh():
    values = load_model(find("model", "dv_e5")).values
    assert values.inertia == pytest.approx(2.1e-3)
    assert values.torque_per_ampere == pytest.approx(0.383)
    assert (values.viscous, values.coulomb, values.preload_open) == (8.8e-3, 0.284, 0.396)


def test_loading_a_model_does_not_load_the_compiler():
    code = (
        "import sys; from etb_hil.base.stock import find; from etb_hil.plant.parameters import load_model;"
        "load_model(find('model', 'default')).values.vector(); assert 'numba' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_value_may_stand_at_either_shaft(tmp_path):
    path = write(tmp_path, ("value: 0.008 N·m\n    shaft: motor", "value: 0.144 N·m\n    shaft: throttle"))
    assert load_model(path).values.coulomb == pytest.approx(0.144)


@pytest.mark.parametrize(
    ("old", "new", "row"),
    [
        ("value: 1.5 ohm", "value: 0.7 ohm", "R_a"),
        ("value: 1.5 mH", "value: 4 mH", "L"),
        ("value: 4e-6 kg·m²", "value: 1e-6 kg·m²", "J_m"),
        ("value: 40e-6 kg·m²", "value: 60e-6 kg·m²", "J_th"),
        ("value: 18", "value: 30", "Gr"),
        ("value: 0.0095 N·m", "value: 0.04 N·m", "T_stick"),
        ("value: 0.001 N·m·s/rad", "value: 0.0001 N·m·s/rad", "B"),
        ("    outside_table_one: the seed paper itself sets 0.008 N·m (IV.3), above its own table\n", "", "T_slip"),
    ],
)
def test_a_value_outside_table_one_warns_and_names_the_row(tmp_path, old, new, row):
    path = write(tmp_path, (old, new))
    with pytest.warns(ParameterRangeWarning) as caught:
        load_model(path)
    assert len(caught) == 1
    message = str(caught[0].message)
    assert f"table I, row {row} " in message
    line = line_of(path, new.strip() or "value: 0.008 N·m")
    assert f"{path}:{line}: parameters." in message


def test_both_springs_have_their_row(tmp_path):
    path = tmp_path / "model.yaml"
    path.write_text(DEFAULT.replace("value: 0.35 N·m", "value: 0.5 N·m"))
    with pytest.warns(ParameterRangeWarning) as caught:
        load_model(path)
    assert [row for row in ("T_open", "T_close") if any(f"row {row} " in str(w.message) for w in caught)] == [
        "T_open",
        "T_close",
    ]


def test_a_bound_of_table_one_is_inside_it(tmp_path):
    path = write(tmp_path, ("value: 1.5 mH", "value: 3 mH"), ("value: 1.5 ohm", "value: 5 ohm"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        load_model(path)


def test_stiction_below_coulomb_is_refused_with_the_reason(tmp_path):
    path = write(tmp_path, ("value: 0.0095 N·m", "value: 0.00315 N·m"))
    found = problem(path)
    assert "T_st is below T_c" in found.what
    assert "LuGre" in found.what
    assert "0.0315" in found.remedy
    assert found.place.line == line_of(path, "0.00315")
    assert found.place.key == "parameters.stiction.value"


@pytest.mark.parametrize(
    ("old", "new", "key", "words"),
    [
        ("value: 1.5 ohm", "value: 1.5 V", "resistance.value", "must be a unit of resistance"),
        ("value: 1.5 ohm", "value: 1.5", "resistance.value", "unit is missing"),
        ("value: 1.5 ohm", "value: many", "resistance.value", "resistance is expected"),
        ("value: 1.5 ohm", "value: -1 ohm", "resistance.value", "impossible"),
        ("value: 1.5 ohm", "resistence: 1.5 ohm", None, None),
        ("value: 1.5 mH", "value: 0 mH", "inductance.value", "impossible"),
        ("value: 140 rad/s", "value: 140 Hz", "stribeck_velocity.value", "angular velocity"),
        ("value: 0.14 rad", "value: 0.001 rad", "limp_home.value", "lower stop"),
        ("value: 0.14 rad", "value: 2 rad", "stop_high.value", "upper stop"),
        ("value: 12 V", "value: 15 V", "voltage_limit.value", "supply"),
        ("value: 0.020 N·m/A", "value: 0.023 N·m/A", "back_emf_constant.value", "K_e differs from K_t"),
        (
            "20 degC}\n    source: seed paper, table I; chosen",
            "0 degC}\n    source: chosen",
            "back_emf_constant",
            "K_e's law",
        ),
        ("tolerance: 0.3 deg", "tolerance: 0.3 N", "limp_home.tolerance", "must be a unit of angle"),
        ("tolerance: 0.3 deg", "tolerance: -1 %", "limp_home.tolerance", "not negative"),
        ("    tolerance: 0.5 V\n", "    tolerance: 100 %\n", "supply_voltage.tolerance", "reaches zero"),
    ],
)
def test_what_is_refused(tmp_path, old, new, key, words):
    path = write(tmp_path, (old, new))
    if key is None:
        with pytest.raises(InputError) as caught:
            load_model(path)
        assert any("unknown key" in p.what and p.place.line == line_of(path, new) for p in caught.value.problems)
        return
    found = problem(path)
    assert found.place.key == f"parameters.{key}"
    assert found.place.file == path
    assert words in found.what
    if key.startswith(("back_emf", "stop_high")):
        return  # the place is the partner of the value that was changed
    assert found.place.line == line_of(path, new.strip())


def test_shafts_are_asked_for_where_they_mean_something(tmp_path):
    found = problem(write(tmp_path, ("value: 140 rad/s\n    shaft: motor", "value: 140 rad/s")))
    assert found.what == "omega_s needs its shaft"
    found = problem(write(tmp_path, ("value: 1.5 ohm", "value: 1.5 ohm\n    shaft: motor")))
    assert found.what == "R_a belongs to no shaft"


def test_unknown_effects_and_schemas_are_refused(tmp_path):
    path = write(tmp_path, ("effects: []", "effects:\n  - id: gremlins\n    strengths: {size: 1}"))
    found = problem(path)
    assert (found.what, found.value, found.place.line) == ("unknown effect", "gremlins", line_of(path, "gremlins"))
    path = write(tmp_path, ("effects: []", "effects:\n  - id: brush_drop\n    strengths: {drop: 30 V}"))
    assert problem(path).place.key == "effects[0].strengths.drop"
    assert "etb_hil/model/1" in problem(write(tmp_path, ("etb_hil/model/1", "etb_hil/model/9"))).what


def test_a_temperature_law_is_linear_about_its_reference():
    model = load_model(find("model", "default"))
    assert model.values_at(20.0) == model.values
    assert model.values_at(120.0).resistance == pytest.approx(1.5 * 1.39)
    assert model.values_at(120.0).torque_per_ampere == pytest.approx(0.36 * 0.8)
    assert model.values_at(120.0).stiction == model.values.stiction


def test_tolerances_are_those_of_the_values():
    model = load_model(find("model", "default"))
    assert model.tolerance("resistance") == pytest.approx(0.15)
    assert model.tolerance("torque_per_ampere") == pytest.approx(0.03 * 0.36)
    assert model.tolerance("limp_home") == pytest.approx(np.deg2rad(0.3))
    assert model.tolerance("inertia") == pytest.approx(0.05 * 18**2 * 4e-6 + 0.1 * 40e-6)
    assert model.tolerance("voltage_limit") == 0.0


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**32), st.sampled_from(["default", "faulty", "literal", "dv_e5"]))
def test_a_drawn_unit_lies_inside_the_tolerances(seed, name):
    model = load_model(find("model", name))
    unit = model.drawn(np.random.default_rng(seed))
    for parameter in KINDS:
        nominal, drawn = model.parameters[parameter], unit.parameters[parameter]
        assert abs(drawn.value - nominal.value) <= nominal.half_width * (1.0 + 1e-12) + 1e-18
    assert unit.values.stiction >= unit.values.coulomb
    assert unit.values.back_emf == pytest.approx(unit.values.torque_per_ampere, rel=1e-12)
    assert unit.values.resistance != model.values.resistance
    assert unit.values == model.drawn(np.random.default_rng(seed)).values


@settings(max_examples=100, deadline=None)
@given(st.text(max_size=60), st.integers(0, 140))
def test_a_spoilt_line_is_an_input_error_or_a_model(tmp_path_factory, text, line):
    lines = DEFAULT.splitlines()
    lines[line % len(lines)] = text
    path = tmp_path_factory.getbasetemp() / "spoilt.yaml"
    path.write_bytes("\n".join(lines).encode("utf-8", "surrogatepass"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ParameterRangeWarning)
        try:
            load_model(path)
            problems = ()
        except InputError as error:
            problems = error.problems
    assert all(str(path) in str(p) for p in problems)


@pytest.mark.parametrize(
    ("stated", "instead", "said"),
    [
        (
            "current_step: 1 mA",
            "current_step: 0 mA",
            "sensors.current_step: out of range (it is '0 mA'); allowed: above 0 A",
        ),
        ("voltage_step: 10 mV", "voltage_step: 0 V", "sensors.voltage_step"),
        ("current_noise: 5 mA", "current_noise: -1 mA", "sensors.current_noise"),
        ("plate_noise: 0.01 deg", "plate_noise: -1 deg", "sensors.plate_noise"),
        ("plate_range: 90 deg", "plate_range: 0 deg", "sensors.plate_range"),
    ],
)
def test_a_sensor_that_cannot_be_is_refused(tmp_path, stated, instead, said):
    text = find("model", "default").read_text("utf-8")
    assert stated in text
    path = tmp_path / "model.yaml"
    path.write_text(text.replace(stated, instead), "utf-8")
    with pytest.raises(InputError) as caught:
        load_model(path)
    assert said in str(caught.value)
