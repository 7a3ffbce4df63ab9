"""Blocks of samples at rest, in which a record shows its sensors alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.measured.measurement import Measurement

_BLOCK = 0.05  # s
_RESTS = 10.0  # times the angle's noise within a block that rests


@dataclass(frozen=True, slots=True)
class Blocks:
    """A measurement in `count` blocks of `samples`, and which of them rest (count)."""

    samples: int
    count: int
    rests: NDArray[np.bool_]

    @staticmethod
    def of(measured: Measurement) -> Blocks:
        """Return the blocks; one rests if all is good and the angle is within its noise."""
        samples = max(round(_BLOCK * measured.rate), 8)
        count = len(measured) // samples
        angle, is_good = (_cut(values, samples, count) for values in (measured.angle, measured.is_good))
        stays = np.ptp(angle, axis=1) <= _RESTS * measured.angle_noise
        return Blocks(samples, count, is_good.all(axis=1) & stays)

    def cut(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return a signal (n) by block (count, samples)."""
        return _cut(values, self.samples, self.count)


def _cut(values: NDArray[Any], samples: int, count: int) -> NDArray[Any]:
    return values[: count * samples].reshape(count, samples)
