"""The seed paper's estimator on a motion, and the numbers of its section IV."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from etb_hil.observer.estimate import FrictionEstimate, SensorNoise
from etb_hil.observer.gains import SlidingModeSettings
from etb_hil.observer.kinds.sliding_mode import ImplicitSlidingModeObserver, SlidingModeObserver
from etb_hil.paper.setups import Motion, healthy
from etb_hil.plant.integrator import TICK
from etb_hil.plant.parameters import ThrottleParameters
from etb_hil.plant.values import FAR_ABOVE
from etb_hil.recording.samples import Float64

MARGIN = 4.0  # M over the healthy T_st: above the faulty one, which is 3.3 times the healthy one
CUTOFF = 120.0  # Hz: between too much lag and too much ripple, see the trade

_EXACT = SensorNoise(0.0, 0.0)


def paper_settings(cutoff: float = CUTOFF) -> SlidingModeSettings:
    """Return M and cut-off (Hz) as the paper's observer has them.

    They are set by hand: nothing comes from the data.
    """
    return SlidingModeSettings(MARGIN * healthy().stiction, cutoff)


def estimate(
    motion: Motion, settings: SlidingModeSettings | None = None, known: ThrottleParameters | None = None
) -> FrictionEstimate:
    """Return what eq. (4) to (6) make of current, angle and velocity at 20 kHz.

    `known` defaults to the healthy unit.

    The observer's model holds springs, inertia and motor constant; of friction it takes M alone.
    """
    observer = SlidingModeObserver(healthy() if known is None else known, _EXACT, settings or paper_settings())
    return observer.push(motion.time_ns, motion.current, motion.angle, motion.velocity)


def without_switching(motion: Motion, settings: SlidingModeSettings) -> FrictionEstimate:
    """Return the same with the sign taken at the end of the step.

    The residual is caused by the filter alone.
    """
    observer = ImplicitSlidingModeObserver(healthy(), _EXACT, settings)
    return observer.push(motion.time_ns, motion.current, motion.angle, motion.velocity)


@dataclass(frozen=True, slots=True)
class Numbers:
    """One set-up in numbers, in N·m at the throttle shaft.

    They are None where the motion does not go there.

    `reached` is the highest true friction below omega_s, `stiction` the highest estimate there (strategy 1);
    `coulomb_literal` the median estimate beyond 2.15 omega_s (strategy 2), `coulomb` the same less the viscous torque.
    `error` is the RMS error of the estimate at its own instant, `error_unlagged` with the filter's lag taken off.
    """

    true_stiction: float
    reached: float
    stiction: float
    true_coulomb: float
    coulomb_literal: float | None
    coulomb: float | None
    error: float
    error_unlagged: float

    @property
    def underestimated(self) -> float:
        """The share by which the estimate of T_st falls short of T_st."""
        return 1.0 - self.stiction / self.true_stiction

    @property
    def underestimated_by_filter(self) -> float:
        """The share by which it falls short of the friction that was reached at all."""
        return 1.0 - self.stiction / self.reached


def numbers_of(motion: Motion, found: FrictionEstimate) -> Numbers:
    """Return the numbers of a motion and its estimate."""
    throttle, counted = motion.throttle, motion.counted & np.isfinite(found.friction)
    speed = np.abs(motion.velocity)
    slow = counted & (speed < throttle.stribeck_velocity)
    far = counted & (speed > FAR_ABOVE * throttle.stribeck_velocity)
    literal = float(np.median(np.abs(found.friction[far]))) if far.any() else None
    viscous = throttle.viscous * float(np.median(speed[far])) if far.any() else 0.0
    lag = round(float(found.delay_ns[-1]) * 1e-9 / TICK)
    unlagged = found.friction[lag:] - motion.friction[: len(motion.time) - lag]
    return Numbers(
        true_stiction=throttle.stiction,
        reached=float(np.abs(motion.friction[slow]).max()),
        stiction=float(np.abs(found.friction[slow]).max()),
        true_coulomb=throttle.coulomb,
        coulomb_literal=literal,
        coulomb=None if literal is None else literal - viscous,
        error=root_mean_square((found.friction - motion.friction)[counted]),
        error_unlagged=root_mean_square(unlagged[counted[lag:]]),
    )


def root_mean_square(values: Float64) -> float:
    """Return the root of the mean square of values (n)."""
    return float(np.sqrt(np.mean(np.square(values))))
