"""The project's plant under a voltage that drives it to and fro, simulated in steps of 50 us, as a record."""

import numpy as np

from etb_hil.estimation.record import record
from etb_hil.plant.extended import advance_extended, new_sensed_state, told_current, told_motor_angle, told_plate

STEP = 50e-6  # s
NOISE = (5e-3, 1e-5, 1e-4)  # of current in A, of both angles in rad


def driven(model, p, rate, seconds=6.0, late=0.0):
    """Return a record of a throttle that goes to and fro, slowly and fast, with its true states at the samples.

    Both stops are met. `p` is the extended vector of the throttle, `model` what is known of it; `late` in s is by how
    much the current is read late. States (n, 2): angle and velocity.
    """
    time = np.arange(round(seconds * rate)) / rate
    volts = 3.0 + 2.5 * np.sin(2.0 * np.pi * 0.7 * time) + 3.0 * np.sign(np.sin(2.0 * np.pi * 1.9 * time))
    every = round(1.0 / (rate * STEP))
    state, gear, fine = new_sensed_state(model.values.limp_home, 25.0, p), model.values.gear_ratio, []
    for held in volts:
        for _ in range(every):
            told = told_current(state, 25.0, p), told_motor_angle(state, p) / gear, told_plate(state, p)
            fine.append((*state[:2], *told))
            advance_extended(state, p, held, 1, 25.0)
    fine = np.array(fine)
    noise = np.random.default_rng(54).standard_normal((3, len(time))) * np.reshape(NOISE, (3, 1))
    current = np.interp(time - late, np.arange(len(fine)) * STEP, fine[:, 2]) + noise[0]
    _, _, _, motor, plate = fine[::every].T
    seen = record(time, volts, model, current=current, motor=motor + noise[1], plate=plate + noise[2])
    return seen, fine[::every, :2]
