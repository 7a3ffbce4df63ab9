"""Limits on what is measured: each is noticed, and nothing inside them is."""

import math
from dataclasses import replace

import numpy as np
import pytest

from etb_hil.base.modes import Mode
from etb_hil.bench.supervision import SafetyLimits, Supervisor
from etb_hil.recording.recording import ClockGrade, Recording
from etb_hil.recording.samples import SampleBlock
from etb_hil.scenario.trajectory import SetPoint
from etb_hil.session.answer_time import answer_time

LIMITS = SafetyLimits(
    current="8 A", voltage="16 V", angle=("-2 deg", "87 deg"), velocity="25 rad/s", temperature="110 degC",
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
    watched = Supervisor(LIMITS, GEAR, 0)
    watched.expect(["current", "encoder"], 0)
    return watched


def test_what_is_inside_all_limits_moves_on(supervisor):
    angle = np.linspace(0.0, 0.02, 10)
    blocks = [
        samples(motor_current=[7.9, -7.9]),
        samples(throttle_angle=angle, motor_angle=angle * GEAR),
        samples(temperature=[109.0], enable=[1.0], faults=[0.0]),
    ]
    assert supervisor.look(blocks) is None
    assert supervisor.current == -7.9
    assert supervisor.velocity == pytest.approx(0.02 / 9e-3)
    assert supervisor.enabled is True


@pytest.mark.parametrize(
    ("columns", "reason"),
    [
        ({"motor_current": [0.0, -8.1, 0.0]}, "current_limit"),
        ({"throttle_angle": [0.5, 1.6, 0.5]}, "angle_limit"),
        ({"throttle_angle": [-0.1]}, "angle_limit"),
        ({"motor_angle": [GEAR * 0.4]}, "velocity_limit"),
        ({"temperature": [111.0]}, "temperature_limit"),
        ({"faults": [1.0]}, "controller_fault"),
        ({"faults": [8.0]}, "controller_overcurrent"),
        ({"motor_voltage": [0.0, -16.5]}, "voltage_limit"),
    ],
)
def test_each_limit_trips(supervisor, columns, reason):
    supervisor.look([samples(motor_angle=[0.0])])
    block = samples(**columns)
    trip = supervisor.look([replace(block, time_ns=block.time_ns + 10_000_000)])
    assert trip is not None
    assert trip.reason_id == reason
    assert any(character.isdigit() for character in trip.reason)


BAD = [math.nan, math.nan]


@pytest.mark.parametrize(
    ("role", "reason", "after_ms"),
    [
        ("motor_current", "no measured sample of motor current for 10", 100),
        ("motor_angle", "no measured sample of motor angle for 10", 100),
        ("throttle_angle", "no measured sample of throttle angle for 10", 100),
        ("temperature", "no temperature for 1000", 10_000),
    ],
)
def test_a_sensor_that_says_it_has_nothing_is_not_heard(role, reason, after_ms):
    watched = Supervisor(LIMITS, GEAR, 0, reports_temperature=True)
    watched.expect(["current", "encoder"], 0)
    good = {
        "motor_current": [1.0, 1.0],
        "motor_angle": [9.0, 9.0],
        "throttle_angle": [0.5, 0.5],
        "temperature": [20, 20],
    }
    watched.look([samples(**good, enable=[1, 1])])
    for ms in range(2, 12_000, 2):
        assert watched.look([samples(stamp_ns=ms * 1_000_000, **(good | {role: BAD}), enable=[1, 1])]) is None
        trip = watched.age(1_000_000 * (ms + 2))
        if trip is not None:
            break
    assert trip is not None
    assert trip.reason_id == "frames_stopped"
    assert trip.reason.startswith(reason)
    assert ms == pytest.approx(after_ms, abs=4)


def test_fault_bits_that_come_and_go_between_two_beats_are_heard(supervisor):
    trip = supervisor.look([samples(faults=[0.0, 4.0]), samples(faults=[math.nan, 0.0])])
    assert trip is not None
    assert (trip.reason_id, supervisor.faults) == ("controller_fault", 0)
    assert supervisor.look([samples(faults=[0.0])]) is None


def test_a_trip_speaks_of_degrees_as_the_files_do(supervisor):
    assert "91.67 deg, outside -2.00 to 87.00 deg" in supervisor.look([samples(throttle_angle=[1.6])]).reason
    assert "91.67 deg" in supervisor.allows(SetPoint(Mode.POSITION, 1.6)).reason


def commanded(mode, stamp_ms):
    return samples(stamp_ns=stamp_ms * 1_000_000, command_mode=[float(mode)])


def shown(is_on, stamp_ms):
    return samples(stamp_ns=stamp_ms * 1_000_000, enable=[float(is_on)])


@pytest.mark.parametrize(("mode", "is_on"), [(Mode.POSITION, True), (Mode.OFF, False)])
def test_a_bridge_that_is_not_shown_to_obey_trips(supervisor, mode, is_on):
    before = Mode.POSITION if mode is Mode.OFF else Mode.OFF
    assert supervisor.look([commanded(before, 10), shown(not is_on, 20), commanded(mode, 30)]) is None
    assert supervisor.look([shown(not is_on, 129), commanded(mode, 130)]) is None
    late = supervisor.look([shown(not is_on, 131)])
    assert late.reason_id == "answers_late"
    assert "101 ms" in late.reason


def test_a_bridge_that_was_shown_to_obey_may_go_off_by_itself(supervisor):
    blocks = [shown(False, 5), commanded(Mode.POSITION, 10), shown(False, 100), shown(True, 105), shown(False, 300)]
    assert supervisor.look(blocks) is None  # its fault bits say why


def test_a_status_that_is_slow_is_not_late(supervisor):
    assert supervisor.look([commanded(Mode.OFF, 0), commanded(Mode.POSITION, 10), shown(True, 510)]) is None


def test_the_answer_time_is_from_the_command_to_the_status_that_shows_it():
    recording = Recording("test", ClockGrade.RECEIVE_STAMPS)
    modes = [0.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0]
    recording.append([samples("commands", command_mode=modes)])  # a millisecond apart, from 1 ms on
    assert answer_time(recording) is None
    late = samples("status", enable=[0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0])
    recording.append([replace(late, stamp_ns=late.stamp_ns + 100_000)])
    found = answer_time(recording)  # on at 3 ms, shown at 4.1; off at 6 ms, shown at 8.1; on at 9 ms: never shown
    assert found == {"mean_ms": pytest.approx(1.6), "worst_ms": pytest.approx(2.1)}


def test_bad_samples_do_not_hide_good_ones(supervisor):
    trip = supervisor.look([samples(motor_current=[math.nan, 9.0])])
    assert trip is not None


def test_old_samples_and_old_status_trip(supervisor):
    measured = {"motor_current": [0.0], "motor_angle": [0.0], "throttle_angle": [0.0]}
    supervisor.look([samples(stamp_ns=0, **measured), samples(stamp_ns=0, enable=[1.0])])
    assert supervisor.age(99_000_000) is None
    assert supervisor.age(101_000_000).reason_id == "frames_stopped"
    supervisor.look([samples(stamp_ns=1_050_000_000, **measured)])
    assert "status" in supervisor.age(1_060_000_000).reason


def test_each_signal_that_was_asked_for_is_due_by_itself(supervisor):
    assert not supervisor.is_complete
    supervisor.look([samples(stamp_ns=100_000_000, motor_current=[0.0])])
    assert not supervisor.is_complete
    assert "motor angle" in supervisor.age(150_000_000).reason
    supervisor.expect(["current"], 100_000_000)
    assert supervisor.is_complete
    assert supervisor.age(150_000_000) is None


def test_stamps_ahead_of_the_clock_trip(supervisor):
    supervisor.look([samples(stamp_ns=500_000_000, motor_current=[0.0], motor_angle=[0.0], throttle_angle=[0.0])])
    assert supervisor.age(450_000_000) is None
    assert supervisor.age(350_000_000).reason_id == "clock_stepped"


def test_velocity_is_the_travel_of_the_last_milliseconds_for_any_blocks():
    angle = 3.0 * np.arange(40) * 1e-3 * GEAR
    whole = samples(motor_angle=angle)
    for size in (1, 3, 10):
        supervisor = Supervisor(LIMITS, GEAR, 0)
        for start in range(0, 40, size):
            supervisor.look([whole.rows(slice(start, start + size))])
        assert supervisor.velocity == pytest.approx(3.0, rel=1e-9)


def test_faults_are_noted_until_they_are_gone_and_heeded_when_asked(supervisor):
    assert supervisor.look([samples(faults=[4.0])], heed_faults=False) is None
    assert supervisor.faults == 4
    assert supervisor.look([samples(motor_current=[0.0])]).reason_id == "controller_fault"
    assert supervisor.look([samples(faults=[0.0])]) is None


def test_an_answer_is_whole_with_the_controllers_status(supervisor):
    supervisor.look([samples(motor_current=[0.0], motor_angle=[0.0], throttle_angle=[0.0])])
    assert supervisor.is_complete
    assert not supervisor.has_answered
    supervisor.look([samples(enable=[0.0])])
    assert not supervisor.has_answered  # it may have been made before the controller heard of this bench
    supervisor.look([samples(enable=[0.0, 0.0])])
    assert supervisor.has_answered
