"""What a free run leaves whose model is the truth: the generator's plant and numbers under the measured voltage."""

import numpy as np
from generator import layout as at
from generator.bench import CONTROL_PERIOD, parts_of_step, steps_per_tick
from generator.compiled import compiled
from generator.driveline import is_two_mass
from generator.friction import move_contact
from generator.motor import terminal_voltage, warm
from generator.plant import advance

from etb_hil.discrepancy.fitting.free_run import SEGMENT_S


def truth_errors(case, voltage, rate):
    """Return root mean square errors of the angle (rad) by segment, each begun with the true state.

    `voltage` (n): what drives the runs, held from row to row at `rate` in Hz.
    """
    rows = case.rig.motion(case.effects)
    rows = rows[:: len(rows) // len(voltage)]
    length = round(SEGMENT_S * rate)
    begins = np.arange(0, len(voltage) - length + 1, length)
    angle = np.empty(len(voltage))
    steps = round(steps_per_tick(case.effects, rate) / CONTROL_PERIOD / rate)
    warmth = case.rig.inputs[0, at.IN_TEMPERATURE]
    slow = np.array([[1.0, 0.0, warmth, warmth]] * 2)  # along the true motion, and in the run
    _run(rows, np.nan_to_num(voltage), case.rig.inputs, begins, length, steps, 1.0 / rate, slow[0], slow[1], angle,
         case.rig.parameters, case.effects)  # fmt: skip
    away = [angle[begin : begin + length] - rows[begin : begin + length, at.LOG_ANGLE] for begin in begins]
    return np.sqrt(np.mean(np.square(away), axis=1))


@compiled()
def _run(rows, voltage, inputs, begins, length, steps, row_s, led, slow, found, p, e):
    two_mass, dt = is_two_mass(e), row_s / steps
    for begin in begins:
        for state_number in range(len(led)):
            slow[state_number] = led[state_number]
        row = rows[begin]
        slow[at.WINDING] = row[at.LOG_WINDING]
        state = (
            row[at.LOG_ANGLE], row[at.LOG_VELOCITY], row[at.LOG_BRISTLE], row[at.LOG_CURRENT], row[at.LOG_PLATE],
            row[at.LOG_PLATE_VELOCITY],
        )  # fmt: skip
        for k in range(begin, begin + length):
            now = inputs[min(len(inputs) - 1, int(k * row_s / CONTROL_PERIOD + 1e-6))]
            opened = now[at.IN_MODE] == at.BRIDGE_OFF
            found[k] = state[0]
            for step in range(steps):
                terminal, _ = terminal_voltage(voltage[k], state[3], k * row_s + step * dt, e)
                parts = parts_of_step(state, slow, dt, now, p, e)
                for _ in range(parts):
                    state = advance(state, slow, terminal, opened, two_mass, dt / parts, now, p, e)
            way = rows[min(k + 1, len(rows) - 1), at.LOG_ANGLE] - rows[k, at.LOG_ANGLE]
            move_contact(led, way / row_s, row_s, e)
            warm(led, rows[k, at.LOG_CURRENT], now[at.IN_TEMPERATURE], row_s, p, e)
