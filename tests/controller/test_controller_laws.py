"""What the laws do by themselves: integral, its limits, and the boundary layer."""

import numpy as np
from controller_harness import OFF, command, drive, model, request, stream

from etb_hil.base.modes import Mode
from etb_hil.controller.laws.interface import CUT_OFF, MEMORY
from etb_hil.controller.laws.kinds import pid, sliding_mode
from etb_hil.controller.machine import Machine

UNIT = model("default")
NOMINAL = UNIT.values


def _integrated(error, cut_off, ticks=1):
    gain, memory = pid.gains(NOMINAL), np.zeros(MEMORY)
    memory[CUT_OFF] = cut_off
    for _ in range(ticks):
        torque = pid.torque(gain, memory, error, 0.0)
    return torque - gain[0] * error


def test_the_integral_stands_still_while_the_bridge_is_at_its_limit_in_its_direction():
    assert _integrated(0.01, cut_off=0.0) > 0.0
    assert _integrated(0.01, cut_off=0.5) == 0.0
    assert _integrated(-0.01, cut_off=0.5) < 0.0


def test_the_integral_never_gives_more_than_a_preload():
    assert _integrated(1.0, cut_off=0.0, ticks=1000) <= NOMINAL.preload_open * (1.0 + 1e-9)


def test_the_reaching_torque_is_bounded_and_the_law_is_odd():
    gain, memory = sliding_mode.gains(NOMINAL), np.zeros(MEMORY)
    assert sliding_mode.torque(gain, memory, 10.0, 0.0) == NOMINAL.preload_open + NOMINAL.preload_close
    assert sliding_mode.torque(gain, memory, 0.003, 0.1) == -sliding_mode.torque(gain, memory, -0.003, -0.1)


def test_a_drive_that_goes_on_again_starts_without_the_old_integral():
    def at(t):
        if t < 0.6:
            return command(Mode.POSITION, 2.0)  # pressed on the stop, so that the integral is full
        return OFF if t < 2.0 else command(Mode.POSITION, NOMINAL.limp_home)

    machine = Machine(UNIT, UNIT, seed=1, start_angle=NOMINAL.limp_home, law="pid")
    trace = drive(machine, [(0, request()), *stream(at, 2.1)], 2.1)
    on = trace.between(2.0005, 2.004)
    assert np.abs(trace.samples["voltage"][on]).max() < 0.7  # a preload through the motor would be 1.5 V
