"""Regimes of motion, each with a noise floor: on a stop, nearly at rest, sliding."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from etb_hil.discrepancy.measured.measurement import Measurement
from etb_hil.discrepancy.measured.spectrum import Spectrum
from etb_hil.plant.parameters import Model
from etb_hil.recording.samples import Float64

STOP, SLOW, SLIDING = 0, 1, 2
REGIMES = ("stop", "slow", "sliding")
_SLOW = 0.04  # of omega_s
_NEAR = 0.012  # rad from where the model has the stop
_REST = 0.04  # s
# Bristles give way under a dither that no encoder shows: a plate that creeps like this is held by unknown friction.
_CREEP = 0.08  # of T_c / sigma_0 in twice that time
_SETTLES = 5.0  # times T_st / sigma_0 that a plate goes until nothing is left of what held it when the record began
_COUNTS = 8.0  # times the noise of the angle: some two counts of its encoder
_AROUND = 0.04  # s that the filter smears a stop over, or what held the plate
GUARD_TIME = 0.1  # s about a bad sample that are not judged: a filter carries it there
# What a true model leaves of the torque balance, before the case's own noise floor is known.
_START = np.array([4.0, 3.0, 1.0])  # by regime


@dataclass(frozen=True, slots=True)
class Regimes:
    """`label` (m) by sample at the output rate; `is_good` (m) False where bridged.

    `is_stuck` (m): the plate rests off the stops, and its friction is unknown: the torque balance says nothing.
    `has_slid` (m): the plate has moved so far that the friction state at the beginning of the record is forgotten.
    """

    label: NDArray[np.int64]
    is_good: NDArray[np.bool_]
    is_stuck: NDArray[np.bool_]
    has_slid: NDArray[np.bool_]

    @staticmethod
    def of(measured: Measurement, model: Model, spectrum: Spectrum, angle: Float64, velocity: Float64) -> Regimes:
        """Return the regimes of a measured motion (n) at the throttle shaft."""
        v = model.values
        near = (angle > v.stop_high - _NEAR) | (angle < v.stop_low + _NEAR)
        near = _widened(near, round(_AROUND * measured.rate))
        width = 2 * max(round(0.016 * measured.rate / 2), 0) + 1
        calm = np.convolve(np.abs(velocity), np.full(width, 1.0 / width), "same")
        label = np.where(near, STOP, np.where(calm < _SLOW * v.stribeck_velocity, SLOW, SLIDING))
        good = ~_widened(~measured.is_good, round(GUARD_TIME * measured.rate))
        stuck = ~near & _resting(
            angle,
            max(round(_REST * measured.rate), 1),
            max(_COUNTS * measured.angle_noise, _CREEP * v.coulomb / v.bristle_stiffness),
        )
        held = np.maximum.accumulate(np.abs(angle - angle[0])) < _SETTLES * v.stiction / v.bristle_stiffness
        slid = ~_widened(held, round(_AROUND * measured.rate))
        return Regimes(spectrum.picked(label), spectrum.picked(good), spectrum.picked(stuck), spectrum.picked(slid))

    def after_first_slide(self) -> Regimes:
        """Return the regimes with no torque judged before the plate first slid."""
        return replace(self, is_stuck=self.is_stuck | ~self.has_slid)

    def start_weights(self, has: tuple[bool, bool, bool]) -> Float64:
        """Return weights (3 m) of the balances until the noise floor is known."""
        torque = np.where(self.is_stuck, 0.0, 1.0 / _START[self.label])
        parts = [torque, np.ones(len(self.label)), np.ones(len(self.label))]
        return np.concatenate([w * self.is_good * there for w, there in zip(parts, has, strict=True)])

    def groups(self) -> NDArray[np.int64]:
        """Return the group (3 m) of each sample: 3 times channel plus regime, else -1."""
        each = np.where(self.is_good, self.label, -10)
        groups = [np.where(each >= 0, 3 * channel + each, -1) for channel in range(3)]
        groups[0] = np.where(self.is_stuck, -1, groups[0])
        return np.concatenate(groups)


def _resting(angle: Float64, half: int, most: float) -> NDArray[np.bool_]:
    """Return where (n) the angle stays within `most` rad for `half` samples around."""
    padded = np.pad(angle, half, mode="edge")
    blocks = np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1)[:, :: max(1, half // 8)]
    return np.asarray(blocks.max(1) - blocks.min(1) < most)


def _widened(flags: NDArray[np.bool_], width: int) -> NDArray[np.bool_]:
    if not flags.any():
        return flags
    return np.convolve(flags, np.ones(2 * width + 1), "same") > 0.5
