"""The slope of the likelihood by variances of disturbances and noise, and the fit that takes it."""

from dataclasses import replace

import numpy as np
import pytest
from independent_throttle import Unit, friction_check
from throttle_as_model import record_until_the_bridge_opens

from etb_hil.estimation.climbing import begun, climbed
from etb_hil.estimation.filtering import Column, Disturbance, Noise, filtered
from etb_hil.estimation.scoring import scored
from etb_hil.estimation.unknown import base_unknowns
from etb_hil.estimation.variances import (
    OF_CURRENT,
    OF_JITTER,
    OF_PLATE,
    OF_VOLTAGE,
    Q_TORQUE,
    Q_VOLTAGE,
)
from etb_hil.plant.effects.catalogue import CATALOGUE

RATE = 2000
LARGE = Disturbance(0.02, 0.3, Noise(3.0, 3.0, 3.0, 30.0))
STEP = 0.05


@pytest.fixture(scope="module")
def healthy():
    """Return a record of a healthy unit's friction check until the bridge opens, and its model."""
    motion = friction_check(Unit(), creeps=(), speeds=(1.6,), dashes=1)
    return record_until_the_bridge_opens(Unit(), Unit(), motion, RATE, 61)


def changed(disturbance, place, share):
    """Return disturbances with one variance multiplied by a share."""
    root = np.sqrt(share)
    if place == Q_TORQUE:
        return replace(disturbance, torque=disturbance.torque * root)
    if place == Q_VOLTAGE:
        return replace(disturbance, voltage=disturbance.voltage * root)
    noise = list(disturbance.noise)
    noise[place - 2] *= share
    return replace(disturbance, noise=Noise(*noise))


@pytest.mark.parametrize("place", [Q_TORQUE, Q_VOLTAGE, OF_CURRENT, OF_PLATE, OF_VOLTAGE, OF_JITTER])
def test_slopes_by_variances_are_differences(healthy, place):
    made, model = healthy
    at = filtered(made, model.vector(), LARGE, is_kept=True)
    slope = -scored(made, at, []).gradient[place]  # of the likelihood
    up, down = (filtered(made, model.vector(), changed(LARGE, place, 1.0 + by)).log_likelihood for by in (STEP, -STEP))
    assert slope == pytest.approx((up - down) / (2.0 * STEP), rel=0.02, abs=0.5)


def test_the_slope_by_the_lag_of_a_driving_reading_is_a_difference(healthy):
    """What takes the lag off makes the noise of the reading larger, too."""
    made, model = healthy
    made = replace(made, is_read=True, readings=made.readings.copy())
    made.readings[:, 0] = np.nan  # as where a reading of the force drives
    effect, p = CATALOGUE["measurement_delay"], model.vector()
    p[effect.place("lag")] = 1.0 / RATE
    column = Column("lag", 1e-5, effect.place("lag"), effect)
    slope = -scored(made, filtered(made, p, LARGE, is_kept=True), [column]).gradient[0]
    ends = []
    for by in (1e-5, -1e-5):
        moved = p.copy()
        moved[effect.place("lag")] += by
        ends.append(filtered(made, moved, LARGE).log_likelihood)
    assert slope == pytest.approx((ends[0] - ends[1]) / 2e-5, rel=0.02)


def test_information_of_the_noise_is_that_of_so_many_samples(healthy):
    """Nothing but the plate's own noise is in its readings: n samples know its logarithm to 2 / n."""
    made, model = healthy
    at = filtered(made, model.vector(), Disturbance(1e-5, 1e-3), is_kept=True)
    found = scored(made, at, []).matrix[OF_PLATE, OF_PLATE]
    assert found == pytest.approx(0.5 * len(made), rel=0.02)


def test_a_fit_from_large_disturbances_ends_where_one_from_small_ones_does(healthy):
    made, model = healthy
    unknowns = base_unknowns(model)
    ends = [climbed(made, begun(made, model.vector(), unknowns, each)) for each in (LARGE, Disturbance(1e-4, 1e-3))]
    assert ends[0].posterior == pytest.approx(ends[1].posterior, abs=10.0)
    assert max(fit.filtered.needed[0] for fit in ends) < 3e-3 * Unit().coulomb
