"""Where the bridge is open, the voltage follows the motor, and no current flows: a plate that falls by its springs."""

from dataclasses import replace

import numpy as np
import pytest
from independent_throttle import Unit, friction_check
from scipy.integrate import solve_ivp
from throttle_as_model import bench_model, record_until_the_bridge_opens

from etb_hil.estimation.filtering import Disturbance, filtered
from etb_hil.estimation.record import record

SMALL = Disturbance(1e-3, 1e-2)
FROM, SECONDS = 1.3, 0.15  # rad above limp-home, and s of a fall


def test_an_open_bridge_makes_no_current_expected():
    """A bridge that opens in the middle of a motion, with any voltage on record."""
    motion = friction_check(Unit(), creeps=(), speeds=(1.6,), dashes=1)
    made, model = record_until_the_bridge_opens(Unit(), Unit(), motion, 2000, 51)
    far = made.voltage.copy()
    far[4000:4400] += 6.0
    unsure = np.where(np.abs(np.arange(len(made)) - 4200) <= 200, np.inf, 0.0)
    p = model.vector()
    sure = filtered(replace(made, voltage=far), p, SMALL)
    told = filtered(replace(made, voltage=far, unsure=unsure), p, SMALL)
    assert np.sum(sure.whitened[4000:4400, 0] ** 2) > 100.0 * np.sum(told.whitened[4000:4400, 0] ** 2)
    assert told.needed[1] < 0.01


@pytest.mark.parametrize("rate", [500, 1000, 2000])
def test_a_free_fall_needs_no_disturbance(rate):
    """Whatever the rate: back-EMF that grows within a sample drives no current.

    The fall is that of an independent solver, until limp-home.
    """
    model = bench_model(Unit())
    v, rng = model.values, np.random.default_rng(61)

    def fall(_, state):
        theta, omega, bristle = state
        level = v.coulomb + (v.stiction - v.coulomb) * np.exp(-((omega / v.stribeck_velocity) ** 2))
        bends = omega - v.bristle_stiffness * abs(omega) / level * bristle
        friction = v.bristle_stiffness * bristle + v.bristle_damping * bends + v.viscous * omega
        spring = v.preload_open + v.slope_open * (theta - v.limp_home)
        return omega, -(spring + friction) / v.inertia, bends

    time = np.arange(round(SECONDS * rate)) / rate
    start = (v.limp_home + FROM, 0.0, -v.stiction / v.bristle_stiffness)
    path = solve_ivp(fall, (0.0, SECONDS), start, "LSODA", time, rtol=1e-9, atol=1e-12).y
    falls = path[0] > v.limp_home + 0.05
    time, (theta, omega, _) = time[falls], path[:, falls]
    step = 2.0 * np.pi / model.sensors.motor_counts_per_turn / v.gear_ratio
    noise = rng.standard_normal((2, len(time))) * np.array(
        [[model.sensors.voltage_noise], [model.sensors.current_noise]]
    )
    made = record(
        time, v.back_emf * omega + noise[0], model, current=noise[1], motor=(np.floor(theta / step) + 0.5) * step,
        unsure=np.inf,
    )  # fmt: skip
    assert np.abs(omega).max() > 10.0
    needed, none = (filtered(made, model.vector(), Disturbance(torque, 1e-3)) for torque in (0.01 * v.coulomb, 1e-5))
    assert needed.log_likelihood < none.log_likelihood + 1.0
