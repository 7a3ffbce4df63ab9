"""The springs' torque is no straight line over the angle."""

from __future__ import annotations

from etb_hil.plant.effects.effect import Balance, BenchMeasurement, Effect, Need, Parity, finer, strength
from etb_hil.plant.effects.port import Port

_MIDDLE = 0.5  # of the travel
_SPAN = "chosen: slopes of 0.05 to 0.09 N·m/rad are found over the travel"


def torque(
    theta: float,
    quadratic: float,
    cubic: float,
    quartic: float,
    kink: float,
    knee: float,
    limp_home: float,
    stop_high: float,
) -> float:
    """Return the torque in N·m that brakes opening at an angle."""
    if theta <= limp_home:
        return 0.0
    x = (theta - limp_home) / (stop_high - limp_home)
    return x * x * (quadratic + x * (cubic + x * quartic)) + kink * max(0.0, x - _MIDDLE - knee)


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
    looks_like="the torque over the angle is bent, equal in both directions and at every speed",
    check="look for coils that touch and for a spring in the wrong hook",
    look_alikes=("aerodynamic_torque", "spring_preload_shift"),
    separated_by="sweep in both directions without air flow",
    source="chosen form: what a straight line leaves",
    is_of_place=True,
    finer=(
        finer("kink", "N·m", -1.0, 1.0, "k: the slope changes at once, as where coils meet", 0.05, is_strength=True),
        finer("knee", "1", -0.4, 0.4, "m: where it does, from the middle of the travel", 0.05),
    ),
    terms={Port.SPRING_TORQUE: torque},
    needs=frozenset({Need.SPRING}),
    by_bench=(BenchMeasurement.SPRINGS, {"quadratic": 0.005, "cubic": 0.005, "quartic": 0.005}),
)
