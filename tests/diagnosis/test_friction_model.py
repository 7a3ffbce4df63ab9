"""Friction along a motion: the derivatives that the fit goes by are those of the values."""

import numpy as np
import pytest

from etb_hil.diagnosis.friction_model import (
    COULOMB,
    DROP,
    FRICTION_PARAMETERS,
    LOG_DAMPING,
    LOG_SPEED,
    LOG_STIFFNESS,
    VISCOUS,
    friction_along,
    unsettled,
)


def motion():
    """Return angles every millisecond: slow sweeps with reversals and presliding, then a dash."""
    t = np.arange(3000) * 1e-3
    slow = 0.2 * np.sin(2 * np.pi * 0.7 * t) + 0.003 * np.sin(2 * np.pi * 9.0 * t)
    dash = np.where(t > 2.0, 0.6 * (1 - np.cos(2 * np.pi * 4.0 * (t - 2.0))), 0.0)
    return slow + dash


def along(angle, q):
    out = np.empty((1 + FRICTION_PARAMETERS, len(angle)))
    friction_along(angle, np.ones(len(angle)), np.ones(len(angle)), q, out)
    return out


@pytest.mark.parametrize("index", [COULOMB, DROP, LOG_SPEED, VISCOUS, LOG_STIFFNESS, LOG_DAMPING])
def test_derivatives_are_those_of_the_values(index):
    q = np.zeros(FRICTION_PARAMETERS)
    q[COULOMB], q[DROP], q[VISCOUS] = 0.144, 0.05, 1e-3
    q[LOG_SPEED], q[LOG_STIFFNESS], q[LOG_DAMPING] = np.log([7.8, 60.0, 0.1])
    angle, step = motion(), 1e-5
    ahead, behind = q.copy(), q.copy()
    ahead[index] += step
    behind[index] -= step
    slope = (along(angle, ahead)[0] - along(angle, behind)[0]) / (2 * step)
    exact = along(angle, q)[1 + index]
    assert np.max(np.abs(exact)) > 1e-3
    assert exact == pytest.approx(slope, abs=2e-6 * np.max(np.abs(exact)))


def test_bristles_settle_along_the_way_and_hang_over_a_reversal():
    q = np.zeros(FRICTION_PARAMETERS)
    q[COULOMB], q[DROP], q[VISCOUS] = 0.144, 0.05, 1e-3
    q[LOG_SPEED], q[LOG_STIFFNESS], q[LOG_DAMPING] = np.log([7.8, 60.0, 0.1])
    step, length = 1e-4, 0.194 / 60.0  # rad in a tick; T_st / sigma_0
    way = np.concatenate([np.full(400, step), np.zeros(50), np.full(400, -step)])
    share = unsettled(np.cumsum(way), q)
    passed = step * np.arange(400)
    assert share[:400] == pytest.approx(np.exp(-passed / length), abs=0.01)
    assert np.all(share[400:450] == share[399])  # a rest is no way
    assert share[450:] == pytest.approx(2.0 * np.exp(-(passed + step) / length), abs=0.02)
