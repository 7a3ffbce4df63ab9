"""The rig: the seed paper's PD law with static feed-forward at 1 kHz on the plant, and the record of what is true."""

import math

import numpy as np

from generator import layout as at
from generator.compiled import compiled
from generator.driveline import is_two_mass
from generator.friction import steady_friction
from generator.motor import back_emf, terminal_voltage, voltage_drop
from generator.plant import advance, rates
from generator.shapes import wave

CONTROL_PERIOD = 1e-3
VOLTAGE_LIMIT = 12.0
_STABLE = 2.0  # of a rate times the step
(GAIN_P, GAIN_D, FEED_OPEN, FEED_CLOSE, FEED_SLOPE, FEED_COULOMB, FEED_VELOCITY, FEED_LIMP_HOME) = range(8)


def control_gains(nominal, bandwidth):
    """Gains of the PD law from nominal values (a dict of the unit's parameters) and a bandwidth in rad/s."""
    k, n, r = nominal["motor_constant"], nominal["gear_ratio"], nominal["resistance"]
    inertia = n * n * nominal["motor_inertia"] + nominal["plate_inertia"]
    per_volt = k * n / r
    gains = np.zeros(8)
    gains[GAIN_P] = bandwidth**2 * inertia / per_volt
    gains[GAIN_D] = max(0.0, 2.0 * 0.8 * bandwidth * inertia - k * n * per_volt) / per_volt
    gains[FEED_OPEN] = nominal["preload_open"] / per_volt
    gains[FEED_CLOSE] = nominal["preload_close"] / per_volt
    gains[FEED_SLOPE] = 0.5 * (nominal["slope_open"] + nominal["slope_close"]) / per_volt
    gains[FEED_COULOMB] = nominal["coulomb"] / per_volt
    gains[FEED_VELOCITY] = k * n + nominal["viscous"] / per_volt
    gains[FEED_LIMP_HOME] = nominal["limp_home"]
    return gains


@compiled()
def encoder_angle(angle, p, e):
    """Plate-side angle that the motor encoder tells, rad: with its eccentricity, before quantisation."""
    if e[at.ECCENTRICITY, at.STRENGTH] == 0.0:
        return angle
    row = e[at.ECCENTRICITY]
    return angle + row[at.STRENGTH] / p[at.N] * wave(p[at.N] * angle + row[at.A], row[at.FORM])


@compiled()
def followed(told, angle, grid):
    """Encoder angle with one count of hysteresis, rad: a count that flickers would shake the resting plate loose."""
    away = angle - told
    if abs(away) <= grid:
        return told
    return told + grid * math.copysign(math.ceil(abs(away) / grid - 1.0), away)


@compiled()
def control(told, told_before, inputs, gains):
    """Voltage of the PD law with static feed-forward (seed paper, section IV), V, within the limit."""
    away = inputs[at.IN_ANGLE] - gains[FEED_LIMP_HOME]
    spring = gains[FEED_OPEN] if away > 0.0 else -gains[FEED_CLOSE]
    feed = spring * min(1.0, abs(away) / 0.01) + gains[FEED_SLOPE] * away
    moving = min(1.0, max(-1.0, inputs[at.IN_VELOCITY] / 0.05))
    feed += gains[FEED_COULOMB] * moving + gains[FEED_VELOCITY] * inputs[at.IN_VELOCITY]
    velocity = (told - told_before) / CONTROL_PERIOD
    voltage = feed + gains[GAIN_P] * (inputs[at.IN_ANGLE] - told)
    voltage += gains[GAIN_D] * (inputs[at.IN_VELOCITY] - velocity) + inputs[at.IN_VOLTAGE]
    return min(VOLTAGE_LIMIT, max(-VOLTAGE_LIMIT, voltage))


def steps_per_tick(e, rate):
    """Integration steps in a control tick: 42 us, 25 us at 20 kHz, half of it with two masses."""
    steps = 24 if 24000 % rate == 0 else 40
    return 2 * steps if is_two_mass(e) else steps


def simulate(inputs, p, e, gains, rate=2000, counts=16384, finer=1):
    """Run all control ticks of `inputs` (n, INPUTS); return the true record (rows, LOGGED) at `rate` in Hz.

    `counts`: the controller's encoder, counts per motor turn; `finer` divides the step. A row holds the voltage from
    its own instant on.
    """
    steps = steps_per_tick(e, rate) * finer
    rows = np.empty((round(len(inputs) * rate * CONTROL_PERIOD), at.LOGGED))
    slow = np.array([1.0, 0.0, inputs[0, at.IN_TEMPERATURE], inputs[0, at.IN_TEMPERATURE]])
    _run(inputs, p, e, gains, slow, rows, steps, round(steps / CONTROL_PERIOD / rate), counts)
    return rows


@compiled()
def _run(inputs, p, e, gains, slow, rows, steps, steps_per_row, counts):
    dt = CONTROL_PERIOD / steps
    two_mass = is_two_mass(e)
    state = (p[at.LIMP_HOME], 0.0, 0.0, 0.0, p[at.LIMP_HOME], 0.0)
    grid = 2.0 * math.pi / counts / p[at.N]
    told = state[0]
    step = 0
    for tick in range(inputs.shape[0]):
        now = inputs[tick]
        told_before, told = told, followed(told, encoder_angle(state[0], p, e), grid)
        opened = now[at.IN_MODE] == at.BRIDGE_OFF
        if opened:
            command = 0.0
        elif now[at.IN_MODE] == at.OPEN_LOOP:
            command = min(VOLTAGE_LIMIT, max(-VOLTAGE_LIMIT, now[at.IN_VOLTAGE]))
        else:
            command = control(told, told_before, now, gains)
        for _ in range(steps):
            terminal, supply = terminal_voltage(command, state[3], step * dt, e)
            if step % steps_per_row == 0:
                write(rows[step // steps_per_row], state, slow, command, terminal, supply, opened, two_mass, now, p, e)
            parts = parts_of_step(state, slow, dt, now, p, e)
            for _ in range(parts):
                state = advance(state, slow, terminal, opened, two_mass, dt / parts, now, p, e)
            step += 1


@compiled()
def parts_of_step(state, slow, dt, inputs, p, e):
    """Return how many steps one is made of.

    Near a stop eight: contact begins with a jump, which costs accuracy. Where friction is nearly gone at speed as many
    as the bristle's rate, sigma_0 omega / g, needs: the method is stable up to 2.8 over a step.
    """
    angle, velocity, plate = state[0], state[1], state[4]
    near_stop = plate > p[at.STOP_HIGH] - 0.002 or plate < p[at.STOP_LOW] + 0.002
    g = steady_friction(angle, velocity, 0.0, slow, inputs, p, e)  # what a load presses adds to it
    return max(8 if near_stop else 1, math.ceil(p[at.SIGMA0] * abs(velocity) / g * dt / _STABLE))


@compiled()
def write(row, state, slow, command, terminal, supply, opened, two_mass, now, p, e):
    """Write one row of the true record."""
    th, w, z, i, plate, v = state
    acceleration, _, current_rate, _, drag = rates(th, w, z, i, plate, v, terminal, opened, two_mass, slow, now, p, e)
    row[at.LOG_ANGLE] = th
    row[at.LOG_VELOCITY] = w
    row[at.LOG_CURRENT] = i
    row[at.LOG_PLATE] = plate
    row[at.LOG_PLATE_VELOCITY] = v
    row[at.LOG_CURRENT_RATE] = current_rate
    if opened:
        # What a voltmeter at the terminals sees: the back-EMF, and the diodes for as long as the current lasts.
        row[at.LOG_COMMAND] = back_emf(th, w, slow, p, e) + voltage_drop(th, i, slow, p, e) + p[at.L] * current_rate
    else:
        row[at.LOG_COMMAND] = command
    row[at.LOG_TERMINAL] = terminal
    row[at.LOG_BRISTLE] = z
    row[at.LOG_FRICTION] = drag
    row[at.LOG_SUPPLY] = supply
    row[at.LOG_ACCELERATION] = acceleration
    row[at.LOG_WINDING] = slow[at.WINDING]
    row[at.LOG_MODE] = now[at.IN_MODE]
