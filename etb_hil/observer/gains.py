"""What sliding-mode observers take from data and the sensors' data sheet.

The common part is their bound, and their filter.

The bound is the data's own. A plate that sticks or slides steadily is held by nothing but friction: then its torque is
what the motor gives less what the springs take, and what moves the plate has been stronger than its friction before.
The highest such torque of late therefore bounds the friction torque, without a derivative, and without a law of it.

The filter is the one with the least error to be expected. A friction torque that turns round once a second, from
one side of the bound to the other, costs lag in proportion to the filter's time constant; white noise of an angle
that is differentiated twice falls with its fifth power. Where the sign switches at every sample, the observer is a
sigma-delta modulator of first order, whose ripple falls with the third (Candy and Temes 1992).

After a start or a gap the velocity is unknown: until it is found, the bound is what the motor can give at most, and the
filter waits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.base.errors import InputError, Problem
from etb_hil.observer.estimate import SensorNoise
from etb_hil.plant.parameters import ThrottleParameters
from etb_hil.recording.samples import Float64

SETTLING = 15.0  # time constants of the filter: at the start all of the velocity passes for a torque
LATE = 1.5  # times the step before: a sample that comes later than this has lost one before it

_MARGIN = 1.5  # M over the bound: half as much again, to reach the sliding mode with
_LEAST = 0.1  # share of the model's stiction that the bound never falls below: a plate at rest unloaded shows none
_FORGOTTEN_S = 0.5  # time constant
_FINDING = 2.0  # times what the motor needs from rest to its top speed: until an unknown velocity is found
_REVERSALS = 1.0  # per s
FOLLOWED = 0.8  # gains stay as they are until the bound has left this share of what they were chosen for
_STEP_ERROR = 2.0625  # integral of the squared error of three equal poles after a step of one, in time constants

_STATED_SWITCHING, _STATED_LAG, _ANGLE_TORQUE, LEAST_BOUND, STRONGEST, FINDING_S = range(6)


@dataclass(frozen=True, slots=True)
class SlidingModeSettings:
    """The two choices that the paper leaves open.

    What is None comes from the data and the sensors' noise.

    `switching_torque`, M in N·m, above the largest friction torque and disturbance. `cutoff` in Hz, of a low-pass
    filter of second order: lower leaves less ripple and underestimates T_st more. InputError where one is stated that
    is not above zero and finite.
    """

    switching_torque: float | None = None
    cutoff: float | None = None

    def __post_init__(self) -> None:
        """Refuse what the observers would take for not stated, or could not filter by."""
        problems = [
            Problem(
                f"{name} of a sliding-mode observer is out of range",
                value=value,
                allowed=f"finite {unit} above 0",
                remedy="leave it out, and it comes from the data",
            )
            for name, value, unit in (
                ("switching_torque (M)", self.switching_torque, "N·m"),
                ("cutoff", self.cutoff, "Hz"),
            )
            if value is not None and not 0.0 < value < math.inf
        ]
        if problems:
            raise InputError(*problems)


def tuning_of(throttle: ThrottleParameters, noise: SensorNoise, settings: SlidingModeSettings | None) -> Float64:
    """Return what the compiled functions below take of a throttle and settings.

    Its sensors are part of it.
    """
    chosen = settings or SlidingModeSettings()
    lag = 0.0 if chosen.cutoff is None else 1.0 / (2.0 * math.pi * chosen.cutoff)
    strongest = throttle.torque_per_ampere * throttle.voltage_limit / throttle.resistance
    finding = _FINDING * throttle.voltage_limit / throttle.back_emf * throttle.inertia / strongest
    angle_torque, least = throttle.inertia * noise.angle, _LEAST * throttle.stiction
    return np.array([chosen.switching_torque or 0.0, lag, angle_torque, least, strongest, finding])


@njit(cache=True, error_model="numpy", inline="always")
def keep(dt: float) -> float:
    """Return the share of the bound that is left after dt in s."""
    return _FORGOTTEN_S / (_FORGOTTEN_S + dt)


@njit(cache=True, error_model="numpy", inline="always")
def followed(bound: float, chosen_for: float) -> float:
    """Return the bound that gains are chosen for.

    The bound is the former one until the bound has moved far from it.
    """
    return bound if bound < FOLLOWED * chosen_for or bound > chosen_for / FOLLOWED else chosen_for


@njit(cache=True, error_model="numpy")
def gains_of(dt: float, bound: float, tuning: Float64, is_noisy: bool, switches: bool) -> tuple[float, ...]:
    """Return M in N·m, the filter's delay in s, and its poles' shares.

    A share is what a pole takes of an error a step: that of the first two, and of the last.

    Filter and M are those with the least error, or as stated, then of two poles: the last takes all. `is_noisy`: the
    torque comes from the angle; `switches`: it is a sign that is taken at every sample.
    """
    stated, lag = tuning[_STATED_SWITCHING], tuning[_STATED_LAG]
    switching = stated if stated > 0.0 else _MARGIN * bound
    poles = 2 if lag > 0.0 else 3
    if poles > 2:
        lag = least_error_lag(dt, bound, tuning[_ANGLE_TORQUE] * is_noisy, switching * switches)
    share = dt / (lag + dt)  # backward Euler: stable for any step, and no exponential
    return switching, poles * lag, share, share if poles > 2 else 1.0


@njit(cache=True, error_model="numpy", inline="always")
def filtered(
    taken: float, first: float, second: float, third: float, share: float, last_share: float
) -> tuple[float, float, float]:
    """Return the three poles' torques in N·m a step later.

    The first takes `taken`, its share of a torque.
    """
    first = (1.0 - share) * first + taken
    second = (1.0 - share) * second + share * first
    return first, second, (1.0 - last_share) * third + last_share * second


@njit(cache=True, error_model="numpy")
def least_error_lag(dt: float, bound: float, angle_torque: float, switching: float) -> float:
    """Return the time constant in s of three poles with the least error.

    The pole placement holds at steps of dt in s.

    Three, because fewer let white noise of an angle, differentiated twice, through at any frequency.

    `bound` of the friction torque in N·m; `angle_torque` inertia times the angle's noise, N·m s^2; `switching` M in N·m
    where its sign is taken at every sample, otherwise zero. With u the time constant and half a step, the mean square
    is lag * u + noise / u^5 + ripple / u^3; the noise is exact for slow filters and for none at all.
    """
    lag = _REVERSALS * 4.0 * bound * bound * _STEP_ERROR
    noise = 3.0 / 16.0 * angle_torque * angle_torque * dt
    ripple = switching * switching / 3.0 * (dt * dt * dt) / 16.0
    square = 1.0  # of u in s; from above, Newton's steps only go down
    for _ in range(200):
        slope = 3.0 * (lag * square * square - ripple)
        step = (lag * square * square * square - 3.0 * ripple * square - 5.0 * noise) / slope
        square -= step
        if step <= 1e-12 * square:
            break
    return max(math.sqrt(square) - 0.5 * dt, 0.0)
