"""Limits on what is measured: each is noticed, and nothing inside them is."""

import math

import numpy as np
import pytest

from etb_hil.bench.supervision import SafetyLimits, Supervisor
from etb_hil.recording.samples import SampleBlock

LIMITS = SafetyLimits(
    current="8 A", voltage="12 V", angle=("-2 deg", "87 deg"), velocity="25 rad/s", temperature="110 degC",
    duration="1 min", frame_age="100 ms",
)  # fmt: skip
GEAR = 18.0


def samples(source="m", stamp_ns=1_000_000, **columns):
    n = len(next(iter(columns.values())))
    time_ns = np.arange(n, dtype=np.int64) * 1_000_000
    arrays = {role: np.asarray(values, float) for role, values in columns.items()}
    return SampleBlock(source, time_ns, time_ns + stamp_ns, arrays, np.zeros(n, np.int64))


@pytest.fixture
def supervisor():
    return Supervisor(LIMITS, GEAR, 0)


def test_what_is_inside_all_limits_moves_on(supervisor):
    angle = np.linspace(0.0, 0.02, 10)
    blocks = [
        samples(motor_current=[7.9, -7.9]),
        samples(throttle_angle=angle, motor_angle=angle * GEAR),
        samples(temperature=[109.0], enable=[1.0], faults=[0.0]),
    ]
    assert supervisor.look(blocks) is None
    assert supervisor.current == -7.9
    assert supervisor.velocity == pytest.approx(0.02 / 9e-3, rel=1e-6)
    assert supervisor.enabled is True


@pytest.mark.parametrize(
    ("columns", "reason"),
    [
        ({"motor_current": [0.0, -8.1, 0.0]}, "current_limit"),
        ({"throttle_angle": [0.5, 1.6, 0.5]}, "angle_limit"),
        ({"throttle_angle": [-0.1]}, "angle_limit"),
        ({"motor_angle": np.arange(10) * GEAR * 0.026}, "velocity_limit"),
        ({"temperature": [111.0]}, "temperature_limit"),
        ({"faults": [4.0]}, "controller_fault"),
    ],
)
def test_each_limit_trips(supervisor, columns, reason):
    trip = supervisor.look([samples(**columns)])
    assert trip is not None
    assert trip.reason_id == reason
    assert any(character.isdigit() for character in trip.reason)


def test_bad_samples_do_not_hide_good_ones(supervisor):
    trip = supervisor.look([samples(motor_current=[math.nan, 9.0])])
    assert trip is not None


def test_old_samples_and_old_status_trip(supervisor):
    supervisor.look([samples(stamp_ns=0, motor_current=[0.0]), samples(stamp_ns=0, enable=[1.0])])
    assert supervisor.age(99_000_000) is None
    assert supervisor.age(101_000_000).reason_id == "frames_stopped"
    supervisor.look([samples(stamp_ns=1_050_000_000, motor_current=[0.0])])
    assert "status" in supervisor.age(1_060_000_000).reason


def test_velocity_does_not_depend_on_how_samples_are_cut():
    angle = np.linspace(0.0, 1.0, 40) ** 2 * GEAR
    whole = samples(motor_angle=angle)
    one, many = Supervisor(LIMITS, GEAR, 0), Supervisor(LIMITS, GEAR, 0)
    one.look([whole])
    for index in range(40):
        many.look([whole.rows(slice(index, index + 1))])
    assert many.velocity == pytest.approx(one.velocity, rel=1e-9)
