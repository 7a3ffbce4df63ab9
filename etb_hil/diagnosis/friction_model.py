"""The LuGre friction along a measured motion, compiled: what a fit holds against the windows."""

from __future__ import annotations

from numba import njit

from etb_hil.diagnosis.ticks import TICK
from etb_hil.diagnosis.windows import bend
from etb_hil.plant.exactmath import exp, exp_neg, gauss
from etb_hil.recording.samples import Float64

# Parameters of the fit. Logarithms keep speeds and stiffnesses positive; the drop may fall below zero, so that a
# throttle without a Stribeck effect is no special case.
COULOMB, DROP, LOG_SPEED, VISCOUS, LOG_STIFFNESS, LOG_DAMPING = range(6)
FRICTION_PARAMETERS = 6

_STEPS = 4
_UNSTEADY = 0.1  # rad/s in a tick

_LEAST = 1e-3  # share of T_c below which g may not fall while the fit looks around


@njit(cache=True, error_model="numpy")
def log(value: float) -> float:
    """Return the natural logarithm of a positive value, by Halley's method on the project's own exponential."""
    guess = 0.0
    for _ in range(400):
        power = exp(guess)
        step = 2.0 * (value - power) / (value + power)
        guess += step
        if abs(step) < 1e-15:
            break
    return guess


@njit(cache=True, error_model="numpy", inline="always")
def level(omega: float, q: Float64, inverse_speed: float) -> float:
    """Return g(omega) in N·m (seed paper, eq. 2)."""
    g = q[COULOMB] + q[DROP] * gauss(omega * inverse_speed)
    least = _LEAST * abs(q[COULOMB]) + 1e-6
    return max(least, g)


@njit(cache=True, error_model="numpy")
def friction_along(angle: Float64, samples: Float64, q: Float64, out: Float64) -> None:
    """Fill out (n) with the friction torque in N·m about ticks whose angles (n) in rad were measured.

    `samples` (n) is how many samples each tick is the mean of: a box of that many widens a curve by its variance.

    The bristles start relaxed and are carried exactly along the way (seed paper, eq. 2). Each value is the mean under
    the triangle that reaches to the neighbouring ticks: that is what a second difference of angles answers to. Where
    the speed changes much within a tick, the motion between is a cubic in steps of a quarter.
    """
    stiffness, damping = exp(q[LOG_STIFFNESS]), exp(q[LOG_DAMPING])
    inverse_speed = exp(-q[LOG_SPEED])
    n = len(angle)
    out[:] = 0.0
    bristle, omega = 0.0, 0.0
    torque = 0.0
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
            if moved != 0.0:
                g = level(moved / (TICK * share), q, inverse_speed)
                settled = g / stiffness if moved > 0.0 else -g / stiffness
                bristle = settled + (bristle - settled) * exp_neg(stiffness * abs(moved) / g)
            rate = omega_after - stiffness * abs(omega_after) * bristle / level(omega_after, q, inverse_speed)
            torque_after = stiffness * bristle + damping * rate + q[VISCOUS] * omega_after
            early, late = 0.5 - (a + b) * 0.5 + 0.5, (a + b) * 0.5
            lean = share / 6.0
            # integral of the triangle's falling and rising side times a torque that is linear over the step
            mean = 0.5 * (torque + torque_after)
            tilt = 0.5 * (torque_after - torque)
            out[k] += share * (early * mean - lean * tilt)
            out[k + 1] += share * (late * mean + lean * tilt)
            torque, before = torque_after, after
        omega = omega_next
    bend(out, 1.0 / 24.0, -1.0 / 24.0, samples)
