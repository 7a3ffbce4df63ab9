"""Friction along a motion: the derivatives that the fit goes by are those of the values."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from etb_hil.diagnosis.friction_model import (
    AGEING,
    COULOMB,
    DROP,
    FRICTION_PARAMETERS,
    LAW_PARAMETERS,
    LOG_DAMPING,
    LOG_EXPONENT,
    LOG_ONSET,
    LOG_RENEWAL,
    LOG_SPEED,
    LOG_SQUARE,
    LOG_STIFFNESS,
    VISCOUS,
    friction_along,
    steady_by,
    steady_level,
    unsettled,
)


def motion():
    """Return angles every millisecond: slow sweeps with reversals and presliding, then a dash."""
    t = np.arange(3000) * 1e-3
    slow = 0.2 * np.sin(2 * np.pi * 0.7 * t) + 0.003 * np.sin(2 * np.pi * 9.0 * t)
    dash = np.where(t > 2.0, 0.6 * (1 - np.cos(2 * np.pi * 4.0 * (t - 2.0))), 0.0)
    return slow + dash


def along(angle, q):
    out = np.empty((1 + FRICTION_PARAMETERS + LAW_PARAMETERS, len(angle)))
    friction_along(angle, np.ones(len(angle)), np.ones(len(angle)), q, out)
    return out


def parameters(exponent=2.0, ageing=0.0):
    q = np.zeros(LOG_EXPONENT + LAW_PARAMETERS)
    q[[COULOMB, DROP, VISCOUS, AGEING]] = 0.144, 0.05, 1e-3, ageing
    q[[LOG_SPEED, LOG_STIFFNESS, LOG_DAMPING, LOG_RENEWAL, LOG_ONSET]] = np.log([7.8, 60.0, 0.1, 3e-3, 0.05])
    q[LOG_EXPONENT] = LOG_SQUARE if exponent == 2.0 else np.log(exponent)
    return q


FRICTION = [COULOMB, DROP, LOG_SPEED, VISCOUS, LOG_STIFFNESS, LOG_DAMPING]
LAW = [LOG_EXPONENT, AGEING, LOG_RENEWAL, LOG_ONSET]


@pytest.mark.parametrize(("exponent", "ageing"), [(2.0, 0.0), (0.7, 0.0), (2.0, 0.014), (1.3, 0.014)])
def test_derivatives_are_those_of_the_values(exponent, ageing):
    q, angle, step = parameters(exponent, ageing), motion(), 1e-5
    exact = along(angle, q)[1:]
    for row, index in zip(exact, FRICTION + LAW, strict=True):
        if ageing == 0.0 and index in LAW[1:]:
            continue  # contacts without age have none
        ahead, behind = q.copy(), q.copy()
        ahead[index] += step
        behind[index] -= step
        slope = (along(angle, ahead)[0] - along(angle, behind)[0]) / (2 * step)
        assert np.max(np.abs(row)) > 1e-3
        assert row == pytest.approx(slope, abs=2e-6 * np.max(np.abs(row))), index


@pytest.mark.parametrize(("exponent", "ageing"), [(2.0, 0.0), (0.7, 0.014)])
def test_steady_sliding_has_the_level_and_the_derivatives_of_the_curve(exponent, ageing):
    q, speed = parameters(exponent, ageing), 0.4
    angle = speed * 1e-3 * np.arange(2000)
    values = along(angle, q)[:, -100]
    assert values[0] == pytest.approx(steady_level(np.array([speed]), q)[0] + 1e-3 * speed, rel=1e-6)
    slopes = steady_by(speed, q)[FRICTION + LAW]
    known = [0, 1, 2, 3, 6] + ([7, 8, 9] if ageing else [])
    assert values[1:][known] == pytest.approx(slopes[known], rel=1e-5)


def test_bristles_settle_along_the_way_and_hang_over_a_reversal():
    q = parameters()
    step, length = 1e-4, 0.194 / 60.0  # rad in a tick; T_st / sigma_0
    way = np.concatenate([np.full(400, step), np.zeros(50), np.full(400, -step)])
    share = unsettled(np.cumsum(way), q)
    passed = step * np.arange(400)
    assert share[:400] == pytest.approx(np.exp(-passed / length), abs=0.01)
    assert np.all(share[400:450] == share[399])  # a rest is no way
    assert share[450:] == pytest.approx(2.0 * np.exp(-(passed + step) / length), abs=0.02)


@pytest.mark.parametrize("exponent", [0.5, 1.0, 2.0])
def test_friction_in_a_dash_is_that_of_an_independent_solver(exponent):
    """Friction that followed the speed 0.1 ms late would be off by 0.1 mN·m, up or down as the speed rises or falls."""
    rise, fall, peak = 0.075, 0.045, 17.5

    def speed(t):
        up, down = np.clip(t / rise, 0.0, 1.0), np.clip((t - rise) / fall, 0.0, 1.0)
        return peak * 0.5 * (np.cos(np.pi * down) - np.cos(np.pi * up))

    def bristles(t, z):
        omega = speed(t)
        level = 0.144 + 0.05 * np.exp(-((abs(omega) / 7.8) ** exponent))
        return omega - 60.0 * abs(omega) / level * z

    fine = np.arange(-0.02, rise + fall, 1e-5)
    z = solve_ivp(bristles, (fine[0], fine[-1]), [0.0], t_eval=fine, rtol=1e-9, atol=1e-12, max_step=1e-4).y[0]
    true = 60.0 * z + 0.1 * bristles(fine, z) + 1e-3 * speed(fine)
    triangle = 1.0 - np.abs(np.arange(-99, 100)) / 100.0
    true = np.convolve(true, triangle / triangle.sum(), "same")[::100]
    angle = np.concatenate([[0.0], np.cumsum(0.5e-5 * (speed(fine)[1:] + speed(fine)[:-1]))])[::100]
    found, omega = along(angle, parameters(exponent))[0], speed(fine)[::100]
    shown = (omega > 2.0) & (np.arange(len(omega)) < len(omega) - 3)
    assert np.max(np.abs(found - true)[shown]) < 4e-5
