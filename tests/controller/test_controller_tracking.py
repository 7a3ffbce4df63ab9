"""Every position law against what the bench asks of it, in physical terms; unit and nominal model differ."""

import math

import numpy as np
import pytest
from controller_harness import MS, command, drive, model, request, stream

from etb_hil.base.modes import Mode
from etb_hil.controller.laws.registry import LAWS
from etb_hil.controller.machine import Machine
from etb_hil.scenario.sines import Sinusoid
from etb_hil.scenario.trajectory import Chain, Held, dash, move

DEFAULT = model("default")
DRAWN = DEFAULT.drawn(np.random.default_rng(17))
FAULTY = model("faulty")
GEAR = 18.0
START = 0.5

pytestmark = pytest.mark.parametrize("law", LAWS.all_own())


def _follow(trajectory, law, unit=DEFAULT, period_ms=10):
    """Return time, angle, velocity of the plate, and the reference at the same times, one command interval later."""
    machine = Machine(unit, DEFAULT, seed=2, start_angle=START, law=law)

    def at(t):
        point = trajectory.at(t)
        return command(point.mode, point.position, point.velocity, point.voltage)

    rows = [(0, request()), *stream(at, trajectory.duration, period_ms=period_ms)]
    trace = drive(machine, rows, trajectory.duration)
    assert not trace.statuses["faults"].any()
    angle = trace.angle(START)
    late = 0.25e-3 + period_ms * 1e-3
    reference = np.array([trajectory.at(t - late).position for t in trace.time])
    return trace.time, angle, np.gradient(angle, trace.time), reference


@pytest.mark.parametrize("unit", [DEFAULT, DRAWN, FAULTY], ids=["default", "drawn", "faulty"])
def test_a_slow_ramp_is_smooth_and_within_a_degree(law, unit):
    ramp = Chain(move(START, 0.3, 1.0), Held(0.3, 0.2), move(0.3, 1.3, 0.4))
    time, angle, velocity, reference = _follow(ramp, law, unit)
    steady = (time > ramp.duration - 2.0) & (time < ramp.duration - 0.1)
    assert np.abs(angle - reference)[steady].max() < math.radians(1.0)
    # no stick-slip: the plate never stands still and never jumps
    assert velocity[steady].min() > 0.2
    assert velocity[steady].max() < 0.6


@pytest.mark.parametrize("speed", [0.3, 0.6])
def test_a_ramp_through_limp_home_is_within_a_degree_in_both_directions(law, speed):
    low, high = 0.05, 0.4
    ramp = Chain(move(START, low, 1.0), Held(low, 0.2), move(low, high, speed), move(high, low, speed))
    time, angle, _, reference = _follow(ramp, law)
    moving = time > ramp.duration - 2 * move(low, high, speed).duration
    assert np.abs(angle - reference)[moving].max() < math.radians(1.0)


@pytest.mark.parametrize("period_ms", [5, 10])
@pytest.mark.parametrize("peak", [17.5, -17.5])
def test_a_dash_rises_monotonically_beyond_215_omega_s(law, peak, period_ms):
    begin = math.radians(12 if peak > 0 else 74)
    run = dash(begin, peak, 1.5, 0.075, 0.045)
    chain = Chain(move(START, begin, 1.5), Held(begin, 0.15), run, Held(run.end, 0.2))
    time, angle, velocity, reference = _follow(chain, law, period_ms=period_ms)
    start = chain.duration - 0.2 - run.duration
    dashing = (time > start) & (time < chain.duration - 0.2)
    signed = velocity * math.copysign(1.0, peak)
    assert signed[dashing].max() > 2.15 * DEFAULT.values.stribeck_velocity
    assert signed[dashing].max() < 18.5
    rising = signed[(time > start + 0.13) & (time < start + 0.16)]
    assert np.diff(rising).min() > -0.1  # the encoder's step is 0.02 rad/s at 1 kHz
    assert np.abs(angle - reference)[dashing].max() < math.radians(0.5)
    assert np.abs(velocity[time > chain.duration - 0.02]).max() < 0.1


def test_velocity_mode_dashes_from_minus_2_to_17_within_80_degrees(law):
    rise = 0.09

    def at(t):
        since = t - 0.4
        if since < 0.0:
            return command(Mode.POSITION, 0.35)
        speed = -2.0 + 19.0 * 0.5 * (1.0 - math.cos(math.pi * min(since / rise, 1.0)))
        return command(Mode.VELOCITY, 0.0, speed)

    end = 0.4 + rise + 0.013
    machine = Machine(DEFAULT, DEFAULT, seed=2, start_angle=0.35, law=law)
    trace = drive(machine, [(0, request()), *stream(at, end, period_ms=5)], end)
    angle = trace.angle(0.35)
    velocity = np.gradient(angle, trace.time)
    turned = int(np.argmin(angle))
    assert velocity.min() < -1.5
    assert velocity.max() > 16.8
    assert angle[int(np.argmax(velocity > 16.8))] - angle[turned] < math.radians(80)
    assert np.abs(trace.samples["voltage"]).max() < DEFAULT.values.voltage_limit + 0.2


def test_velocity_mode_holds_a_slow_speed(law):
    machine = Machine(DEFAULT, DEFAULT, seed=2, start_angle=0.35, law=law)
    rows = [(0, request()), *stream(lambda t: command(Mode.VELOCITY, 0.0, min(t, 0.1) * 4.0), 2.0)]
    trace = drive(machine, rows, 2.0)
    angle = trace.angle(0.35)
    steady = trace.between(0.5, 2.0)
    assert np.gradient(angle, trace.time)[steady].mean() == pytest.approx(0.4, rel=0.01)


def test_the_papers_sinusoid_is_followed_within_2_degrees(law):
    centre = 0.74
    sine = Chain(move(START, centre, 1.5), Held(centre, 0.1), Sinusoid(centre, 0.57, 30.0, 1.2))
    time, angle, velocity, reference = _follow(sine, law, period_ms=5)
    late = time > sine.duration - 0.6
    assert np.abs(angle - reference)[late].max() < math.radians(2.0)
    assert np.abs(velocity[late]).max() > 2.15 * DEFAULT.values.stribeck_velocity


def test_a_held_position_is_left_within_what_friction_can_hide(law):
    machine = Machine(DEFAULT, DEFAULT, seed=2, start_angle=START, law=law)
    trace = drive(machine, [(0, request()), *stream(lambda _: command(Mode.POSITION, 0.9), 1.0)], 1.0)
    values = DEFAULT.values
    stiffness = values.inertia * 180.0**2
    assert abs(trace.angle(START)[-1] - 0.9) < 1.3 * values.stiction / stiffness + math.radians(0.03)
    settled = trace.samples["tick"] * 50_000 > 200 * MS
    assert np.ptp(trace.angle(START)[settled & (trace.time > 0.8)]) < math.radians(0.1)
