"""The plate sensor lags its shaft."""

from __future__ import annotations

import numpy as np
from numba import njit

from etb_hil.plant.effects.effect import Balance, Effect, Parity, shape, strength
from etb_hil.plant.effects.layout import row
from etb_hil.plant.physics import Vector

_K = row("sensor_hysteresis")

EFFECT = Effect(
    id="sensor_hysteresis",
    equation="theta_measured = play of half width h, softened: dy = d theta (abs(e) / h)^m where e grows",
    balance=Balance.ANGLE,
    parity=Parity.ODD,
    parameters=(
        strength("half_width", "rad", -0.0005, 0.03, (0.0015,), "0.25 %, up to 0.27 deg"),
        shape("sharpness", "1", 0.3, 20.0, (20.0, 1.5), "20: free play; less: a rounded loop"),
    ),
    looks_like="the plate sensor lags by a constant amount, by direction",
    check="second sensor",
    look_alikes=("gear_backlash",),
    separated_by="a second sensor on the same shaft",
    source="sensor data sheets",
    is_one_way=True,
)


def measured_plate(plate: Vector, p: Vector) -> Vector:
    """Return what the sensor makes of a plate angle (n) in rad."""
    if p[_K] == 0.0:
        return plate
    out = np.empty_like(plate)
    _lag(plate, max(abs(p[_K]), 1e-6), p[_K + 1], out)
    return out if p[_K] > 0.0 else 2.0 * plate - out


@njit(cache=True, error_model="numpy")
def lagged(behind: float, way: float, half: float, sharpness: float) -> float:
    """Return how far in rad a sensor lags that lagged by `behind`, after its shaft has gone a way in rad."""
    if behind * way >= 0.0:
        way *= 1.0 - min(abs(behind) / half, 1.0) ** sharpness
    return min(max(behind + way, -half), half)


@njit(cache=True, error_model="numpy", nogil=True)
def _lag(plate: Vector, half: float, sharpness: float, out: Vector) -> None:
    behind = 0.0
    out[0] = plate[0]
    for k in range(1, len(plate)):
        behind = lagged(behind, plate[k] - plate[k - 1], half, sharpness)
        out[k] = plate[k] - behind
