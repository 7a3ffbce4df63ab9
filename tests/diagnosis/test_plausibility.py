"""What speaks against samples: each check on both sides of its limit, and how a stream is cut changes nothing."""

import itertools
import math
import re
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from etb_hil.base.modes import Mode
from etb_hil.base.stock import find
from etb_hil.diagnosis.motor_balance import worst_residual
from etb_hil.diagnosis.plausibility import Plausibility
from etb_hil.plant.parameters import load_model
from etb_hil.recording.samples import SampleBlock

# As docs/reference/faults.md states them.
TRACKS, ENCODER = 0.03, 0.05  # rad
OFF_CURRENT = 0.03  # A
MISSING, RATE = 0.05, 0.3  # of the time of motion, of the rate that was asked for
STEP_NS, DRIFT = 20_000_000, 1e-3


def rows(start, current, mode, rng):
    count = 500
    time_ns = start + np.arange(count) * 1_000_000
    columns = {
        "motor_current": current + rng.normal(0.0, 0.005, count),
        "motor_angle": np.full(count, 2.5),
        "command_mode": np.full(count, float(mode)),
    }
    return SampleBlock("joined", time_ns, time_ns + 200_000, columns, np.zeros(count, np.int64))


def doubts(*segments):
    rng, watch = np.random.default_rng(1), Plausibility(load_model(find("model", "default")))
    for number, (current, mode) in enumerate(segments):
        watch.push(rows(number * 500_000_000, current, mode, rng), number, moving=False)
    return [doubt.id for doubt in watch.doubts()]


@pytest.mark.parametrize("moved", [1.5 * OFF_CURRENT, -1.5 * OFF_CURRENT])
def test_a_zero_that_moves_is_seen_with_the_bridge_commanded_off(moved):
    assert doubts((0.0, Mode.OFF), (moved, Mode.OFF)) == ["current_zero_moves"]


def test_a_current_that_the_bridge_drives_is_no_zero():
    assert doubts((0.0, Mode.OFF), (0.8, Mode.POSITION), (0.01, Mode.OFF)) == []


def test_where_commands_are_not_recorded_nothing_is_said():
    assert doubts((0.0, np.nan), (1.0, np.nan)) == []


MODEL = load_model(find("model", "default"))
GEAR = MODEL.values.gear_ratio
MS = 1_000_000
MIDDLE = 0.7  # rad, between limp-home and the upper stop


@dataclass
class Record:
    """Rows at 1 kHz of a plate that swings, with all its sensors in order; a test spoils what it is about."""

    count: int = 2_000
    seed: int = 3
    speed: float = 0.0  # rad/s, up and down every second
    columns: dict = field(default_factory=dict)

    def __post_init__(self):
        rng = np.random.default_rng(self.seed)
        t = np.arange(self.count) * 1e-3
        angle = MIDDLE + self.speed / math.tau * np.sin(math.tau * t)
        self.time_ns = np.arange(self.count) * MS + 5 * MS
        self.stamp_ns = self.time_ns + 200_000
        self.columns = {
            "motor_current": 0.5 + rng.normal(0.0, 0.005, self.count),
            "motor_angle": GEAR * (angle - 0.1),  # an encoder counts from anywhere
            "throttle_angle": angle.copy(),
            "throttle_angle_2": angle.copy(),
            "command_mode": np.full(self.count, float(Mode.POSITION)),
        }

    def block(self):
        return SampleBlock("joined", self.time_ns, self.stamp_ns, self.columns, np.zeros(len(self.time_ns), np.int64))

    def found(self, *, moving=True, asked=None, pieces=1, model=MODEL):
        watch = Plausibility(model)
        if asked is not None:
            watch.ask(asked, 0)
        edges = np.linspace(0, len(self.time_ns), pieces + 1).astype(int)
        for start, end in itertools.pairwise(edges):
            watch.push(self.block().select(slice(start, end)), 0, moving=moving)
        return watch.doubts()

    def ids(self, **how):
        return [doubt.id for doubt in self.found(**how)]

    def keep(self, chosen):
        self.time_ns, self.stamp_ns = self.time_ns[chosen], self.stamp_ns[chosen]
        self.columns = {name: values[chosen] for name, values in self.columns.items()}
        return self


@pytest.mark.parametrize("speed", [0.0, 1.0, 5.0])
def test_a_bench_in_order_has_no_doubts(speed):
    assert Record(speed=speed).ids(asked=1000.0) == []


@pytest.mark.parametrize(("apart", "samples", "seen"), [(1.05, 5, True), (1.05, 4, False), (0.95, 500, False)])
def test_plate_tracks_that_disagree(apart, samples, seen):
    record = Record()
    record.columns["throttle_angle_2"][100 : 100 + samples] += apart * TRACKS
    doubts = record.found()
    assert [d.id for d in doubts] == (["tracks_disagree"] if seen else [])
    assert not seen or f"in {samples} samples" in doubts[0].text


def test_plate_tracks_may_differ_by_their_limit():
    record = Record()
    for name in ("throttle_angle", "throttle_angle_2"):
        record.columns[name][:] = TRACKS
    record.columns["throttle_angle_2"][100:200] = 0.0
    assert record.ids() == []


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("apart", "samples", "seen"), [(1.05, 5, True), (1.05, 4, False), (0.95, 500, False)])
def test_a_plate_that_parts_from_the_encoder(apart, samples, seen, sign):
    record = Record()
    for name in ("throttle_angle", "throttle_angle_2"):
        record.columns[name][100 : 100 + samples] += sign * apart * ENCODER
    doubts = record.found()
    assert [d.id for d in doubts] == (["angles_disagree"] if seen else [])
    assert not seen or f"in {samples} samples" in doubts[0].text


@pytest.mark.parametrize(("late", "seen"), [(0.9, False), (1.1, True)])
def test_a_plate_sensor_may_lag_by_a_millisecond_of_motion(late, seen):
    """Where the plate turns at 5 rad/s: 5 mrad more than at rest."""
    record = Record(speed=5.0)
    fastest = np.flatnonzero(np.cos(math.tau * np.arange(record.count) * 1e-3) > 0.9999)
    fastest = fastest[fastest > 100]  # the first ones tell where the encoder counts from
    for name in ("throttle_angle", "throttle_angle_2"):
        record.columns[name][fastest] -= ENCODER + late * 5e-3
    assert record.ids() == (["angles_disagree"] if seen else [])


def test_where_the_encoder_counts_from_is_told_by_the_first_samples():
    record = Record()
    record.columns["motor_angle"] += GEAR * 3.0
    assert record.ids() == []


def test_the_first_fifty_samples_tell_where_the_encoder_counts_from():
    record = Record(count=400)
    for name in ("throttle_angle", "throttle_angle_2"):
        record.columns[name][50:] += 1.2 * ENCODER
    (doubt,) = record.found()
    assert (doubt.id, "in 350 samples" in doubt.text) == ("angles_disagree", True)


@pytest.mark.parametrize(("rows", "off"), [(slice(25, None), 1.2), (slice(50, 51), 60.0)])
def test_no_more_and_no_less_than_fifty_samples_tell_where_the_encoder_counts_from(rows, off):
    """The mean of half of them each leaves no sample off by more than 0.6 of the limit; the 51st counts no more."""
    record = Record(count=400)
    for name in ("throttle_angle", "throttle_angle_2"):
        record.columns[name][rows] += off * ENCODER
    assert record.ids() == []


@pytest.mark.parametrize(("off", "seen"), [(0.09, False), (0.11, True)])
def test_an_encoder_that_jumps_is_no_excuse_for_more_than_fifty_milliradians(off, seen):
    """A sensor's millisecond at 50 rad/s: no plate is faster."""
    record = Record()
    record.columns["motor_angle"][100:150:10] += GEAR * off
    assert ("angles_disagree" in record.ids()) == seen


def wild(size, where, at=0.0):
    """Return a record whose encoder is off by `size` times what a motor's step of a millisecond may bend."""
    values = MODEL.values
    torque = values.torque_per_ampere * values.voltage_limit / values.resistance
    torque += max(values.preload_open, values.preload_close) + values.stiction
    bend = 3.0 * torque / values.inertia * 1e-6 + 3.0 * math.tau / MODEL.sensors.motor_counts_per_turn / GEAR
    record = Record()
    record.columns["motor_angle"][where] += GEAR * size * bend
    if at:
        for name in ("throttle_angle", "throttle_angle_2"):
            record.columns[name] += at
    return record


@pytest.mark.parametrize(
    ("size", "where", "jumps"),
    [
        (1.05, [500], 3),  # one wrong angle bends three times: by its size, by twice that, by its size
        (1.05, [500, 600], 6),
        (0.95, [500, 600], 0),  # two bends of twice its size
        (0.95, [500, 600, 700], 3),
        (0.49, [500, 600, 700, 800], 0),
        (1.05, [1, 600], 5),  # the first three samples bend as well
    ],
)
def test_an_encoder_that_jumps(size, where, jumps):
    doubts = wild(size, where).found()
    assert [d.id for d in doubts] == (["angle_jumps"] if jumps else [])
    assert not jumps or f"{jumps} times" in doubts[0].text


@pytest.mark.parametrize("weak", ["open", "close"])
def test_the_stronger_spring_says_how_an_angle_may_bend(weak, tmp_path):
    text = find("model", "default").read_text("utf-8")
    before = f"  preload_{weak}:\n    value: 0.35 N·m\n"
    assert before in text
    path = tmp_path / "model.yaml"
    path.write_text(text.replace(before, before.replace("0.35", "0.30")), "utf-8")
    model = load_model(path)
    assert wild(1.002, [500, 600]).ids(model=model) == ["angle_jumps"]
    assert wild(0.998, [500, 600]).ids(model=model) == []


def test_an_encoder_that_jumps_back_is_seen_as_well():
    assert wild(-1.05, [500, 600]).ids() == ["angle_jumps"]


def test_a_plate_next_to_a_stop_may_be_thrown_back():
    """0.05 rad next to a stop, it is the stop that accelerates."""
    for stop, outwards in ((MODEL.values.stop_high, 1.0), (MODEL.values.stop_low, -1.0)):
        assert wild(1.05, [500, 600], at=stop - outwards * 0.06 - MIDDLE).ids() == ["angle_jumps"]
        assert wild(1.05, [500, 600], at=stop - outwards * 0.04 - MIDDLE).ids() == []


def test_without_a_plate_sensor_an_encoders_jumps_are_seen_still():
    record = wild(1.05, [500, 600])
    for name in ("throttle_angle", "throttle_angle_2"):
        del record.columns[name]
    assert record.ids() == ["angle_jumps"]


def test_over_a_gap_nothing_is_said_of_the_encoder():
    record = wild(1.05, [500, 600, 700])
    chosen = np.full(record.count, True)
    chosen[[499, 501, 599, 601, 699, 701]] = False  # each wrong angle stands between gaps
    assert record.keep(chosen).ids() == []


def test_a_current_that_stands_still_is_frozen():
    """A step of 1 mA and noise of 5 mA repeat one reading with a chance of 0.056."""
    chance = 1.0 / (5.0 * 2.0 * math.sqrt(math.pi))
    needed = 2 * math.ceil(70.0 / -math.log(chance))
    for count, seen in ((needed, False), (needed + 1, True)):
        record = Record()
        record.columns["motor_current"][300 : 300 + count] = 0.4
        doubts = record.found()
        assert [d.id for d in doubts] == (["current_frozen"] if seen else [])
        assert not seen or f"for {count} samples" in doubts[0].text


def test_a_current_that_stands_still_for_less_than_20_ms_may_be_held():
    record = Record()
    record.time_ns = 5 * MS + np.arange(record.count) * 100_000  # 10 kHz
    record.stamp_ns = record.time_ns + 200_000
    record.columns["motor_current"][300:500] = 0.4
    assert record.ids() == []
    record.columns["motor_current"][300:501] = 0.4
    assert record.ids() == ["current_frozen"]


def test_the_longest_stretch_of_a_frozen_current_is_said():
    record = Record()
    record.columns["motor_current"][300:600] = 0.4
    record.columns["motor_current"][700:800] = 0.4
    assert "for 300 samples" in record.found()[0].text


@pytest.mark.parametrize(("share", "seen"), [(0.96, False), (1.04, True)])
def test_samples_that_are_missing_while_the_plate_moves(share, seen):
    chosen = np.full(2_000, True)
    chosen[1_000 : 1_000 + round(share * MISSING * 2_000)] = False
    assert Record().keep(chosen).ids() == (["samples_missing"] if seen else [])
    assert Record().keep(chosen).ids(moving=False) == []


def test_samples_that_are_a_little_late_are_not_missing():
    record = Record()
    record.time_ns = record.time_ns + np.where(np.arange(record.count) % 2, 150_000, 0)
    record.stamp_ns = record.time_ns + 200_000
    assert record.ids() == []


@pytest.mark.parametrize(("factor", "seen"), [(1.5, False), (1.6, True)])
def test_half_an_interval_more_is_no_missing_sample(factor, seen):
    record = Record()
    gaps = np.where(np.arange(record.count) % 4 == 3, round(factor * MS), MS)
    record.time_ns = np.cumsum(gaps)
    record.stamp_ns = record.time_ns + 200_000
    doubts = record.found()
    assert [d.id for d in doubts] == (["samples_missing"] if seen else [])
    if seen:  # a quarter of all gaps has 0.6 ms without samples, of 1.15 ms in the mean
        assert float(re.match(r"([\d.]+)%", doubts[0].text)[1]) == pytest.approx(100 * 0.15 / 1.15, abs=0.1)


@pytest.mark.parametrize(
    ("asked", "seen"),
    [(1000.0, False), (780.0, False), (750.0, False), (690.0, True), (1280.0, False), (1350.0, True), (1.0, True)],
)
def test_samples_come_as_they_were_asked_for(asked, seen):
    doubts = Record().found(asked=asked)
    assert [d.id for d in doubts] == (["not_as_asked"] if seen else [])
    assert not seen or f"at 1000 Hz; {asked:.0f} Hz" in doubts[0].text
    assert seen == (abs(1.0 / 1000.0 - 1.0 / asked) > RATE / asked)


def test_the_rate_counts_from_a_tenth_of_a_second_after_the_request():
    """What was asked for before is still on its way."""
    record = Record()
    early = np.concatenate([np.arange(90) * 500_000, 50 * MS + np.arange(record.count - 90) * MS])
    record.time_ns, record.stamp_ns = early, early + 200_000
    assert record.ids(asked=1000.0, moving=False) == []
    late = np.concatenate([np.arange(300) * 500_000, 200 * MS + np.arange(record.count - 300) * MS])
    record.time_ns, record.stamp_ns = late, late + 200_000
    assert record.ids(asked=1000.0, moving=False) == ["not_as_asked"]


def test_each_request_has_its_own_rate():
    record = Record()
    watch = Plausibility(MODEL)
    watch.ask(1000.0, 0)
    watch.ask(2000.0, int(record.stamp_ns[1_000]))
    watch.push(record.block(), 0, moving=True)
    doubts = watch.doubts()
    assert [d.id for d in doubts] == ["not_as_asked"]
    assert "at 1000 Hz; 2000 Hz" in doubts[0].text


def test_a_rate_is_judged_before_the_next_request():
    record = Record()
    watch = Plausibility(MODEL)
    watch.ask(2000.0, 0)
    watch.ask(1000.0, int(record.stamp_ns[1_000]))
    watch.push(record.block(), 0, moving=True)
    assert ["at 1000 Hz; 2000 Hz" in doubt.text for doubt in watch.doubts()] == [True]


def test_a_request_that_no_sample_followed_in_time_is_not_judged():
    """The last fifty samples come within the tenth of a second in which a request is not yet heeded."""
    record = Record()
    watch = Plausibility(MODEL)
    watch.ask(1000.0, 0)
    watch.ask(500.0, int(record.stamp_ns[1_950]))
    watch.push(record.block(), 0, moving=True)
    assert watch.doubts() == []


def test_a_request_counts_from_its_stamp_though_it_is_known_before():
    """Samples that are missing just before it are missing ones, however the stream is cut."""
    record = Record()
    asked_at = int(record.stamp_ns[1_500])
    first, rest = record.block().select(slice(0, 1_000)), record.block().select(np.r_[1_000:1_150, 1_350:2_000])
    watch = Plausibility(MODEL)
    watch.ask(1000.0, 0)
    watch.ask(1000.0, asked_at)
    for block in (first, rest):
        watch.push(block, 0, moving=True)
    assert [doubt.id for doubt in watch.doubts()] == ["samples_missing"]


def test_nothing_is_said_of_a_rate_that_nobody_asked_for():
    assert Record().ids(asked=0.0) == []


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("moved", "seen"), [(0.9, False), (1.1, True)])
def test_a_host_clock_that_was_set(moved, seen, sign):
    """20 ms, and one in a thousand of the time that has passed: a second before, two at the end."""
    record = Record(count=4_000)
    record.time_ns = record.time_ns + 20_000 * MS  # two clocks may begin anywhere
    record.stamp_ns = record.stamp_ns + (20_000 + sign * 10_000) * MS
    record.stamp_ns[2_000:] += sign * round(moved * (STEP_NS + DRIFT * 4_000 * MS))
    doubts = record.found(moving=False)
    assert [d.id for d in doubts] == (["clocks_disagree"] if seen else [])
    if seen:
        parted = int(re.search(r"part by (\d+) ms", doubts[0].text)[1])
        assert parted == round(moved * (20 + 4))


def test_a_first_sample_that_is_late_tells_no_delay():
    record = Record(count=4_000)
    record.time_ns = record.time_ns + 20_000 * MS
    record.stamp_ns = record.time_ns + 200_000
    record.stamp_ns[0] += 80 * MS
    assert record.ids(moving=False) == []


def test_frames_that_are_late_now_and_then_are_no_clock_that_was_set():
    record = Record(count=4_000)
    record.stamp_ns = record.stamp_ns + np.where(np.arange(4_000) % 7 == 3, 0, 80 * MS)
    assert record.ids() == []


def test_a_clock_that_was_set_late_may_have_drifted_no_further():
    record = Record(count=4_000)
    record.stamp_ns[3_000:] += round(1.1 * (STEP_NS + DRIFT * 4_000 * MS))
    assert record.ids(moving=False) == ["clocks_disagree"]


@pytest.mark.parametrize(("first", "late", "seen"), [(2_010, 400, False), (2_240, 600, False), (2_010, 1_010, True)])
def test_a_clock_is_judged_by_the_least_delay_of_half_a_second(first, late, seen):
    """What is late for less than that is a host that stalls; in more than two halves one of them is late as a whole."""
    record = Record(count=4_000)
    record.stamp_ns[first : first + late] += 80 * MS
    assert record.ids() == (["clocks_disagree"] if seen else [])


@pytest.mark.parametrize("role", ["motor_current", "motor_angle"])
def test_samples_without_a_value_are_missing_ones(role):
    record = Record()
    record.columns[role][1_000:1_120] = math.nan
    assert record.ids() == ["samples_missing"]


def test_a_slower_request_is_not_held_against_the_samples_before_it():
    record = Record()
    fast = 5 * MS + np.arange(1_000) * 500_000
    record.time_ns = np.concatenate([fast, fast[-1] + MS + np.arange(1_000) * MS])
    record.stamp_ns = record.time_ns + 200_000
    watch = Plausibility(MODEL)
    watch.ask(2000.0, 0)
    watch.ask(1000.0, int(record.stamp_ns[1_000]))
    watch.push(record.block(), 0, moving=False)
    assert watch.doubts() == []


@pytest.mark.parametrize(("size", "seen"), [(0.9, False), (1.1, True)])
def test_at_a_fast_rate_an_angle_may_jump_by_three_counts_of_the_encoder(size, seen):
    values = MODEL.values
    torque = values.torque_per_ampere * values.voltage_limit / values.resistance
    torque += max(values.preload_open, values.preload_close) + values.stiction
    bend = 3.0 * torque / values.inertia * (50e-6) ** 2 + 3.0 * math.tau / MODEL.sensors.motor_counts_per_turn / GEAR
    record = Record()
    record.time_ns = 5 * MS + np.arange(record.count) * 50_000
    record.stamp_ns = record.time_ns + 200_000
    record.columns["motor_angle"][[500, 600, 700]] += 0.5 * GEAR * size * bend  # bends twice that in the middle
    assert record.ids() == (["angle_jumps"] if seen else [])


def test_readings_of_a_coarse_sensor_may_well_be_equal():
    sensors = MODEL.sensors.model_copy(update={"current_step": 0.011, "current_noise": 0.005})
    record = Record()
    record.columns["motor_current"][300:1_500] = 0.4
    assert record.ids(model=replace(MODEL, sensors=sensors)) == []
    assert record.ids() == ["current_frozen"]
    half = MODEL.sensors.model_copy(update={"current_step": 0.01, "current_noise": 0.005})
    assert record.ids(model=replace(MODEL, sensors=half)) == ["current_frozen"]
    exact = MODEL.sensors.model_copy(update={"current_step": 0.0, "current_noise": 0.0})
    assert record.ids(model=replace(MODEL, sensors=exact)) == []


def test_rows_without_current_or_angle_are_passed_over():
    record = Record()
    record.columns["motor_current"][100:110] = math.nan
    record.columns["motor_angle"][400:410] = math.nan
    assert record.ids() == []


@pytest.mark.parametrize("pieces", [2, 7, 400])
def test_how_the_rows_are_cut_changes_no_doubt(pieces):
    record = wild(1.05, [500, 600])
    record.columns["throttle_angle_2"][100:300] += 2 * TRACKS
    record.columns["motor_current"][700:1_000] = 0.4
    assert record.found(pieces=pieces) == record.found()
    assert len(record.found()) == 3


def bridge_off(*means, length=1_000, settle=99):
    """Return a record with the bridge off in segments, between them on; the current settles slowly in each."""
    record = Record(count=len(means) * (length + 100))
    for number, mean in enumerate(means):
        start = number * (length + 100)
        record.columns["command_mode"][start : start + length] = float(Mode.OFF)
        record.columns["motor_current"][start : start + length] += mean - 0.5
        record.columns["motor_current"][start : start + settle] += 0.3
    return record


def test_a_current_that_dies_away_is_no_zero_that_moves():
    assert bridge_off(0.0, 0.0, settle=99).ids() == []
    assert bridge_off(0.0, 0.0, settle=120).ids() == ["current_zero_moves"]


def test_a_zero_needs_fifty_samples():
    assert bridge_off(0.0, 0.1, length=148).ids() == []
    doubts = bridge_off(0.0, 0.1, length=151).found()
    assert [d.id for d in doubts] == ["current_zero_moves"]
    low, high = (float(v) for v in re.search(r"reads (-?[\d.]+) to (-?[\d.]+) A", doubts[0].text).groups())
    assert (low, high) == (pytest.approx(0.0, abs=3e-3), pytest.approx(0.1, abs=3e-3))


def test_the_zeros_furthest_apart_are_told():
    doubts = bridge_off(0.05, 0.1, 0.02, -0.03, 0.06, length=151).found()
    assert [d.id for d in doubts] == ["current_zero_moves"]
    low, high = (float(v) for v in re.search(r"reads (-?[\d.]+) to (-?[\d.]+) A", doubts[0].text).groups())
    assert (low, high) == (pytest.approx(-0.03, abs=3e-3), pytest.approx(0.1, abs=3e-3))


def test_a_zero_is_the_mean_of_all_fifty_samples():
    """A mean of 49 of them, over 50, would be 2 % less: zeros apart by 1 % more than is allowed would pass."""
    for factor, seen in ((0.99, []), (1.01, ["current_zero_moves"])):
        record = bridge_off(1.0, 1.0 + factor * OFF_CURRENT, settle=0)
        is_off = record.columns["command_mode"] == float(Mode.OFF)
        exact = np.where(np.arange(record.count) < 1_100, 1.0, 1.0 + factor * OFF_CURRENT)
        wobble = 1e-3 * (-1.0) ** np.arange(record.count)  # no sensor repeats itself
        record.columns["motor_current"] = np.where(is_off, exact + wobble, record.columns["motor_current"])
        assert record.ids() == seen


def driven(volts=0.0, where=slice(0, 0), count=6_000, seed=9, gap=None):
    """Return a motor driven by its own equation, whose voltmeter is off by some volts somewhere."""
    rng, values = np.random.default_rng(seed), MODEL.values
    record = Record(count=count, speed=2.0)
    t = np.arange(count) * 1e-3
    current = 0.8 * np.sin(math.tau * 0.7 * t) + 0.3 * np.sin(math.tau * 3.1 * t)
    slope = 0.8 * math.tau * 0.7 * np.cos(math.tau * 0.7 * t) + 0.3 * math.tau * 3.1 * np.cos(math.tau * 3.1 * t)
    omega = 2.0 * np.cos(math.tau * t)
    record.columns["motor_current"] = current + rng.normal(0.0, 0.005, count)
    voltage = values.resistance * current + values.back_emf * omega + values.inductance * slope
    record.columns["motor_voltage"] = voltage + rng.normal(0.0, 0.02, count)
    record.columns["motor_voltage"][where] += volts
    return record if gap is None else record.keep(np.r_[0 : gap[0], gap[1] : count])


def test_a_voltmeter_that_is_off_for_a_while_contradicts_current_and_velocity():
    assert driven().ids() == []
    doubts = driven(0.6, slice(3_000, 3_100)).found()
    assert [d.id for d in doubts] == ["motor_balance"]
    assert float(re.search(r"by up to ([\d.]+) V", doubts[0].text)[1]) == pytest.approx(0.6, abs=0.06)
    assert driven(0.15, slice(3_000, 3_100)).ids() == []


def test_a_voltage_that_steps_between_two_samples_is_known_to_less():
    """One sample of 12 V more is 0.6 V more in the mean of 20 ms: so is a step that is late by a millisecond."""
    assert driven(12.0, [3_000, 4_500]).ids() == []
    assert driven(0.6, slice(3_000, 3_100)).ids() == ["motor_balance"]


@pytest.mark.parametrize("step", [12.0, -12.0])
def test_a_voltage_that_steps_one_way_and_creeps_back_is_known_to_less(step):
    """In 5 of the 20 ms of a window it creeps back: 1.5 V in its mean, of which the step accounts for 0.6 V."""
    assert driven(step * np.array([1.0, 0.8, 0.6, 0.4, 0.2]), slice(3_158, 3_163)).ids() == []


def test_the_motors_balance_is_the_same_however_the_rows_are_cut():
    assert driven(0.6, slice(3_000, 3_100)).found(pieces=40) == driven(0.6, slice(3_000, 3_100)).found()


def test_a_gap_in_the_samples_is_no_contradiction_of_the_motor():
    assert driven(gap=(3_000, 3_037)).ids() == []
    assert driven(volts=math.nan, where=slice(3_000, 3_037)).ids() == []


@pytest.mark.parametrize("missing", [1, 10])
def test_motion_within_a_gap_is_in_no_window(missing):
    """Within each gap the plate is turned by 0.04 rad: a window over it would have a velocity without a voltage."""
    whole = driven(count=8_000)
    for start in range(1_000, 7_000, 500):
        whole.columns["motor_angle"][start + missing // 2 :] += GEAR * 0.04
        for name in ("throttle_angle", "throttle_angle_2"):
            whole.columns[name][start + missing // 2 :] += 0.04
    gaps = np.concatenate([np.arange(start, start + missing) for start in range(1_000, 7_000, 500)])
    without = np.setdiff1d(np.arange(8_000), gaps)
    assert "motor_balance" in whole.ids()
    unmeasured = driven(count=8_000)
    unmeasured.columns = {name: values.copy() for name, values in whole.columns.items()}
    unmeasured.columns["motor_voltage"][gaps] = math.nan
    assert "motor_balance" not in unmeasured.ids()
    assert "motor_balance" not in whole.keep(without).ids()


@pytest.mark.parametrize(("count", "seen"), [(1_049, False), (1_050, True)])
def test_a_window_of_the_balance_is_20_ms(count, seen):
    """Fifty windows are needed, each of 21 samples."""
    assert ("motor_balance" in driven(0.6, slice(300, 400), count=count).ids()) is seen


def windows(count=200, seed=4):
    rng = np.random.default_rng(seed)
    found = rng.normal(0.0, 1.0, (count, 6)) * [1.0, 1.0, 2.0, 50.0, 100.0, 0.0]
    found[:, 0] = 1.5 * found[:, 1] + 0.36 * found[:, 2] + 1.5e-3 * found[:, 3] + 1e-4 * found[:, 4] + 0.2
    found[:, 0] += rng.normal(0.0, 1e-3, count)
    return found


def test_the_balance_needs_fifty_windows():
    spoilt = windows(50)
    spoilt[10, 0] += 5.0
    assert worst_residual(spoilt) is not None
    assert worst_residual(spoilt[:49]) is None


@pytest.mark.parametrize(
    ("off", "where", "seen"),
    [(0.24, [50, 51], False), (0.27, [50, 51], True), (0.27, [50, 52], False), (0.48, [50], False), (0.52, [50], True)],
)
def test_a_quarter_of_a_volt_twice_or_half_a_volt_once(off, where, seen):
    spoilt = windows()
    spoilt[where, 0] += off
    said = worst_residual(spoilt)
    assert (said is not None) == seen
    if seen:
        assert f"for {0.02 * len(where):.2f} s" in said
        assert float(re.search(r"up to ([\d.]+) V", said)[1]) == pytest.approx(off, abs=0.015)


def test_a_voltage_that_steps_between_two_samples_may_be_off_by_more():
    spoilt = windows()
    spoilt[[50, 51], 0] += 0.5
    spoilt[[50, 51], 5] = 0.09
    assert worst_residual(spoilt) is None
    spoilt[[50, 51], 5] = 0.07
    assert worst_residual(spoilt) is not None


def test_a_noisy_bench_is_held_to_eight_times_its_own_residual():
    rng = np.random.default_rng(6)
    noisy = windows()
    noisy[:, 0] += 0.1 * rng.choice([-1.0, 1.0], len(noisy))
    for off, seen in ((0.7, False), (1.1, True)):
        spoilt = noisy.copy()
        spoilt[[50, 51], 0] += off
        assert (worst_residual(spoilt) is not None) == seen
