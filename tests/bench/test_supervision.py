"""Limits on what is measured: each is noticed, and nothing inside them is."""

import math
from dataclasses import replace

import numpy as np
import pytest

from etb_hil.base.modes import Mode
from etb_hil.base.stock import find
from etb_hil.bench.bench_file import load_bench
from etb_hil.bench.safety_limits import SafetyLimits
from etb_hil.bench.supervision import OVER_CURRENT, TIMEOUT, Supervisor
from etb_hil.controller.state import Fault
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
        ({"temperature": [109.0, 111.0, 109.0]}, "temperature_limit"),
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


@pytest.mark.parametrize(
    ("columns", "reason"),
    [
        ({"throttle_angle": [-0.1], "motor_angle": [GEAR * 0.4]}, None),
        ({"motor_current": [8.1]}, "current_limit"),
        ({"motor_voltage": [16.5]}, "voltage_limit"),
        ({"temperature": [111.0]}, "temperature_limit"),
        ({"faults": [1.0]}, "controller_fault"),
    ],
)
def test_with_the_drive_off_the_plate_may_move_as_it_likes_and_nothing_else_may(supervisor, columns, reason):
    supervisor.look([samples(motor_angle=[0.0])], moves=False)
    block = samples(**columns)
    trip = supervisor.look([replace(block, time_ns=block.time_ns + 10_000_000)], moves=False)
    assert (trip and trip.reason_id) == reason
    if reason is None:
        assert (supervisor.angle, supervisor.velocity) == (-0.1, pytest.approx(40.0))


def test_a_plate_that_has_left_its_range_is_not_driven_from_there(supervisor):
    for angle, reason in ((-0.1, "angle_limit"), (0.5, "set_point_limit"), (math.nan, "set_point_limit")):
        supervisor.look([samples(throttle_angle=[angle])], moves=False)
        assert supervisor.allows(SetPoint(Mode.POSITION, -0.1)).reason_id == reason
        assert supervisor.allows(SetPoint(Mode.POSITION, 0.5)) is None


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
    assert "0x4" in trip.reason
    assert supervisor.look([samples(faults=[0.0])]) is None


def test_an_angle_is_told_that_is_outside_beside_one_at_the_limit(supervisor):
    low, high = LIMITS.angle
    assert "plate at 91.67 deg" in supervisor.look([samples(throttle_angle=[low, 1.6])]).reason
    assert "plate at -5.73 deg" in supervisor.look([samples(throttle_angle=[-0.1, high])]).reason


def test_a_temperature_is_as_old_as_its_newest_sample():
    watched = Supervisor(LIMITS, GEAR, 0, reports_temperature=True, reports_status=False)
    assert watched.velocity == 0.0
    watched.look([samples(stamp_ns=1_000_000_000, temperature=[20.0, 20.0, 20.0])])
    assert watched.age(11_002_000_000) is None
    assert watched.age(11_002_000_001).reason.startswith("no temperature for 10000 ms")
    watched.look([samples(stamp_ns=2_000_000_000, temperature=[20.0])])
    assert watched.age(12_000_000_000) is None
    assert watched.age(12_000_000_001).reason.startswith("no temperature for 10000 ms")


def test_a_temperature_that_no_controller_promises_is_not_due():
    watched = Supervisor(LIMITS, GEAR, 0, reports_status=False)
    watched.look([samples(temperature=[20.0])])
    assert watched.age(60_000_000_000) is None


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
    assert (found.mean_ms, found.worst_ms) == (pytest.approx(1.6), pytest.approx(2.1))


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
            supervisor.look([whole.select(slice(start, start + size))])
        assert supervisor.velocity == pytest.approx(3.0, rel=1e-9)


def test_faults_are_noted_until_they_are_gone_and_heeded_when_asked(supervisor):
    assert supervisor.look([samples(faults=[4.0])], heed_faults=False) is None
    assert supervisor.faults == 4
    trip = supervisor.look([samples(motor_current=[0.0])])
    assert (trip.reason_id, "0x4" in trip.reason) == ("controller_fault", True)
    assert supervisor.look([samples(faults=[0.0])]) is None


def test_an_answer_is_whole_with_the_controllers_status(supervisor):
    supervisor.look([samples(motor_current=[0.0], motor_angle=[0.0], throttle_angle=[0.0])])
    assert supervisor.is_complete
    assert not supervisor.has_answered
    supervisor.look([samples(enable=[0.0])])
    assert not supervisor.has_answered  # it may have been made before the controller heard of this bench
    supervisor.look([samples(enable=[0.0, 0.0])])
    assert supervisor.has_answered


def test_what_is_at_its_limit_moves_on(supervisor):
    low, high = LIMITS.angle
    blocks = [
        samples(motor_current=[8.0, -8.0], motor_voltage=[16.0, -16.0]),
        samples(throttle_angle=[low, high]),
        samples(temperature=[110.0]),
    ]
    assert supervisor.look(blocks) is None


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_speed_is_held_against_its_limit_in_both_directions(supervisor, sign):
    angle = sign * GEAR * 1e-3 * np.arange(10)
    assert supervisor.look([samples(motor_angle=angle * 24.9)]) is None
    trip = Supervisor(LIMITS, GEAR, 0).look([samples(motor_angle=angle * 25.1)])
    assert (trip.reason_id, f"{np.degrees(sign * 25.1):.0f} deg/s" in trip.reason) == ("velocity_limit", True)


@pytest.mark.parametrize(
    ("set_point", "is_allowed"),
    [
        (SetPoint(Mode.POSITION, LIMITS.angle[0], -25.0, -16.0), True),
        (SetPoint(Mode.POSITION, LIMITS.angle[1], 25.0 * (1.0 + 5e-10), 16.0 * (1.0 + 5e-10)), True),
        (SetPoint(Mode.POSITION, 0.5, 25.0 * (1.0 + 1e-9), 16.0 * (1.0 + 1e-9)), True),
        (SetPoint(Mode.POSITION, LIMITS.angle[0] - 1e-6), False),
        (SetPoint(Mode.POSITION, LIMITS.angle[1] + 1e-6), False),
        (SetPoint(Mode.POSITION, 0.5, 25.0 * (1.0 + 3e-9)), False),
        (SetPoint(Mode.POSITION, 0.5, -25.1), False),
        (SetPoint(Mode.POSITION, 0.5, 0.0, 16.0 * (1.0 + 3e-9)), False),
        (SetPoint(Mode.POSITION, 0.5, 0.0, -16.1), False),
        (SetPoint(Mode.POSITION, math.nan), False),
        (SetPoint(Mode.POSITION, 0.5, math.nan), False),
        (SetPoint(Mode.POSITION, 0.5, 0.0, math.nan), False),
        (SetPoint(Mode.OFF, 5.0), True),
    ],
)
def test_a_set_point_outside_the_limits_is_not_sent(supervisor, set_point, is_allowed):
    assert (supervisor.allows(set_point) is None) is is_allowed


MEASURED = {"motor_current": [0.0], "motor_angle": [0.0], "throttle_angle": [0.0]}


@pytest.mark.parametrize(
    ("status_ns", "now_ns", "reason"),
    [
        (0, 1_000_000_000, None),
        (0, 1_000_000_001, "frames_stopped"),
        (1_100_000_000, 1_000_000_000, None),
        (1_100_000_001, 1_000_000_000, "clock_stepped"),
        (-1, 1_000_000_000, "clock_stepped"),  # the run began at 0
    ],
)
def test_a_status_may_be_ten_times_as_old_as_a_sample(supervisor, status_ns, now_ns, reason):
    supervisor.look([samples(stamp_ns=now_ns, **MEASURED), samples(stamp_ns=status_ns, enable=[0.0])])
    trip = supervisor.age(now_ns)
    assert (trip and trip.reason_id) == reason
    assert trip is None or "status frame" in trip.reason
    assert reason != "frames_stopped" or trip.reason.endswith("(allowed: 1000 ms)")


@pytest.mark.parametrize(("age_ns", "reason"), [(100_000_000, None), (100_000_001, "frames_stopped")])
def test_a_sample_may_be_as_old_as_the_bench_says(supervisor, age_ns, reason):
    now_ns = 500_000_000
    supervisor.look([samples(stamp_ns=now_ns - age_ns, **MEASURED), samples(stamp_ns=now_ns, enable=[0.0])])
    assert supervisor.newest_ns == now_ns - age_ns
    trip = supervisor.age(now_ns)
    assert (trip and trip.reason_id) == reason


def test_without_a_status_message_samples_alone_are_the_answer():
    watched = Supervisor(LIMITS, GEAR, 0, reports_status=False)
    assert not watched.has_answered
    watched.expect(["current"], 0)
    assert not watched.has_answered
    watched.look([samples(stamp_ns=5_000_000_000, motor_current=[0.0])])
    assert watched.has_answered
    assert watched.age(5_000_000_000) is None


def test_two_statuses_may_be_of_before(supervisor):
    supervisor.look([samples(**MEASURED), samples(enable=[0.0, 0.0])])
    assert not supervisor.has_answered
    supervisor.look([samples(enable=[0.0])])
    assert supervisor.has_answered


def test_samples_that_are_asked_for_again_are_due_from_then_on(supervisor):
    supervisor.look([samples(stamp_ns=100_000_000, **MEASURED)])
    supervisor.expect(["current", "encoder"], 300_000_000)
    assert supervisor.newest_ns == 300_000_000
    supervisor.expect(["current"], 200_000_000)
    assert supervisor.newest_ns == 300_000_000


def test_the_newest_good_values_are_shown(supervisor):
    supervisor.look([samples(throttle_angle=[0.1, 0.2], motor_current=[1.0, 2.0]), samples(temperature=[20.0, 21.0])])
    assert (supervisor.angle, supervisor.current, supervisor.temperature) == (0.2, 2.0, 21.0)
    supervisor.look([samples(enable=[1.0, 0.0])])
    assert supervisor.enabled is False


def test_fault_bits_stay_until_a_status_takes_them_back(supervisor):
    assert supervisor.look([samples(faults=[8.0, 4.0])]).reason_id == "controller_fault"
    assert supervisor.look([samples(faults=[math.nan])]).reason_id == "controller_fault"
    assert supervisor.look([samples(faults=[0.0])]) is None
    assert supervisor.look([]) is None


def test_a_block_without_samples_says_nothing(supervisor):
    empty = samples(motor_current=[9.0], faults=[1.0]).select(slice(0))
    assert supervisor.look([empty, samples(motor_current=[1.0])]) is None
    assert supervisor.current == 1.0


def test_the_newest_good_sample_counts(supervisor):
    good = {role: [0.1] * 5 for role in MEASURED}
    supervisor.look([samples(stamp_ns=10_000_000, **(good | {"motor_current": [1.0, 1.0, 1.0, math.nan, math.nan]}))])
    assert supervisor.newest_ns == 12_000_000
    supervisor.look([samples(stamp_ns=20_000_000, **(good | {"motor_current": [math.nan] * 5}))])
    assert supervisor.newest_ns == 12_000_000
    supervisor.look([samples(stamp_ns=30_000_000, **(good | {"motor_current": [1.0, 1.0, 1.0, 1.0, math.nan]}))])
    assert supervisor.newest_ns == 33_000_000


def test_before_the_first_sample_nothing_is_known(supervisor):
    assert all(math.isnan(value) for value in (supervisor.current, supervisor.angle, supervisor.temperature))
    assert (supervisor.velocity, supervisor.enabled, supervisor.faults) == (0.0, None, 0)


def test_a_sample_of_before_the_run_says_by_how_much():
    watched = Supervisor(LIMITS, GEAR, 1_000_000_000, reports_status=False)
    watched.expect(["current"], 1_000_000_000)
    watched.look([samples(stamp_ns=400_000_000, motor_current=[0.0])])
    trip = watched.age(1_000_000_000)
    assert trip.reason_id == "clock_stepped"
    assert trip.reason == "a measured sample of motor current is stamped 600 ms before the run began"


def test_what_is_read_by_request_may_pause_at_rest():
    watched = Supervisor(LIMITS, GEAR, 0, reports_status=False, requested=["motor_current"])
    watched.expect(["current", "encoder"], 0)
    watched.look([samples(stamp_ns=500_000_000, motor_angle=[0.0], throttle_angle=[0.0])])
    assert watched.age(500_000_000, moves=False) is None
    for how in ({}, {"moves": True}):
        assert "motor current for 500 ms" in watched.age(500_000_000, **how).reason
    assert "motor angle for 101 ms" in watched.age(601_000_000, moves=False).reason


def test_fault_bits_are_those_of_the_controller():
    assert (TIMEOUT, OVER_CURRENT) == (Fault.TIMEOUT, Fault.OVER_CURRENT)


def test_a_sample_may_be_a_tenth_of_a_second_old_where_the_bench_does_not_say():
    path = find("bench", "virtual_classic")
    assert "frame_age" not in path.read_text()
    watched = Supervisor(load_bench(path).bench.limits, GEAR, 0, reports_status=False)
    watched.expect(["current"], 0)
    assert watched.age(100_000_000) is None
    assert watched.age(100_000_001).reason_id == "frames_stopped"


@pytest.mark.parametrize(
    ("reports", "fresh_until_ns"),
    [
        ({"reports_temperature": True}, 6_000_000_000),  # ten ages of a sample after the status
        ({"reports_temperature": True, "reports_status": False}, 12_000_000_000),  # 10 s after the temperature
        ({"reports_temperature": False}, 6_000_000_000),
        ({"reports_temperature": False, "reports_status": False}, math.inf),
    ],
)
def test_status_and_temperature_are_fresh_until_they_are_too_old(reports, fresh_until_ns):
    watched = Supervisor(LIMITS, GEAR, 0, **reports)
    watched.look([samples(stamp_ns=2_000_000_000, temperature=[20.0]), samples(stamp_ns=5_000_000_000, enable=[0.0])])
    assert watched.fresh_until_ns() == min(fresh_until_ns, np.iinfo(np.int64).max)
    if fresh_until_ns < math.inf:
        assert watched.age(int(fresh_until_ns)) is None
        assert watched.age(int(fresh_until_ns) + 1).reason_id == "frames_stopped"


def test_what_is_measured_until_a_time_is_what_a_look_at_each_sample_says(supervisor):
    current = samples(stamp_ns=50_000_000, motor_current=[0.0, np.nan, 0.0, 0.0])
    angles = samples(stamp_ns=51_500_000, motor_angle=[0.0] * 3, throttle_angle=[0.0] * 3)
    times_ns = 50_000_000 + 500_000 * np.arange(12, dtype=np.int64)
    foreseen = supervisor.measured_until_ns([current, angles], times_ns)
    seen = []
    for time_ns in times_ns:
        for block in (current, angles):
            come = block.stamp_ns == time_ns
            supervisor.look([block.select(slice(k, k + 1)) for k in np.flatnonzero(come)])
        seen.append(supervisor.newest_ns)
    assert foreseen.tolist() == seen
    assert seen[:2] == [0, 0]
    assert len(set(seen)) == 6


def test_what_is_measured_is_not_foreseen_where_more_than_stamps_decides(supervisor):
    def foreseen(watched, *blocks, at_ns=(5_000_000,)):
        found = watched.measured_until_ns(blocks, np.array(at_ns))
        return None if found is None else found.tolist()

    block = samples(**MEASURED)
    assert foreseen(supervisor, block) == [1_000_000]
    assert foreseen(supervisor, block, samples(temperature=[20.0])) == [1_000_000]
    assert foreseen(supervisor, block, samples("n", motor_current=[0.0])) is None
    assert foreseen(supervisor, block, samples(stamp_ns=3_000_000, **MEASURED)) == [
        3_000_000
    ]  # a segment ended between
    assert foreseen(supervisor, block, at_ns=[5_000_000, 101_000_000]) == [1_000_000] * 2
    assert foreseen(supervisor, block, at_ns=[5_000_000, 101_000_001]) is None
    assert foreseen(supervisor, at_ns=[100_000_000]) == [0]
    assert foreseen(Supervisor(LIMITS, GEAR, 0), block) is None


def test_a_value_that_decides_has_an_age_of_its_own_and_bad_samples_do_not_renew_it():
    watched = Supervisor(LIMITS, GEAR, 0, oldest_ns={"faults": 2_000_000_000})
    watched.expect(["current", "encoder"], 0)
    assert not watched.is_told
    at_ns = {"stamp_ns": 1_000_000_000}
    watched.look([samples(faults=[0.0], **at_ns), samples(enable=[0.0], **at_ns)])
    assert watched.is_told
    for now_ns in (2_900_000_000, 3_000_000_000, 3_000_000_001):
        late = {"stamp_ns": now_ns}
        trip = watched.look([samples(enable=[0.0], faults=[math.nan], **late), samples(**late, **MEASURED)])
        assert trip is None
        trip = watched.age(now_ns)
        assert (trip is None) is (now_ns <= 3_000_000_000)
    assert "status frame with faults" in trip.reason
    assert watched.fresh_until_ns() == 3_000_000_000
    assert watched.enabled is False


def test_every_value_that_decides_is_to_come_before_the_start_is_told():
    watched = Supervisor(LIMITS, GEAR, 0, oldest_ns={"faults": 2_000_000_000, "supply_voltage": 2_000_000_000})
    watched.look([samples(faults=[0.0])])
    assert not watched.is_told
    watched.look([samples(supply_voltage=[13.0])])
    assert watched.is_told


def test_a_value_that_decides_and_is_read_by_request_may_pause_at_rest_and_the_others_may_not():
    ages = {"supply_voltage": 1_000_000_000, "faults": 2_000_000_000}
    watched = Supervisor(LIMITS, GEAR, 0, requested=["supply_voltage"], oldest_ns=ages)
    watched.look([samples(stamp_ns=1_500_000_000, enable=[1.0])])
    assert watched.age(1_500_000_000, moves=False) is None
    assert "supply voltage" in watched.age(1_500_000_000, moves=True).reason
    watched.look([samples(stamp_ns=2_500_000_000, enable=[1.0])])
    assert "faults" in watched.age(2_500_000_000, moves=False).reason


def test_a_cyclic_value_that_decides_may_not_pause_at_rest():
    watched = Supervisor(LIMITS, GEAR, 0, oldest_ns={"supply_voltage": 1_000_000_000})
    watched.look([samples(stamp_ns=1_500_000_000, enable=[1.0])])
    assert "supply voltage" in watched.age(1_500_000_000, moves=False).reason


def test_of_two_samples_the_one_that_is_read_by_request_may_pause_at_rest_and_the_other_may_not():
    watched = Supervisor(LIMITS, GEAR, 0, reports_status=False, requested=["motor_current"])
    watched.expect(["current", "encoder"], 0)
    watched.look([samples(motor_current=[0.0]), samples(throttle_angle=[0.1], motor_angle=[1.8])])
    assert "motor current" not in watched.age(300_000_000, moves=False).reason


def test_a_value_that_decides_may_be_stamped_ahead_as_far_as_a_sample():
    watched = Supervisor(LIMITS, GEAR, 0, reports_status=False, oldest_ns={"supply_voltage": 1_000_000_000})
    watched.look([samples(stamp_ns=1_000_000_000, supply_voltage=[13.0])])
    assert watched.age(900_000_000) is None
    assert watched.age(1_050_000_000) is None
    assert "ahead of the clock" in watched.age(899_999_999).reason
