"""The numbers of a friction curve, with intervals, from the fits by all laws.

Only the law's form separates T_c, omega_s and viscosity. Where the run does not bear it out, friction at every speed
bounds T_c and viscosity above.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from etb_hil.diagnosis.assessment import Assessment
from etb_hil.diagnosis.friction_model import COULOMB, DROP, LOG_SPEED, VISCOUS, peak_left, steady_by, steady_level
from etb_hil.diagnosis.half_width import TWO_SIDED_95
from etb_hil.diagnosis.interval import Interval, at_most, mixed
from etb_hil.diagnosis.prior import PRELOAD_CLOSE, PRELOAD_OPEN
from etb_hil.diagnosis.speed_misfit import SpeedMisfit
from etb_hil.diagnosis.stribeck_fit import STICTION, StribeckFit
from etb_hil.plant.exactmath import exp
from etb_hil.plant.parameters import ThrottleParameters
from etb_hil.recording.samples import Float64

_DROP_STANDS_OUT = 3.0  # standard errors
# Share of omega_s that it costs to know the motion at ticks only, for each time that the cube of what the speed changes
# by between them exceeds that of so many rad/s; up to there, draws see it. No noise, so it does not average out
# (decision 0010; `benchmarks/interval_coverage.py`).
_BETWEEN_TICKS, _CHANGE = 0.002, 0.8
_SHARES = np.linspace(0.05, 1.0, 20)  # of the fastest speed, at which friction bounds T_c


def fitted_numbers(
    assessment: Assessment, throttle: ThrottleParameters, misfit: SpeedMisfit | None
) -> dict[str, Interval]:
    """Return T_st, T_c, omega_s, viscosity and return margin with their intervals.

    There are none without a fit. They are in SI units at the throttle shaft, and those of all laws by which friction
    may go, in the proportion of their probabilities. A number that the likeliest law does not have is left out. T_st
    reaches up to what slower motion may hide. T_c is bounded above where the likeliest law does not show it. Where
    friction goes by no law (a `misfit`), T_c and viscosity are the highest bounds of all laws, and there is no omega_s.
    """
    laws, fastest, hardest = assessment.laws, assessment.fastest, assessment.hardest
    if not laws:
        return {}
    numbers = [(law.probability, _numbers(law.fit, throttle, fastest, hardest, misfit)) for law in laws]
    found = {}
    for name in numbers[0][1]:
        parts = [(probability, of[name]) for probability, of in numbers if name in of]
        whole = sum(probability for probability, _ in parts)
        mixture = mixed([(probability / whole, part) for probability, part in parts])
        found[name] = at_most(mixture.high) if parts[0][1].is_bound else mixture
    if misfit is not None:
        found["T_c"] = at_most(max(of["T_c"].high for _, of in numbers))
        found["viscous"] = at_most(max(_all_viscous(law.fit, fastest, misfit) for law in laws))
    hidden = assessment.hidden
    found["T_st"] = replace(found["T_st"], high=found["T_st"].high + hidden)
    found["return_margin"] = replace(found["return_margin"], low=found["return_margin"].low - hidden)
    return found


def _numbers(
    fit: StribeckFit, throttle: ThrottleParameters, fastest: float, hardest: float, misfit: SpeedMisfit | None
) -> dict[str, Interval]:
    """Return the numbers under one law.

    Without a drop from T_st to T_c there is no omega_s, nor without a law that friction goes by.
    """
    q = fit.parameters
    numbers = {
        "T_st": _around(fit.stiction[0], fit.reach(STICTION)),
        "T_c": _coulomb(fit, fastest, throttle, misfit),
        "viscous": _around(float(q[VISCOUS]), fit.reach({VISCOUS: 1.0})),
        "return_margin": _return_margin(fit, throttle),
    }
    if misfit is None and _shows_drop(fit, fastest):
        numbers["omega_s"] = _stribeck_velocity(fit, hardest)
    return numbers


def _stribeck_velocity(fit: StribeckFit, hardest: float) -> Interval:
    share = hardest / _CHANGE
    between = TWO_SIDED_95 * _BETWEEN_TICKS * max(share * share * share - 1.0, 0.0)
    reach = fit.reach({LOG_SPEED: 1.0})
    speed, factor = float(exp(fit.parameters[LOG_SPEED])), float(exp(math.sqrt(reach * reach + between * between)))
    return Interval(speed, speed / factor, speed * factor)


def _shows_drop(fit: StribeckFit, fastest: float) -> bool:
    """Return whether friction was seen to fall from T_st towards T_c.

    Only then can the Stribeck effect be distinguished from viscosity.
    """
    stands_out = float(fit.parameters[DROP]) > _DROP_STANDS_OUT * fit.error({DROP: 1.0})
    return stands_out and fastest * float(exp(-fit.parameters[LOG_SPEED])) >= 1.0


def fitted_curve(fit: StribeckFit, speeds: Float64) -> tuple[Float64, Float64]:
    """Return the friction of steady sliding at speeds (n), and its error (n).

    Speeds are in rad/s; friction and its standard error are in N·m.
    """
    q = fit.parameters
    error = np.array([fit.error_along(steady_by(omega, q)) for omega in speeds.tolist()])
    return np.where(speeds >= 0.0, 1.0, -1.0) * steady_level(speeds, q) + q[VISCOUS] * speeds, error


def _coulomb(fit: StribeckFit, fastest: float, throttle: ThrottleParameters, misfit: SpeedMisfit | None) -> Interval:
    """Return T_c with its interval, wider where the plate never slid fast enough.

    Fast enough means far above omega_s. What the fitted curve has left at the fastest speed was never seen to fall
    away. Where no drop from T_st stands out, the plate was slower than omega_s, friction goes by no law, or T_c might
    as well be nothing, Stribeck effect and viscosity cannot be distinguished: T_c lies below T_st and below friction at
    every speed of the run, and no more is known; not even that where the plate only crept.
    """
    q = fit.parameters
    coulomb, drop = float(q[COULOMB]), float(q[DROP])
    stiction, stiction_error = fit.stiction
    around = _around(coulomb, fit.reach({COULOMB: 1.0}))
    if misfit is None and _shows_drop(fit, fastest) and around.low > 0.0:
        unseen = drop * float(peak_left(fastest, q))
        return Interval(coulomb, around.low - unseen, around.high + unseen)
    value = min(coulomb, stiction)
    bound = min(stiction + TWO_SIDED_95 * stiction_error, float(np.min(_highest(fit, fastest * _SHARES, misfit))))
    if fastest < throttle.stribeck_velocity:
        bound = max(bound, around.high)
    return Interval(value, min(value, 0.0), max(value, bound), is_bound=True)


def _all_viscous(fit: StribeckFit, fastest: float, misfit: SpeedMisfit) -> float:
    """Return the viscosity that takes all of the friction at the fastest speed."""
    return float(_highest(fit, np.array([fastest]), misfit)[0]) / fastest


def _highest(fit: StribeckFit, speeds: Float64, misfit: SpeedMisfit | None) -> Float64:
    """Return up to where friction at speeds (n) reaches, in 95 %.

    Where friction is above the curve, so is what it reaches up to.
    """
    level, error = fitted_curve(fit, speeds)
    reached: Float64 = level + TWO_SIDED_95 * error
    return reached if misfit is None else reached + np.maximum(misfit.at(speeds), 0.0)


def _return_margin(fit: StribeckFit, throttle: ThrottleParameters) -> Interval:
    """Return the weaker spring's preload less T_st.

    Both depend on the motor's constant, so their errors are correlated.
    """
    margins = []
    for index, preload in ((PRELOAD_OPEN, throttle.preload_open), (PRELOAD_CLOSE, throttle.preload_close)):
        value = preload + float(fit.parameters[index]) - fit.stiction[0]
        margins.append(_around(value, fit.reach({index: 1.0, COULOMB: -1.0, DROP: -1.0})))
    return min(margins, key=lambda margin: margin.value)


def _around(value: float, reach: float) -> Interval:
    return Interval(value, value - reach, value + reach)
