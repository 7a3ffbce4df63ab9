"""Numbers of one unit that were measured by hand: they take the place of what the model file states."""

import warnings

import pytest

from etb_hil.base.errors import InputError
from etb_hil.base.stock import find
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.entries import parsed
from etb_hil.plant.parameters import load_model


def loaded(tmp_path, *lines):
    path = tmp_path / "model.yaml"
    text = find("model", "default").read_text("utf-8")
    path.write_text("\n".join([text, "measured:", *lines, ""]), "utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return load_model(path)


@pytest.fixture
def stated():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return load_model(find("model", "default"))


def test_a_measured_value_holds_in_the_width_of_its_uncertainty(tmp_path, stated):
    value = 1.02 * stated.values.resistance
    model = loaded(tmp_path, f"  resistance: {{value: {value} ohm, uncertainty: 0.5 %, source: four-wire}}")
    assert model.values.resistance == pytest.approx(value)
    assert model.tolerance("resistance") == pytest.approx(0.005 * value)
    one = model.measured["resistance"]
    assert (one.id, one.unit, one.stated) == ("parameter:resistance", "ohm", stated.values.resistance)
    assert one.tolerance == pytest.approx(stated.tolerance("resistance"))


def test_nothing_measured_changes_nothing(tmp_path, stated):
    assert loaded(tmp_path, "  {}").parameters == stated.parameters
    assert stated.measured == {}


def test_a_number_outside_what_is_stated_whatever_its_own_error_is_a_cause(tmp_path, stated):
    edge = stated.values.resistance + stated.tolerance("resistance")
    inside, outside = (
        loaded(tmp_path, f"  resistance: {{value: {edge + off} ohm, uncertainty: 20 mohm, source: four-wire}}")
        for off in (0.019, 0.021)
    )
    assert not inside.measured["resistance"].is_off
    assert outside.measured["resistance"].is_off


def test_who_measures_the_torque_constant_has_measured_the_back_emf(tmp_path, stated):
    value = 1.03 * stated.parameters["torque_constant"].value
    model = loaded(
        tmp_path, f"  torque_constant: {{value: {value} N·m/A, shaft: motor, uncertainty: 1 %, source: spun}}"
    )
    assert model.values.back_emf == pytest.approx(1.03 * stated.values.back_emf)
    assert model.tolerance("back_emf") == pytest.approx(0.01 * model.values.back_emf)


def test_what_a_gauge_reads_at_the_plate_is_understood_at_the_plate(tmp_path, stated):
    """The model file states friction at the motor shaft; a width in N·m counts where it was read, too."""
    at_plate = 1.02 * stated.values.coulomb
    text = f"  coulomb: {{value: {at_plate} N·m, shaft: throttle, uncertainty: 4.3 mN·m, source: torque gauge}}"
    model = loaded(tmp_path, text)
    assert model.values.coulomb == pytest.approx(at_plate)
    assert model.tolerance("coulomb") == pytest.approx(4.3e-3)
    one = model.measured["coulomb"]
    assert (one.value, one.uncertainty) == pytest.approx((at_plate / 18.0, 4.3e-3 / 18.0))
    assert not one.is_off


def test_a_measured_strength_is_part_of_the_model(tmp_path):
    model = loaded(tmp_path, "  current_sensor_gain.gain_error: {value: 0.08, uncertainty: 0.005, source: shunt}")
    assert [(entry.id, dict(entry.strengths)) for entry in model.effects] == [
        ("current_sensor_gain", {"gain_error": 0.08})
    ]
    assert model.measured["current_sensor_gain.gain_error"].is_off
    assert model.measured["current_sensor_gain.gain_error"].id == "current_sensor_gain"


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("  winding: {value: 2 ohm, uncertainty: 1 %, source: x}", "nothing that could be measured"),
        ("  gear_backlash.loose: {value: 2 ohm, uncertainty: 1 %, source: x}", "gear_backlash.play"),
        ("  resistance: {value: 2 V, uncertainty: 1 %, source: x}", "must be a unit of resistance"),
        ("  resistance: {value: 2 ohm, uncertainty: 3 ohm, source: x}", "reaches zero"),
        ("  gear_backlash.play: {value: 2 rad, uncertainty: 1 mm, source: x}", "uncertainty: its unit is rad"),
        ("  gear_backlash.play: {value: 2 rad, uncertainty: 0.1 rad, source: x}", "-0.005 to 0.08 rad"),
        ("  gear_backlash.play: {value: 0 rad, uncertainty: -0.1 rad, source: x}", "above 0"),
        ("  resistance: {value: 2 ohm, uncertainty: 0 ohm, source: x}", "above 0"),
        ("  gear_ratio: {value: 18, uncertainty: 0.1, source: x}", "state the value among the parameters"),
        ("  coulomb: {value: 1 N·m, shaft: motor, uncertainty: 1 %, source: x}", "T_st is below T_c"),
        ("  coulomb: {value: 0.01 N·m, uncertainty: 1 %, source: x}", "add the 'shaft'"),
        ("  resistance: {value: 2 ohm, shaft: motor, uncertainty: 1 %, source: x}", "belongs to no shaft"),
    ],
)
def test_what_cannot_have_been_measured_is_refused(tmp_path, line, words):
    with pytest.raises(InputError, match=words):
        loaded(tmp_path, line)


def test_one_number_is_not_given_twice(tmp_path, stated):
    k_t, k_e = (stated.parameters[name].value for name in ("torque_constant", "back_emf_constant"))
    with pytest.raises(InputError, match="one number of one motor"):
        loaded(
            tmp_path,
            f"  torque_constant: {{value: {k_t} N·m/A, shaft: motor, uncertainty: 1 %, source: spun}}",
            f"  back_emf_constant: {{value: {k_e} V·s/rad, shaft: motor, uncertainty: 1 %, source: spun}}",
        )


def test_a_strength_takes_any_unit_of_its_kind():
    parameter = CATALOGUE["presliding_hysteresis"].stated[0]
    assert parsed("12 mN·m", parameter) == pytest.approx(0.012)
    assert parsed("0.012 N·m", parameter) == 0.012
    with pytest.raises(ValueError, match="its unit is N·m"):
        parsed("12 mm", parameter)
