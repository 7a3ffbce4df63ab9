"""The throttle once more, written from the paper and solved by ODEPACK's LSODA: what the plant is checked against."""

import math

import numpy as np
from scipy.integrate import odeint

CONTROL_PERIOD = 1e-3
SAMPLES = 20  # a control period


def friction(omega, z, v, elastic=0.0):
    """Seed paper, eq. (2); Dupont et al. (2002) with bristles that are elastic up to a share of friction."""
    g = v.coulomb + (v.stiction - v.coulomb) * math.exp(-((omega / v.stribeck_velocity) ** 2))
    z_dot = omega - v.bristle_stiffness * abs(omega) / g * z
    if elastic > 0.0:
        bent = v.bristle_stiffness * z * math.copysign(1.0, omega) / g
        z_dot = omega * (1.0 - max(bent - elastic, 0.0) / (1.0 - elastic))
    return v.bristle_stiffness * z + v.bristle_damping * z_dot + v.viscous * omega, z_dot


def springs(theta, v):
    """Seed paper, fig. 3; the jump is a smooth step over the dead zone, zero at limp-home."""
    x = theta - v.limp_home
    u = min(abs(x) / v.dead_zone, 1.0)
    side = v.preload_open + v.slope_open * x if x > 0 else -v.preload_close + v.slope_close * x
    return side * (3 * u**2 - 2 * u**3)


def stops(theta, omega, v):
    """A spring and a damper at each end of the stroke that cannot pull."""
    if theta > v.stop_high:
        return max(0.0, v.stop_stiffness * (theta - v.stop_high) + v.stop_damping * omega)
    if theta < v.stop_low:
        return min(0.0, v.stop_stiffness * (theta - v.stop_low) + v.stop_damping * omega)
    return 0.0


def rates(y, v, voltage):
    """Seed paper, eq. (1); voltage None holds the current."""
    theta, omega, z, current = y
    torque, z_dot = friction(omega, z, v)
    acceleration = (v.torque_per_ampere * current - torque - springs(theta, v) - stops(theta, omega, v)) / v.inertia
    current_rate = 0.0 if voltage is None else (voltage - v.resistance * current - v.back_emf * omega) / v.inductance
    return omega, acceleration, z_dot, current_rate


def solve(y, times, v, voltage):
    """States (n, 4) at the times from y at the first of them, under a constant voltage."""
    return odeint(
        lambda y, _: rates(y, v, voltage), y, times, rtol=1e-10, atol=[1e-13, 1e-11, 1e-15, 1e-11], mxstep=100_000
    )


def coast(y, times, v):
    """States (n, 4) with the bridge open: the diodes put the supply against the current until it is gone."""
    if y[3] == 0.0:
        return solve(y, times, v, None)
    against = -math.copysign(v.supply_voltage, y[3])
    rows = solve(y, times, v, against)
    still = int(np.argmin(rows[:, 3] * y[3] > 0.0)) if np.any(rows[:, 3] * y[3] <= 0.0) else len(rows)
    if still == len(rows):
        return rows
    start, low, high = times[still - 1], times[still - 1], times[still]
    gone = before = rows[still - 1]
    while high - low > 1e-13:
        middle = 0.5 * (low + high)
        trial = solve(before, [start, middle], v, against)[-1]
        if trial[3] * y[3] > 0.0:
            low, gone = middle, trial
        else:
            high = middle
    free = solve([*gone[:3], 0.0], [low, *times[still:]], v, None)[1:]
    return np.concatenate([rows[:still], free])


def closed_loop(v, controller, theta, duration):
    """States (n, 4) every 50 us under a controller called each millisecond with its number and the state."""
    rows = [np.array([[theta, 0.0, 0.0, 0.0]])]
    times = np.linspace(0.0, CONTROL_PERIOD, SAMPLES + 1)
    for period in range(round(duration / CONTROL_PERIOD)):
        y = rows[-1][-1]
        voltage = controller(period, y)
        rows.append((coast(y, times, v) if math.isnan(voltage) else solve(y, times, v, voltage))[1:])
    return np.concatenate(rows)
