"""The LuGre friction along a measured motion, compiled.

A fit holds it against the windows.
"""

from __future__ import annotations

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.diagnosis.ticks import TICK
from etb_hil.diagnosis.windows import bend
from etb_hil.plant.exactmath import exp, exp_neg, gauss, log
from etb_hil.recording.samples import Float64, Int64

# Parameters of the fit. Logarithms keep speeds and stiffnesses positive; the drop may fall below zero, so that a
# throttle without a Stribeck effect is no special case.
COULOMB, DROP, LOG_SPEED, VISCOUS, LOG_STIFFNESS, LOG_DAMPING = range(6)
FRICTION_PARAMETERS = 6

# Parameters of the law, behind those of the bench's model: the exponent of the Stribeck curve; by how many N·m friction
# rises with a unit of the logarithm of the contacts' age; the way in rad that renews them; the age in s from which it
# does.
LOG_EXPONENT, AGEING, LOG_RENEWAL, LOG_ONSET = range(16, 20)
LAW_PARAMETERS = 4
LOG_SQUARE = 0.6931471805599453  # the exponent 2 of the seed paper, eq. 2
_EXPONENT_BY, _AGEING_BY, _RENEWAL_BY, _ONSET_BY = range(FRICTION_PARAMETERS, FRICTION_PARAMETERS + LAW_PARAMETERS)

_STEPS = 4  # of a tick in which the speed changes fast: a straight line makes T_c of a sticky unit 10 % wrong there
_UNSTEADY = 0.1  # rad/s in a tick

_SLOWEST = 1e-9  # rad/s
_SHORT = 1e-4  # of the way that bends bristles to the full: below it, differences of near numbers lose digits
_BLOCK = 256  # steps whose numbers stay in the processor's cache
# Numbers of a step: the way in rad, the speed and the factor on g after it, its begin and end as shares of the tick;
# the level g after it, way over the one that bends bristles to the full, what of the bend is kept, and what is early;
# the end that bristles approach, their deflection after it and its rate; the derivatives of the deflection by the
# level before and after it and by the logarithm of the stiffness, and those of the torque by deflection and level.
_MOVED, _OMEGA, _LOCAL, _FROM, _TO, _LEVEL, _RATIO, _KEPT, _EARLY, _EARLY_BY = range(10)
_SETTLED, _BRISTLE, _RATE, _OF_FIRST, _OF_LAST, _OF_STIFFNESS, _OF_BRISTLE, _OF_LEVEL = range(10, 18)
_FALLING, _RISING, _FIELDS = range(18, 21)
_LEAST = 1e-3  # share of T_c below which g may not fall while the fit looks around


@njit(cache=True, error_model="numpy")
def friction_along(angle: Float64, samples: Float64, local: Float64, q: Float64, out: Float64) -> None:
    """Fill out with the friction torque in N·m about ticks, and its derivatives.

    `out` is (1 + 6, n) or (1 + 10, n). The derivatives are those by the friction's parameters and, in the last four of
    ten rows, by the law's.

    `angle` (n) rad was measured at the ticks; `samples` (n) is how many samples each tick is the mean of: a box of that
    many widens a curve by its variance. `local` (n) is the factor on g where the plate was, 1 without a bump.

    The bristles start relaxed and are carried along the way (seed paper, eq. 2), their derivatives with them. In each
    step their level changes evenly. Each value is the mean under the triangle that reaches to the neighbouring ticks:
    that is what a second difference of angles answers to. Where the speed changes much within a tick, the motion
    between is a cubic in steps of a quarter. Contacts age while they rest and are renewed along the way (Dieterich
    1979, Ruina 1983).
    """
    parameters = len(out) - 1
    steps, tick = np.zeros((_FIELDS, 1 + _BLOCK)), np.empty(1 + _BLOCK, np.int64)
    by, bent = np.zeros((parameters, 1 + _BLOCK)), np.zeros((parameters, 1 + _BLOCK))
    torque, age = np.zeros((1 + parameters, 1 + _BLOCK)), np.zeros(2)
    for p in range(1 + parameters):
        for k in range(len(angle)):
            out[p, k] = 0.0
    steps[_LOCAL, 0] = local[0]
    _fill_levels(steps, 0, 0, q, by)
    begin, omega = 0, 0.0
    # Block by block, each thing for all steps of a block: what one step does not hand to the next waits for nothing.
    while begin < len(angle) - 1:
        count, begin, omega = _cut(angle, local, begin, omega, steps, tick)
        _fill_levels(steps, 1, count, q, by)
        if q[AGEING] != 0.0:
            _add_age(steps, count, q, age, by)
        _fill_ratios(steps, count, q)
        _carry(steps, count, q, by, bent)
        _share_out(steps, count, tick, q, by, bent, torque, out)
        steps[_LEVEL, 0], steps[_BRISTLE, 0] = steps[_LEVEL, count], steps[_BRISTLE, count]
        for p in range(parameters):
            by[p, 0], bent[p, 0] = by[p, count], bent[p, count]
        for p in range(1 + parameters):
            torque[p, 0] = torque[p, count]
    for p in range(1 + parameters):
        bend(out[p], 1.0 / 24.0, -1.0 / 24.0, samples)


@njit(cache=True, error_model="numpy", forceinline=True)
def _cut(
    angle: Float64, local: Float64, begin: int, omega: float, steps: Float64, tick: Int64
) -> tuple[int, int, float]:
    """Cut ticks into the steps of a block.

    Return how many they are, the tick behind them, and the speed there.
    """
    count, k, last = 0, begin, len(angle) - 1
    while k < last and count <= _BLOCK - _STEPS:
        way = angle[k + 1] - angle[k]
        ahead = min(k + 2, last)
        omega_next = (angle[ahead] - angle[k]) / (TICK * (ahead - k))
        parts = _STEPS if abs(omega_next - omega) > _UNSTEADY else 1
        share = 1.0 / parts
        before = 0.0
        for part in range(parts):
            a, b = part * share, (part + 1) * share
            after, omega_after = way, omega_next
            if part < parts - 1:
                after, omega_after = _between(b, way, omega, omega_next)
            count += 1
            tick[count] = k
            steps[_MOVED, count], steps[_OMEGA, count] = after - before, omega_after
            steps[_LOCAL, count] = local[k] + b * (local[k + 1] - local[k])
            steps[_FROM, count], steps[_TO, count] = a, b
            before = after
        omega = omega_next
        k += 1
    return count, k, omega


@njit(cache=True, error_model="numpy", forceinline=True)
def _fill_levels(steps: Float64, first: int, last: int, q: Float64, by: Float64) -> None:
    """Fill in the levels after steps without age, and their derivatives.

    `by` (p, 1 + n) has those by the parameters.
    """
    inverse_speed, exponent, least = exp(-q[LOG_SPEED]), _exponent(q), _least(q)
    is_law = len(by) > FRICTION_PARAMETERS
    if exponent == 2.0 and not is_law:  # as constants: the usual loop takes a fifth of the time
        for j in range(first, last + 1):
            level = _level(steps[_OMEGA, j], steps[_LOCAL, j], q, inverse_speed, 2.0, least, False)
            steps[_LEVEL, j], by[COULOMB, j], by[DROP, j], by[LOG_SPEED, j], _ = level
        return
    for j in range(first, last + 1):
        level = _level(steps[_OMEGA, j], steps[_LOCAL, j], q, inverse_speed, exponent, least, is_law)
        steps[_LEVEL, j], by[COULOMB, j], by[DROP, j], by[LOG_SPEED, j], of_exponent = level
        if is_law:
            by[_EXPONENT_BY, j] = of_exponent


@njit(cache=True, error_model="numpy", forceinline=True)
def _add_age(steps: Float64, count: int, q: Float64, age: Float64, by: Float64) -> None:
    """Add to the levels what the contacts' age makes of them.

    `age` has the age in s and its derivative, which are carried on.
    """
    inverse_way, inverse_onset = exp(-q[LOG_RENEWAL]), exp(-q[LOG_ONSET])
    for j in range(1, count + 1):
        time = TICK * (steps[_TO, j] - steps[_FROM, j])
        age[0], age[1] = _aged(age[0], age[1], steps[_MOVED, j], time, inverse_way)
        more, of_ageing, of_renewal, of_onset = _of_age(age[0], age[1], steps[_LOCAL, j], q, inverse_onset)
        steps[_LEVEL, j] += more
        if len(by) > FRICTION_PARAMETERS:
            by[_AGEING_BY, j], by[_RENEWAL_BY, j], by[_ONSET_BY, j] = of_ageing, of_renewal, of_onset


@njit(cache=True, error_model="numpy", forceinline=True)
def _fill_ratios(steps: Float64, count: int, q: Float64) -> None:
    """Fill in what each step keeps of the bristles' bend."""
    stiffness = exp(q[LOG_STIFFNESS])
    for j in range(1, count + 1):
        ratio = stiffness * abs(steps[_MOVED, j]) / (0.5 * (steps[_LEVEL, j - 1] + steps[_LEVEL, j]))
        kept = exp_neg(ratio)
        early = (1.0 - kept) / ratio if ratio > _SHORT else 1.0 - 0.5 * ratio
        steps[_RATIO, j], steps[_KEPT, j], steps[_EARLY, j] = ratio, kept, early
        # d early = early_by d ratio, d kept = -kept d ratio, d ratio = -ratio d mean / mean, and ratio by log stiffness
        steps[_EARLY_BY, j] = (kept - early) / ratio if ratio > _SHORT else ratio / 3.0 - 0.5


@njit(cache=True, error_model="numpy", forceinline=True)
def _carry(steps: Float64, count: int, q: Float64, by: Float64, bent: Float64) -> None:
    """Carry the bristles' deflection along a block, with its derivatives.

    `bent` (p, 1 + n) has those by the parameters. The level goes evenly from g to h along a step. Were it held at its
    mean, bristles would follow a level that changes with speed half a step late.
    """
    stiffness, damping = exp(q[LOG_STIFFNESS]), exp(q[LOG_DAMPING])
    for j in range(1, count + 1):
        side, kept, early = _side(steps[_MOVED, j]), steps[_KEPT, j], steps[_EARLY, j]
        first, last = side * steps[_LEVEL, j - 1] / stiffness, side * steps[_LEVEL, j] / stiffness
        steps[_SETTLED, j] = last * (1.0 - early) + first * (early - kept)
    for j in range(1, count + 1):
        steps[_BRISTLE, j] = steps[_SETTLED, j] + steps[_BRISTLE, j - 1] * steps[_KEPT, j]
    for j in range(1, count + 1):
        g, h, omega, bristle = steps[_LEVEL, j - 1], steps[_LEVEL, j], steps[_OMEGA, j], steps[_BRISTLE, j]
        ratio, kept, early, early_by = steps[_RATIO, j], steps[_KEPT, j], steps[_EARLY, j], steps[_EARLY_BY, j]
        side, mean = _side(steps[_MOVED, j]), 0.5 * (g + h)
        first, last = side * g / stiffness, side * h / stiffness
        by_ratio = first * (early_by + kept) - last * early_by - steps[_BRISTLE, j - 1] * kept
        of_mean = -0.5 * by_ratio * ratio / mean
        steps[_OF_FIRST, j] = of_mean + side * (early - kept) / stiffness
        steps[_OF_LAST, j] = of_mean + side * (1.0 - early) / stiffness
        steps[_OF_STIFFNESS, j] = by_ratio * ratio - steps[_SETTLED, j]
        drag = stiffness * abs(omega) / h
        steps[_RATE, j] = omega - drag * bristle
        steps[_OF_BRISTLE, j], steps[_OF_LEVEL, j] = stiffness - damping * drag, damping * drag * bristle / h
    for j in range(1, count + 1):
        kept, of_first, of_last = steps[_KEPT, j], steps[_OF_FIRST, j], steps[_OF_LAST, j]
        for p in range(len(bent)):
            bent[p, j] = bent[p, j - 1] * kept + of_first * by[p, j - 1] + of_last * by[p, j]
        bent[LOG_STIFFNESS, j] += steps[_OF_STIFFNESS, j]


@njit(cache=True, error_model="numpy", forceinline=True)
def _share_out(
    steps: Float64, count: int, tick: Int64, q: Float64, by: Float64, bent: Float64, torque: Float64, out: Float64
) -> None:
    """Share the torque after each step out to the ticks, with its derivatives.

    `torque` (1 + p, 1 + n) is filled in. A tick gets the integral of the torque times the falling side of its triangle,
    the next one that times the rising side; the torque is linear over the step.
    """
    stiffness, damping = exp(q[LOG_STIFFNESS]), exp(q[LOG_DAMPING])
    for j in range(1, count + 1):
        torque[0, j] = stiffness * steps[_BRISTLE, j] + damping * steps[_RATE, j] + q[VISCOUS] * steps[_OMEGA, j]
    for p in range(len(by)):
        for j in range(1, count + 1):
            torque[1 + p, j] = steps[_OF_BRISTLE, j] * bent[p, j] + steps[_OF_LEVEL, j] * by[p, j]
    for j in range(1, count + 1):
        torque[1 + VISCOUS, j] += steps[_OMEGA, j]
        torque[1 + LOG_STIFFNESS, j] += steps[_OF_BRISTLE, j] * steps[_BRISTLE, j]
        torque[1 + LOG_DAMPING, j] += damping * steps[_RATE, j]
    for p in range(len(torque)):
        for j in range(1, count + 1):
            share, middle = steps[_TO, j] - steps[_FROM, j], (steps[_FROM, j] + steps[_TO, j]) * 0.5
            level, tilt = 0.5 * (torque[p, j - 1] + torque[p, j]), 0.5 * (torque[p, j] - torque[p, j - 1])
            steps[_FALLING, j] = share * ((0.5 - middle + 0.5) * level - share / 6.0 * tilt)
            steps[_RISING, j] = share * (middle * level + share / 6.0 * tilt)
        for j in range(1, count + 1):
            out[p, tick[j]] += steps[_FALLING, j]
            out[p, tick[j] + 1] += steps[_RISING, j]


@njit(cache=True, error_model="numpy", forceinline=True)
def _side(moved: float) -> float:
    return 1.0 if moved > 0.0 else -1.0


@njit(cache=True, error_model="numpy", forceinline=True)
def _least(q: Float64) -> float:
    return _LEAST * abs(q[COULOMB]) + 1e-6


@njit(cache=True, error_model="numpy", forceinline=True)
def _between(b: float, way: float, omega: float, omega_next: float) -> tuple[float, float]:
    """Return way and velocity at a share of a tick.

    They are those of a cubic through both angles with both speeds (Hermite).
    """
    c = b * b * (3.0 - 2.0 * b)
    after = c * way + TICK * b * (1.0 - b) * ((1.0 - b) * omega - b * omega_next)
    omega_after = (
        6.0 * b * (1.0 - b) * way / TICK + (1.0 - b) * (1.0 - 3.0 * b) * omega + b * (3.0 * b - 2.0) * omega_next
    )
    return after, omega_after


@njit(cache=True, error_model="numpy")
def unsettled(angle: Float64, q: Float64) -> Float64:
    """Return at every tick (n) how far the bristles are from steady sliding.

    The distance is 0 in steady sliding, 1 where they are relaxed, and 2 where they are bent the other way. That is the
    share of sigma_0 by which friction answers an error of the angle (n).
    """
    out = np.empty(len(angle))
    stiffness, inverse_speed, exponent = exp(q[LOG_STIFFNESS]), exp(-q[LOG_SPEED]), _exponent(q)
    least = _least(q)
    bent, share = 0.0, 1.0  # bristles' torque
    for k in range(len(angle)):
        way = angle[k] - angle[max(k - 1, 0)]
        if way != 0.0:
            g = max(q[COULOMB] + q[DROP] * _peak(way / TICK * inverse_speed, exponent), least)
            settled = g if way > 0.0 else -g
            bent = settled + (bent - settled) * exp_neg(stiffness * abs(way) / g)
            share = abs(1.0 - bent / settled)
        out[k] = share
    return out


@njit(cache=True, error_model="numpy")
def steady_level(omega: Float64, q: Float64) -> Float64:
    """Return g (m) in N·m at velocities (m) in rad/s (seed paper, eq. 2)."""
    out = np.empty(len(omega))
    inverse_speed, exponent = exp(-q[LOG_SPEED]), _exponent(q)
    renewed = exp(q[LOG_RENEWAL] - q[LOG_ONSET])  # rad/s at which a way renews the contacts within the onset
    for k in range(len(omega)):
        out[k] = q[COULOMB] + q[DROP] * _peak(omega[k] * inverse_speed, exponent)
        if q[AGEING] != 0.0:
            out[k] += q[AGEING] * log(1.0 + renewed / max(abs(omega[k]), _SLOWEST))
    return out


def grown_at_rest(rest: float, q: Float64) -> float:
    """Return what a rest of so many seconds adds to g in N·m (Dieterich 1979)."""
    return float(q[AGEING] * log(1.0 + rest * exp(-q[LOG_ONSET])))


@njit(cache=True, error_model="numpy")
def steady_by(omega: float, q: Float64) -> Float64:
    """Return the derivatives (20) of the friction of steady sliding.

    They are those at a velocity in rad/s.
    """
    out = np.zeros(len(q))
    way = 1.0 if omega >= 0.0 else -1.0
    _, of_coulomb, of_drop, of_speed, of_exponent = _level(
        omega, 1.0, q, exp(-q[LOG_SPEED]), _exponent(q), -np.inf, True
    )
    out[COULOMB], out[DROP], out[LOG_SPEED], out[VISCOUS] = way * of_coulomb, way * of_drop, way * of_speed, omega
    out[LOG_EXPONENT] = way * of_exponent
    if q[AGEING] != 0.0:
        age = exp(q[LOG_RENEWAL]) / max(abs(omega), _SLOWEST)
        _, of_ageing, of_renewal, of_onset = _of_age(age, age, 1.0, q, exp(-q[LOG_ONSET]))
        out[AGEING], out[LOG_RENEWAL], out[LOG_ONSET] = way * of_ageing, way * of_renewal, way * of_onset
    return out


@njit(cache=True, error_model="numpy")
def peak_left(omega: float, q: Float64) -> float:
    """Return the share of T_st - T_c that is left at a velocity in rad/s."""
    return _peak(omega * exp(-q[LOG_SPEED]), _exponent(q))


@njit(cache=True, error_model="numpy", forceinline=True)
def _exponent(q: Float64) -> float:
    return 2.0 if q[LOG_EXPONENT] == LOG_SQUARE else exp(q[LOG_EXPONENT])


@njit(cache=True, error_model="numpy", forceinline=True)
def _peak(ratio: float, exponent: float) -> float:
    """Return the share of T_st - T_c that is left at a speed.

    That is exp(-|ratio|^exponent), where `ratio` is the speed over omega_s.
    """
    u = abs(ratio)
    if exponent == 2.0:
        return gauss(u)
    return exp_neg(exp(exponent * log(u))) if u > 0.0 else 1.0


@njit(cache=True, error_model="numpy", forceinline=True)
def _level(
    omega: float, local: float, q: Float64, inverse_speed: float, exponent: float, least: float, is_law: bool
) -> tuple[float, float, float, float, float]:
    """Return g(omega) in N·m times a factor, without age, and its derivatives.

    They are those by T_c, by the drop, by the logarithm of the speed and, with `is_law`, by that of the exponent.
    Source: seed paper, eq. 2, with any exponent (Armstrong-Helouvry 1991).
    """
    u = abs(omega) * inverse_speed
    logarithm = log(u) if u > 0.0 and (exponent != 2.0 or is_law) else 0.0
    power = u * u if exponent == 2.0 else (exp(exponent * logarithm) if u > 0.0 else 0.0)
    bell = gauss(u) if exponent == 2.0 else exp_neg(power)
    g = local * (q[COULOMB] + q[DROP] * bell)
    if g < least:
        return least, 0.0, 0.0, 0.0, 0.0
    slope = local * exponent * power * bell * q[DROP]
    return g, local, local * bell, slope, -slope * logarithm


@njit(cache=True, error_model="numpy", forceinline=True)
def _aged(age: float, age_by: float, moved: float, time: float, inverse_way: float) -> tuple[float, float]:
    """Return the age in s of contacts after a way at a steady speed.

    The second result is its derivative by LOG_RENEWAL.

    d age / dt = 1 - age |omega| / way: Dieterich's law of ageing (Ruina 1983).
    """
    renewals = abs(moved) * inverse_way
    if renewals < 1e-6:
        return age + time, age_by + age * renewals
    settled, kept = time / renewals, exp_neg(renewals)
    # d settled = settled and d kept = kept renewals, both by the logarithm of the way
    by = settled * (1.0 - kept) + age_by * kept + (age - settled) * kept * renewals
    return settled + (age - settled) * kept, by


@njit(cache=True, error_model="numpy", forceinline=True)
def _of_age(
    age: float, age_by: float, local: float, q: Float64, inverse_onset: float
) -> tuple[float, float, float, float]:
    """Return what contacts of an age in s add to g in N·m (Dieterich 1979).

    The others are its derivatives by the growth and by the logarithms of renewal and onset.
    """
    ratio = age * inverse_onset
    logarithm, slope = log(1.0 + ratio), local * q[AGEING] * inverse_onset / (1.0 + ratio)
    return local * q[AGEING] * logarithm, local * logarithm, slope * age_by, -slope * age
