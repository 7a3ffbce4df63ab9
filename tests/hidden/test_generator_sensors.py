"""Noise, steps and seeds of the generated records."""

import numpy as np
import pytest
from generator import layout as at
from generator.case import make_case
from generator.play import play
from generator.rig import no_effects, set_up
from generator.sensors import Sensors


@pytest.fixture(scope="module")
def at_rest():
    """A rig whose bridge stays off: all that is measured is noise."""
    rig = set_up(11, "slow_sweep", 10.0, 2000)
    rig.inputs[:, at.IN_MODE] = at.BRIDGE_OFF
    return rig.record(no_effects()), Sensors()


def test_current_noise_is_that_of_the_data_sheet(at_rest):
    table, sensors = at_rest
    current = table["motor_current"]
    expected = np.hypot(sensors.current_noise, sensors.current_step / np.sqrt(12.0))
    # 20 000 samples: the rms is known to 0.5 %, the mean to 35 uA.
    assert np.std(current) == pytest.approx(expected, rel=0.025)
    assert abs(np.mean(current)) < 2e-4


def test_noise_is_white(at_rest):
    table, _ = at_rest
    current = table["motor_current"] - np.mean(table["motor_current"])
    correlation = [np.mean(current[lag:] * current[:-lag]) / np.var(current) for lag in range(1, 20)]
    assert np.abs(correlation).max() < 0.04


def test_signals_lie_on_the_steps_of_their_converters(at_rest):
    table, sensors = at_rest
    for role, step in [
        ("motor_current", sensors.current_step),
        ("motor_voltage", sensors.voltage_step),
        ("throttle_angle", sensors.plate_step),
        ("motor_angle", 2.0 * np.pi / sensors.motor_counts),
    ]:
        counts = table[role] / step
        assert np.abs(counts - np.round(counts)).max() < 1e-6, role


def test_the_plate_sensor_has_its_noise_and_its_step(at_rest):
    table, sensors = at_rest
    spread = np.std(table["throttle_angle"])
    assert 0.8 * sensors.plate_noise < spread < np.hypot(sensors.plate_noise, sensors.plate_step)


def test_a_resting_encoder_does_not_flicker(at_rest):
    assert np.ptp(at_rest[0]["motor_angle"]) == 0.0


def test_the_same_seed_gives_the_same_case_and_another_seed_another():
    first, again, other = (make_case(seed, ("brush_drop",), seconds=20.0) for seed in (4, 4, 5))
    assert first.truth == again.truth
    assert first.nominal == again.nominal
    for role, values in first.table.items():
        assert np.array_equal(values, again.table[role]), role
    assert first.nominal["resistance"] != other.nominal["resistance"]
    assert not np.array_equal(first.table["motor_current"], other.table["motor_current"])


@pytest.mark.parametrize(("rate", "rows"), [(1000, 5000), (2000, 10000), (20000, 100000)])
def test_rows_come_at_the_asked_rate(rate, rows):
    table = set_up(2, "rich", 5.0, rate).record(no_effects())
    assert table["time"].size == rows
    assert np.diff(table["time"]) == pytest.approx(1.0 / rate)


@pytest.mark.parametrize(
    ("view", "missing", "counts"),
    [
        ("plate_only", {"motor_angle"}, 16384),
        ("no_current", {"motor_current"}, 16384),
        ("coarse_encoder", set(), 64),
        ("fair_encoder", set(), 1024),
        ("encoder_only", {"throttle_angle"}, 256),
    ],
)
def test_views_take_a_sensor_away_or_make_it_coarse(view, missing, counts):
    case = make_case(6, seconds=5.0, view=view)
    assert set(make_case(6, seconds=5.0).table) - set(case.table) == missing
    assert case.sensors.motor_counts == counts
    if "motor_angle" in case.table:
        steps = np.diff(case.table["motor_angle"]) * counts / (2.0 * np.pi)
        assert np.abs(steps - np.round(steps)).max() < 1e-6


def test_a_rough_bench_logs_the_same_motion_badly():
    good, rough = make_case(6, seconds=5.0), make_case(6, seconds=5.0, view="rough_bench")
    assert rough.sensors == good.sensors  # the data sheet knows of nothing
    np.testing.assert_array_equal(rough.table["motor_angle"], good.table["motor_angle"])
    assert np.count_nonzero(np.abs(rough.table["motor_current"] - good.table["motor_current"]) > 2.0) == 10
    assert np.mean(rough.table["time"] - good.table["time"]) == pytest.approx(1e-4, rel=0.1)
    late = rough.table["motor_voltage"][1:] - good.table["motor_voltage"][:-1]
    assert np.median(late) == pytest.approx(0.02, abs=2e-3)


def test_a_logger_with_a_clock_of_its_own_sees_the_same_motion_between_the_ticks():
    at_ticks, beside = (make_case(6, seconds=5.0, view=view).table for view in ("full", "own_clock"))
    angle, later = at_ticks["throttle_angle"], beside["throttle_angle"]
    way = np.abs(later - angle)[:-1]
    assert np.quantile(way, 0.9) < np.abs(np.diff(angle)).max()
    speed = np.gradient(angle) * 2000.0
    fast = np.abs(speed) > 5.0
    assert 2e-5 < np.median((later - angle)[fast] / speed[fast]) < 4.8e-4


@pytest.mark.parametrize("form", [0.0, 1.0, 2.0])
def test_play_lags_by_half_its_width_and_forgets_nothing(form):
    up = np.linspace(0.0, 1.0, 500)
    followed = play(np.concatenate([up, up[::-1]]), 0.02, form)
    assert followed[499] == pytest.approx(0.99, abs=1e-6)
    assert followed[-1] == pytest.approx(0.01, abs=1e-6)


@pytest.mark.parametrize(
    ("row", "roles"),
    [
        (at.ANGLE_DELAY, ("motor_angle", "throttle_angle")),
        (at.MOTOR_DELAY, ("motor_angle",)),
        (at.PLATE_DELAY, ("throttle_angle",)),
    ],
)
def test_a_late_angle_is_the_angle_some_rows_before(row, roles):
    rig = set_up(2, "rich", 5.0, 2000)
    effects, steady = no_effects(), Sensors(jitter=0.0, plate_noise=0.0)
    in_time = rig.record(effects, steady)
    effects[row, at.STRENGTH], effects[row, at.FORM] = 2e-3, 0.0
    late = rig.record(effects, steady)
    steps = {"motor_angle": 2.0 * np.pi / steady.motor_counts, "throttle_angle": steady.plate_step}
    for role in roles:
        assert np.abs(late[role][4:] - in_time[role][:-4]).max() <= 1.001 * steps[role]
    for other in {"motor_current", "motor_angle", "throttle_angle"} - set(roles):
        assert np.array_equal(late[other], in_time[other])
