"""Uniform weighting: all samples of a balance have one weight."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import Calibration
from etb_hil.discrepancy.fitting.fit import Residual, fit_of, jacobian
from etb_hil.discrepancy.measured.regimes import STOP
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.physics import Vector

Float64 = NDArray[np.float64]

_LEAST_NOISE = 0.2  # of what the sensors promise: a balance is not believed to know better


def uniformly_weighted(
    balances: Sequence[Balances], healthy: Calibration, whole: Vector
) -> tuple[Residual, Calibration]:
    """Return the residual of a record without a cause, uniformly weighted, linearised.

    The calibration is linearised at `whole`. A sample's weight is the noise of its whole balance; torque on the stops
    has its own. Samples in which the plate rests count, too: they are no evidence, but what two causes would do there
    is known of both.
    """
    weights = [_weights(b, healthy.fit.whole) for b in balances]

    def residual(moved: Vector) -> Float64:
        return np.concatenate([_channels(b, moved) * weight for b, weight in zip(balances, weights, strict=True)])

    fit = fit_of(residual, whole)
    return residual, Calibration(healthy.unknowns, fit, jacobian(residual, fit, healthy.unknowns))


def _channels(balances: Balances, whole: Vector) -> Float64:
    return np.concatenate(balances.channels(whole[:EXTENDED], whole[EXTENDED:]))


def _weights(balances: Balances, whole: Vector) -> Float64:
    """Return the reciprocal noise (3 m) of the model's own simulation, else zero."""
    left = _channels(balances, whole).reshape(3, -1)
    found = np.zeros(left.shape)
    on_stop = balances.regimes.label == STOP
    for channel, is_there in enumerate(balances.has):
        parts = [on_stop, ~on_stop] if channel == 0 else [np.ones(len(on_stop), bool)]
        for part in parts:
            samples = part & balances.regimes.is_good
            if is_there and samples.any():
                found[channel, samples] = 1.0 / max(float(np.sqrt(np.mean(left[channel, samples] ** 2))), _LEAST_NOISE)
    return found.ravel()
