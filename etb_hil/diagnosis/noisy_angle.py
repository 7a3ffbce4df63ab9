"""What noise of the angle adds to the uncertainty.

Bristles follow the measured way, and noise that turns it bends them back: a fit then calls for more friction than there
is. How much, is found by adding as much noise once more (simulation and extrapolation; Cook and Stefanski 1994).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.base.draws import share
from etb_hil.diagnosis.evidence import Evidence
from etb_hil.diagnosis.prior import USUAL, Prior
from etb_hil.diagnosis.stribeck_fit import StribeckFit, linearised, shifted
from etb_hil.diagnosis.ticks import TICK, Ticks
from etb_hil.diagnosis.windows import NARROW, WIDE, Shape, Windows
from etb_hil.plant.parameters import ThrottleParameters
from etb_hil.recording.samples import Float64

# Noise may be as large as this share of the bristles' way, or of the plate's in a tick of slow motion (the slowest
# tenth of windows). Without means a plate track of 12 bits with 0.01 deg of noise, read at 1 kHz, has T_st 6 % too high
# and held in 53 %, with them in all of 40 units (`benchmarks/interval_coverage.py --rate 1000 --track`).
_LITTLE, _OF_WAY, _SLOW = 0.03, 0.2, 0.1
# Share of T_c by which noise may change the inertia's torque in a narrow window. With six times that T_c is known to
# 22 % by narrow windows and to 8 % by wide ones (`interval_coverage.py --track`), with 0.6 of it to the same.
_OF_COULOMB = 0.01
_RAMPS = 0.2  # rad/s, half the speed of the stock checks' slow ramps, which always count
_GAIN = 70.0  # variance of a fourth difference of white noise: 1 + 16 + 36 + 16 + 1


@dataclass(frozen=True, slots=True)
class Quieted:
    """Ticks as they were read, and what lowers the noise of their angle.

    `deviation`: of white noise, rad; `reach`: how many ticks on both sides a mean takes in. `ticks`: those by whose
    angle noise bends bristles little.
    """

    read: Ticks
    deviation: float
    reach: int
    ticks: Ticks

    def noisier(self, deviation: float) -> Ticks:
        """Return the means of the ticks with more noise, of a standard deviation in rad."""
        return _quiet(replace(self.read, angle=_noisier(self.read.angle, deviation)), self.reach)


def shape_for(ticks: Ticks, windows: Windows, throttle: ThrottleParameters) -> Shape:
    """Return the shape of windows for the noise of the ticks' angle.

    `windows` are narrow ones. An angle's noise counts in a window by the inertia's torque.
    """
    if not len(windows):
        return NARROW
    weights = NARROW.acceleration
    noise = throttle.inertia * noise_of(ticks, windows) * math.sqrt(float(np.sum(weights * weights)))
    return WIDE if noise > _OF_COULOMB * throttle.coulomb else NARROW


def slowest_for(ticks: Ticks, windows: Windows, shape: Shape) -> float:
    """Return the speed in rad/s from which windows of a shape count in a fit.

    In slower motion noise of the angle turns bristles, even as a mean over a whole window. `windows` are narrow ones.
    """
    if not len(windows):
        return 0.0
    return min(noise_of(ticks, windows) / (_OF_WAY * math.sqrt(2 * shape.half + 1) * TICK), _RAMPS)


def quieted(ticks: Ticks, windows: Windows, velocity: Float64, bristle: float) -> Quieted:
    """Return ticks whose angle is a mean over as many as it needs.

    `velocity` rad/s of the windows (m); `bristle`: way in rad that bends bristles to the full. An encoder's ticks stay
    as they are: noise that is less than the plate's way turns nothing.
    """
    way, deviation = float(np.quantile(np.abs(velocity), _SLOW)) * TICK, noise_of(ticks, windows)
    count = (deviation / max(_LITTLE * bristle, _OF_WAY * way)) ** 2
    reach = min(max(math.ceil(0.5 * (count - 1.0)), 0), windows.shape.half)
    return Quieted(ticks, deviation, reach, _quiet(ticks, reach))


def _quiet(ticks: Ticks, reach: int) -> Ticks:
    return ticks if reach == 0 else replace(ticks, angle=_means(ticks.time, ticks.angle, reach))


def unsure_by_noise(quiet: Quieted, evidence: Evidence, prior: Prior, fit: StribeckFit) -> StribeckFit:
    """Return a fit with the uncertainty that noise of the angle adds.

    The uncertainty is of first order. Noise of either sign leaves its mean: what goes with the noise itself is in the
    scatter of the run. The rounding of an encoder stands still with the plate: it turns no bristles at rest, and as
    much noise would. Where the angle needs no means, noise counts for other laws than the paper's.
    """
    if quiet.reach == 0 and (evidence.windows.shape is NARROW or prior.count == USUAL):
        return fit
    moved = -fit.residual
    for way in (quiet.deviation, -quiet.deviation):
        noisier = quiet.noisier(way)
        moved = moved + 0.5 * linearised(replace(evidence, ticks=noisier), fit.parameters, prior.count).residual
    return fit.with_error(shifted(evidence, prior, fit, moved))


def noise_of(ticks: Ticks, windows: Windows) -> float:
    """Return the standard deviation of white noise of the ticks' angle in rad.

    A fourth difference leaves little of a motion. The median over windows leaves out blows.
    """
    fourth = np.diff(ticks.angle, 4)
    power = np.concatenate(([0.0], np.cumsum(fourth * fourth)))
    half = windows.shape.half
    begin, end = windows.centre - half, windows.centre + half - 3
    return math.sqrt(float(np.median((power[end] - power[begin]) / (end - begin))) / _GAIN)


@njit(cache=True, error_model="numpy")
def _means(time: Float64, angle: Float64, reach: int) -> Float64:
    """Return means over ticks that follow each other without a gap (n).

    They take in up to `reach` of them on both sides, as many on each.
    """
    found = angle.copy()
    for k in range(len(angle)):
        for j in range(1, min(reach, k, len(angle) - 1 - k) + 1):
            if time[k + j] - time[k - j] > (2 * j + 0.5) * TICK:
                break
            found[k] += ((angle[k + j] + angle[k - j]) - 2.0 * found[k]) / (2 * j + 1)
    return found


@njit(cache=True, error_model="numpy")
def _noisier(angle: Float64, deviation: float) -> Float64:
    """Return angles (n) with more noise, evenly distributed."""
    found, width = angle.copy(), deviation * math.sqrt(12.0)
    for k in range(len(angle)):
        found[k] += width * (share(k) - 0.5)
    return found
