"""Pearson type III distributions, fitted by L-moments."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import betainc, gammainc, gammaincinv, gammaln

from etb_hil.recording.samples import Float64

_SHAPES = np.geomspace(0.05, 2e4, 600)  # of a gamma distribution; the last is normal for all that 3 sigma shows
_SKEWS = 6.0 * betainc(_SHAPES, 2.0 * _SHAPES, 1.0 / 3.0) - 3.0  # their L-skewness (Hosking and Wallis 1997, A.9)


@dataclass(frozen=True, slots=True)
class Pearson:
    """Pearson type III distributions (k): mean, shape and scale of a gamma.

    A scale below zero skews to the left.
    """

    mean: Float64
    shape: Float64
    scale: Float64

    @classmethod
    def of(cls, samples: Float64) -> Pearson:
        """Return the distributions of samples (k, n) by L-moments (Hosking 1990)."""
        count = samples.shape[1]
        place = np.arange(count)
        ordered = np.sort(samples, axis=1)
        b0, b1 = ordered.mean(axis=1), (ordered * (place / (count - 1))).mean(axis=1)
        b2 = (ordered * (place * (place - 1) / ((count - 1) * (count - 2)))).mean(axis=1)
        width = 2.0 * b1 - b0
        skew = (6.0 * b2 - 6.0 * b1 + b0) / width
        shape = np.exp(np.interp(-np.abs(skew), -_SKEWS, np.log(_SHAPES)))
        scale = np.sqrt(np.pi) * width * np.exp(gammaln(shape) - gammaln(shape + 0.5))
        return cls(b0, shape, np.where(skew < 0.0, -scale, scale))

    def quantiles(self, shares: Float64) -> Float64:
        """Return the quantiles (k, q) of some shares (q)."""
        mean, shape, scale = (each[:, None] for each in (self.mean, self.shape, self.scale))
        share = np.where(scale > 0.0, shares, 1.0 - shares)
        found: Float64 = mean + scale * (gammaincinv(shape, share) - shape)
        return found

    def distance(self, samples: Float64) -> Float64:
        """Return the Cramer-von Mises distance (k) of samples (k, n).

        The distance is that from their distributions.
        """
        mean, shape, scale = (each[:, None] for each in (self.mean, self.shape, self.scale))
        below = gammainc(shape, np.maximum(shape + (samples - mean) / scale, 0.0))
        share = np.sort(np.where(scale > 0.0, below, 1.0 - below), axis=1)
        count = samples.shape[1]
        apart: Float64 = ((share - (np.arange(count) + 0.5) / count) ** 2).sum(axis=1)
        return apart
