"""A drive without springs: a linear or rotary axis under a position controller, driven in force and read with noise.

In a linear axis' words (kg, N, m): for a rotary one they are kg·m², N·m and rad.
"""

import math
from dataclasses import dataclass

import numpy as np

from generator.compiled import compiled

TICK = 1e-5  # s
_CONTROL = 100  # ticks from one command to the next
_BANDWIDTH = 80.0  # rad/s of the controller

MASS, VISCOUS, COULOMB, STICTION, SETTLED, STIFFNESS, DAMPING, LOAD, ASYMMETRY, TOOTH, TURN, STEP = range(12)
_MOTIONS = {
    # mass, coulomb, viscous, settled speed, presliding, steps of the sensor in a turn; way, speed, acceleration
    "linear": ((20, 150), (10, 60), (50, 400), (8e-3, 3e-2), (5e-6, 2e-5), (5e4, 5e4), (0.2, 0.35, 4.0)),
    "rotary": ((1e-3, 2e-2), (0.1, 0.8), (5e-3, 3e-2), (0.3, 1.0), (5e-4, 3e-3), (6e4, 2e5), (6.0, 12.0, 150.0)),
}
_UNITS = {
    "linear": {"mass": "kg", "damping": "N·s/m", "force": "N", "speed": "m/s", "way": "m"},
    "rotary": {"mass": "kg·m²", "damping": "N·m·s/rad", "force": "N·m", "speed": "rad/s", "way": "rad"},
}
ROLES = {"linear": ("drive_force", "linear_position"), "rotary": ("drive_torque", "drive_angle")}


@dataclass(frozen=True)
class Axis:
    """What was measured on a drawn axis, by role, and the drive file of what its bench believes of it."""

    table: dict
    file: str


@compiled()
def _rates(x, v, z, force, p):
    """Rates of velocity and bristle (seed paper, eq. 2), friction of its own in each direction, one wave a turn."""
    coulomb = p[COULOMB] * (1.0 + p[ASYMMETRY] * math.tanh(v / (0.02 * p[SETTLED])))
    g = coulomb + (p[STICTION] - p[COULOMB]) * math.exp(-((v / p[SETTLED]) ** 2))
    rate = v - p[STIFFNESS] * abs(v) / g * z
    drag = p[STIFFNESS] * z + p[DAMPING] * rate + p[VISCOUS] * v + p[LOAD]
    drag += p[TOOTH] * math.sin(2.0 * math.pi * x / p[TURN])
    return (force - drag) / p[MASS], rate


@compiled()
def _run(wanted, speeds, ahead, every, most, p, out):
    """Follow a path (a row each command) and write position and force (rows of `out`), every so many ticks."""
    x, v, z, force, told = wanted[0], 0.0, 0.0, 0.0, wanted[0]
    gain, damping = _BANDWIDTH**2 * p[MASS], 1.6 * _BANDWIDTH * p[MASS]
    for k in range(wanted.size * _CONTROL):
        if k % _CONTROL == 0:
            now = math.floor(x / p[STEP]) * p[STEP]
            at = k // _CONTROL
            speed = (now - told) / (_CONTROL * TICK)
            told = now
            force = gain * (wanted[at] - now) + damping * (speeds[at] - speed) + ahead[at]
            force = min(max(force, -most), most)
        if k % every == 0:
            out[k // every, 0], out[k // every, 1] = x, force
        a1, b1 = _rates(x, v, z, force, p)
        v1 = v + 0.5 * TICK * a1
        a2, b2 = _rates(x + 0.5 * TICK * v, v1, z + 0.5 * TICK * b1, force, p)
        x, v, z = x + TICK * v1, v + TICK * a2, z + TICK * b2


def draw_axis(seed, motion="linear", *, force_scale=1.0, wrong=(), asymmetry=0.0, tooth=0.0, rate=1000, seconds=40.0):
    """Draw an axis, run it for `seconds` and measure it at `rate` rows a second; its file is up to 10 % off.

    `force_scale`: what its force is read as, over what it is; `wrong`: {parameter's place: true value over the drawn
    one}; `asymmetry`: a share of the friction; `tooth`: a force that comes once a turn, in shares of the friction.
    """
    rng = np.random.default_rng([seed, *motion.encode()])
    mass, coulomb, viscous, settled, presliding, steps, (way, speed, acceleration) = _MOTIONS[motion]
    p = np.zeros(12)
    places = (MASS, COULOMB, VISCOUS, SETTLED, STIFFNESS)
    for place, ends in zip(places, (mass, coulomb, viscous, settled, presliding), strict=True):
        p[place] = rng.uniform(*ends)
    p[TURN] = 2.0 * math.pi if motion == "rotary" else rng.choice([2.5e-3, 5e-3, 1e-2, 2e-2])
    p[STEP] = p[TURN] / rng.uniform(*steps)
    p[STICTION] = p[COULOMB] * rng.uniform(1.0, 1.05)
    p[LOAD] = p[COULOMB] * rng.uniform(-0.3, 0.3)
    believed = p * rng.uniform(1.0 / 1.1, 1.1, len(p))
    believed[LOAD] = p[LOAD] + 0.05 * p[COULOMB] * rng.uniform(-1.0, 1.0)
    p[STIFFNESS] = p[COULOMB] / p[STIFFNESS]
    p[DAMPING] = 0.02 * p[COULOMB] / p[SETTLED]
    p[ASYMMETRY], p[TOOTH] = asymmetry, tooth * p[COULOMB]
    for place, factor in dict(wrong).items():
        p[place] *= factor
    noise = 0.01 * believed[COULOMB]
    path = _path(rng, seconds, way, speed, acceleration)
    speeds = np.gradient(path, _CONTROL * TICK)
    ahead = believed[MASS] * np.gradient(speeds, _CONTROL * TICK) + believed[VISCOUS] * speeds
    out = np.empty((round(seconds * rate), 2))
    most = 40.0 * p[COULOMB] + 3.0 * p[MASS] * acceleration
    _run(path, speeds, ahead, round(1.0 / (rate * TICK)), most, p, out)
    read = force_scale * (out[:, 1] + noise * rng.standard_normal(len(out)))
    force_role, way_role = ROLES[motion]
    table = {"time": np.arange(len(out)) / rate, force_role: read, way_role: np.round(out[:, 0] / p[STEP]) * p[STEP]}
    return Axis(table, _file(believed, p, noise, motion))


def _path(rng, seconds, way, speed, acceleration):
    """Moves of all lengths and speeds with rests between them, waves of several frequencies, and small triangles."""
    tick, found, at = _CONTROL * TICK, [np.zeros(300)], 0.0
    while sum(len(part) for part in found) * tick < seconds:
        kind = rng.integers(5)
        if kind < 3:
            to = rng.uniform(-way, way)
            fast = min(speed * math.exp(rng.uniform(math.log(0.03), 0.0)), math.sqrt(abs(to - at) * acceleration))
            ramp = fast / acceleration
            lasts = abs(to - at) / fast + ramp
            t = np.minimum(np.arange(0.0, lasts + tick, tick), lasts)
            end = lasts - t
            gone = np.where(t < ramp, 0.5 * acceleration * t**2, fast * (t - 0.5 * ramp))
            gone = np.where(end < ramp, abs(to - at) - 0.5 * acceleration * end**2, gone)
            found += [at + math.copysign(1.0, to - at) * gone, np.full(rng.integers(20, 600), to)]
            at = to
            continue
        t = np.arange(rng.integers(1500, 3000)) * tick
        if kind == 3:
            wave = sum(np.sin(2.0 * math.pi * f * t + rng.uniform(0.0, 6.3)) / f for f in (0.7, 1.9, 4.3, 9.1))
            wave *= np.minimum(1.0, np.minimum(t, t[::-1]) / 0.3)
            found.append(at + 0.3 * way * wave / np.abs(wave).max())
        else:
            size, f = way * rng.uniform(0.005, 0.05), rng.uniform(0.5, 2.0)
            found.append(at + 2.0 / math.pi * size * np.arcsin(np.sin(2.0 * math.pi * f * t)))
    window = np.hanning(43)[1:-1]
    path = np.concatenate(found)[: round(seconds / tick)]
    return np.convolve(np.pad(path, 20, mode="edge"), window / window.sum(), "valid")


def _file(believed, p, noise, motion):
    unit = _UNITS[motion]

    def entry(place, of, tolerance="20 %"):
        return f"{{value: {believed[place]:.6g} {unit[of]}, tolerance: {tolerance}, source: drawn}}"

    lines = ["schema: etb_hil/drive/1", "name: drawn axis", "description: nominal values of a drawn axis"]
    lines += [f"motion: {motion}", f"inertia: {entry(MASS, 'mass')}", f"viscous: {entry(VISCOUS, 'damping')}"]
    lines += [f"coulomb: {entry(COULOMB, 'force')}"]
    lines += [f"constant_load: {entry(LOAD, 'force', f'{0.2 * believed[COULOMB]:.4g} ' + unit['force'])}"]
    lines += [
        f"presliding: {believed[STIFFNESS]:.6g} {unit['way']}",
        f"settled_speed: {believed[SETTLED]:.6g} {unit['speed']}",
    ]
    lines += [f"travel_per_turn: {p[TURN]:.9g} {unit['way']}", f"position_step: {p[STEP]:.9g} {unit['way']}"]
    lines += [f"drive_noise: {noise:.6g} {unit['force']}"]
    return "\n".join(lines) + "\n"
