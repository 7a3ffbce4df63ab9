"""Changes of mode, the drive to limp-home, the stops, and the controller's own protections."""

import math

import numpy as np
import pytest
from controller_harness import OFF, command, drive, model, request, stream

from etb_hil.base.errors import InputError
from etb_hil.base.modes import Mode
from etb_hil.controller.machine import Machine
from etb_hil.controller.reference import PRESS
from etb_hil.controller.state import Fault

UNIT = model("default")
FAULTY = model("faulty")
LIMP_HOME = UNIT.values.limp_home


def _run(at, end_s, *, start, unit=UNIT, ambient=20.0, period_ms=10):
    machine = Machine(unit, UNIT, seed=6, start_angle=start, ambient=ambient)
    return drive(machine, [(0, request()), *stream(at, end_s, period_ms=period_ms)], end_s)


def _steps(trace, start_s, end_s):
    return np.abs(np.diff(trace.samples["voltage"][trace.between(start_s, end_s)]))


def test_changing_between_position_and_velocity_while_moving_gives_no_jerk():
    def at(t):
        mode = Mode.VELOCITY if 0.8 <= t < 1.2 else Mode.POSITION
        return command(mode, 0.4 + 0.4 * t, 0.4)

    trace = _run(at, 1.6, start=0.4)
    usual = _steps(trace, 0.5, 0.79).max()
    for change in (0.8, 1.2):
        assert _steps(trace, change - 0.005, change + 0.03).max() < usual + 0.5
    velocity = np.gradient(trace.angle(0.4), trace.time)
    assert np.abs(velocity - 0.4)[trace.between(0.5, 1.6)].max() < 0.25


def test_taking_over_a_moving_plate_gives_no_jerk():
    trace = _run(lambda t: OFF if t < 0.02 else command(Mode.VELOCITY, 0.0, -8.0), 0.15, start=1.4)
    on = trace.switches[0]["tick"] * 50e-6
    velocity = np.gradient(trace.angle(1.4), trace.time)
    before = velocity[trace.between(on - 0.002, on)].mean()
    assert before < -2.0
    assert abs(velocity[trace.between(on, on + 0.003)].mean() - before) < 1.5


def test_position_mode_at_rest_starts_where_the_plate_is():
    trace = _run(lambda t: OFF if t < 0.3 else command(Mode.POSITION, LIMP_HOME), 0.6, start=LIMP_HOME)
    assert np.abs(trace.angle(LIMP_HOME) - LIMP_HOME).max() < math.radians(0.1)


@pytest.mark.parametrize("unit", [UNIT, FAULTY], ids=["default", "faulty"])
@pytest.mark.parametrize("start", [1.2, 0.02])
def test_limp_home_drives_there_and_lets_go(unit, start):
    def at(t):
        return command(Mode.POSITION, start) if t < 0.2 else command(Mode.LIMP_HOME)

    trace = _run(at, 2.0, start=start, unit=unit)
    assert [int(row["on"]) for row in trace.switches] == [1, 0]
    assert abs(trace.angle(start)[-1] - LIMP_HOME) < math.radians(1.0)
    assert np.abs(trace.samples["current"][-100:]).max() < 6 * UNIT.sensors.current_noise
    assert trace.statuses[-1]["mode"] == Mode.LIMP_HOME
    assert trace.statuses[-1]["enable"] == 0


def test_voltage_mode_gives_the_voltage_within_the_limit():
    def at(t):
        return command(Mode.VOLTAGE, voltage=3.0 if t < 0.5 else -20.0)

    trace = _run(at, 1.0, start=LIMP_HOME)
    voltage = trace.samples["voltage"]
    assert voltage[trace.between(0.1, 0.5)].mean() == pytest.approx(3.0, abs=0.01)
    assert voltage[trace.between(0.6, 1.0)].mean() == pytest.approx(-UNIT.values.voltage_limit, abs=0.01)


def test_a_command_without_enable_or_with_an_unknown_mode_is_off():
    for event in (command(Mode.POSITION, 0.5, enable=False), command(7, 0.5)):
        trace = _run(lambda _, event=event: event, 0.2, start=LIMP_HOME)
        assert len(trace.switches) == 0
        assert set(trace.statuses["enable"]) == {0}


@pytest.mark.parametrize(("target", "stop"), [(-0.5, "stop_low"), (2.0, "stop_high")])
def test_a_set_point_beyond_a_stop_presses_gently(target, stop):
    trace = _run(lambda _: command(Mode.POSITION, target), 1.0, start=0.7)
    settled = trace.between(0.8, 1.0)
    assert trace.angle(0.7)[settled].mean() == pytest.approx(getattr(UNIT.values, stop), abs=0.01)
    assert np.abs(trace.samples["current"][settled]).max() < 6.0
    assert not trace.statuses["faults"].any()


def test_velocity_mode_brakes_before_a_stop():
    trace = _run(lambda t: command(Mode.VELOCITY, 0.0, min(t * 200.0, 15.0)), 0.6, start=0.1, period_ms=5)
    angle = trace.angle(0.1)
    velocity = np.gradient(angle, trace.time)
    assert velocity.max() > 12.0
    reached = int(np.argmax(angle > UNIT.values.stop_high - 0.002))
    assert abs(velocity[reached]) < 3.0


def test_a_velocity_that_cannot_be_reached_leaves_nothing_to_catch_up_with():
    trace = _run(lambda t: command(Mode.VELOCITY, 0.0, 30.0 if t < 0.04 else 0.0), 0.3, start=0.1, period_ms=5)
    angle = trace.angle(0.1)
    asked_off = int(np.argmax(trace.time >= 0.045))
    assert np.gradient(angle, trace.time)[asked_off] > 8.0
    assert angle.max() - angle[asked_off] < 0.1  # braking from there, and no more


def test_stalled_at_full_voltage_the_protection_lets_go_after_5_seconds():
    trace = _run(lambda _: command(Mode.VOLTAGE, voltage=12.0), 6.0, start=LIMP_HOME)
    off = trace.switches[-1]
    assert off["faults"] == Fault.OVER_CURRENT
    assert off["tick"] * 50e-6 == pytest.approx(5.0, abs=0.05)
    assert np.abs(trace.samples["current"][trace.between(5.2, 6.0)]).max() < 6 * UNIT.sensors.current_noise


def test_a_housing_that_is_too_hot_is_not_driven():
    trace = _run(lambda _: command(Mode.POSITION, 0.5), 0.2, start=LIMP_HOME, ambient=130.0)
    assert len(trace.switches) == 0
    assert trace.statuses[-1]["faults"] & Fault.OVER_TEMPERATURE


def test_the_housing_warms_by_the_motors_loss():
    trace = _run(lambda _: command(Mode.VOLTAGE, voltage=6.0), 4.0, start=LIMP_HOME)
    loss = UNIT.values.resistance * (6.0 / UNIT.values.resistance) ** 2
    assert trace.statuses["temperature"][-1] - 20.0 == pytest.approx(3.0 * loss * 4.0 / 600.0, rel=0.05)


def test_an_unknown_law_is_refused_with_the_laws_there_are():
    with pytest.raises(InputError, match="pd, pid, sliding-mode"):
        Machine(UNIT, UNIT, seed=1, law="bang-bang")


@pytest.mark.parametrize("angle", [-0.5, 2.0, float("nan")])
def test_a_plate_beyond_its_stops_is_refused(angle):
    low, high = (math.degrees(stop) for stop in (UNIT.values.stop_low - PRESS, UNIT.values.stop_high + PRESS))
    with pytest.raises(InputError, match=f"no plate can stand at this angle.*{low:.1f} to {high:.1f} deg"):
        Machine(UNIT, UNIT, seed=1, start_angle=angle)


@pytest.mark.parametrize("seed", [-1, 0, 2**80])
def test_any_integer_is_a_seed_and_the_plate_rests_about_limp_home(seed):
    assert abs(Machine(UNIT, UNIT, seed=seed).plate_angle - LIMP_HOME) < UNIT.values.dead_zone
    assert abs(Machine(FAULTY, UNIT, seed=seed).plate_angle - LIMP_HOME) < 0.01


def test_a_sticky_plate_stays_where_it_was_let_go():
    trace = _run(lambda t: command(Mode.POSITION, 1.0) if t < 0.5 else OFF, 1.5, start=0.9, unit=FAULTY)
    angle = trace.angle(0.9)
    assert abs(angle[-1] - angle[trace.between(0.4, 0.5)][-1]) < 0.15
    healthy = _run(lambda t: command(Mode.POSITION, 1.0) if t < 0.5 else OFF, 1.5, start=0.9)
    assert abs(healthy.angle(0.9)[-1] - LIMP_HOME) < 0.02
