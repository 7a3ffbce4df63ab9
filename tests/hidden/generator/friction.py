"""Friction: LuGre with everything that can change its steady-state curve."""

import math

from generator import layout as at
from generator.compiled import compiled
from generator.shapes import bump, step, wave

_LOWEST = 1e-3  # N·m: friction never vanishes, and the bristle's rate divides by it


@compiled()
def stribeck_fraction(velocity, p, e):
    """Share of the stiction peak that is left at a velocity, 1 at rest."""
    x = abs(velocity) / p[at.STRIBECK]
    fraction = math.exp(-x * x)
    if e[at.STRIBECK_SHAPE, at.STRENGTH] != 0.0:
        row = e[at.STRIBECK_SHAPE]
        y = x / row[at.A]
        if row[at.FORM] == 1.0:
            other = 1.0 / (1.0 + y * y)
        elif row[at.FORM] == 2.0:
            other = math.exp(-y)
        else:
            other = math.exp(-(y ** row[at.B]))
        fraction += row[at.STRENGTH] * (other - fraction)
    return fraction


@compiled()
def age_strength(age, row):
    """Growth of stiction with contact age: 0 logarithm (a decade), 1 power, 2 saturating."""
    x = age / row[at.A]
    if row[at.FORM] == 1.0:
        return (1.0 + x) ** 0.18 - 1.0
    if row[at.FORM] == 2.0:
        return 2.0 * (1.0 - math.exp(-x / 40.0))
    return math.log10(1.0 + x)


@compiled()
def steady_friction(angle, velocity, load, slow, inputs, p, e):
    """g of the seed paper's eq. (2), N·m at the throttle shaft, with the friction effects of `e`."""
    fraction = stribeck_fraction(velocity, p, e)
    g = p[at.COULOMB] + (p[at.STICTION] - p[at.COULOMB]) * fraction
    if e[at.FRICTION_PERIODIC, at.STRENGTH] != 0.0:
        row = e[at.FRICTION_PERIODIC]
        g += p[at.COULOMB] * row[at.STRENGTH] * wave(row[at.A] * angle + row[at.B], row[at.FORM])
    if e[at.FRICTION_LOCAL, at.STRENGTH] != 0.0:
        row = e[at.FRICTION_LOCAL]
        g += row[at.STRENGTH] * bump((angle - row[at.A]) / row[at.B], row[at.FORM])
    if e[at.FRICTION_ASYMMETRY, at.STRENGTH] != 0.0:
        row = e[at.FRICTION_ASYMMETRY]
        side = step(velocity / row[at.A], row[at.FORM])
        g += p[at.COULOMB] * row[at.STRENGTH] * (side + row[at.B])
    if e[at.DWELL, at.STRENGTH] != 0.0:
        row = e[at.DWELL]
        g += row[at.STRENGTH] * p[at.STICTION] * age_strength(slow[at.AGE], row) * fraction
    if e[at.FRICTION_LOAD, at.STRENGTH] != 0.0:
        row = e[at.FRICTION_LOAD]
        g += row[at.STRENGTH] * loaded(load, row)
    return max(_LOWEST, g * environment(inputs, e))


@compiled()
def loaded(load, row):
    """Friction of the transmitted torque: 0 in proportion, 1 a power, 2 above a threshold."""
    size = abs(load)
    if row[at.FORM] == 1.0:
        return 0.4 * (size / 0.4) ** row[at.A]
    if row[at.FORM] == 2.0:
        return max(0.0, size - row[at.B])
    return size


@compiled()
def environment(inputs, e):
    """Factor on friction from temperature, running-in and passing debris."""
    factor = 1.0
    if e[at.FRICTION_TEMPERATURE, at.STRENGTH] != 0.0:
        row = e[at.FRICTION_TEMPERATURE]
        warm = (inputs[at.IN_TEMPERATURE] - 25.0) / 30.0
        if row[at.FORM] == 1.0:
            factor *= math.exp(-row[at.STRENGTH] * warm)
        elif row[at.FORM] == 2.0:
            factor *= 1.0 / (1.0 + row[at.STRENGTH] * max(warm, -0.8))
        else:
            factor *= 1.0 - row[at.STRENGTH] * warm
    factor += e[at.RUNNING_IN, at.STRENGTH] * inputs[at.IN_RUNNING_IN]
    factor += e[at.BURSTS, at.STRENGTH] * inputs[at.IN_BURSTS]
    return max(0.05, factor)


@compiled()
def viscous_coefficient(inputs, p, e):
    """Viscous friction, N·m·s/rad, which cold grease makes much larger."""
    if e[at.FRICTION_TEMPERATURE, at.STRENGTH] != 0.0:
        row = e[at.FRICTION_TEMPERATURE]
        return p[at.VISCOUS] * math.exp(-row[at.A] * row[at.STRENGTH] * (inputs[at.IN_TEMPERATURE] - 25.0) / 30.0)
    return p[at.VISCOUS]


@compiled()
def extra_drag(velocity, slow, e):
    """Torque against motion that no bristle carries, N·m: reversal memory, iron loss, air drag."""
    torque = 0.0
    if e[at.PRESLIDING, at.STRENGTH] != 0.0:
        torque += e[at.PRESLIDING, at.STRENGTH] * slow[at.MEMORY]
    if e[at.IRON_LOSS, at.STRENGTH] != 0.0:
        row = e[at.IRON_LOSS]
        x = velocity / row[at.A]
        curve = x / (1.0 + abs(x)) ** 0.5 if row[at.FORM] == 3.0 else step(x, row[at.FORM])
        torque += row[at.STRENGTH] * (curve + row[at.B] * velocity)
    if e[at.AIR_DRAG, at.STRENGTH] != 0.0:
        row = e[at.AIR_DRAG]
        torque += row[at.STRENGTH] * velocity * abs(velocity) ** row[at.A]
    return torque


@compiled()
def move_contact(slow, velocity, dt, e):
    """Age the contact and wind the reversal memory over a step at a constant velocity."""
    if e[at.DWELL, at.STRENGTH] != 0.0:
        row = e[at.DWELL]
        rate = abs(velocity) / row[at.B]
        if rate * dt > 1e-9:
            slow[at.AGE] = 1.0 / rate + (slow[at.AGE] - 1.0 / rate) * math.exp(-rate * dt)
        else:
            slow[at.AGE] += dt
    if e[at.PRESLIDING, at.STRENGTH] != 0.0:
        row = e[at.PRESLIDING]
        travel = velocity * dt / row[at.A]
        if row[at.FORM] == 1.0:
            slow[at.MEMORY] = min(1.0, max(-1.0, slow[at.MEMORY] + travel))
        else:
            direction = math.copysign(1.0, travel)
            gap = 1.0 - direction * slow[at.MEMORY]
            if row[at.FORM] == 2.0:
                slow[at.MEMORY] = direction * (1.0 - gap / (1.0 + abs(travel) * gap))
            else:
                slow[at.MEMORY] = direction * (1.0 - gap * math.exp(-abs(travel)))
