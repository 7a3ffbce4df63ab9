"""Bristles of the filter are those of the plant, and their derivatives are those of a small change."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from etb_hil.estimation.bristles import bent
from etb_hil.plant.bristle import bend

STEP = 1e-6
SHARES = st.one_of(st.just(0.0), st.floats(0.3, 0.95))


@given(
    torque=st.floats(-1.0, 1.0),
    way=st.floats(-5.0, 5.0).filter(lambda one: abs(one) > 1e-3),
    friction=st.floats(0.05, 0.3),
    share=SHARES,
    stiffness=st.floats(20.0, 120.0),
)
def test_end_and_mean_are_the_plants(torque, way, friction, share, stiffness):
    """Torque is in shares of friction, and the way in lengths of a bristle."""
    torque, way = torque * friction, way * friction / stiffness
    found = bent(torque, way, friction, share, stiffness)
    end, mean, _, _ = bend(torque / stiffness, way, friction, friction, stiffness, 1.0 / stiffness, share)
    assert np.allclose([found.end, found.mean], [stiffness * end, stiffness * mean], rtol=1e-9, atol=1e-12)


@given(
    torque=st.floats(-0.98, 0.98),
    way=st.floats(0.01, 5.0),
    sign=st.sampled_from([-1.0, 1.0]),
    friction=st.floats(0.05, 0.3),
    share=SHARES,
)
def test_derivatives_are_those_of_a_small_change(torque, way, sign, friction, share):
    """By way, torque before it, friction and share: of the two sides where the law has a bend there, of either one."""
    stiffness = 60.0
    at = np.array([torque * friction, sign * way * friction / stiffness, friction, share])
    found = bent(*at, stiffness)
    stated = {
        1: (found.end_by_way, found.mean_by_way),
        0: (found.end_by_bristle, found.mean_by_bristle),
        2: (found.end_by_friction, found.mean_by_friction),
        3: (found.end_by_share, found.mean_by_share),
    }
    for place, (end, mean) in stated.items():
        if place == 3 and share == 0.0:
            continue
        step = STEP * (1e-2 if place == 1 else 1.0)
        sides = []
        for side in (-step, step):
            moved = at.copy()
            moved[place] += side
            other = bent(*moved, stiffness)
            sides.append(np.array([other.end - found.end, other.mean - found.mean]) / side)
        low, high = np.minimum(*sides), np.maximum(*sides)
        slack = 1e-3 * np.maximum(np.abs(low), np.abs(high)) + 1e-4 * (stiffness if place == 1 else 1.0)
        assert np.all([end, mean] >= low - slack)
        assert np.all([end, mean] <= high + slack)
