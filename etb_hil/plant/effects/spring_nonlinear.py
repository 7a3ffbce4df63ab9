"""The springs' torque is no straight line over the angle."""

from __future__ import annotations

from numba import njit

from etb_hil.plant.effects.effect import Balance, Effect, Parity, finer, strength
from etb_hil.plant.effects.layout import row
from etb_hil.plant.physics import LIMP_HOME, STOP_HIGH, Vector

_K = row("spring_nonlinear")
_MIDDLE = 0.5  # of the travel
_SPAN = "chosen: slopes of 0.05 to 0.09 N·m/rad are found over the travel"

EFFECT = Effect(
    id="spring_nonlinear",
    equation="x = (theta - lh) / (theta_high - lh): a x^2 + b x^3 + c x^4 + k max(0, x - 0.5 - m) above limp-home",
    balance=Balance.TORQUE,
    parity=Parity.EVEN,
    parameters=(
        strength("quadratic", "N·m", -2.0, 2.0, (0.02,), _SPAN),
        strength("cubic", "N·m", -3.0, 3.0, (0.02,), _SPAN),
        strength("quartic", "N·m", -2.0, 2.0, (0.02,), _SPAN),
    ),
    looks_like="the torque over the angle is bent, alike in both directions and at every speed",
    check="coils that touch, a spring hooked wrongly",
    look_alikes=("aerodynamic_torque", "spring_preload_shift"),
    separated_by="sweeps in both directions, with no air flow",
    source="chosen form: what a straight line leaves",
    is_of_place=True,
    finer=(
        finer("kink", "N·m", -1.0, 1.0, "k: the slope changes at once, as where coils meet", 0.05),
        finer("knee", "1", -0.4, 0.4, "m: where it does, from the middle of the travel", 0.05),
    ),
)


@njit(cache=True, error_model="numpy")
def torque(theta: float, p: Vector) -> float:
    """Return the torque in N·m that brakes opening at an angle."""
    if theta <= p[LIMP_HOME]:
        return 0.0
    x = (theta - p[LIMP_HOME]) / (p[STOP_HIGH] - p[LIMP_HOME])
    kink = p[_K + 3] * max(0.0, x - _MIDDLE - p[_K + 4])
    return x * x * (p[_K] + x * (p[_K + 1] + x * p[_K + 2])) + kink
