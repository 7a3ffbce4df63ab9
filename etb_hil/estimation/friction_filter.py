"""An extended Kalman filter of motion along LuGre friction, compiled.

The filter adapts its own parameters.

State and parameters are those of `motion`, the current is the input and the plate angle the measurement. The torque
constant is the unit that friction is measured in: whoever scales motor, springs, inertia and friction equally sees the
same motion. So it is known as well as springs and inertia are. All of them take a share of each correction, since
friction of another law biases them.

What the equations lack is process noise: a disturbance torque (Ornstein-Uhlenbeck), a friction level that wanders along
the way, and bristles that differ from LuGre's while they bend. All three grow while the mean innovation is larger than
white innovations make it, the last one for longer: a law of presliding that is not LuGre's stays so.
"""

from __future__ import annotations

import math
from typing import Any

from etb_hil.base.compiled import njit
from etb_hil.estimation.kept import keep, keep_in_both, restore
from etb_hil.estimation.motion import (
    ADAPTED,
    AT_INERTIA,
    AT_PRELOAD_OPEN,
    AT_STIFFNESS,
    AT_STRIBECK,
    AT_VISCOUS,
    BENT_MOST,
    BRISTLE,
    DISTURBANCE,
    LEVEL,
    MOVING,
    OMEGA,
    STATES,
    THETA,
    advance,
    spring,
)
from etb_hil.estimation.rounding import rounding_variance
from etb_hil.plant.exactmath import gauss
from etb_hil.plant.physics import (
    BRISTLE_DAMPING,
    BRISTLE_STIFFNESS,
    COULOMB,
    DEAD_ZONE,
    LIMP_HOME,
    STICTION,
    STOP_HIGH,
    STOP_LOW,
    STRIBECK_VELOCITY,
    TORQUE_PER_AMPERE,
    VISCOUS,
    Vector,
)
from etb_hil.recording.samples import Float64, Int64

LONGEST_GAP_NS = 20_000_000  # longer gaps start the motion afresh: friction may have reversed unseen
_LONGEST_STEP = 0.5e-3  # s; coarser steps show a false error of the current

# What the model file says of sensors and tolerances
ANGLE_NOISE = 0  # variance of the angle's white noise, rad^2
ANGLE_STEP = 1  # rad
LASTING = 2  # share of the rounding error that lasts as long as an edge: 0 where noise dithers it
CURRENT_NOISE = 3  # variance, A^2
CONSTANT = 4  # variance of the torque constant's share
LIMP_TOLERANCE = 5  # rad
STOP_TOLERANCE = 6  # rad
NOMINAL = 7  # T_st of the model, N·m
STRONGEST = 8  # A: a larger reading is none
SETTINGS = 9

# What is carried beside state and covariance
CURRENT, RUNNING, MEAN_INNOVATION, OF_MEAN, EXCESS, MISFIT, SETTLED, QUIET_S, SINCE_COPY, FAULT_S, IS_FAULTY = range(11)
CARRIED = 11

# Process noise, shares of friction; benchmarks/observer_table.py shows what they give.
_RELAXES = 2.0  # 1/s, disturbance torque
_WANDERS = 3e-5  # 1/s, disturbance torque, of T_st squared
_UNEVEN = 3e-5  # 1/rad, friction level
_DRIFTS = 1e-5  # 1/s, friction level and shape
_BENDS = 6e-4  # bristle torque over the way of presliding, of T_c squared
_SECOND_ORDER = 3.0  # times the square of a parameter's variance; with 0.3 an unseen throttle has twice the error
_STEADY = 0.3  # share of it that stays when the bristles are bent
_MOST_LEARNT, _MOST = 0.03, 0.3
_FORGETS = 1.0  # 1/s, of what was learnt of the bristles
# What is learnt of bristles that are not LuGre's, a share of T_c squared (of LuGre's it is below 0.001); how many times
# the stated variance of the constant counts then at most
_ANOTHER_LAW, _MORE_THAN_STATED = 0.002, 2.0
# Growth of the three, and what is learnt of the last, for each unit of excess
_MORE_TORQUE, _MORE_UNEVEN, _MORE_BENDING, _LEARNS = 1.0, 5000.0, 100.0, 0.05
_MEAN_OVER = 0.01  # s, mean innovation
_WHITE = 9.0  # its square in its own variances: 0.3 % of white innovations exceed that
_CURVE = 0.05  # share of the current's change over a sample by which its mean may be off
_LIMP_S = 3e-3  # s, longest that one error of the springs at limp-home lasts
# Excess that no friction explains (a bump of 25 % makes up to 56); 1/s, growth of the disturbance torque meanwhile
_FOREIGN, _FOREIGN_WANDERS = 60.0, 10.0
_KEEPS_S = 0.05  # s between copies of the parameters; innovations show a wrong current within 5 to 20 ms
_FAULT_S = 0.5  # s, longest that innovations count as those of a fault, and as long without them ends it
_ABSORBED = 0.1  # of T_st: a larger disturbance torque is a wrong reading that the filter has taken for one
# Share of a correction that motor, springs and inertia take (partial update; Brink 2017): with 1 single models are off
# by 10 % of T_c, with 0.1 constants that are off by 10 % cost twice as much
_CAREFUL = 0.5
_OUTLIER, _LOST = 5.0, 8.0  # innovations in standard deviations: weighted down, and opening the covariance
_FASTEST_UNSEEN = 10.0  # rad/s, standard deviation of a velocity that nobody measured
_SURE, _SETTLES_S = 0.05, 0.05  # share of T_st, below which a standard deviation ends the settling; s, its longest


@njit(cache=True, error_model="numpy")
def restart(x: Vector, cov: Float64, s: Vector, angle: float, current: float, settings: Vector) -> None:
    """Start the motion at a measured angle in rad.

    Velocity and friction are unknown; parameters stay as they are.
    """
    for k in range(LEVEL):
        x[k] = 0.0
        for m in range(len(cov)):
            cov[k, m] = cov[m, k] = 0.0
    x[THETA] = angle
    cov[THETA, THETA] = settings[ANGLE_NOISE] + settings[ANGLE_STEP] ** 2 / 12.0
    cov[OMEGA, OMEGA] = _FASTEST_UNSEEN**2
    cov[BRISTLE, BRISTLE] = settings[NOMINAL] ** 2
    cov[DISTURBANCE, DISTURBANCE] = _WANDERS * settings[NOMINAL] ** 2 / (2.0 * _RELAXES)
    s[CURRENT], s[RUNNING], s[MEAN_INNOVATION], s[OF_MEAN], s[EXCESS] = current, 1.0, 0.0, 0.0, 0.0
    s[SETTLED], s[QUIET_S], s[SINCE_COPY], s[FAULT_S], s[IS_FAULTY] = 0.0, 0.0, 0.0, 0.0, 0.0


@njit(cache=True, error_model="numpy", forceinline=True)
def _multiplied(cov: Float64, r: Vector, f: Vector, n: int, v: Vector, w: Vector) -> None:
    """Fill in v = P r and w = P f."""
    for k in range(n):
        v[k] = w[k] = 0.0
    for m in range(n):
        rm, fm = r[m], f[m]
        if rm != 0.0:
            for k in range(n):
                v[k] += rm * cov[m, k]
        if fm != 0.0:
            for k in range(n):
                w[k] += fm * cov[m, k]


@njit(cache=True, error_model="numpy", forceinline=True)
def _predict(
    x: Vector,
    cov: Float64,
    p: Vector,
    current: float,
    noise: tuple[float, float, float, float],
    h: float,
    n: int,
    work: Float64,
) -> None:
    """Carry state and covariance over h s.

    `noise`: variance of the mean torque, (N·m)^2; growth of the disturbance's variance, (N·m)^2/s; of the level's,
    1/rad; of the bristles', a share of T_c squared.
    """
    torque, wanders, uneven, bends = noise
    r, f, v, w = work[0], work[1], work[2], work[3]
    before = x[THETA]
    along = x[BRISTLE] if x[OMEGA] > 0.0 else -x[BRISTLE]
    straight = min(_STEADY + max(1.0 - along / p[COULOMB], 0.0), 1.0)
    end_by_way = advance(x, p, 0.0, p[TORQUE_PER_AMPERE] * current, 0.0, h, n, r, f)
    way = abs(x[THETA] - before)
    keeps = 1.0 - _RELAXES * h
    x[DISTURBANCE] *= keeps
    _multiplied(cov, r, f, n, v, w)
    rr, rf, ff = r[DISTURBANCE] * r[DISTURBANCE] * torque, 0.0, 0.0
    for k in range(n):
        rr += r[k] * v[k]
        rf += f[k] * v[k]
        ff += f[k] * w[k]
    b = 2.0 / h
    p00, p01, p11 = cov[THETA, THETA], cov[THETA, OMEGA], cov[OMEGA, OMEGA]
    for k in range(DISTURBANCE, n):
        scale = keeps if k == DISTURBANCE else 1.0
        cov[THETA, k] = cov[k, THETA] = scale * (cov[THETA, k] + v[k])
        cov[OMEGA, k] = cov[k, OMEGA] = scale * (b * v[k] - cov[OMEGA, k])
        cov[BRISTLE, k] = cov[k, BRISTLE] = scale * (end_by_way * v[k] + w[k])
    for k in range(LEVEL, n):
        cov[DISTURBANCE, k] = cov[k, DISTURBANCE] = keeps * cov[DISTURBANCE, k]
    cov[DISTURBANCE, DISTURBANCE] = keeps * keeps * cov[DISTURBANCE, DISTURBANCE] + wanders * h
    cov[THETA, THETA] = p00 + 2.0 * v[THETA] + rr
    cov[THETA, OMEGA] = cov[OMEGA, THETA] = b * (v[THETA] + rr) - p01 - v[OMEGA]
    cov[THETA, BRISTLE] = cov[BRISTLE, THETA] = end_by_way * (v[THETA] + rr) + w[THETA] + rf
    cov[OMEGA, OMEGA] = b * (b * rr - 2.0 * v[OMEGA]) + p11
    cov[OMEGA, BRISTLE] = cov[BRISTLE, OMEGA] = b * (end_by_way * rr + rf) - end_by_way * v[OMEGA] - w[OMEGA]
    # The second order that the linearisation lacks counts as noise, too. Without it the first reversals, whose
    # stiffness and level are hardly known, are believed too much.
    unknown = bends + _SECOND_ORDER * cov[LEVEL, LEVEL] * cov[LEVEL, LEVEL]
    if n > MOVING:
        unknown += _SECOND_ORDER * cov[AT_STIFFNESS, AT_STIFFNESS] ** 2
        for k in range(MOVING, AT_STRIBECK + 1):
            cov[k, k] += _DRIFTS * h
    unknown *= p[COULOMB] ** 2 * straight * min(way * p[BRISTLE_STIFFNESS] / p[COULOMB], 1.0)
    cov[BRISTLE, BRISTLE] = end_by_way * (end_by_way * rr + 2.0 * rf) + ff + unknown
    cov[LEVEL, LEVEL] += uneven * way + _DRIFTS * h


@njit(cache=True, error_model="numpy", forceinline=True)
def _noise(
    x: Vector, p: Vector, s: Vector, change: float, dt: float, h: float, settings: Vector
) -> tuple[float, float, float, float]:
    """Return the process noise of a sample, as `_predict` takes it.

    `change` is that of the current in A.
    """
    nominal = settings[NOMINAL] ** 2
    wanders, uneven, bends = _WANDERS * nominal, _UNEVEN, _BENDS
    excess = s[EXCESS]
    if s[IS_FAULTY] > 0.0 or excess > _FOREIGN:
        wanders = _FOREIGN_WANDERS * nominal
    elif excess > 0.0:
        wanders *= 1.0 + _MORE_TORQUE * excess
        uneven *= 1.0 + _MORE_UNEVEN * excess
        bends *= 1.0 + _MORE_BENDING * excess
        s[MISFIT] = min(s[MISFIT] + _LEARNS * excess * dt, _MOST_LEARNT)
    s[MISFIT] *= 1.0 - _FORGETS * dt
    bends = min(bends + s[MISFIT], _MOST)
    current = settings[CURRENT_NOISE] + (_CURVE * change) ** 2 * dt / h
    torque = p[TORQUE_PER_AMPERE] ** 2 * current
    theta, unsure = x[THETA], settings[LIMP_TOLERANCE]
    if abs(theta - p[LIMP_HOME]) < unsure + p[DEAD_ZONE] + abs(x[OMEGA]) * dt:
        high, _, _ = spring(theta + unsure, p)
        low, _, _ = spring(theta - unsure, p)
        steps = min(2.0 * unsure / (abs(x[OMEGA]) * h + 1e-12), _LIMP_S / h + 1.0)
        torque += 0.25 * (high - low) ** 2 * max(steps, 1.0)
    if theta > p[STOP_HIGH] - settings[STOP_TOLERANCE] or theta < p[STOP_LOW] + settings[STOP_TOLERANCE]:
        wanders += 1e3 * nominal  # the stop's torque passes for a disturbance within milliseconds
    return torque, wanders, uneven, bends


@njit(cache=True, error_model="numpy", forceinline=True)
def _correct(
    x: Vector, cov: Float64, p: Vector, s: Vector, error: float, dt: float, n: int, settings: Vector, v: Vector
) -> None:
    """Take the innovation of an angle in rad into state, parameters and covariance."""
    variance = settings[ANGLE_NOISE] + rounding_variance(settings[ANGLE_STEP], settings[LASTING], x[OMEGA], dt)
    total = cov[THETA, THETA] + variance
    size = abs(error) / math.sqrt(total)
    whitened = min(size, _OUTLIER) * (1.0 if error > 0.0 else -1.0)
    share = dt / (_MEAN_OVER + dt)
    s[MEAN_INNOVATION] += share * (whitened - s[MEAN_INNOVATION])
    s[OF_MEAN] = (1.0 - share) ** 2 * s[OF_MEAN] + share * share  # its variance, of white innovations
    s[EXCESS] = s[MEAN_INNOVATION] ** 2 / s[OF_MEAN] - _WHITE  # its square beyond that of white ones
    if size > _LOST:
        cov[THETA, THETA] += error * error
        cov[OMEGA, OMEGA] += min((error / dt) ** 2, _FASTEST_UNSEEN**2)
        cov[BRISTLE, BRISTLE] += settings[NOMINAL] ** 2
        cov[DISTURBANCE, DISTURBANCE] += settings[NOMINAL] ** 2
        total = cov[THETA, THETA] + variance
    per = (_OUTLIER / size if size > _OUTLIER else 1.0) / total
    for m in range(n):
        v[m] = cov[m, THETA]
    # What is no friction moves state and disturbance alone: the parameters are considered, not adapted.
    adapted = n if size < _OUTLIER and s[EXCESS] < _FOREIGN and s[IS_FAULTY] == 0.0 else LEVEL
    for m in range(n):
        gain = v[m] * per
        for k in range(n if m < adapted else adapted):
            cov[m, k] -= gain * v[k]
        if m >= AT_INERTIA and adapted == n:
            cov[m, m] += gain * v[m] * (1.0 - _CAREFUL) ** 2
            gain *= _CAREFUL
        if m >= adapted:
            continue
        if m < LEVEL:
            x[m] += gain * error
            continue
        change = gain * error
        if m >= AT_PRELOAD_OPEN:
            p[ADAPTED[m - MOVING]] += change
            continue
        change = min(max(change, -0.3), 0.3)
        scale = 1.0 + change + 0.5 * change * change
        if m == LEVEL:
            p[COULOMB] *= scale
            p[STICTION] *= scale
        else:
            p[ADAPTED[m - MOVING]] *= scale


@njit(cache=True, error_model="numpy", forceinline=True)
def _watch(x: Vector, cov: Float64, p: Vector, s: Vector, dt: float, n: int, nominal: float, kept: Float64) -> None:
    """Keep the parameters, and restore earlier ones where a fault begins.

    Innovations that no friction explains tell of a fault some milliseconds after it began. It has ended when they were
    small for a while and the disturbance torque is small again, too. What does not end soon is no fault of a sensor but
    another friction: the filter adapts to it.
    """
    if s[FAULT_S] > 0.0:
        s[FAULT_S] += dt
        if s[FAULT_S] > _FAULT_S:
            s[IS_FAULTY] = 0.0
    if s[EXCESS] >= _FOREIGN:
        if s[IS_FAULTY] == 0.0 and s[FAULT_S] <= _FAULT_S:
            restore(cov, p, n, kept)
            s[IS_FAULTY], s[FAULT_S] = 1.0, max(s[FAULT_S], dt)
        s[QUIET_S] = 0.0
        return
    s[QUIET_S] += dt
    if s[QUIET_S] > _KEEPS_S and abs(x[DISTURBANCE]) < _ABSORBED * nominal:
        s[IS_FAULTY] = 0.0
    if s[QUIET_S] > _FAULT_S and s[FAULT_S] > 0.0:
        s[IS_FAULTY] = s[FAULT_S] = s[SINCE_COPY] = 0.0
        keep_in_both(cov, p, n, kept)
    s[SINCE_COPY] += dt
    if s[SINCE_COPY] > _KEEPS_S and s[FAULT_S] == 0.0:
        s[SINCE_COPY] = 0.0
        keep(cov, p, n, kept)


@njit(cache=True, error_model="numpy", forceinline=True)
def _estimate(
    x: Vector, cov: Float64, p: Vector, misfit: float, n: int, settings: Vector, lowest: Vector, highest: Vector
) -> tuple[float, float]:
    """Keep parameters inside their bounds, and return the friction torque.

    The second value is its standard deviation; both are in N·m.

    `misfit`: the estimated deviation of the bristles from LuGre's, a share of T_c squared. It counts while they bend.
    """
    if n > MOVING:
        for k in range(len(ADAPTED)):
            at = ADAPTED[k]
            p[at] = min(max(p[at], lowest[k]), highest[k])
    p[COULOMB] = min(max(p[COULOMB], lowest[-1]), highest[-1])
    p[STICTION] = max(p[STICTION], p[COULOMB])
    omega, damping = x[OMEGA], p[BRISTLE_DAMPING]
    g = p[COULOMB] + (p[STICTION] - p[COULOMB]) * gauss(omega / p[STRIBECK_VELOCITY])
    x[BRISTLE] = min(max(x[BRISTLE], -BENT_MOST * g), BENT_MOST * g)
    per_g = 1.0 / g
    yields = 1.0 - (1.0 if omega >= 0.0 else -1.0) * x[BRISTLE] * per_g
    friction = x[BRISTLE] + damping * omega * yields + p[VISCOUS] * omega + x[DISTURBANCE]
    # Bristles that yield as fast as they go are bent by the level alone, whatever their own error was.
    a, b = damping * yields + p[VISCOUS], max(1.0 - damping * abs(omega) * per_g, 0.0)
    # The estimate of the constant is right for LuGre's friction. Else its stated variance counts, too.
    stated = settings[CONSTANT] * min(misfit / _ANOTHER_LAW, _MORE_THAN_STATED)
    square = stated * friction * friction + cov[DISTURBANCE, DISTURBANCE]
    square += misfit * p[COULOMB] ** 2 * min(max(yields, 0.0), 1.0)
    square += a * (a * cov[OMEGA, OMEGA] + 2.0 * (b * cov[OMEGA, BRISTLE] + cov[OMEGA, DISTURBANCE]))
    square += b * (b * cov[BRISTLE, BRISTLE] + 2.0 * cov[BRISTLE, DISTURBANCE])
    c = (1.0 - b) * x[BRISTLE]
    shared = a * cov[OMEGA, LEVEL] + b * cov[BRISTLE, LEVEL] + cov[DISTURBANCE, LEVEL]
    square += c * (c * cov[LEVEL, LEVEL] + 2.0 * shared)
    if n > MOVING:
        shared = a * cov[OMEGA, AT_VISCOUS] + b * cov[BRISTLE, AT_VISCOUS] + cov[DISTURBANCE, AT_VISCOUS]
        shared += c * cov[LEVEL, AT_VISCOUS]
        c = omega * p[VISCOUS]
        square += c * (c * cov[AT_VISCOUS, AT_VISCOUS] + 2.0 * shared)
    return friction, math.sqrt(max(square, 0.0))


@njit(cache=True, error_model="numpy", forceinline=True)
def _run(
    n: int,
    time_ns: Int64,
    current: Float64,
    angle: Float64,
    x: Vector,
    cov: Float64,
    p: Vector,
    s: Vector,
    last_ns: Int64,
    settings: Vector,
    lowest: Vector,
    highest: Vector,
    work: Float64,
    kept: Float64,
    velocity: Float64,
    friction: Float64,
    deviation: Float64,
) -> None:
    """Filter samples, and fill in velocity, friction torque and its deviation.

    See `run_adapting`; the first `n` states are estimated.
    """
    last = last_ns[0]
    for k in range(len(time_ns)):
        i, measured = current[k], angle[k]
        velocity[k] = friction[k] = deviation[k] = math.nan
        step_ns = time_ns[k] - last
        if not math.isfinite(i + measured) or abs(i) > settings[STRONGEST] or (step_ns == 0 and s[RUNNING] > 0.0):
            continue
        last = time_ns[k]
        if s[RUNNING] == 0.0 or step_ns > LONGEST_GAP_NS or step_ns <= 0 or not math.isfinite(x[THETA] + cov[0, 0]):
            restart(x, cov, s, measured, i, settings)
            continue
        dt = step_ns * 1e-9
        steps = int(dt / _LONGEST_STEP - 1e-6) + 1
        h, before, change = dt / steps, s[CURRENT], i - s[CURRENT]
        s[CURRENT] = i
        noise = _noise(x, p, s, change, dt, h, settings)
        for part in range(steps):
            _predict(x, cov, p, before + change * (part + 0.5) / steps, noise, h, n, work)
        _correct(x, cov, p, s, measured - x[THETA], dt, n, settings, work[2])
        _watch(x, cov, p, s, dt, n, settings[NOMINAL], kept)
        torque, sigma = _estimate(x, cov, p, s[MISFIT], n, settings, lowest, highest)
        unsure = max(sigma, math.sqrt(max(cov[BRISTLE, BRISTLE], 0.0)))
        s[SETTLED] += dt if unsure > _SURE * settings[NOMINAL] else _SETTLES_S
        if s[SETTLED] < _SETTLES_S:
            continue
        velocity[k], friction[k], deviation[k] = x[OMEGA], torque, sigma
    last_ns[0] = last


# A kernel for each number of states: loops of a known length take half of the time.
@njit(cache=True, error_model="numpy")
def run_adapting(*columns: Any) -> None:  # noqa: ANN401 (those of `_run`)
    """Filter samples, and fill in velocity, friction torque and its deviation.

    Velocities are in rad/s, torques in N·m; the deviation is a standard deviation.

    Instants in ns, current in A, angle in rad. State, covariance, parameters (`lowest`, `highest`: their bounds, those
    of T_c last) and what is carried are changed in place. A sample that is not a number gives none, nor does
    one with a current that no voltage drives or with the stamp of the one before; nor do the first ones after a gap,
    until the friction is known.
    """
    _run(STATES, *columns)


@njit(cache=True, error_model="numpy")
def run_moving(*columns: Any) -> None:  # noqa: ANN401 (those of `_run`)
    """Filter samples as `run_adapting` does, but adapt the friction level alone."""
    _run(MOVING, *columns)
