"""Prior of a fit.

That is the bench's model, and how far its tolerances let it be off.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from etb_hil.diagnosis.friction_model import (
    AGEING,
    COULOMB,
    DROP,
    FRICTION_PARAMETERS,
    LAW_PARAMETERS,
    LOG_DAMPING,
    LOG_EXPONENT,
    LOG_ONSET,
    LOG_RENEWAL,
    LOG_SPEED,
    LOG_SQUARE,
    LOG_STIFFNESS,
    VISCOUS,
)
from etb_hil.diagnosis.voltage_balance import VoltageBalance
from etb_hil.observer.normal_equations import accumulate
from etb_hil.plant.exactmath import log
from etb_hil.plant.parameters import Model, ThrottleParameters
from etb_hil.recording.samples import Float64

# Errors of the bench's model, behind the friction's own parameters: shares of the motor constant and of the inertia,
# N·m of the preloads, N·m/rad of the slopes, rad of the motor's angle by a disc of the encoder that is off centre, A of
# the current's zero, s by which the current samples lag.
CONSTANT, INERTIA, PRELOAD_OPEN, PRELOAD_CLOSE, SLOPE_OPEN, SLOPE_CLOSE, DISC_SINE, DISC_COSINE, OFFSET, LAG = range(
    FRICTION_PARAMETERS, LOG_EXPONENT
)
PARAMETERS = LOG_EXPONENT + LAW_PARAMETERS
CERTAIN = 1e18  # inverse variance of a parameter that is held
USUAL = LOG_EXPONENT  # how many the paper's law has: the exponent is 2 there, and contacts do not age

_EVEN = 1.0 / math.sqrt(3.0)  # standard deviation of a value that lies anywhere inside +- 1
ANY_TORQUE = 1.0  # N·m: T_c and T_st are what is asked, nothing is assumed of them
_ANY_FACTOR = 0.5  # of the logarithm of the Stribeck velocity: twice or half the model's is 1.4 standard deviations
_ANY_BRISTLE = 1.0  # of the logarithms of stiffness and damping
_ANY_VISCOSITY = 1.0  # times the model's
# Mean and standard deviation of the logarithm of the Stribeck curve's exponent, where it is not the paper's: 0.5 to 2
# are in use (Armstrong-Helouvry 1991), 8 is a step.
ANY_EXPONENT, _ANY_EXPONENT = 0.0, 0.7
ANY_AGEING = 0.08  # times T_st, a unit of the logarithm of the contacts' age
_ONSET = 0.1  # s
_ANY_AGE = 1.0  # of the logarithms of the way that renews contacts and of the age from which it counts
# Sampled once a control period, just before the voltage steps, the current stands for the end of its period and not
# for its mean: that is a shift by up to half a period, on top of what a sensor's filter delays.
_ANY_LAG = 5e-4  # s
_ANY_DISC = 0.02  # rad, of sine and cosine each: encoders' data sheets have up to 0.4 to 0.6 % of a turn


@dataclass(frozen=True, slots=True)
class Prior:
    """Means (20) and inverse variances (20) of the fit's parameters.

    `stribeck_velocity` in rad/s is the model's. The first `count` parameters are fitted; those behind have the values
    of their means.
    """

    mean: Float64
    precision: Float64
    stribeck_velocity: float
    count: int = USUAL

    def beside(self, jacobian: Float64, residual: Float64, weight: Float64, q: Float64) -> tuple[Float64, Float64]:
        """Return information (p, p) and gradient (p) of the fitted parameters at q (20).

        They are those of windows with a residual (m), its Jacobian (m, p) and weights (m), together with the prior's.
        """
        matrix, gradient = accumulate(jacobian, residual, weight)
        matrix[np.diag_indices(self.count)] += self.precision[: self.count]
        return matrix, gradient + (self.precision * (self.mean - q))[: self.count]


def prior_of(model: Model, throttle: ThrottleParameters, offset_error: float, balance: VoltageBalance | None) -> Prior:
    """Return what is known of the fit's parameters before the fit.

    `offset_error` in A is the standard error of the current's zero.
    """
    mean, spread = np.zeros(PARAMETERS), np.empty(PARAMETERS)
    mean[COULOMB], spread[COULOMB] = throttle.coulomb, ANY_TORQUE
    mean[DROP], spread[DROP] = throttle.stiction - throttle.coulomb, ANY_TORQUE
    mean[LOG_SPEED], spread[LOG_SPEED] = log(throttle.stribeck_velocity), _ANY_FACTOR
    mean[VISCOUS], spread[VISCOUS] = throttle.viscous, _ANY_VISCOSITY * throttle.viscous
    mean[LOG_STIFFNESS], spread[LOG_STIFFNESS] = log(throttle.bristle_stiffness), _ANY_BRISTLE
    mean[LOG_DAMPING], spread[LOG_DAMPING] = log(throttle.bristle_damping), _ANY_BRISTLE
    mean[LOG_EXPONENT], spread[LOG_EXPONENT] = LOG_SQUARE, _ANY_EXPONENT
    spread[AGEING] = ANY_AGEING * throttle.stiction
    # contacts are renewed along the way that bends bristles to the full (Rice and Ruina 1983)
    mean[LOG_RENEWAL], spread[LOG_RENEWAL] = log(throttle.stiction / throttle.bristle_stiffness), _ANY_AGE
    mean[LOG_ONSET], spread[LOG_ONSET] = log(_ONSET), _ANY_AGE
    spread[CONSTANT] = _EVEN * model.tolerance("torque_per_ampere") / throttle.torque_per_ampere
    spread[INERTIA] = _EVEN * model.tolerance("inertia") / throttle.inertia
    for index, name in (
        (PRELOAD_OPEN, "preload_open"),
        (PRELOAD_CLOSE, "preload_close"),
        (SLOPE_OPEN, "slope_open"),
        (SLOPE_CLOSE, "slope_close"),
    ):
        spread[index] = _EVEN * model.tolerance(name)
    spread[[DISC_SINE, DISC_COSINE]] = _ANY_DISC
    spread[OFFSET] = offset_error
    spread[LAG] = _ANY_LAG
    precision = 1.0 / (np.maximum(spread, 1e-9) * np.maximum(spread, 1e-9))
    if balance is not None:
        shift, error = balance.torque_constant_shift(throttle)
        measured = 1.0 / (error * error)
        mean[CONSTANT] = shift * measured / (measured + precision[CONSTANT])
        precision[CONSTANT] += measured
    return Prior(mean, precision, throttle.stribeck_velocity)
