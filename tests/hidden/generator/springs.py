"""What holds the plate: two springs about limp-home, the stops, flow; even in direction."""

import math

from generator import layout as at
from generator.compiled import compiled
from generator.shapes import bump


@compiled()
def smooth_rise(x):
    """Rise of the preload over the dead zone, 0 at limp-home to 1 at its edge: the cubic that a model file means."""
    return x * x * (3.0 - 2.0 * x) if x < 1.0 else 1.0


@compiled()
def spring_torque(angle, inputs, p, e):
    """Torque that drives the plate towards limp-home, N·m, positive above it."""
    centre, half = p[at.LIMP_HOME], p[at.DEAD_ZONE]
    half_above = half_below = half
    if e[at.LIMP_HOME_ZONE, at.STRENGTH] != 0.0:
        row = e[at.LIMP_HOME_ZONE]
        if row[at.FORM] == 1.0:
            half_above += 2.0 * row[at.STRENGTH]
        elif row[at.FORM] == 2.0:
            half_below += 2.0 * row[at.STRENGTH]
        else:
            half_above += row[at.STRENGTH]
            half_below += row[at.STRENGTH]
    away = angle - centre
    below = away < 0.0
    share = smooth_rise(abs(away) / (half_below if below else half_above))
    preload, slope = (p[at.PRELOAD_CLOSE], p[at.SLOPE_CLOSE]) if below else (p[at.PRELOAD_OPEN], p[at.SLOPE_OPEN])
    size = preload + e[at.PRELOAD_SHIFT, at.STRENGTH] + slope * abs(away)
    torque = -share * size if below else share * size
    if e[at.SPRING_HEAT, at.STRENGTH] != 0.0:
        torque *= 1.0 - e[at.SPRING_HEAT, at.STRENGTH] * (inputs[at.IN_TEMPERATURE] - 25.0) / 30.0
    return torque + shape_error(away, e) + flow_torque(angle, p, e)


@compiled()
def shape_error(away, e):
    """Departure of the springs from a line: 0 square, 1 cube, 2 coils that bind, 3 a knee."""
    if e[at.SPRING_SHAPE, at.STRENGTH] == 0.0:
        return 0.0
    row = e[at.SPRING_SHAPE]
    x = abs(away)
    if row[at.FORM] == 1.0:
        curve = x * x * x
    elif row[at.FORM] == 2.0:
        curve = (math.exp(3.0 * x) - 1.0 - 3.0 * x) / 20.0
    elif row[at.FORM] == 3.0:
        curve = max(0.0, x - row[at.A])
    else:
        curve = x * x
    return row[at.STRENGTH] * math.copysign(curve, away)


@compiled()
def flow_torque(angle, p, e):
    """Closing torque of the air flow, N·m: 0 double angle, 1 cubic, 2 a hump."""
    if e[at.AERODYNAMIC, at.STRENGTH] == 0.0:
        return 0.0
    row = e[at.AERODYNAMIC]
    x = min(1.0, max(0.0, (angle - p[at.STOP_LOW]) / (p[at.STOP_HIGH] - p[at.STOP_LOW])))
    if row[at.FORM] == 1.0:
        return row[at.STRENGTH] * 6.75 * x * (1.0 - x) * (1.0 - x)
    if row[at.FORM] == 2.0:
        return row[at.STRENGTH] * bump((x - row[at.A]) / 0.3, 0.0)
    return row[at.STRENGTH] * math.sin(math.pi * x ** row[at.B])


@compiled()
def stop_torque(angle, velocity, p, e):
    """Torque of the end stops against penetration, N·m; a stop pushes and never pulls."""
    torque = 0.0
    if angle > p[at.STOP_HIGH]:
        depth = angle - p[at.STOP_HIGH]
        torque = max(0.0, p[at.STOP_STIFFNESS] * depth + p[at.STOP_DAMPING] * velocity)
    elif angle < p[at.STOP_LOW]:
        depth = p[at.STOP_LOW] - angle
        torque = -max(0.0, p[at.STOP_STIFFNESS] * depth - p[at.STOP_DAMPING] * velocity)
    if e[at.SOFT_STOP, at.STRENGTH] != 0.0:
        row = e[at.SOFT_STOP]
        torque += soft_layer(angle - (p[at.STOP_HIGH] - row[at.A]), velocity, row)
        torque -= soft_layer((p[at.STOP_LOW] + row[at.B]) - angle, -velocity, row)
    return torque


@compiled()
def soft_layer(depth, closing_velocity, row):
    """A layer before the stop: 0 linear, 1 Hertz, 2 square; its damping grows with its stiffness."""
    if depth <= 0.0:
        return 0.0
    if row[at.FORM] == 1.0:
        force = (depth / 0.02) ** 1.5 * 0.02
    elif row[at.FORM] == 2.0:
        force = depth * depth / 0.02
    else:
        force = depth
    return max(0.0, row[at.STRENGTH] * (force + row[at.C] * depth / 0.02 * closing_velocity))
