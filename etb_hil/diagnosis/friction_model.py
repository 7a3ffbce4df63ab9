"""The LuGre friction along a measured motion, compiled.

A fit holds it against the windows.
"""

from __future__ import annotations

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.base.copying import copy_into
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
# the level g after it, way over the one that bends bristles to the full, what of the bend is kept, and what is early.
_MOVED, _OMEGA, _LOCAL, _FROM, _TO, _LEVEL, _RATIO, _KEPT, _EARLY, _EARLY_BY, _FIELDS = range(11)
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
    steps, by = np.empty((_FIELDS, 1 + _BLOCK)), np.zeros((1 + _BLOCK, parameters))
    tick = np.empty(1 + _BLOCK, np.int64)
    bristle_by, age = np.zeros(1 + parameters), np.zeros(2)  # what is carried along, and its derivatives
    torque, here, there = np.zeros(1 + parameters), np.zeros(1 + parameters), np.zeros(1 + parameters)
    steps[_LEVEL, 0] = _level(0.0, local[0], q, exp(-q[LOG_SPEED]), _exponent(q), _least(q), by[0])
    begin, omega = 0, 0.0
    # Block by block, each thing for all steps of a block: what one step does not hand to the next waits for nothing.
    while begin < len(angle) - 1:
        count, begin, omega = _cut(angle, local, begin, omega, steps, tick)
        _fill_levels(steps, count, q, age, by)
        _carry(steps, count, tick, q, by, bristle_by, torque, here, there, out)
        steps[_LEVEL, 0] = steps[_LEVEL, count]
        copy_into(by[0], 0, by[count])
    for p in range(1 + parameters):
        out[p, len(angle) - 1] = here[p]
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
def _fill_levels(steps: Float64, count: int, q: Float64, age: Float64, by: Float64) -> None:
    """Fill in the levels after each step, and their derivatives.

    With them comes what each step keeps of the bristles' bend.
    """
    inverse_speed, exponent, least = exp(-q[LOG_SPEED]), _exponent(q), _least(q)
    for j in range(1, count + 1):
        steps[_LEVEL, j] = _level(steps[_OMEGA, j], steps[_LOCAL, j], q, inverse_speed, exponent, least, by[j])
    if q[AGEING] != 0.0:
        inverse_way, inverse_onset = exp(-q[LOG_RENEWAL]), exp(-q[LOG_ONSET])
        for j in range(1, count + 1):
            time = TICK * (steps[_TO, j] - steps[_FROM, j])
            age[0], age[1] = _aged(age[0], age[1], steps[_MOVED, j], time, inverse_way)
            steps[_LEVEL, j] += _of_age(age[0], age[1], steps[_LOCAL, j], q, inverse_onset, by[j])
    stiffness = exp(q[LOG_STIFFNESS])
    for j in range(1, count + 1):
        ratio = stiffness * abs(steps[_MOVED, j]) / (0.5 * (steps[_LEVEL, j - 1] + steps[_LEVEL, j]))
        kept = exp_neg(ratio)
        early = (1.0 - kept) / ratio if ratio > _SHORT else 1.0 - 0.5 * ratio
        steps[_RATIO, j], steps[_KEPT, j], steps[_EARLY, j] = ratio, kept, early
        # d early = early_by d ratio, d kept = -kept d ratio, d ratio = -ratio d mean / mean, and ratio by log stiffness
        steps[_EARLY_BY, j] = (kept - early) / ratio if ratio > _SHORT else ratio / 3.0 - 0.5


@njit(cache=True, error_model="numpy", forceinline=True)
def _carry(
    steps: Float64,
    count: int,
    tick: Int64,
    q: Float64,
    by: Float64,
    bristle_by: Float64,
    torque: Float64,
    here: Float64,
    there: Float64,
    out: Float64,
) -> None:
    """Carry the bristles along a block, and share the torque out to its ticks.

    `bristle_by` has the bristles' deflection and its derivatives, `torque` (1 + p) those of the torque, `here` and
    `there` what has come together at the tick that is under way and at the next one.

    The level goes evenly from g to h along a step. Were it held at its mean, bristles would follow a level that changes
    with speed half a step late.
    """
    stiffness, damping = exp(q[LOG_STIFFNESS]), exp(q[LOG_DAMPING])
    for j in range(1, count + 1):
        g, h, omega = steps[_LEVEL, j - 1], steps[_LEVEL, j], steps[_OMEGA, j]
        ratio, kept, early, early_by = steps[_RATIO, j], steps[_KEPT, j], steps[_EARLY, j], steps[_EARLY_BY, j]
        side = 1.0 if steps[_MOVED, j] > 0.0 else -1.0
        mean = 0.5 * (g + h)
        first, last = side * g / stiffness, side * h / stiffness
        by_ratio = first * (early_by + kept) - last * early_by - bristle_by[0] * kept
        of_mean = -0.5 * by_ratio * ratio / mean
        of_first, of_last = of_mean + side * (early - kept) / stiffness, of_mean + side * (1.0 - early) / stiffness
        settled = last * (1.0 - early) + first * (early - kept)
        bristle_by[0] = bristle = settled + bristle_by[0] * kept
        drag = stiffness * abs(omega) / h
        rate = omega - drag * bristle
        of_bristle, of_level = stiffness - damping * drag, damping * drag * bristle / h
        share, middle = steps[_TO, j] - steps[_FROM, j], (steps[_FROM, j] + steps[_TO, j]) * 0.5
        for p in range(len(torque)):
            if p == 0:
                after = stiffness * bristle + damping * rate + q[VISCOUS] * omega
            else:
                bent = bristle_by[p] * kept + of_first * by[j - 1, p - 1] + of_last * by[j, p - 1]
                if p == 1 + LOG_STIFFNESS:
                    bent += by_ratio * ratio - settled
                bristle_by[p] = bent
                after = of_bristle * bent + of_level * by[j, p - 1]
                if p == 1 + VISCOUS:
                    after += omega
                elif p == 1 + LOG_STIFFNESS:
                    after += of_bristle * bristle
                elif p == 1 + LOG_DAMPING:
                    after += damping * rate
            # A tick gets the integral of the torque times the falling side of its triangle, the next one that times
            # the rising side; the torque is linear over the step.
            level, tilt = 0.5 * (torque[p] + after), 0.5 * (after - torque[p])
            here[p] += share * ((0.5 - middle + 0.5) * level - share / 6.0 * tilt)
            there[p] += share * (middle * level + share / 6.0 * tilt)
            torque[p] = after
        if j == count or tick[j + 1] != tick[j]:
            for p in range(len(torque)):
                out[p, tick[j]] = here[p]
                here[p], there[p] = there[p], 0.0


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
    by, out = np.zeros(FRICTION_PARAMETERS + LAW_PARAMETERS), np.zeros(len(q))
    way = 1.0 if omega >= 0.0 else -1.0
    _level(omega, 1.0, q, exp(-q[LOG_SPEED]), _exponent(q), -np.inf, by)
    if q[AGEING] != 0.0:
        age = exp(q[LOG_RENEWAL]) / max(abs(omega), _SLOWEST)
        _of_age(age, age, 1.0, q, exp(-q[LOG_ONSET]), by)
    for k in range(FRICTION_PARAMETERS):
        out[k] = way * by[k]
    out[VISCOUS] = omega
    for k in range(LAW_PARAMETERS):
        out[LOG_EXPONENT + k] = way * by[FRICTION_PARAMETERS + k]
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
    omega: float, local: float, q: Float64, inverse_speed: float, exponent: float, least: float, by: Float64
) -> float:
    """Return g(omega) in N·m times a factor, without age, and its derivatives.

    Source: seed paper, eq. 2, with any exponent (Armstrong-Helouvry 1991).
    """
    u = abs(omega) * inverse_speed
    logarithm = log(u) if u > 0.0 and (exponent != 2.0 or len(by) > FRICTION_PARAMETERS) else 0.0
    power = u * u if exponent == 2.0 else (exp(exponent * logarithm) if u > 0.0 else 0.0)
    bell = gauss(u) if exponent == 2.0 else exp_neg(power)
    g = local * (q[COULOMB] + q[DROP] * bell)
    if g < least:
        by[:] = 0.0
        return least
    slope = local * exponent * power * bell * q[DROP]
    by[COULOMB], by[DROP], by[LOG_SPEED] = local, local * bell, slope
    if len(by) > FRICTION_PARAMETERS:
        by[_EXPONENT_BY] = -slope * logarithm
    return g


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
def _of_age(age: float, age_by: float, local: float, q: Float64, inverse_onset: float, by: Float64) -> float:
    """Return what contacts of an age in s add to g in N·m (Dieterich 1979).

    Its derivatives are filled into `by`.
    """
    ratio = age * inverse_onset
    logarithm, slope = log(1.0 + ratio), local * q[AGEING] * inverse_onset / (1.0 + ratio)
    if len(by) > FRICTION_PARAMETERS:
        by[_AGEING_BY], by[_RENEWAL_BY], by[_ONSET_BY] = local * logarithm, slope * age_by, -slope * age
    return local * q[AGEING] * logarithm
