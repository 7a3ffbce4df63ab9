"""Cases: sizes that land where asked, nominal values off by no more than stated, files without the truth."""

import json
import warnings

import numpy as np
import pytest
from generator import layout as at
from generator.case import SINGLES, make_case, together
from generator.excitation import EXCITATIONS
from generator.files import write_case
from generator.recipes import PARAMETER_LIKE, RECIPES, look_alike
from generator.size import OutOfReachError, band, find_strength
from generator.unit import STATED_TOLERANCE, draw_nominal, draw_unit
from generator.wrong_parameter import PARAMETERS

from etb_hil.plant.parameters import load_model

QUICK = (
    "friction_position_local",
    "cogging_torque",
    "brush_drop",
    "gear_backlash",
    "sensor_hysteresis",
    "encoder_slip",
)
# One size of each balance, and one effect of each kind; all of them every night.
SHOWN = {("cogging_torque", "weak"), ("brush_drop", "medium"), ("sensor_hysteresis", "strong")}
HIDDEN = {"friction_temperature", "air_drag", "parameter:coulomb", "measurement_delay"}


def _largest(case, index=0):
    return max(case.truth["effects"][index]["ratios"].values())


@pytest.mark.parametrize(
    ("name", "level"),
    [
        pytest.param(name, level, marks=[] if (name, level) in SHOWN else pytest.mark.study)
        for name in QUICK
        for level in ("weak", "medium", "strong")
    ],
)
def test_the_residual_lands_in_the_requested_band(name, level):
    low, high = band(name, level)
    assert low < _largest(make_case(21, (name,), level, seconds=20.0)) < high


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[] if name in HIDDEN else pytest.mark.study)
        for name in SINGLES + at.OUTSIDE + at.LATE_ANGLES
        if name not in QUICK
    ],
)
def test_every_effect_can_be_hidden_strong(name):
    case = make_case(22, (name,), "strong", seconds=20.0)
    assert _largest(case) > 5.0
    assert all(np.isfinite(values).all() for values in case.table.values())


def test_every_effect_has_a_recipe_and_eight_and_more_lie_outside_the_catalogue():
    assert set(RECIPES) == set(at.EFFECTS)
    assert len(at.OUTSIDE) >= 8
    assert not set(at.OUTSIDE) & set(at.CATALOGUE)


def test_with_nothing_hidden_the_residual_is_noise():
    case = make_case(23, seconds=20.0)
    assert case.truth["kind"] == "nothing"
    assert list(case.truth["ratios_together"].values()) == pytest.approx([1.0] * len(case.truth["ratios_together"]))


def test_nominal_values_are_off_by_up_to_a_factor_of_1_1():
    edge = 1.0 + STATED_TOLERANCE
    off = []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        unit = draw_unit(rng)
        nominal = draw_nominal(rng, unit)
        off.append([unit[name] / nominal[name] for name in unit if not name.startswith("stop_")])
    assert np.max(off) <= edge
    assert np.min(off) >= 1.0 / edge
    assert np.max(off) > 1.09
    assert np.min(off) < 0.92


def test_units_have_the_paper_s_box_and_a_healthy_return():
    for seed in range(100):
        unit = draw_unit(np.random.default_rng(seed))
        assert 1.05 <= unit["stiction"] / unit["coulomb"] <= 1.4
        assert min(unit["preload_open"], unit["preload_close"]) > unit["stiction"]
        assert 1.0 <= unit["resistance"] <= 3.0


def test_a_wrong_parameter_lies_clearly_outside_its_tolerance_and_only_there():
    case = make_case(24, ("parameter:resistance",), "strong", seconds=20.0)
    ratio = case.nominal["resistance"] / case.truth["unit"]["resistance"]
    assert ratio == pytest.approx(case.truth["effects"][0]["strength"])
    assert not 1.0 / 1.154 < ratio < 1.154
    for name in set(PARAMETERS) - {"resistance"}:
        assert 1.0 / 1.1 <= case.truth["unit"][name] / case.nominal[name] <= 1.1


@pytest.mark.study
def test_pairs_are_no_look_alikes_and_each_lands_in_its_band():
    for seed in range(3):
        case = make_case(seed, together(seed, 2), seconds=20.0)
        first, second = (entry["effect"] for entry in case.truth["effects"])
        assert not look_alike(first, second)
        assert not {first, second} & PARAMETER_LIKE
        assert _largest(case, 0) > 5.0
        assert _largest(case, 1) > 5.0


@pytest.mark.parametrize("excitation", EXCITATIONS)
def test_every_excitation_moves_the_plate_and_stays_within_12_volts(excitation):
    case = make_case(25, excitation=excitation, seconds=20.0)
    assert np.ptp(case.table["throttle_angle"]) > np.radians(30.0)
    on = case.rig.motion(case.effects)[:, at.LOG_MODE] != at.BRIDGE_OFF
    assert np.abs(case.table["motor_voltage"][on]).max() < 12.2
    assert case.about["excitation"] == excitation


def test_the_rich_excitation_crosses_limp_home_and_presses_into_both_stops():
    for seed in range(4):
        case = make_case(seed, seconds=30.0)
        angle = case.rig.motion(case.effects)[:, at.LOG_ANGLE]
        assert angle.max() > case.truth["unit"]["stop_high"]
        assert angle.min() < case.truth["unit"]["stop_low"]


def test_a_strength_out_of_reach_is_said():
    with pytest.raises(OutOfReachError):
        find_strength(lambda strength: (strength, {"torque": 1.0 + strength}), 0.1, 0.2, 3.0, (2.0, 5.0))


def test_files_hold_what_the_tool_may_see_and_the_truth_lies_elsewhere(tmp_path):
    case = make_case(26, ("brush_drop",), "medium", seconds=5.0)
    write_case(case, tmp_path / "case", tmp_path / "sealed" / "case.json")
    header, first, *_ = (tmp_path / "case" / "data.csv").read_text("utf-8").splitlines()
    assert header == (
        "time_s,motor_voltage_V,motor_current_A,motor_angle_rad,throttle_angle_rad,temperature_degC,supply_voltage_V"
    )
    assert len(first.split(",")) == 7
    seen = "".join(path.read_text("utf-8") for path in (tmp_path / "case").iterdir())
    assert "brush" not in seen
    truth = json.loads((tmp_path / "sealed" / "case.json").read_text("utf-8"))
    assert truth["effects"][0]["effect"] == "brush_drop"
    with pytest.raises(ValueError, match="must not lie"):
        write_case(case, tmp_path / "case", tmp_path / "case" / "truth.json")


def test_the_package_reads_the_model_file_as_it_was_meant(tmp_path):
    case = make_case(27, seconds=5.0)
    write_case(case, tmp_path / "case", tmp_path / "sealed.json", binary=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # drawn values may lie outside table I
        model = load_model(tmp_path / "case" / "model.yaml")
    values, nominal = model.values, case.nominal
    assert values.resistance == pytest.approx(nominal["resistance"])
    assert values.torque_per_ampere == pytest.approx(nominal["motor_constant"] * nominal["gear_ratio"])
    assert values.inertia == pytest.approx(
        nominal["motor_inertia"] * nominal["gear_ratio"] ** 2 + nominal["plate_inertia"]
    )
    assert values.stiction == pytest.approx(nominal["stiction"])
    assert values.stribeck_velocity == pytest.approx(nominal["stribeck_velocity"])
    assert model.tolerance("coulomb") == pytest.approx(0.1 * nominal["coulomb"])
    assert "motor_angle_rad" in np.load(tmp_path / "case" / "data.npz").files
