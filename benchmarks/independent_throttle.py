"""A throttle to judge observers and diagnosis on, written apart from the project's plant and sharing no line with it.

Seed paper, eq. (1) and (2), by the classical Runge-Kutta method at 25 us with math.exp. The project's plant uses a
splitting scheme and an exponential of its own: an error in either shows as a difference between the two.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numba import njit

SAMPLE_S = 50e-6
SUBSTEPS = 2
_STIFF = 500.0  # 1/rad, sigma_0 / T_c: from there on, and where the force has kinks, twice as many
PER_CONTROL = 20  # samples in one period of the 1 kHz controller
COUNTS_PER_TURN = 16384
_OFF, _VOLTS, _TORQUE = 0, 1, 2
LUGRE, ELASTO_PLASTIC, MAXWELL_SLIP, GMS = 0.0, 1.0, 2.0, 3.0
_BREAKS = 0.7  # share of T_c below which elasto-plastic bristles do not creep
_ELEMENTS = ((0.5, 0.25), (0.3, 0.35), (0.2, 0.4))  # of Maxwell slip: shares of stiffness and of friction
_PULLED = 2000.0  # 1/s, how fast an element that slips follows its limit
# Share of its limit above which an element of generalised Maxwell slip goes on slipping (Al-Bender, Lampaert and
# Swevers 2005: until the plate turns round). While the plate slides, a limit rises by less than the other 3 % in
# 1 / _PULLED. Plain Maxwell slip has 1: an element sticks again as soon as its limit rises.
_SLIPS_ON = 0.97
_TEETH = (1000.0, 0.1)  # N·m/rad and N·m s/rad of teeth that touch, where the gear has play
_PLATE = 4e-5  # kg m^2 of the inertia that is the plate's
# rad, from where the plate creeps in the stock check
CREEPS = (math.radians(25.0), math.radians(60.0))


@dataclass(frozen=True)
class Unit:
    """A throttle; every value at the throttle shaft in SI units."""

    resistance: float = 1.5
    inductance: float = 1.5e-3
    back_emf: float = 0.36
    torque_per_ampere: float = 0.36
    gear_ratio: float = 18.0
    inertia: float = 1.336e-3
    preload_open: float = 0.35
    preload_close: float = 0.35
    slope_open: float = 0.05
    slope_close: float = 0.05
    limp_home: float = 0.14
    dead_zone: float = 2e-3
    stop_low: float = 0.0
    stop_high: float = 1.484
    stop_stiffness: float = 300.0
    stop_damping: float = 0.3
    coulomb: float = 0.144
    stiction: float = 0.171
    stribeck_velocity: float = 140.0 / 18.0
    bristle_stiffness: float = 60.0
    bristle_damping: float = 0.1
    viscous: float = 1e-3
    voltage_limit: float = 12.0
    bump_angle: float = 0.0
    bump_width: float = 1.0
    bump: float = 0.0
    bump_every: float = 0.0  # rad from bump to bump; 0: there is one
    exponent: float = 2.0  # of the speed's share of stribeck_velocity: the paper's eq. (2) has 2
    rise: float = 0.0  # share of friction for a rad, from 0 rad on
    by_direction: float = 0.0  # share by which friction is higher opening, and lower closing
    bump_way: float = 0.0  # 1: bumps are met opening alone, -1: closing alone, 0: both ways
    drift: float = 0.0  # share of friction that a second adds, at first: grease that warms, cools or is run in
    drift_ends: float = 0.0  # s, time constant with which that comes to an end; 0: it goes on
    law: float = 0.0  # of presliding: 0 LuGre, 1 elasto-plastic bristles, 2 Maxwell slip, 3 GMS
    dwell: float = 0.0  # share of T_st that friction gains with a unit of the logarithm of the contacts' age
    dwell_onset: float = 0.05  # s, age from which it does
    dwell_way: float = 3e-3  # rad over which contacts are renewed
    weight: float = 0.0  # N·m of a centre of mass beside the shaft, which closes the plate
    weight_angle: float = 0.0  # rad: its torque is weight sin(angle + weight_angle)
    play: float = 0.0  # rad between motor and plate, which is a mass of its own then
    sticks: float = 0.0  # N·m by which friction rises further below `sticks_below`
    sticks_below: float = 0.1  # rad/s

    def vector(self):
        return np.array([getattr(self, name) for name in self.__dataclass_fields__], float)


FAULTY = Unit(stiction=18 * 0.0315)


@dataclass(frozen=True)
class Truth:
    """What really happened, every 50 us: (n) arrays."""

    time: np.ndarray
    angle: np.ndarray
    velocity: np.ndarray
    current: np.ndarray
    voltage: np.ndarray
    friction: np.ndarray
    plate: np.ndarray | None = None  # where the plate is elsewhere than the motor


@njit(cache=True)
def _creep(z, w, g, s0, tc):
    """Return how much elasto-plastic bristles give way, 0 to 1 (Dupont et al. 2002, eq. 16 to 18)."""
    if z * w <= 0.0 or s0 * abs(z) <= _BREAKS * tc:
        return 0.0
    if s0 * abs(z) >= g:
        return 1.0
    middle, width = 0.5 * (g + _BREAKS * tc), g - _BREAKS * tc
    return 0.5 + 0.5 * math.sin(math.pi * (s0 * abs(z) - middle) / width)


@njit(cache=True)
def _slip(y, w, g, s0, s1, slips, out):
    """Fill in the rates of Maxwell-slip elements, which are the states from 4 on; return their torque."""
    torque = 0.0
    for k in range(3):
        stiffness, limit = s0 * _ELEMENTS[k][0], g * _ELEMENTS[k][1]
        force = stiffness * y[4 + k]
        rate = w
        if abs(force) >= slips * limit and force * w >= 0.0:
            rate = -_PULLED * (y[4 + k] - math.copysign(limit / stiffness, force))
        out[4 + k] = rate
        torque += force + s1 * _ELEMENTS[k][0] * rate
    return torque


@njit(cache=True)
def _spring(gap, po, pc, so, sc, dz):
    """Return the torque of both springs where the plate is by so much above limp-home."""
    if gap > dz:
        return po + so * (gap - dz)
    if gap < -dz:
        return -pc + sc * (gap + dz)
    return (po if gap > 0.0 else pc) * gap / dz


@njit(cache=True)
def _teeth(ahead, faster, play):
    """Return the torque that the motor gives the plate where it is so far ahead and so much faster."""
    if abs(ahead) <= 0.5 * play:
        return 0.0
    side = math.copysign(1.0, ahead)
    return side * max(_TEETH[0] * (abs(ahead) - 0.5 * play) + side * _TEETH[1] * faster, 0.0)


@njit(cache=True)
def _bumped(away, b, bw, every):
    """Return the factor of friction so far away from a bump."""
    if every > 0.0:
        away -= every * math.floor(away / every + 0.5)
    return 1.0 + b * math.exp(-((away / bw) ** 2))


@njit(cache=True)
def _derivative(y, u, mode, p, out):  # noqa: C901 (what a unit may have is one condition each)
    """Fill out with d/dt of the states; return the friction torque.

    They are angle, velocity, bristle, current, 3 slip elements, age, and the plate's own angle and velocity.
    """
    (
        r, inductance, ke, kt, _, j, po, pc, so, sc, lh, dz, lo, hi, ks, ds, tc, ts, ws, s0, s1, s2, _,
        ba, bw, b, every, exponent, rise, by_direction, way, _, _, law, dwell, onset, renewal, weight, weight_angle,
        play, sticks, sticks_below,
    ) = p  # fmt: skip
    a, w, z, i = y[0], y[1], y[2], y[3]
    if play > 0.0:
        a, w = y[8], y[9]
    spring = _spring(a - lh, po, pc, so, sc, dz)
    if weight != 0.0:
        spring += weight * math.sin(a + weight_angle)
    stop = 0.0
    if a < lo:
        stop = min(ks * (a - lo) + ds * w, 0.0)
    elif a > hi:
        stop = max(ks * (a - hi) + ds * w, 0.0)
    out[8], out[9] = 0.0, 0.0
    if play > 0.0:
        carried = _teeth(y[0] - a, y[1] - w, play)
        out[8], out[9] = w, (carried - spring - stop) / _PLATE
        spring, stop, j, a, w = carried, 0.0, j - _PLATE, y[0], y[1]
    local = 1.0 + rise * a
    if b != 0.0 and way * w >= 0.0:
        local *= _bumped(a - ba, b, bw, every)
    share = abs(w / ws)
    share = share * share if exponent == 2.0 else share**exponent
    g = (tc + (ts - tc) * math.exp(-share)) * local * (1.0 + by_direction * math.copysign(1.0, w))
    if sticks != 0.0:
        g += sticks * math.exp(-((w / sticks_below) ** 2))
    if dwell != 0.0:
        g += dwell * ts * math.log(1.0 + y[7] / onset)
    creep = _creep(z, w, g, s0, tc) if law == ELASTO_PLASTIC else 1.0
    dz_dt = w - creep * s0 * abs(w) * z / g
    for k in range(4, 7):
        out[k] = 0.0
    out[7] = 1.0 - y[7] * abs(w) / renewal
    friction = (
        _slip(y, w, g, s0, s1, _SLIPS_ON if law == GMS else 1.0, out) if law >= MAXWELL_SLIP else s0 * z + s1 * dz_dt
    ) + s2 * w
    out[0] = w
    out[1] = (kt * i - friction - spring - stop) / j
    out[2] = dz_dt
    if mode == _VOLTS:
        out[3] = (u - r * i - ke * w) / inductance
    else:  # an open bridge, or a current that is set from outside
        out[3] = -i / 1e-4 if mode == _OFF else 0.0
    return friction


@njit(cache=True)
def _moved(y, h, slope, out):
    """Fill out with y + h slope: no arrays are made on the way."""
    for j in range(len(y)):
        out[j] = y[j] + h * slope[j]


@njit(cache=True)
def _torque(y, reference, velocity, n, after, share):
    """Return the torque of a position loop that follows its set-points continuously, not in steps of a millisecond."""
    position = reference[n] + share * (reference[after] - reference[n])
    speed = velocity[n] + share * (velocity[after] - velocity[n])
    return 6.0 * (position - y[0]) + 0.12 * (speed - y[1])


@njit(cache=True)
def _simulate(p, reference, velocity, mode, limp_angle, out):
    """Mode of each control period: bridge off, position loop in volts, position loop in torque without a motor."""
    y = np.array([limp_angle, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, limp_angle, 0.0])
    k1, k2, k3, k4, at = np.zeros(10), np.zeros(10), np.zeros(10), np.zeros(10), np.zeros(10)
    substeps = 2 * SUBSTEPS if p[33] >= MAXWELL_SLIP or p[19] > _STIFF * p[16] else SUBSTEPS
    h = SAMPLE_S / substeps
    r, ke, kt, limit = p[0], p[2], p[3], p[22]
    p, coulomb, stiction, drift, ends = p.copy(), p[16], p[17], p[31], p[32]
    turn = 2.0 * math.pi / COUNTS_PER_TURN / p[4]
    last = math.floor(y[0] / turn) * turn
    row = 0
    slope = 0.0
    for n in range(len(reference)):
        since = n * SAMPLE_S * PER_CONTROL
        aged = 1.0 + drift * (since if ends == 0.0 else ends * (1.0 - math.exp(-since / ends)))
        p[16], p[17] = aged * coulomb, aged * stiction
        seen = math.floor(y[0] / turn) * turn
        slope += 0.3 * ((seen - last) / (SAMPLE_S * PER_CONTROL) - slope)
        last = seen
        torque = 6.0 * (reference[n] - seen) + 0.12 * (velocity[n] - slope)
        u = 0.0
        if mode[n] == _VOLTS:
            direction = 0.0 if velocity[n] == 0.0 else math.copysign(1.0, velocity[n])
            spring = p[6] if seen > p[10] else -p[7]
            torque += spring + 0.8 * p[16] * direction
            u = min(max(r * torque / kt + ke * slope, -limit), limit)
        after = min(n + 1, len(reference) - 1)
        for tick in range(PER_CONTROL):
            if mode[n] == _TORQUE:
                y[3] = _torque(y, reference, velocity, n, after, tick / PER_CONTROL) / kt
            friction = _derivative(y, u, mode[n], p, k1)
            out[0, row], out[1, row], out[2, row] = y[0], y[1], y[3]
            out[3, row], out[4, row] = u if mode[n] == _VOLTS else ke * y[1], friction
            out[5, row] = y[8] if p[39] > 0.0 else y[0]
            row += 1
            for part in range(substeps):
                if part > 0:  # the first one's slope was just asked for
                    if mode[n] == _TORQUE:
                        share = (tick + part / substeps) / PER_CONTROL
                        y[3] = _torque(y, reference, velocity, n, after, share) / kt
                    _derivative(y, u, mode[n], p, k1)
                _moved(y, 0.5 * h, k1, at)
                _derivative(at, u, mode[n], p, k2)
                _moved(y, 0.5 * h, k2, at)
                _derivative(at, u, mode[n], p, k3)
                _moved(y, h, k3, at)
                _derivative(at, u, mode[n], p, k4)
                for j in range(len(y)):
                    y[j] += h / 6.0 * (k1[j] + 2.0 * k2[j] + 2.0 * k3[j] + k4[j])


def simulate(unit, reference, velocity, mode):
    """Run a unit through set-points at 1 kHz: `reference` rad, `velocity` rad/s, `mode` 0 off, 1 volts, 2 torque."""
    n = len(reference) * PER_CONTROL
    out = np.empty((6, n))
    start = unit.limp_home if mode[0] != _TORQUE else reference[0]
    _simulate(unit.vector(), reference, velocity, mode, start, out)
    return Truth(np.arange(n) * SAMPLE_S, *out)


def _glide(start, end, speed, soft=0.05):
    way = end - start
    cruise = max(abs(way) / speed - soft, 0.0)
    t = np.arange(0.0, cruise + 2 * soft, 1e-3)
    v = speed * np.clip(np.minimum(t, cruise + 2 * soft - t) / soft, 0.0, 1.0)
    v *= abs(way) / max(v.sum() * 1e-3, 1e-12)
    return np.sign(way) * v


def _dash(peak, against, rise, fall):
    def cosine(a, b, length):
        t = np.arange(0.0, length, 1e-3)
        return a + (b - a) * 0.5 * (1.0 - np.cos(np.pi * t / length))

    first = -math.copysign(against, peak)
    return np.concatenate(
        [cosine(0, first, 0.05), np.full(50, first), cosine(first, peak, rise), cosine(peak, 0, fall)]
    )


@lru_cache(maxsize=8)
def friction_check(unit, *, low=0.035, high=1.396, creeps=CREEPS, speeds=(0.4, 1.2), dashes=2):
    """Return Truth and (kind, first sample, end sample) for the phases of a friction check; of recent units, the same.

    The arrays are read-only.
    """
    *motion, phases = check_motion(unit.limp_home, low=low, high=high, creeps=creeps, speeds=speeds, dashes=dashes)
    truth = simulate(unit, *motion)
    for values in vars(truth).values():
        if values is not None:
            values.setflags(write=False)
    return truth, tuple(phases)


def check_motion(start, *, low=0.035, high=1.396, creeps=CREEPS, speeds=(0.4, 1.2), dashes=2):
    """Return set-points and modes of a friction check, as `simulate` takes them, and its phases.

    `creeps` rad are the angles from which the plate creeps after a rest, opening and closing.
    """
    pieces, kinds, at = [], [], start

    def add(kind, velocity, mode=1):
        nonlocal at
        position = at + np.cumsum(velocity) * 1e-3
        pieces.append((position, velocity, np.full(len(velocity), mode)))
        kinds.append((kind, len(velocity)))
        at = position[-1]

    add("current_zero", np.zeros(1000), 0)
    if creeps:
        still, parts, start = np.zeros(200), [], at
        for begin in creeps:
            end = begin + math.radians(4.0)
            parts += [_glide(start, begin, 1.5), still, _glide(begin, end, 0.08), still, _glide(end, begin, 0.08)]
            start = begin
        add("break_away", np.concatenate(parts))
    for speed in speeds:
        add("ramp", np.concatenate([_glide(at, low, 1.5), _glide(low, high, speed), _glide(high, low, speed)]))
    for _ in range(dashes):
        for begin, peak in ((math.radians(12), 17.5), (math.radians(74), -17.5)):
            still = np.zeros(150)
            add("dash", np.concatenate([_glide(at, begin, 1.5), still, _dash(peak, 1.5, 0.075, 0.045), still]))
    add("off", np.zeros(500), 0)
    reference, velocity, mode = (np.concatenate(part) for part in zip(*pieces, strict=True))
    ends = np.cumsum([length for _, length in kinds]) * PER_CONTROL
    phases = [
        (kind, int(end - length * PER_CONTROL), int(end)) for (kind, length), end in zip(kinds, ends, strict=True)
    ]
    return reference, velocity, mode, phases


@dataclass(frozen=True)
class Sensed:
    """What the sensors said, at one rate: `time_ns` (n), the rest (n) in SI; `angle` at the motor shaft."""

    time_ns: np.ndarray
    current: np.ndarray
    voltage: np.ndarray
    motor_angle: np.ndarray
    throttle_angle: np.ndarray


def sense(unit, truth, rate, rng, *, current_offset=0.02):
    """Sample at 20 kHz or a divisor of it: 5 mA rms and 1 mA steps, 16 384 edges a turn, 12 bits over 90 deg."""
    every = round(1.0 / SAMPLE_S / rate)
    part = slice(None, None, every)
    n = len(truth.time[part])
    current = truth.current[part] + current_offset + 5e-3 * rng.standard_normal(n)
    turn = 2.0 * math.pi / COUNTS_PER_TURN
    plate_bit = math.radians(90.0) / 4096
    plate = (truth.angle if truth.plate is None else truth.plate)[part] + math.radians(0.01) * rng.standard_normal(n)
    return Sensed(
        np.round(truth.time[part] * 1e9).astype(np.int64),
        np.round(current / 1e-3) * 1e-3,
        np.round((truth.voltage[part] + 0.01 * rng.standard_normal(n)) / 0.01) * 0.01,
        np.floor(truth.angle[part] * unit.gear_ratio / turn) * turn,
        np.round(plate / plate_bit) * plate_bit,
    )


def off_by_tolerances(unit, rng, *, constant=0.03, spring=0.03, inertia=0.05):
    """Return the bench's idea of a unit: motor constant, springs and inertia drawn inside their tolerances."""

    def off(share):
        return 1.0 + share * rng.uniform(-1.0, 1.0)

    k = off(constant)
    return replace(
        unit,
        torque_per_ampere=unit.torque_per_ampere * k,
        back_emf=unit.back_emf * k,
        preload_open=unit.preload_open * off(spring),
        preload_close=unit.preload_close * off(spring),
        inertia=unit.inertia * off(inertia),
    )
