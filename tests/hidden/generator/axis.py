"""An axis under a position controller, linear or rotary, driven in force, current or volts and read with noise.

In a linear axis' words (kg, N, m): for a rotary one they are kg·m², N·m and rad. It may carry a mass beside its shaft,
or pull a spring.
"""

import math
from dataclasses import dataclass

import numpy as np

from generator.compiled import compiled

TICK = 1e-5  # s
_CONTROL = 100  # ticks from one command to the next
_BANDWIDTH = 80.0  # rad/s of the controller

MASS, VISCOUS, COULOMB, STICTION, SETTLED, STIFFNESS, DAMPING, LOAD, ASYMMETRY, TOOTH, TURN, STEP = range(12)
GRAVITY, HANGS, SPRING, REST, RESISTANCE, INDUCTANCE, CONSTANT, FAN = range(12, 20)
_SIZE = 20
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
    drag += p[GRAVITY] * math.sin(x - p[HANGS]) + p[SPRING] * (x - p[REST])
    drag += p[FAN] * v * abs(v)
    return (force - drag) / p[MASS], rate


@compiled()
def _run(wanted, speeds, ahead, every, most, p, out):
    """Follow a path (a row each command) and write position, drive and current (rows of `out`), every so many ticks.

    The drive is the force; with a winding it is the voltage that the controller holds to get that force.
    """
    x, v, z, force, told, volts, amperes = wanted[0], 0.0, 0.0, 0.0, wanted[0], 0.0, 0.0
    gain, damping = _BANDWIDTH**2 * p[MASS], 1.6 * _BANDWIDTH * p[MASS]
    for k in range(wanted.size * _CONTROL):
        if k % _CONTROL == 0:
            now = math.floor(x / p[STEP]) * p[STEP]
            at = k // _CONTROL
            speed = (now - told) / (_CONTROL * TICK)
            told = now
            force = gain * (wanted[at] - now) + damping * (speeds[at] - speed) + ahead[at]
            force = min(max(force, -most), most)
            if p[CONSTANT] > 0.0:
                volts = p[RESISTANCE] * force / p[CONSTANT] + p[CONSTANT] * speed
        if k % every == 0:
            out[k // every, 0], out[k // every, 1] = x, volts if p[CONSTANT] > 0.0 else force
            out[k // every, 2] = amperes
        if p[CONSTANT] > 0.0:
            slope = (volts - p[CONSTANT] * v - p[RESISTANCE] * amperes) / p[INDUCTANCE]
            middle = amperes + 0.5 * TICK * slope
            amperes += TICK * (volts - p[CONSTANT] * v - p[RESISTANCE] * middle) / p[INDUCTANCE]
            force = p[CONSTANT] * amperes
        a1, b1 = _rates(x, v, z, force, p)
        v1 = v + 0.5 * TICK * a1
        a2, b2 = _rates(x + 0.5 * TICK * v, v1, z + 0.5 * TICK * b1, force, p)
        x, v, z = x + TICK * v1, v + TICK * a2, z + TICK * b2


def draw_axis(
    seed,
    motion="linear",
    *,
    driven="force",
    gravity=0.0,
    spring=0.0,
    is_stated=True,
    force_scale=1.0,
    wrong=(),
    asymmetry=0.0,
    tooth=0.0,
    fan=0.0,
    rate=1000,
    seconds=40.0,
    way_of=None,
    zero=0.0,
):
    """Draw an axis, run it for `seconds` and measure it at `rate` rows a second; its file is up to 10 % off.

    `driven`: "force", "current", "voltage", or "voltage and current" where both were read. `gravity`, `spring`: their
    force at most, in shares of the friction; `is_stated`: whether the file has them. `force_scale`: what its force is
    read as, over what it is; `wrong`: {parameter's place: true value over the drawn one}; `asymmetry`: a share of the
    friction; `tooth`: a force that comes once a turn, and `fan`: a drag over the square of the speed, at the highest
    one, in shares of the friction.
    `way_of`: seed of another path and noise of the same unit; `zero`: what its sensor reads at 0, in turns.
    """
    rng = np.random.default_rng([seed, *motion.encode()])
    mass, coulomb, viscous, settled, presliding, steps, (way, speed, acceleration) = _MOTIONS[motion]
    p = np.zeros(_SIZE)
    places = (MASS, COULOMB, VISCOUS, SETTLED, STIFFNESS)
    for place, ends in zip(places, (mass, coulomb, viscous, settled, presliding), strict=True):
        p[place] = rng.uniform(*ends)
    p[TURN] = 2.0 * math.pi if motion == "rotary" else rng.choice([2.5e-3, 5e-3, 1e-2, 2e-2])
    p[STEP] = p[TURN] / rng.uniform(*steps)
    p[STICTION] = p[COULOMB] * rng.uniform(1.0, 1.05)
    p[LOAD] = p[COULOMB] * rng.uniform(-0.3, 0.3)
    if gravity or spring:
        p[GRAVITY], p[HANGS] = gravity * p[COULOMB], rng.uniform(-3.0, 3.0)
        p[SPRING], p[REST] = spring * p[COULOMB] / way, rng.uniform(-0.2, 0.2) * way
    if spring:
        p[LOAD] = 0.0
    believed = p.copy()
    believed[:FAN] *= rng.uniform(1.0 / 1.1, 1.1, FAN)
    believed[LOAD] = p[LOAD] + 0.05 * p[COULOMB] * rng.uniform(-1.0, 1.0)
    believed[HANGS], believed[REST] = p[HANGS], p[REST] + 0.01 * way * rng.uniform(-1.0, 1.0)
    p[STIFFNESS] = p[COULOMB] / p[STIFFNESS]
    p[DAMPING] = 0.02 * p[COULOMB] / p[SETTLED]
    p[ASYMMETRY], p[TOOTH], p[FAN] = asymmetry, tooth * p[COULOMB], fan * p[COULOMB] / speed**2
    most = 40.0 * p[COULOMB] + 3.0 * p[MASS] * acceleration
    if driven != "force":
        # A motor that takes 10 A at the most, and its winding: the back-EMF is half of the voltage at full speed.
        p[CONSTANT] = most / 10.0
        p[RESISTANCE] = rng.uniform(0.5, 1.5) * p[CONSTANT] * speed / 10.0
        p[INDUCTANCE] = p[RESISTANCE] * rng.uniform(2e-4, 8e-4)
        places = [RESISTANCE, INDUCTANCE, CONSTANT]
        believed[places] = p[places] * rng.uniform(1.0 / 1.05, 1.05, 3)
    for place, factor in dict(wrong).items():
        p[place] *= factor
    rng = rng if way_of is None else np.random.default_rng([way_of, *motion.encode()])
    path = _path(rng, seconds, way, speed, acceleration)
    speeds = np.gradient(path, _CONTROL * TICK)
    ahead = believed[MASS] * np.gradient(speeds, _CONTROL * TICK) + believed[VISCOUS] * speeds
    out = np.empty((round(seconds * rate), 3))
    run = p.copy()
    if driven == "current":
        run[CONSTANT] = 0.0
    _run(path, speeds, ahead, round(1.0 / (rate * TICK)), most, run, out)
    noise = 0.01 * believed[COULOMB]
    way_role = ROLES[motion][1]
    table = {"time": np.arange(len(out)) / rate, way_role: np.round((out[:, 0] + zero * p[TURN]) / p[STEP]) * p[STEP]}
    if driven == "force":
        table[ROLES[motion][0]] = force_scale * (out[:, 1] + noise * rng.standard_normal(len(out)))
    elif driven == "current":
        noise /= p[CONSTANT]
        table["motor_current"] = out[:, 1] / p[CONSTANT] + noise * rng.standard_normal(len(out))
    else:
        noise *= p[RESISTANCE] / p[CONSTANT]
        table["motor_voltage"] = out[:, 1] + noise * rng.standard_normal(len(out))
        if driven == "voltage and current":
            table["motor_current"] = out[:, 2] + noise / p[RESISTANCE] * rng.standard_normal(len(out))
    return Axis(table, _file(believed, p, noise, motion, driven, is_stated))


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


def _file(believed, p, noise, motion, driven, is_stated):
    unit = _UNITS[motion]

    def entry(place, its, tolerance="20 %"):
        return f"{{value: {believed[place]:.6g} {its}, tolerance: {tolerance}, source: drawn}}"

    constant = f"torque_constant: {entry(CONSTANT, unit['force'] + '/A', '5 %')}"
    if driven == "force":
        drive = f"{'force' if motion == 'linear' else 'torque'}: {{noise: {noise:.6g} {unit['force']}}}"
    elif driven == "current":
        drive = f"current: {{{constant}, noise: {noise:.6g} A}}"
    else:
        drive = f"voltage: {{resistance: {entry(RESISTANCE, 'ohm', '10 %')}, {constant}, limit: 10000 V,"
        drive += f" inductance: {entry(INDUCTANCE, 'H')}, noise: {noise:.6g} V"
        drive += f", current_noise: {noise / p[RESISTANCE]:.6g} A}}" if "current" in driven else "}"
    load = [f"constant: {entry(LOAD, unit['force'], f'{0.2 * believed[COULOMB]:.4g} ' + unit['force'])}"]
    if p[GRAVITY] and is_stated:
        load.append(f"gravity: {{torque: {believed[GRAVITY]:.6g} N·m, hangs_at: {believed[HANGS]:.6g} rad}}")
    if p[SPRING]:
        rest = entry(REST, unit["way"], f"{0.02 * abs(p[COULOMB] / p[SPRING]) + 0.02:.4g} {unit['way']}")
        load = [f"spring: {{stiffness: {entry(SPRING, unit['force'] + '/' + unit['way'])}, rest: {rest}}}"]
    lines = ["schema: etb_hil/drive/2", "name: drawn axis", "description: nominal values of a drawn axis"]
    lines += [f"motion: {motion}", f"driven_by: {{{drive}}}", f"inertia: {entry(MASS, unit['mass'])}"]
    lines += [f"friction: {{viscous: {entry(VISCOUS, unit['damping'])}, coulomb: {entry(COULOMB, unit['force'])},"]
    lines += [f"  presliding: {believed[STIFFNESS]:.6g} {unit['way']},"]
    lines += [f"  settled_speed: {believed[SETTLED]:.6g} {unit['speed']}}}"]
    lines += [f"load: {{{', '.join(load)}}}"]
    lines += [f"travel_per_turn: {p[TURN]:.9g} {unit['way']}", f"position_step: {p[STEP]:.9g} {unit['way']}"]
    return "\n".join(lines) + "\n"
