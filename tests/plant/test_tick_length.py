"""A plant may be simulated in ticks of another length than its own 50 us."""

import numpy as np
import pytest
from numba import njit

from etb_hil.base.stock import find
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.extended import advance_extended, new_extended_state
from etb_hil.plant.integrator import TICK
from etb_hil.plant.parameters import load_model

MODEL = load_model(find("model", "default"))
PERIOD = 5e-4  # s
TIME = PERIOD * np.arange(4000)
VOLTAGE = 2.2 * np.sin(8.2 * TIME) + 1.2 * np.sin(2.3 * TIME) + 0.5  # turns back, crosses limp-home


@njit
def _angles(state, p, voltage, ticks, length):
    found = np.empty(len(voltage))
    for k in range(len(voltage)):
        advance_extended(state, p, voltage[k], ticks, 25.0, length)
        found[k] = state[0]
    return found


def angles(p, ticks):
    return _angles(new_extended_state(0.5, 25.0, p), p, VOLTAGE, ticks, PERIOD / ticks)


def with_effect(id_):
    """The default model with a strong effect."""
    p = MODEL.vector()
    if id_ is not None:
        effect = CATALOGUE[id_]
        for one, place in zip(effect.parameters, effect.indices, strict=True):
            start = one.starts[len(one.starts) // 2] if one.starts else 0.0
            p[place] = np.clip(4.0 * start, 0.9 * one.low, 0.9 * one.high) if one.is_strength else start
    return p


@pytest.mark.parametrize("id_", [None, *CATALOGUE])
def test_the_length_of_ticks_hardly_changes_a_motion(id_):
    """True models, fitted anew, err by 5e-4 rad in free runs of 2 s; effects are of first order in a tick."""
    p = with_effect(id_)
    own = angles(p, round(PERIOD / TICK))
    assert np.ptp(own) > 0.5
    assert np.sqrt(np.mean((angles(p, round(0.5 * PERIOD / TICK)) - own) ** 2)) < 1e-4


def test_own_ticks_need_no_length():
    p = with_effect("cogging_torque")
    one, other = (new_extended_state(0.5, 25.0, p) for _ in range(2))
    advance_extended(one, p, 3.0, 200, 25.0)
    advance_extended(other, p, 3.0, 200, 25.0, TICK)
    np.testing.assert_array_equal(one, other)
