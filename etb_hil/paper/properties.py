"""Check properties 1 to 3 of the LuGre model (seed paper, section III)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.paper.setups import friction_torque, stribeck_friction
from etb_hil.plant.parameters import ThrottleParameters
from etb_hil.recording.samples import Float64

_STEP_S = 20e-6
_RAMP_STEPS = 20_000
_FROM, _TO = -0.5, 4.0  # times omega_s: where the trajectories of property 3 begin and end
_NEAR = 0.02  # share of T_st by which a peak may stay below it


@dataclass(frozen=True, slots=True)
class BoundedBristles:
    """Property 1 over random motions.

    The property has the largest sigma_0 |z| and the largest |T_f|, over T_st.

    `steady` is the largest difference in N·m between the friction of steady sliding and the property's formula.
    """

    bristles: float
    torque: float
    steady: float


@dataclass(frozen=True, slots=True)
class Passage:
    """A velocity ramp through zero, as properties 2 and 3 have it.

    Bristles begin at `start` (times T_st / sigma_0).

    `bristles` is the highest sigma_0 z on the way up and `torque` the highest friction below omega_s, both over T_st;
    `end` the friction at the end less the viscous torque, over T_c; `zeros` counts how often z passes zero.
    """

    start: float
    bristles: float
    torque: float
    end: float
    zeros: int


@dataclass(frozen=True, slots=True)
class SlowEnough:
    """f(omega_s) of property 3, an acceleration in rad/s^2.

    Up to it sigma_0 z comes within 2 % of T_st.
    """

    stribeck_velocity: float
    acceleration: float


def bounded_bristles(throttle: ThrottleParameters, rng: np.random.Generator, motions: int = 100) -> BoundedBristles:
    """Check property 1 on random motions of up to five omega_s.

    They begin from any bristles that it allows.
    """
    time = np.arange(25_000) * _STEP_S
    most_bristles = most_torque = 0.0
    limit = throttle.stiction / throttle.bristle_stiffness
    for _ in range(motions):
        frequencies, phases = rng.uniform(0.5, 60.0, 4), rng.uniform(0.0, 2.0 * np.pi, 4)
        sizes = rng.uniform(0.0, 1.25 * throttle.stribeck_velocity, 4)
        velocity = np.sum(sizes[:, None] * np.sin(2.0 * np.pi * frequencies[:, None] * time + phases[:, None]), axis=0)
        bristle = bristles_along(velocity, _STEP_S, limit * rng.uniform(-1.0, 1.0), throttle)
        most_bristles = max(most_bristles, float(np.abs(bristle).max()) / limit)
        most_torque = max(most_torque, float(np.abs(friction_torque(velocity, bristle, throttle)).max()))
    speeds = np.linspace(0.05, 5.0, 40) * throttle.stribeck_velocity
    found = [_steady_friction(speed, throttle) for speed in speeds]
    formula = stribeck_friction(speeds, throttle) + throttle.viscous * speeds
    return BoundedBristles(
        most_bristles, most_torque / throttle.stiction, float(np.abs(np.array(found) - formula).max())
    )


def passage(throttle: ThrottleParameters, start: float, acceleration: float) -> Passage:
    """Run a velocity that rises evenly from -0.5 to 4 omega_s.

    The acceleration is in rad/s^2.
    """
    omega_s = throttle.stribeck_velocity
    velocity = np.linspace(_FROM, _TO, _RAMP_STEPS) * omega_s
    step = (_TO - _FROM) * omega_s / acceleration / (_RAMP_STEPS - 1)
    limit = throttle.stiction / throttle.bristle_stiffness
    bristle = bristles_along(velocity, step, start * limit, throttle)
    friction = friction_torque(velocity, bristle, throttle)
    rising = velocity > 0.0
    slow = rising & (velocity < omega_s)
    return Passage(
        start=start,
        bristles=float(bristle[rising].max()) / limit,
        torque=float(friction[slow].max()) / throttle.stiction,
        end=float(friction[-1] - throttle.viscous * velocity[-1]) / throttle.coulomb,
        zeros=int(np.count_nonzero(np.diff(np.sign(bristle[bristle != 0.0])))),
    )


def slow_enough(throttle: ThrottleParameters, factor: float) -> SlowEnough:
    """Find f(omega_s) by bisection for `factor` times the throttle's omega_s."""
    changed = replace(throttle, stribeck_velocity=factor * throttle.stribeck_velocity)
    low, high = 1e-2, 1e6
    while high / low > 1.01:
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if passage(changed, 1.0, middle).bristles > 1.0 - _NEAR else (low, middle)
    return SlowEnough(changed.stribeck_velocity, low)


def bristles_along(velocity: Float64, step: float, start: float, throttle: ThrottleParameters) -> Float64:
    """Return the bristles' deflection (n) in rad along velocities (n) in rad/s.

    They are `step` s apart; seed paper, eq. (2).

    Over each step the way is the trapezoid's and g that of the mean velocity: then eq. (2) has a solution in
    exponentials.
    """
    level = stribeck_friction(0.5 * (velocity[1:] + velocity[:-1]), throttle) / throttle.bristle_stiffness
    out = np.empty(len(velocity))
    out[0] = start
    _carry(0.5 * step * (velocity[1:] + velocity[:-1]), level, out)
    return out


@njit(cache=True, error_model="numpy")
def _carry(way: Float64, level: Float64, out: Float64) -> None:
    for k in range(len(way)):
        settled = level[k] if way[k] > 0.0 else -level[k]
        out[k + 1] = settled + (out[k] - settled) * np.exp(-abs(way[k]) / level[k])


def _steady_friction(speed: float, throttle: ThrottleParameters) -> float:
    way = 20.0 * throttle.stiction / throttle.bristle_stiffness
    velocity = np.full(2_000, speed)
    bristle = bristles_along(velocity, way / speed / 2_000, 0.0, throttle)
    return float(friction_torque(velocity[-1:], bristle[-1:], throttle)[0])
