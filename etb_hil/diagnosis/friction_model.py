"""The LuGre friction along a measured motion, compiled: what a fit holds against the windows."""

from __future__ import annotations

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.diagnosis.ticks import TICK
from etb_hil.diagnosis.windows import bend
from etb_hil.plant.exactmath import exp, exp_neg, gauss
from etb_hil.recording.samples import Float64

# Parameters of the fit. Logarithms keep speeds and stiffnesses positive; the drop may fall below zero, so that a
# throttle without a Stribeck effect is no special case.
COULOMB, DROP, LOG_SPEED, VISCOUS, LOG_STIFFNESS, LOG_DAMPING = range(6)
FRICTION_PARAMETERS = 6

_STEPS = 4  # of a tick in which the speed changes fast: a straight line makes T_c of a sticky unit 10 % wrong there
_UNSTEADY = 0.1  # rad/s in a tick

_LEAST = 1e-3  # share of T_c below which g may not fall while the fit looks around


@njit(cache=True, error_model="numpy")
def friction_along(angle: Float64, samples: Float64, local: Float64, q: Float64, out: Float64) -> None:
    """Fill out (1 + 6, n) with the friction torque in N·m about ticks, and its derivatives by the parameters.

    `angle` (n) rad was measured at the ticks; `samples` (n) is how many samples each tick is the mean of: a box of that
    many widens a curve by its variance. `local` (n) is the factor on g where the plate was, 1 without a bump.

    The bristles start relaxed and are carried exactly along the way (seed paper, eq. 2), their derivatives with them.
    Each value is the mean under the triangle that reaches to the neighbouring ticks: that is what a second difference
    of angles answers to. Where the speed changes much within a tick, the motion between is a cubic in steps of a
    quarter.
    """
    stiffness, damping = exp(q[LOG_STIFFNESS]), exp(q[LOG_DAMPING])
    inverse_speed = exp(-q[LOG_SPEED])
    least = _LEAST * abs(q[COULOMB]) + 1e-6
    n = len(angle)
    out[:] = 0.0
    bristle = omega = 0.0
    bristle_by, g_by = np.zeros(FRICTION_PARAMETERS), np.zeros(FRICTION_PARAMETERS)
    torque, torque_after = np.zeros(1 + FRICTION_PARAMETERS), np.zeros(1 + FRICTION_PARAMETERS)
    for k in range(n - 1):
        way = angle[k + 1] - angle[k]
        ahead = min(k + 2, n - 1)
        omega_next = (angle[ahead] - angle[k]) / (TICK * (ahead - k))
        steps = _STEPS if abs(omega_next - omega) > _UNSTEADY else 1
        share = 1.0 / steps
        before = 0.0
        # The triangle's weights on a linear torque over one step that spans (a, b) of the tick
        for step in range(steps):
            a, b = step * share, (step + 1) * share
            if step == steps - 1:
                after, omega_after = way, omega_next
            else:
                # cubic through both angles with both speeds (Hermite)
                c = b * b * (3.0 - 2.0 * b)
                after = c * way + TICK * b * (1.0 - b) * ((1.0 - b) * omega - b * omega_next)
                omega_after = (
                    6.0 * b * (1.0 - b) * way / TICK
                    + (1.0 - b) * (1.0 - 3.0 * b) * omega
                    + b * (3.0 * b - 2.0) * omega_next
                )
            moved = after - before
            change = local[k + 1] - local[k]
            here, beyond = local[k] + (a + b) * 0.5 * change, local[k] + b * change
            if moved != 0.0:
                g = _level(moved / (TICK * share), here, q, inverse_speed, least, g_by)
                settled = g / stiffness if moved > 0.0 else -g / stiffness
                ratio = stiffness * abs(moved) / g
                kept = exp_neg(ratio)
                # d kept = -kept d ratio, d ratio = -ratio dg / g; the stiffness divides one and multiplies the other
                follow = settled / g * (1.0 - kept) + (bristle - settled) * kept * ratio / g
                for p in range(FRICTION_PARAMETERS):
                    bristle_by[p] = bristle_by[p] * kept + follow * g_by[p]
                bristle_by[LOG_STIFFNESS] -= follow * g
                bristle = settled + (bristle - settled) * kept
            g = _level(omega_after, beyond, q, inverse_speed, least, g_by)
            drag = stiffness * abs(omega_after) / g
            rate = omega_after - drag * bristle
            torque_after[0] = stiffness * bristle + damping * rate + q[VISCOUS] * omega_after
            for p in range(FRICTION_PARAMETERS):
                torque_after[1 + p] = (stiffness - damping * drag) * bristle_by[
                    p
                ] + damping * drag * bristle / g * g_by[p]
            torque_after[1 + VISCOUS] += omega_after
            torque_after[1 + LOG_STIFFNESS] += (stiffness - damping * drag) * bristle
            torque_after[1 + LOG_DAMPING] += damping * rate
            early, late, lean = 0.5 - (a + b) * 0.5 + 0.5, (a + b) * 0.5, share / 6.0
            # integral of the triangle's falling and rising side times a torque that is linear over the step
            for p in range(1 + FRICTION_PARAMETERS):
                mean, tilt = 0.5 * (torque[p] + torque_after[p]), 0.5 * (torque_after[p] - torque[p])
                out[p, k] += share * (early * mean - lean * tilt)
                out[p, k + 1] += share * (late * mean + lean * tilt)
                torque[p] = torque_after[p]
            before = after
        omega = omega_next
    for p in range(1 + FRICTION_PARAMETERS):
        bend(out[p], 1.0 / 24.0, -1.0 / 24.0, samples)


@njit(cache=True, error_model="numpy")
def unsettled(angle: Float64, q: Float64) -> Float64:
    """Return at every tick (n) how far the bristles are from steady sliding: 0 there, 1 relaxed, 2 bent the other way.

    That is the share of sigma_0 by which friction answers an error of the angle (n).
    """
    out = np.empty(len(angle))
    stiffness, inverse_speed = exp(q[LOG_STIFFNESS]), exp(-q[LOG_SPEED])
    least = _LEAST * abs(q[COULOMB]) + 1e-6
    bent, share = 0.0, 1.0  # bristles' torque
    for k in range(len(angle)):
        way = angle[k] - angle[max(k - 1, 0)]
        if way != 0.0:
            g = max(q[COULOMB] + q[DROP] * gauss(way / TICK * inverse_speed), least)
            settled = g if way > 0.0 else -g
            bent = settled + (bent - settled) * exp_neg(stiffness * abs(way) / g)
            share = abs(1.0 - bent / settled)
        out[k] = share
    return out


@njit(cache=True, error_model="numpy")
def steady_level(omega: Float64, q: Float64) -> Float64:
    """Return g (m) in N·m at velocities (m) in rad/s (seed paper, eq. 2)."""
    out = np.empty(len(omega))
    inverse_speed = exp(-q[LOG_SPEED])
    for k in range(len(omega)):
        out[k] = q[COULOMB] + q[DROP] * gauss(omega[k] * inverse_speed)
    return out


@njit(cache=True, error_model="numpy", inline="always")
def _level(omega: float, local: float, q: Float64, inverse_speed: float, least: float, by: Float64) -> float:
    """Return g(omega) in N·m (seed paper, eq. 2), times a factor, and its derivatives by T_c, drop and log omega_s."""
    u = omega * inverse_speed
    bell = gauss(u)
    g = local * (q[COULOMB] + q[DROP] * bell)
    if g < least:
        by[COULOMB], by[DROP], by[LOG_SPEED] = 0.0, 0.0, 0.0
        return least
    by[COULOMB], by[DROP], by[LOG_SPEED] = local, local * bell, local * 2.0 * u * u * bell * q[DROP]
    return g
