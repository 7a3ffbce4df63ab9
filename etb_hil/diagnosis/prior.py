"""What is known before a fit: the bench's model and how far its tolerances let it be off."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from etb_hil.diagnosis.friction_model import (
    COULOMB,
    DROP,
    FRICTION_PARAMETERS,
    LOG_DAMPING,
    LOG_SPEED,
    LOG_STIFFNESS,
    VISCOUS,
)
from etb_hil.diagnosis.voltage_balance import VoltageBalance
from etb_hil.plant.exactmath import log
from etb_hil.plant.parameters import Model, ThrottleParameters
from etb_hil.recording.samples import Float64

# Errors of the bench's model, behind the friction's own parameters: shares of the motor constant and of the inertia,
# N·m of the preloads, N·m/rad of the slopes, A of the current's zero, s by which the current samples lag.
CONSTANT, INERTIA, PRELOAD_OPEN, PRELOAD_CLOSE, SLOPE_OPEN, SLOPE_CLOSE, OFFSET, LAG = range(
    FRICTION_PARAMETERS, FRICTION_PARAMETERS + 8
)
PARAMETERS = FRICTION_PARAMETERS + 8

_EVEN = 1.0 / math.sqrt(3.0)  # standard deviation of a value that lies anywhere inside +- 1
_ANY_TORQUE = 1.0  # N·m: T_c and T_st are what is asked, nothing is assumed of them
_ANY_FACTOR = 0.5  # of the logarithm of the Stribeck velocity: twice or half the model's is 1.4 standard deviations
_ANY_BRISTLE = 1.0  # of the logarithms of stiffness and damping
_ANY_VISCOSITY = 1.0  # times the model's
# Sampled once a control period, just before the voltage steps, the current stands for the end of its period and not
# for its mean: that is a shift by up to half a period, on top of what a sensor's filter delays.
_ANY_LAG = 5e-4  # s


@dataclass(frozen=True, slots=True)
class Prior:
    """Means (14) and inverse variances (14) of the fit's parameters; the model's `stribeck_velocity` in rad/s."""

    mean: Float64
    precision: Float64
    stribeck_velocity: float


def prior_of(model: Model, throttle: ThrottleParameters, offset_error: float, balance: VoltageBalance | None) -> Prior:
    """Return what is known before a fit; `offset_error` in A is the standard error of the current's zero."""
    mean, spread = np.zeros(PARAMETERS), np.empty(PARAMETERS)
    mean[COULOMB], spread[COULOMB] = throttle.coulomb, _ANY_TORQUE
    mean[DROP], spread[DROP] = throttle.stiction - throttle.coulomb, _ANY_TORQUE
    mean[LOG_SPEED], spread[LOG_SPEED] = log(throttle.stribeck_velocity), _ANY_FACTOR
    mean[VISCOUS], spread[VISCOUS] = throttle.viscous, _ANY_VISCOSITY * throttle.viscous
    mean[LOG_STIFFNESS], spread[LOG_STIFFNESS] = log(throttle.bristle_stiffness), _ANY_BRISTLE
    mean[LOG_DAMPING], spread[LOG_DAMPING] = log(throttle.bristle_damping), _ANY_BRISTLE
    spread[CONSTANT] = _EVEN * model.tolerance("torque_per_ampere") / throttle.torque_per_ampere
    spread[INERTIA] = _EVEN * model.tolerance("inertia") / throttle.inertia
    for index, name in (
        (PRELOAD_OPEN, "preload_open"),
        (PRELOAD_CLOSE, "preload_close"),
        (SLOPE_OPEN, "slope_open"),
        (SLOPE_CLOSE, "slope_close"),
    ):
        spread[index] = _EVEN * model.tolerance(name)
    spread[OFFSET] = offset_error
    spread[LAG] = _ANY_LAG
    precision = 1.0 / (np.maximum(spread, 1e-9) * np.maximum(spread, 1e-9))
    if balance is not None:
        shift, error = balance.torque_constant_shift(throttle)
        measured = 1.0 / (error * error)
        mean[CONSTANT] = shift * measured / (measured + precision[CONSTANT])
        precision[CONSTANT] += measured
    return Prior(mean, precision, throttle.stribeck_velocity)
