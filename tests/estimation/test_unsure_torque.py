"""Where torque is unsure: the likelihood's slope, and a plate at rest that creeps."""

import numpy as np
import pytest
from independent_throttle import Unit, friction_check
from throttle_as_model import record_until_the_bridge_opens

from etb_hil.estimation.filtering import Disturbance, filtered
from etb_hil.estimation.record import joined, record
from etb_hil.estimation.scoring import scored
from etb_hil.estimation.unknown import base_unknowns
from etb_hil.hypotheses.constants import GAIN
from etb_hil.plant.physics import LIMP_HOME

RATE = 1000
SMALL = Disturbance(1e-3, 1e-2)
HELD_AT, HELD = 0.5, 1.0  # rad and s
STEP = 1e-5  # rad


@pytest.fixture(scope="module")
def motion():
    """Return a record of a healthy unit's friction check until the bridge opens, and its model."""
    motion = friction_check(Unit(), creeps=(), speeds=(1.6,), dashes=1)
    return record_until_the_bridge_opens(Unit(), Unit(), motion, RATE, 31)


@pytest.mark.parametrize("off", [-5e-4, 5e-4])
def test_likelihood_follows_limp_home_as_its_slope_says(motion, off):
    made, model = motion
    (home,) = (one for one in base_unknowns(model) if one.place == LIMP_HOME)

    def at(moved):
        p = model.vector()
        p[LIMP_HOME] += off + moved
        return filtered(made, p, SMALL, is_kept=True)

    slope = -scored(made, at(0.0), [home.column()]).gradient[0]
    difference = (at(STEP).log_likelihood - at(-STEP).log_likelihood) / (2.0 * STEP)
    assert slope == pytest.approx(difference, rel=0.15)


@pytest.mark.parametrize("creep", [-20.0, -5.0, 0.0, 5.0, 20.0])
def test_creep_of_a_resting_plate_needs_no_disturbance(motion, creep):
    """Hold a plate below break-away, whose encoder counts `creep` steps a second, whatever LuGre says of that."""
    made, model = motion
    v, rng, count = model.values, np.random.default_rng(32), round(HELD * RATE)
    time = np.arange(count) / RATE
    push = v.preload_open + v.slope_open * (HELD_AT - v.limp_home) + 0.8 * v.coulomb
    current = push / v.torque_per_ampere
    step = 2.0 * np.pi / model.sensors.motor_counts_per_turn / v.gear_ratio
    angle = (np.floor(HELD_AT / step + creep * time) + 0.5) * step
    noise = rng.standard_normal((2, count)) * np.array([[model.sensors.voltage_noise], [model.sensors.current_noise]])
    held = record(time, current * v.resistance + noise[0], model, current=current + noise[1], motor=angle)

    def likelihood(one, torque):
        return filtered(one, model.vector(), Disturbance(torque, 1e-3)).log_likelihood

    both = joined([made, held])
    without, with_it = (likelihood(both, torque) - likelihood(made, torque) for torque in (1e-5, 1e-2))
    assert with_it - without < GAIN
