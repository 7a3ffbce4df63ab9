"""Motor and bridge: constant, resistance, losses between the commanded and the working voltage."""

import math

from generator import layout as at
from generator.compiled import compiled
from generator.shapes import step, wave

RATED_SUPPLY = 13.5  # V: what the controller turns a commanded voltage into a duty with
FREEWHEEL = 1e-3  # s: the current dies away through the diodes once the bridge is open


@compiled()
def magnet_factor(slow, e):
    """What heat leaves of the magnets' flux."""
    if e[at.MAGNET_HEAT, at.STRENGTH] == 0.0:
        return 1.0
    row = e[at.MAGNET_HEAT]
    warm = slow[at.MAGNET] - 25.0
    curve = warm + (0.004 * warm * abs(warm) if row[at.FORM] == 1.0 else 0.0)
    return 1.0 - row[at.STRENGTH] * 0.002 * curve


@compiled()
def position_ripple(angle, p, e):
    """Relative torque ripple over the rotor's position."""
    if e[at.RIPPLE, at.STRENGTH] == 0.0:
        return 0.0
    row = e[at.RIPPLE]
    return row[at.STRENGTH] * wave(row[at.A] * p[at.N] * angle + row[at.B], row[at.FORM])


@compiled()
def motor_torque(angle, current, slow, p, e):
    """Torque of the current and of the magnets at the throttle shaft, N·m."""
    factor = magnet_factor(slow, e) * (1.0 + position_ripple(angle, p, e))
    if e[at.SATURATION, at.STRENGTH] != 0.0:
        row = e[at.SATURATION]
        x = row[at.STRENGTH] * current * current
        factor *= 1.0 / (1.0 + x) if row[at.FORM] == 0.0 else math.exp(-x)
    torque = p[at.K] * p[at.N] * factor * current
    if e[at.COGGING, at.STRENGTH] != 0.0:
        row = e[at.COGGING]
        torque += row[at.STRENGTH] * wave(row[at.A] * p[at.N] * angle + row[at.B], row[at.FORM])
    return torque


@compiled()
def back_emf(angle, velocity, slow, p, e):
    """Voltage of the turning rotor, V; ripple enters it where the ripple comes from the flux (C set)."""
    ripple = position_ripple(angle, p, e) * e[at.RIPPLE, at.C]
    return p[at.K] * p[at.N] * magnet_factor(slow, e) * (1.0 + ripple) * velocity


@compiled()
def voltage_drop(angle, current, slow, p, e):
    """Voltage over winding and brushes, V."""
    resistance = p[at.R]
    if e[at.COPPER_HEAT, at.STRENGTH] != 0.0:
        row = e[at.COPPER_HEAT]
        resistance *= 1.0 + 0.00393 * row[at.STRENGTH] * (slow[at.WINDING] - 25.0)
    if e[at.BRUSH_CONTACT, at.STRENGTH] != 0.0:
        row = e[at.BRUSH_CONTACT]
        resistance *= 1.0 + row[at.STRENGTH] * wave(row[at.A] * p[at.N] * angle + row[at.B], row[at.FORM])
    drop = resistance * current
    if e[at.BRUSH_DROP, at.STRENGTH] != 0.0:
        row = e[at.BRUSH_DROP]
        drop += row[at.STRENGTH] * step(current / row[at.A], row[at.FORM])
    return drop


@compiled()
def terminal_voltage(command, current, time, e):
    """Voltage at the motor's terminals and supply at the controller for a commanded voltage, V."""
    supply = RATED_SUPPLY
    duty = command / RATED_SUPPLY
    if e[at.SAG, at.STRENGTH] != 0.0:
        row = e[at.SAG]
        drawn = duty * current if row[at.FORM] == 0.0 else abs(current)
        supply -= row[at.STRENGTH] * drawn + row[at.A] * row[at.STRENGTH]
    voltage = duty * supply
    if e[at.SUPPLY_RIPPLE, at.STRENGTH] != 0.0:
        row = e[at.SUPPLY_RIPPLE]
        phase = row[at.A] * time + 2.0 * math.sin(row[at.B] * time)
        voltage += duty * row[at.STRENGTH] * wave(phase, row[at.FORM])
    if e[at.DEAD_TIME, at.STRENGTH] != 0.0:
        row = e[at.DEAD_TIME]
        # The current's ripple crosses zero within +-A: there the error fades out.
        x = min(1.0, max(-1.0, current / row[at.A]))
        if row[at.FORM] == 1.0:
            x = 0.5 * x * (3.0 - x * x)
        elif row[at.FORM] == 2.0:
            x = x * abs(x)
        voltage -= row[at.STRENGTH] * x * supply / RATED_SUPPLY
    return voltage, supply


@compiled()
def warm(slow, current, housing, dt, p, e):
    """Move winding and magnet temperature over a step, degC."""
    if e[at.COPPER_HEAT, at.STRENGTH] != 0.0:
        row = e[at.COPPER_HEAT]
        target = housing + row[at.A] * p[at.R] * current * current
        slow[at.WINDING] += dt / row[at.B] * (target - slow[at.WINDING])
    if e[at.MAGNET_HEAT, at.STRENGTH] != 0.0:
        row = e[at.MAGNET_HEAT]
        slow[at.MAGNET] += dt / row[at.A] * (housing - slow[at.MAGNET])
