import dataclasses

import numpy as np
import pytest
from drawn_unit import BOX, FAULTY_RATIO, HEALTHY_RATIO, random_unit

from etb_hil.base.stock import find
from etb_hil.plant.integrator import OMEGA, STATES, advance_record, new_state
from etb_hil.plant.parameters import load_model
from etb_hil.plant.reach import peak_velocities
from etb_hil.plant.values import FAR_ABOVE


@pytest.mark.parametrize("healthy", [True, False])
def test_units_lie_in_the_box(healthy):
    rng = np.random.default_rng(3)
    for _ in range(15):
        unit = random_unit(rng, healthy=healthy)
        drawn = unit.model.parameters
        for name, (low, high) in BOX.items():
            assert low <= drawn[name].value <= high
        low, high = HEALTHY_RATIO if healthy else FAULTY_RATIO
        assert low <= drawn["stiction"].value / drawn["coulomb"].value <= high
        assert drawn["back_emf_constant"].value == drawn["torque_constant"].value
        values = unit.model.values
        if healthy:
            assert values.return_margin > 0.0
        assert unit.reaches_coulomb == (
            min(unit.peak_opening, unit.peak_closing) > FAR_ABOVE * values.stribeck_velocity
        )


def test_units_repeat_with_their_seed():
    first, second = (random_unit(np.random.default_rng(8), healthy=False) for _ in range(2))
    assert first.model.values == second.model.values


def test_the_default_throttle_reaches_sliding_and_a_strong_motor_does_not():
    values = load_model(find("model", "default")).values
    opening, closing = peak_velocities(values)
    assert opening > FAR_ABOVE * values.stribeck_velocity
    assert closing > opening  # the spring helps over most of the stroke
    strong = dataclasses.replace(values, torque_per_ampere=18 * 0.05, back_emf=18 * 0.05)
    assert max(peak_velocities(strong)) < FAR_ABOVE * strong.stribeck_velocity


def test_the_peak_is_no_more_than_full_voltage_gives():
    values = load_model(find("model", "dv_e5")).values
    record = np.empty((4000, STATES))
    advance_record(new_state(values.stop_low), values.vector(), np.array([values.voltage_limit]), 4000, record)
    assert 0.5 * record[:, OMEGA].max() < peak_velocities(values)[0] <= record[:, OMEGA].max()
