"""Contradictions between the data and the bench's model.

Where there is one, the model, the sensors or the unit are not what they are taken for.

What the fit rests on withholds the verdict: the motor's constants and where springs and stops stand. What it measures
along (springs' torques, inertia, viscosity) is said and no more.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from etb_hil.diagnosis.assessment import Assessment
from etb_hil.diagnosis.friction_model import AGEING, LOG_EXPONENT, LOG_SQUARE, VISCOUS
from etb_hil.diagnosis.half_width import TWO_SIDED_95, half_width
from etb_hil.diagnosis.hot_motor import HotMotor, hot_motor
from etb_hil.diagnosis.interval import Interval, at_most
from etb_hil.diagnosis.local_friction import LocalFriction
from etb_hil.diagnosis.prior import CONSTANT, INERTIA, PRELOAD_CLOSE, PRELOAD_OPEN, SLOPE_CLOSE, SLOPE_OPEN
from etb_hil.diagnosis.result import Reason
from etb_hil.diagnosis.stribeck_fit import StribeckFit
from etb_hil.diagnosis.ticks import Ticks
from etb_hil.diagnosis.voltage_balance import VoltageBalance
from etb_hil.plant.exactmath import exp
from etb_hil.plant.parameters import Model, ThrottleParameters

GAIN = 0.02  # share by which the current sensor's gain may be off: what a bench has to keep (decision 0010)

_SURE = 4.0  # standard errors: a normal error exceeds them once in 16 000 runs
_WINDING = 0.04  # share of R_a: the winding may be 10 K from the housing, and copper has 0.39 %/K
_MAGNET = 0.01  # share of K_e: the magnets may be 5 K from the housing, and have 0.2 %/K
_ELSEWHERE = 0.05  # N·m, even in the direction: a seventh of what a spring's or a stop's wrong side makes
_FEWEST_A_WAY = 30  # windows: a slow sweep has hundreds
_ENOUGH = 2.0  # A, root of the mean square, to measure a resistance at rest: a zero of 0.02 A is then 1 %


@dataclass(frozen=True, slots=True)
class Widening:
    """By what intervals are wider than the fit has them: what no noise shows.

    `gain`: the factors between which the current's gain lies; `way`: by which shares friction may lie below and above
    the curve, along an uneven way and a drift;
    `is_confounded`, whether something else passes for what goes with speed, and no T_c but a bound above comes out;
    `is_bent`, whether that is friction that changed with time, so that not even what was fast and late bounds T_c.
    """

    gain: tuple[float, float] = (1.0, 1.0)
    way: tuple[float, float] = (0.0, 0.0)
    is_confounded: bool = False
    is_bent: bool = False

    def of_stiction(self, interval: Interval) -> Interval:
        """Return the interval of T_st as wide as an uneven way makes it."""
        low = min(interval.low, interval.low * (1.0 - self.way[0]))
        return Interval(interval.value, low, interval.high * (1.0 + self.way[1]))

    def of_coulomb(self, interval: Interval, stiction: Interval) -> Interval:
        """Return the interval of T_c, widened for an uneven way.

        `stiction` is the interval of T_st, which bounds that of T_c where friction changed with time. T_c is seen where
        the plate is fast, which may be at the highest places; the unit's may be that of the lowest.
        """
        low = max(interval.low, 0.0) * max(1.0 - self.way[0] - self.way[1], 0.0)
        value = max(interval.value, 0.0)  # what hardly bounds T_c may have fitted less than none
        high = max(interval.high, stiction.high if self.is_bent else 0.0)
        high = max(high * (1.0 + self.way[1]), value)
        return at_most(high) if self.is_confounded or interval.is_bound else Interval(value, low, high)

    def of_curve(self, interval: Interval, settled: float) -> Interval:
        """Return the interval of sliding friction, widened for gain and an uneven way.

        Friction has fallen from T_st by the share `settled` of the drop.
        """
        below, above = self.way[0] + settled * self.way[1], self.way[1]
        low = min(interval.low, interval.low * max(1.0 - below, 0.0))
        least, most = widened(interval.value, low, interval.high * (1.0 + above), self.gain)
        return Interval(interval.value, least, most)

    def of_margin(self, interval: Interval, stiction: float) -> Interval:
        """Return the interval of a spring's margin over T_st, widened for an uneven way.

        `stiction` is T_st in N·m.
        """
        below, above = self.way
        return Interval(interval.value, interval.low - above * stiction, interval.high + below * stiction)


def withholding(
    assessment: Assessment,
    local: LocalFriction | None,
    model: Model,
    throttle: ThrottleParameters,
    hot: HotMotor | None,
) -> list[Reason]:
    """Return why this model and these motions tell nothing of friction.

    The gravest reason comes first. `local` is of windows in which no bristles bend. A motor that is `hot`, and the
    model's for all that, contradicts nothing.
    """
    found = []
    if assessment.balance is not None and hot is None:
        found += _motor(assessment.balance, model, throttle)
    if text := _pushed(local):
        found.append(Reason("spring_elsewhere", f"{text}: limp-home or a stop stands elsewhere"))
    return [*found, *_one_way(assessment)]


def pushed_at_turn(local: LocalFriction | None) -> Reason | None:
    """Return a doubt about a push that is seen by windows in which bristles may bend.

    Alone these do not distinguish a stop that the plate turns back at from friction that is higher there.
    """
    text = _pushed(local)
    return Reason("pushed_at_turn", f"{text}: a stop stands elsewhere, or friction is higher there") if text else None


def _pushed(local: LocalFriction | None) -> str:
    """Return where the plate is certainly pushed beyond springs, empty if nowhere."""
    if local is None or not len(local.angle):
        return ""
    worst = int(np.argmax(np.abs(local.even) - _SURE * local.error))
    if abs(local.even[worst]) - _SURE * local.error[worst] <= _ELSEWHERE:
        return ""
    return (
        f"at {math.degrees(local.angle[worst]):.1f} deg the plate is pushed by {local.even[worst]:+.3f} N·m in both "
        "directions of motion, more than the model's springs"
    )


def _one_way(assessment: Assessment) -> list[Reason]:
    """Return a reason where the plate slid one way only.

    Nothing but its sign distinguishes friction from springs.
    """
    opening, closing = assessment.ways
    if assessment.fit is None or min(opening, closing) >= _FEWEST_A_WAY:
        return []
    text = (
        f"{opening} segments of at least 17 ms opened the plate and {closing} closed it: both are needed to measure "
        "friction"
    )
    return [Reason("one_way", text)]


def heated(
    balance: VoltageBalance | None, model: Model, throttle: ThrottleParameters, temperature: float
) -> HotMotor | None:
    """Return a hot motor where that explains why the motor is not the model's.

    A hot motor is warmer than its housing. None where the motor fits the model, or heat does not explain it.
    """
    if balance is None or not _motor(balance, model, throttle):
        return None
    allowed = (_allowed(model, throttle, "resistance"), _allowed(model, throttle, "back_emf"))
    return hot_motor(
        balance, model, throttle, temperature, (allowed[0] / throttle.resistance, allowed[1] / throttle.back_emf)
    )


def _allowed(model: Model, throttle: ThrottleParameters, name: str) -> float:
    """Return by how much a parameter of the motor may differ from the model's.

    `name` is that of R_a, in ohm, or of K_e G_r, in V·s/rad.
    """
    warmer = _WINDING if name == "resistance" else _MAGNET
    return model.tolerance(name) + warmer * float(getattr(throttle, name))


def _motor(balance: VoltageBalance, model: Model, throttle: ThrottleParameters) -> list[Reason]:
    found = []
    if not resistance_fits(balance.resistance, balance.resistance_error, model, throttle):
        text = (
            f"R_a measures {balance.resistance:.3f} ohm; the model says {throttle.resistance:.3f}, "
            f"{_allowed(model, throttle, 'resistance'):.3f} off at most: the current channel or the model's resistance "
            "is wrong"
        )
        found.append(Reason("resistance_contradicts", text))
    allowed = _allowed(model, throttle, "back_emf")
    if abs(balance.back_emf - throttle.back_emf) > allowed + _SURE * balance.back_emf_error:
        text = (
            f"K_e G_r measures {balance.back_emf:.4f} V·s/rad; the model says {throttle.back_emf:.4f}, {allowed:.4f} "
            "off at most: the model is another motor's, or the scale of angle or voltage is wrong"
        )
        found.append(Reason("back_emf_contradicts", text))
    return found


def resistance_fits(value: float, error: float, model: Model, throttle: ThrottleParameters) -> bool:
    """Return whether a measured R_a, in ohm, can be the model's."""
    return abs(value - throttle.resistance) <= _allowed(model, throttle, "resistance") + _SURE * error


def resistance_at_rest(ticks: Ticks) -> float | None:
    """Return R_a in ohm of a plate at rest, from all ticks with a voltage.

    The result is None where too little current flowed.
    """
    known = np.isfinite(ticks.voltage)
    current, voltage = ticks.current[known], ticks.voltage[known]
    square = product = 0.0
    for i, u in zip(current.tolist(), voltage.tolist(), strict=True):
        square += i * i
        product += i * u
    if not len(current) or square < _ENOUGH * _ENOUGH * len(current):
        return None
    return product / square


def remarks(
    fit: StribeckFit, balance: VoltageBalance | None, model: Model, throttle: ThrottleParameters
) -> list[Reason]:
    """Return which of the model's parameters were found beyond their tolerance.

    Friction is fitted jointly with them.
    """
    listed = (
        (PRELOAD_OPEN, "preload_open", throttle.preload_open, "N·m", 0.0, 1.0),
        (PRELOAD_CLOSE, "preload_close", throttle.preload_close, "N·m", 0.0, 1.0),
        (SLOPE_OPEN, "slope_open", throttle.slope_open, "N·m/rad", 0.0, 1.0),
        (SLOPE_CLOSE, "slope_close", throttle.slope_close, "N·m/rad", 0.0, 1.0),
        (INERTIA, "inertia", throttle.inertia, "kg·m²", 0.0, throttle.inertia),
        (VISCOUS, "viscous", throttle.viscous, "N·m·s/rad", throttle.viscous, 1.0),
    )
    words = []
    for index, name, nominal, unit, zero, scale in listed:
        off, error = (float(fit.parameters[index]) - zero) * scale, fit.error({index: 1.0}) * scale
        if _is_beyond(off, error, name, model):
            words.append(f"{name} is {nominal + off:.3g} {unit} (model {nominal:.3g})")
    apart = 0.0 if _tells_constant(balance, model, throttle) else _motor_and_springs(fit, model, throttle)
    if apart != 0.0:
        unknown = "a voltage would tell" if balance is None else "the voltage does not tell the motor's constant"
        words.append(
            f"both springs are {apart:+.1%} off what the current says of the motor's torque: the gain of the current, "
            f"the motor's constant, or both springs ({unknown})"
        )
    if not words:
        return []
    return [Reason("model_contradicted", "beyond the model's tolerance: " + "; ".join(words))]


def law_remarks(fit: StribeckFit) -> list[Reason]:
    """Return by which law friction is likeliest to go, where that is not the paper's."""
    q, words = fit.parameters, []
    exponent, paper_s = (f"{float(exp(one)):.2g}" for one in (q[LOG_EXPONENT], LOG_SQUARE))
    if exponent != paper_s:
        words.append(
            f"it falls from T_st to T_c as exp(-(speed/omega_s)^{exponent}), where the model has the exponent {paper_s}"
        )
    if q[AGEING] > 0.0:
        share = float(q[AGEING]) / fit.stiction[0]
        words.append(f"it grows with the time at rest by {share:.1%} of T_st for e times the time")
    if not words:
        return []
    text = f"friction does not go by the model's law: {'; '.join(words)}. T_st, T_c and viscosity are fitted with that"
    return [Reason("another_friction_law", text)]


def gain_range(
    fit: StribeckFit,
    balance: VoltageBalance | None,
    model: Model,
    throttle: ThrottleParameters,
    hot: HotMotor | None = None,
) -> tuple[float, float]:
    """Return between which factors the gain of the current may lie, beside `GAIN`.

    Both springs too strong, or both too weak, may as well be the current's gain. The resistance bounds it: a gain that
    is too high makes R_a too low. Where no voltage tells the motor's constant, motor and springs have nothing but each
    other to be held against: the fit parts what they differ by, and all of it may be one's, or the other's. Where one
    tells it, springs beyond their tolerance may have pulled it off that.
    """
    is_told = _tells_constant(balance, model, throttle)
    apart = 0.0 if is_told else _motor_and_springs(fit, model, throttle)
    shares = []
    for index, name in ((PRELOAD_OPEN, "preload_open"), (PRELOAD_CLOSE, "preload_close")):
        off = float(fit.parameters[index])
        sure = apart != 0.0 or _is_beyond(off, fit.error({index: 1.0}), name, model)
        known = getattr(throttle, name)
        own = model.tolerance(name) / known  # the spring's own error may hide as much of the gain's
        shares.append(off / known + (own if off > 0.0 else -own) if sure else 0.0)
    low, high = min(1.0, 1.0 + max(shares)), max(1.0, 1.0 + min(shares))
    if balance is not None and apart == 0.0 and balance.resistance > 0.0:
        resistance = (throttle if hot is None else hot.of(throttle)).resistance
        share = model.tolerance("resistance") / resistance + _WINDING
        middle = resistance / balance.resistance
        low, high = max(low, min(1.0, middle * (1.0 - share))), min(high, max(1.0, middle * (1.0 + share)))
    constant = 1.0 + float(fit.parameters[CONSTANT])
    if balance is not None and is_told:
        constant /= 1.0 + balance.torque_constant_shift(throttle)[0]
        low, high = min(low, constant), max(high, constant)
    elif apart != 0.0:
        own = _tolerated_constant(model, throttle)
        low, high = min(low, constant * (1.0 - own)), max(high, constant * (1.0 + own))
    return max(low, 0.05), high


def _tells_constant(balance: VoltageBalance | None, model: Model, throttle: ThrottleParameters) -> bool:
    """Tell whether a voltage tells the motor's constant better than its tolerance.

    A voltage that brushes or a bridge take away hides much of the back-EMF.
    """
    if balance is None:
        return False
    tolerated = _tolerated_constant(model, throttle) * throttle.back_emf
    return tolerated == 0.0 or _SURE * balance.back_emf_error <= tolerated


def _tolerated_constant(model: Model, throttle: ThrottleParameters) -> float:
    """Return the tolerance of the motor's constant as a share of it."""
    return model.tolerance("torque_per_ampere") / throttle.torque_per_ampere


def _motor_and_springs(fit: StribeckFit, model: Model, throttle: ThrottleParameters) -> float:
    """Return by what share both springs are stronger than the motor's torque says.

    The share is zero where the tolerances of the motor and both springs may explain the difference. The fit parts such
    a difference between them by their tolerances: alone none of them need stand out.
    """
    apart = []
    for index, name in ((PRELOAD_OPEN, "preload_open"), (PRELOAD_CLOSE, "preload_close")):
        known = getattr(throttle, name)
        share = float(fit.parameters[index]) / known - float(fit.parameters[CONSTANT])
        allowed = model.tolerance(name) / known + _tolerated_constant(model, throttle)
        is_sure = abs(share) > allowed + _SURE * fit.error({index: 1.0 / known, CONSTANT: -1.0})
        apart.append(share if is_sure else 0.0)
    return min(apart, key=abs) if apart[0] * apart[1] > 0.0 else 0.0


def against_each_other(fit: StribeckFit, model: Model) -> float:
    """Return by how many N·m friction may differ from its mean by direction.

    Above zero it is higher in opening. Springs that are off against each other and friction that differs by direction
    are one torque. It is zero where both springs are inside their tolerances.
    """
    opening, closing = float(fit.parameters[PRELOAD_OPEN]), -float(fit.parameters[PRELOAD_CLOSE])
    own_open, own_close = model.tolerance("preload_open"), model.tolerance("preload_close")
    is_beyond = _is_beyond(opening, fit.error({PRELOAD_OPEN: 1.0}), "preload_open", model) or _is_beyond(
        closing, fit.error({PRELOAD_CLOSE: 1.0}), "preload_close", model
    )
    if not is_beyond or opening * closing <= 0.0:
        return 0.0
    return math.copysign(min(abs(opening) + own_open, abs(closing) + own_close), opening)


def _is_beyond(off: float, error: float, name: str, model: Model) -> bool:
    """Tell whether a parameter is certain to leave its tolerance.

    The parameter is off by `off`, with the standard error `error`.
    """
    return abs(off) > model.tolerance(name) + _SURE * error


def widened(value: float, low: float, high: float, gain: tuple[float, float]) -> tuple[float, float]:
    """Return the 95 % interval of a torque, widened for the current's gain.

    The gain lies between two factors. Even a gain within `GAIN` widens the interval.
    """
    even = GAIN * abs(value)
    low = value - half_width((value - low) / TWO_SIDED_95, even)
    high = value + half_width((high - value) / TWO_SIDED_95, even)
    return min(low, low / gain[0], low / gain[1]), max(high, high / gain[0], high / gain[1])
