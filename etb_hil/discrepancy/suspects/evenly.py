"""A record with uniform weighting: all samples of a balance have one weight, whatever their noise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.calibration import Calibration
from etb_hil.discrepancy.fitting.fit import Residual, columns, fit_of
from etb_hil.discrepancy.measured.regimes import STOP
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.physics import Vector

Float64 = NDArray[np.float64]

_LEAST_NOISE = 0.2  # of what the sensors promise: a balance is not believed to know better


def evenly(balances: Sequence[Balances], healthy: Calibration, whole: Vector) -> tuple[Residual, Calibration]:
    """Return the residual of a record without a cause, weighed evenly, and its calibration linearised at `whole`.

    A sample weighs by the noise of its whole balance, the torque on the stops by its own. Samples in which the plate
    rests count, too: they blame nobody, but what two causes would do there is known of both.
    """
    weights = [_weights(b, healthy.fit.whole) for b in balances]

    def residual(moved: Vector) -> Float64:
        return np.concatenate([_channels(b, moved) * weight for b, weight in zip(balances, weights, strict=True)])

    fit = fit_of(residual, whole)
    return residual, Calibration(healthy.unknowns, fit, columns(residual, fit, healthy.unknowns))


def _channels(balances: Balances, whole: Vector) -> Float64:
    return np.concatenate(balances.channels(whole[:EXTENDED], whole[EXTENDED:]))


def _weights(balances: Balances, whole: Vector) -> Float64:
    """Return one over the noise (3 m) that the model's own simulation shows; zero where a balance cannot be judged."""
    left = _channels(balances, whole).reshape(3, -1)
    found = np.zeros(left.shape)
    on_stop = balances.regimes.label == STOP
    for channel, is_there in enumerate(balances.has):
        parts = [on_stop, ~on_stop] if channel == 0 else [np.ones(len(on_stop), bool)]
        for part in parts:
            rows = part & balances.regimes.is_good
            if is_there and rows.any():
                found[channel, rows] = 1.0 / max(float(np.sqrt(np.mean(left[channel, rows] ** 2))), _LEAST_NOISE)
    return found.ravel()
