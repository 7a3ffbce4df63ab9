"""The generator's own judgement of what can be told apart."""

from dataclasses import replace

import numpy as np
import pytest
from generator import layout as at
from generator.balances import CHANNELS, low_passed, root_mean_square
from generator.case import make_case
from generator.following import follow
from generator.rig import no_effects
from generator.sensitivity import QUIET, Sensitivities
from generator.separability import sealed, separability


def _cosine(a, b):
    return float(a @ b / np.linalg.norm(a) / np.linalg.norm(b))


@pytest.mark.parametrize(
    "name",
    [
        "friction_load",
        pytest.param("stiction_dwell", marks=pytest.mark.study),
        pytest.param("torque_ripple", marks=pytest.mark.study),
        pytest.param("magnet_temperature", marks=pytest.mark.study),
        pytest.param("supply_sag", marks=pytest.mark.study),
        pytest.param("gear_backlash", marks=pytest.mark.study),
        pytest.param("shaft_compliance", marks=pytest.mark.study),
    ],
)
def test_replayed_sensitivities_agree_with_whole_simulations(name):
    case = make_case(31, (name,), "medium", seconds=20.0)
    columns = Sensitivities(case.rig)
    replayed = columns.of_effect(name, case.effects[at.ROW[name]])
    floor = case.rig.floors()
    quiet = replace(case.rig, sensors=QUIET)
    with_it, plain = quiet.residuals(case.effects), quiet.residuals(no_effects())
    whole = np.concatenate([(with_it[c] - plain[c]) / (floor[c] or np.inf) for c in CHANNELS])
    # The controller makes another motion of it: a motor runs through its play.
    assert _cosine(replayed, whole) > (0.9 if name == "gear_backlash" else 0.97)
    assert np.linalg.norm(replayed) == pytest.approx(np.linalg.norm(whole), rel=0.1)


@pytest.mark.study
def test_brush_drop_and_dead_time_look_alike():
    (verdict,) = separability(make_case(32, ("brush_drop",), "medium", seconds=20.0))
    assert "hbridge_dead_time" in verdict.look_alikes
    assert not verdict.top_1_counts


def test_a_shift_of_the_preload_is_its_parameter():
    (verdict,) = separability(make_case(33, ("spring_preload_shift",), "strong", seconds=20.0))
    assert verdict.kept < 0.1
    assert "preload_open" in verdict.parameters


@pytest.mark.study
def test_a_wrong_preload_looks_like_its_shift():
    (verdict,) = separability(make_case(34, ("parameter:preload_open",), "strong", seconds=20.0))
    assert "spring_preload_shift" in verdict.look_alikes


@pytest.mark.study
def test_a_sensor_s_hysteresis_stands_alone_and_stays_visible():
    case = make_case(35, ("sensor_hysteresis",), "strong", seconds=20.0)
    (verdict,) = separability(case)
    assert verdict.top_1_counts
    assert verdict.visible > 4.0
    assert sealed(case)["separability"][0]["effect"] == "sensor_hysteresis"


@pytest.mark.study
def test_in_a_textbook_sweep_base_parameters_imitate_more_than_in_a_rich_excitation():
    kept = [
        separability(make_case(36, ("friction_load",), "strong", excitation=excitation, seconds=20.0))[0].kept
        for excitation in ("slow_sweep", "rich")
    ]
    assert kept[0] < kept[1]


@pytest.mark.study
def test_a_wrong_torque_constant_looks_like_a_battery_that_is_low_by_itself():
    (verdict,) = separability(make_case(300, ("parameter:motor_constant",), "strong"))
    assert "supply_sag" in verdict.look_alikes
    assert not verdict.top_1_counts


@pytest.mark.parametrize("name", ["gear_backlash", pytest.param("shaft_compliance", marks=pytest.mark.study)])
def test_the_plate_stands_where_two_masses_have_it(name):
    case = make_case(37, (name,), "strong", seconds=20.0)
    rig = case.rig
    rows = rig.motion(case.effects)
    lag = follow(rows, rig.inputs, rig.parameters, case.effects, rig.rate)[0]
    simulated = rows[:, at.LOG_ANGLE] - rows[:, at.LOG_PLATE]
    each = low_passed(np.stack([lag, lag - simulated]), rig.rate)
    assert root_mean_square(each[1]) < 0.1 * root_mean_square(each[0])


@pytest.mark.parametrize(
    ("name", "other"),
    [
        ("gear_backlash", "shaft_compliance"),
        pytest.param("shaft_compliance", "gear_backlash", marks=pytest.mark.study),
    ],
)
def test_play_and_a_soft_shaft_look_alike_where_springs_load_the_teeth(name, other):
    (verdict,) = separability(make_case(38, (name,), "strong", seconds=20.0))
    assert verdict.look_alikes == (other,)


@pytest.mark.study
def test_a_rival_is_looked_for_beyond_its_first_draws():
    (verdict,) = separability(make_case(175000, ("parameter:bristle_stiffness",), "medium"))
    assert "presliding_hysteresis" in verdict.look_alikes  # a way of 1.3 mrad, which the first four draws do not have
