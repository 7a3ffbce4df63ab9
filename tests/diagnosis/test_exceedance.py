"""Episodes of friction above a limit: where they begin and end, what counts as certain, and what they keep."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from etb_hil.base.stock import find
from etb_hil.diagnosis.exceedance import ExceedanceDetector
from etb_hil.plant.parameters import load_model
from etb_hil.plant.physics import spring_torque

MODEL = load_model(find("model", "default"))
THROTTLE = MODEL.values
STICTION, COULOMB = 0.26, 0.2
SLOW = THROTTLE.stribeck_velocity
MS = 1_000_000
# A place between limp-home and the upper stop, away from both: only the springs' tolerance speaks there.
PLACE = 0.5 * (THROTTLE.limp_home + THROTTLE.stop_high)


class Stream:
    """A detector, and samples a millisecond apart of which only what is named differs from friction at rest."""

    def __init__(self, model=MODEL):
        self.detector = ExceedanceDetector(model, model.values, STICTION, COULOMB)
        self.now = 0

    def push(self, friction, phase="ramp", *, deviation=0.0, every=MS, **columns):
        friction = np.atleast_1d(np.asarray(friction, float))
        count = len(friction)
        usual = {"current": 0.0, "angle": PLACE, "temperature": 25.0, "velocity": 0.0}
        sampled = {
            name: np.broadcast_to(np.asarray(columns.pop(name, value), float), count).copy()
            for name, value in usual.items()
        }
        delay = np.full(count, columns.pop("delay_ns", 0), np.int64)
        time_ns = self.now + every * np.arange(count)
        self.now += every * count
        of_friction = None if deviation is None else np.full(count, deviation)
        assert not columns
        self.detector.push(
            time_ns, sampled["current"], sampled["angle"], sampled["temperature"], sampled["velocity"], friction, delay,
            of_friction, phase,
        )  # fmt: skip
        return self

    def found(self):
        self.detector.close()
        return [(e.kind, e.start_ns // MS, e.end_ns // MS) for e in self.detector.episodes]


def spring(angle):
    return spring_torque(angle, THROTTLE.vector())


def test_an_episode_begins_above_the_limit_and_ends_below_nine_tenths_of_it():
    assert Stream().push([0.26] * 10).found() == []
    stream = Stream().push([0.2, 0.261, 0.25, 0.24, 0.235, 0.233, 0.235, 0.25])
    assert stream.found() == [("T_st", 1, 4)]


@pytest.mark.parametrize(("length", "counts"), [(3, False), (4, True)])
def test_an_episode_lasts_three_milliseconds_at_least(length, counts):
    """From its first sample to its last: four samples are three milliseconds."""
    stream = Stream().push([0.1] + [0.3] * length + [0.1])
    assert stream.found() == ([("T_st", 1, length)] if counts else [])
    assert Stream().push([0.3] * length).found() == ([("T_st", 0, length - 1)] if counts else [])


def test_friction_counts_by_its_size_in_both_directions():
    assert Stream().push([-0.3] * 5).found() == [("T_st", 0, 4)]


def test_unknown_friction_ends_an_episode():
    assert Stream().push([0.3] * 5 + [math.nan] + [0.3] * 6).found() == [("T_st", 0, 4), ("T_st", 6, 11)]


def test_a_phase_ends_its_episode_and_names_it():
    stream = Stream().push([0.3] * 5, "ramp").push([0.3] * 5, "dash")
    assert stream.detector.open_episodes == 1
    assert stream.found() == [("T_st", 0, 4), ("T_st", 5, 9)]
    assert [e.phase for e in stream.detector.episodes] == ["ramp", "dash"]
    assert stream.detector.open_episodes == 0


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("speed", "friction", "kinds"),
    [
        (0.99, 0.3, ["T_st"]),
        (1.0, 0.3, []),  # on the falling part of the Stribeck curve no limit applies
        (2.14, 0.3, []),
        (2.15, 0.3, []),
        (2.16, 0.3, ["T_c"]),
        (2.16, 0.19, []),
    ],
)
def test_each_limit_has_its_speeds(speed, friction, kinds, sign):
    stream = Stream().push([sign * friction] * 6, velocity=sign * speed * SLOW)
    assert [kind for kind, *_ in stream.found()] == kinds


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_viscous_torque_is_no_part_of_what_t_c_limits(sign):
    speed = 20.0 * SLOW
    viscous = THROTTLE.viscous * speed
    tolerance = MODEL.tolerance("viscous") * speed
    assert Stream().push([COULOMB + viscous + tolerance - 0.001] * 6, velocity=sign * speed).found() == []
    stream = Stream().push([COULOMB + viscous + tolerance + 0.001] * 6, velocity=sign * speed)
    assert stream.found() == [("T_c", 0, 5)]
    assert stream.detector.episodes[0].peak == pytest.approx(COULOMB + tolerance + 0.001)


def test_an_observer_that_states_its_deviation_is_believed_by_two_of_them():
    assert Stream().push([0.279] * 6, deviation=0.01).found() == []
    stream = Stream().push([0.281] * 6, deviation=0.01)
    assert stream.found() == [("T_st", 0, 5)]
    assert stream.detector.episodes[0].allowance == pytest.approx(0.02)


@pytest.mark.parametrize("omega", [0.0, 0.9 * SLOW, -0.9 * SLOW])
def test_without_a_deviation_the_models_tolerances_are_what_friction_may_be_off_by(omega):
    springs = max(MODEL.tolerance("preload_open"), MODEL.tolerance("preload_close"))
    springs += max(MODEL.tolerance("slope_open"), MODEL.tolerance("slope_close")) * THROTTLE.stop_high
    for torque, current in itertools.product((0.4, -0.4), (1.5, -1.5)):
        acceleration = (THROTTLE.torque_per_ampere * current - spring(PLACE) - torque) / THROTTLE.inertia
        expected = springs + MODEL.tolerance("torque_per_ampere") * abs(current)
        expected += MODEL.tolerance("inertia") * abs(acceleration) + MODEL.tolerance("viscous") * abs(omega)
        stream = Stream().push([torque] * 6, deviation=None, current=current, velocity=omega)
        assert STICTION + expected < 0.4
        assert stream.found() == [("T_st", 0, 5)]
        assert stream.detector.episodes[0].allowance == pytest.approx(expected)


@pytest.mark.parametrize(("wide", "narrow"), [("open", "close"), ("close", "open")])
def test_of_both_springs_the_less_certain_one_counts(wide, narrow, tmp_path):
    text = find("model", "default").read_text("utf-8")
    for name, value, tolerance in (("preload", "0.35 N·m", "3 %"), ("slope", "0.05 N·m/rad", "20 %")):
        before = f"  {name}_{narrow}:\n    value: {value}\n    shaft: throttle\n    tolerance: {tolerance}\n"
        assert before in text
        text = text.replace(before, before.replace(tolerance, "1 %"))
    path = tmp_path / "model.yaml"
    path.write_text(text, "utf-8")
    allowances = []
    for model in (MODEL, load_model(path)):
        stream = Stream(model).push([0.4] * 6, deviation=None)
        assert stream.found() == [("T_st", 0, 5)]
        allowances.append(stream.detector.episodes[0].allowance)
    assert allowances[0] == allowances[1]
    assert MODEL.tolerance(f"preload_{wide}") > load_model(path).tolerance(f"preload_{narrow}")


def test_an_allowance_ends_an_episode_as_less_friction_does():
    stream = Stream().push([0.3] * 5).push([0.3] * 5, deviation=0.04)
    assert stream.found() == [("T_st", 0, 4)]


def test_next_to_a_stop_nothing_is_certain():
    for stop, inwards in ((THROTTLE.stop_low, 1.0), (THROTTLE.stop_high, -1.0)):
        blur = MODEL.tolerance("limp_home") + MODEL.tolerance("dead_zone") + 1e-3
        assert Stream().push([0.9] * 6, angle=stop + inwards * 0.99 * blur).found() == []
        for share in (1.0, 1.01):
            assert Stream().push([0.9] * 6, angle=stop + inwards * share * blur).found() == [("T_st", 0, 5)]


def test_at_limp_home_the_springs_jump_may_be_off_by_the_angles_doubt():
    blur = MODEL.tolerance("limp_home") + MODEL.tolerance("dead_zone") + 1e-3
    reach = blur + THROTTLE.dead_zone
    for side in (1.0, -1.0):
        far = THROTTLE.limp_home + side * 1.01 * reach
        stream = Stream().push([2.0] * 6, angle=far)
        assert stream.found() == [("T_st", 0, 5)]
        assert stream.detector.episodes[0].allowance == 0.0
        near = THROTTLE.limp_home + side * 0.9 * reach
        stream = Stream().push([2.0] * 6, angle=near)
        assert stream.found() == [("T_st", 0, 5)]
        expected = abs(spring(near + blur) - spring(near - blur))
        assert stream.detector.episodes[0].allowance == pytest.approx(expected)
        assert expected > 0.1


def test_friction_that_lags_is_held_together_with_the_speed_of_its_own_instant():
    """A plate that a torque accelerates was slower when the observer's friction was felt."""
    delay = 0.004
    current = (spring(PLACE) + 0.3 + 4.0 * THROTTLE.inertia * SLOW / 0.004) / THROTTLE.torque_per_ampere
    fast = 4.5 * SLOW
    assert [k for k, *_ in Stream().push([0.3] * 6, velocity=fast, current=current).found()] == ["T_c"]
    stream = Stream().push([0.3] * 6, velocity=fast, current=current, delay_ns=round(delay * 1e9))
    assert [k for k, *_ in stream.found()] == ["T_st"]
    assert stream.detector.episodes[0].velocity == pytest.approx(0.5 * SLOW)
    assert stream.detector.episodes[0].allowance == pytest.approx(MODEL.tolerance("viscous") * 0.5 * SLOW)


@pytest.mark.parametrize(("stop", "sign"), [(THROTTLE.stop_high, 1.0), (THROTTLE.stop_low, -1.0)])
def test_a_late_angle_of_a_moving_plate_widens_what_is_next_to_a_stop(stop, sign):
    delay, speed = 0.004, 3.0 * SLOW
    blur = MODEL.tolerance("limp_home") + MODEL.tolerance("dead_zone") + 1e-3 + 4.0 * delay * speed
    current = (spring(stop - sign * blur) + sign * 3.0) / THROTTLE.torque_per_ampere  # no acceleration to speak of
    for share, kinds in ((0.97, []), (1.03, ["T_c"])):
        stream = Stream().push(
            [sign * 3.0] * 6, angle=stop - sign * share * blur, velocity=sign * speed, current=current,
            delay_ns=round(delay * 1e9),
        )  # fmt: skip
        assert [k for k, *_ in stream.found()] == kinds


def test_an_episode_keeps_its_peak_with_its_place():
    friction = np.array([0.27, 0.3, 0.35, 0.31, 0.3])
    angle = PLACE + 0.01 * np.arange(5)
    velocity = 0.1 * SLOW * np.arange(5)
    stream = Stream().push(friction, angle=angle, velocity=velocity, temperature=np.arange(5.0))
    assert stream.found() == [("T_st", 0, 4)]
    one = stream.detector.episodes[0]
    assert (one.peak, one.limit, one.temperature) == (0.35, STICTION, 2.0)
    assert one.angle == pytest.approx(PLACE + 0.02)
    assert one.velocity == pytest.approx(0.2 * SLOW)
    assert one.allowance == pytest.approx(MODEL.tolerance("viscous") * 0.2 * SLOW)


def test_of_two_equal_peaks_the_first_is_kept():
    stream = Stream().push([0.3, 0.35, 0.3, 0.35, 0.3], temperature=np.arange(5.0))
    assert stream.found() == [("T_st", 0, 4)]
    assert stream.detector.episodes[0].temperature == 1.0


def test_a_peak_is_of_its_own_episode():
    stream = Stream().push([0.5] * 5 + [0.1] * 3 + [0.3] * 5)
    assert stream.found() == [("T_st", 0, 4), ("T_st", 8, 12)]
    assert [e.peak for e in stream.detector.episodes] == [0.5, 0.3]


@given(
    st.lists(st.sampled_from([0.1, 0.235, 0.25, 0.27, -0.3, math.nan]), min_size=1, max_size=60),
    st.lists(st.integers(0, 60), max_size=5),
)
def test_how_the_stream_is_cut_changes_nothing(friction, cuts):
    whole = Stream().push(friction)
    parts = Stream()
    edges = sorted({0, len(friction), *(c for c in cuts if c < len(friction))})
    for start, end in itertools.pairwise(edges):
        parts.push(friction[start:end])
    assert parts.found() == whole.found()
    assert [e.peak for e in parts.detector.episodes] == [e.peak for e in whole.detector.episodes]
