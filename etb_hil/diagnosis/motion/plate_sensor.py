"""The plate sensor against the motor's encoder, on slow passes.

The passes go in both directions.

The largest of many noisy values is too large. Each half of the samples therefore says where the extreme lies, and the
other half how large the value is there: what is read is independent of what was chosen (cross-validation, Stone 1974).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.diagnosis.half_width import combined
from etb_hil.diagnosis.measurement_kind import Estimate
from etb_hil.diagnosis.motion.commands import reports
from etb_hil.diagnosis.motion.passes import Bins, presliding, slow_passes
from etb_hil.diagnosis.motion.sensors import plate_rounding
from etb_hil.diagnosis.segments import Segment
from etb_hil.recording.samples import Float64

if TYPE_CHECKING:
    from etb_hil.diagnosis.findings import Findings

BIN = math.radians(1.0)
_FEWEST = 20  # bins: a quarter of the way
_DIFFERENCE = "plate_less_encoder"


def deviation(run: Findings) -> Estimate | None:
    """Return half the range of the difference between the sensors.

    The half range is that over both directions.
    """

    def ends(profile: Float64) -> Float64:
        weights = np.zeros(profile.shape)
        weights.flat[int(np.argmax(profile))] = 0.5
        weights.flat[int(np.argmin(profile))] = -0.5
        return weights

    return _largest(run, ends)


def hysteresis(run: Findings) -> Estimate | None:
    """Return the largest difference between opening and closing at one angle."""

    def place(profile: Float64) -> Float64:
        weights, apart = np.zeros(profile.shape), profile[0] - profile[1]
        largest = int(np.argmax(np.abs(apart)))
        sign = math.copysign(1.0, float(apart[largest]))
        weights[:, largest] = sign, -sign
        return weights

    return _largest(run, place)


def difference(run: Findings) -> Bins | None:
    """Return the plate sensor's angle less the encoder's, on slow passes.

    None where they cover too little.
    """
    segments = [_with_difference(segment, None) for segment in run.of("ramp")]
    found = slow_passes(segments, _DIFFERENCE, BIN, presliding(run))
    return found if len(found) >= _FEWEST else None


def _largest(run: Findings, choose: Callable[[Float64], Float64]) -> Estimate | None:
    """Return an extreme of the difference: a weighted sum of few of its values.

    `choose` gives the weights (2, m) to a profile (2, m). Chosen by noise, the place is not always that of the extreme,
    so that this is too small in the mean; the extreme of all samples is too large. The interval reaches from what lies
    below the one to what lies above the larger of them.
    """
    halves = run.once(_halves)
    if halves is None:
        return None
    first, second = halves
    read = []
    for chosen, other in ((first, second), (second, first)):
        weights = choose(_smooth(chosen.value))
        error = np.sqrt(np.sum(weights * weights * other.error * other.error))
        read.append((float(np.sum(weights * other.value)), float(error), float(np.sqrt(np.sum(weights * weights)))))
    value = 0.5 * (read[0][0] + read[1][0])
    reach = combined((read[0][2] * plate_rounding(run.model),), 0.5 * math.hypot(read[0][1], read[1][1]))
    whole = _smooth(0.5 * (first.value + second.value))
    most = max(value, float(np.sum(choose(whole) * whole)))
    note = f"of {len(first)} bins of 1 deg, each way"
    return Estimate(max(value, 0.0), max(value - reach, 0.0), max(most + reach, 0.0), note)


def _halves(run: Findings) -> tuple[Bins, Bins] | None:
    """Return the difference by each half of the samples, over the same bins.

    One half is every other sample, the other half those between.
    """
    found = []
    for half in (0, 1):
        segments = [_with_difference(segment, half) for segment in run.of("ramp")]
        found.append(slow_passes(segments, _DIFFERENCE, BIN, presliding(run)))
    numbers = [np.floor(bins.angle[0] / BIN).astype(np.int64) for bins in found]
    _, *places = np.intersect1d(*numbers, return_indices=True)
    first, second = (
        Bins(bins.angle[:, at], bins.value[:, at], bins.error[:, at]) for bins, at in zip(found, places, strict=True)
    )
    return (first, second) if len(first) >= _FEWEST else None


def _with_difference(segment: Segment, half: int | None) -> Segment:
    """Return a segment with a column of the difference of the sensors.

    The difference is from one `half` of the samples that are new, or from all.
    """
    column: Float64 = segment.column("throttle_angle") - segment.column("angle")
    if half is not None:
        kept = np.full(len(column), np.nan)
        taken = reports(segment).first[half::2]
        kept[taken] = column[taken]
        column = kept
    return replace(segment, columns={**segment.columns, _DIFFERENCE: column})


def _smooth(profile: Float64) -> Float64:
    """Return means (2, m) over three neighbouring bins, two at the ends."""
    wide = np.pad(profile, ((0, 0), (1, 1)))
    count = np.pad(np.ones(profile.shape[1]), 1)
    return (wide[:, :-2] + wide[:, 1:-1] + wide[:, 2:]) / (count[:-2] + count[1:-1] + count[2:])
