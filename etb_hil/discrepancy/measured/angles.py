"""Choice of the angle sensor that the motion is read from: the finer one."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from etb_hil.base.errors import InputError, Problem
from etb_hil.discrepancy.measured.measurement import plate_rms
from etb_hil.plant.parameters import Model
from etb_hil.recording.samples import Float64

_OTHER_ZERO = 0.03  # rad; less is the plate sensor's own zero, which is fitted
_FEW, _WHOLE = 3.5, 0.05  # steps at a time that have to be whole ones, but for the digits of a file
_A_TURN = 2.0 * math.pi * 1.001  # rad, with what the digits of a file round
_NO_GAP = 1.5  # times the step of a record: between such samples none is missing
_FASTER = 2.0  # times the longest step below half a turn: a motion may be at its fastest where it passes a whole turn
_OUTLIERS = (0.001, 0.999)  # shares of the samples outside of which a bad one may lie
_COUNT_ON = "add a turn at each jump (numpy.unwrap), or record an angle that counts on"
_STANDS_FOR_IT = "the plate sensor is used instead, and gear and shaft are not seen"


@dataclass(frozen=True, slots=True)
class Angles:
    """The angle (n) of a motion with its noise (rms), and a second angle (n).

    All are in rad at the throttle shaft. The second one is the plate's, behind backlash and compliance. `is_plates`:
    the first is the plate sensor's, and there is no second; `encoder` (n) is then the motor's, where it has one that is
    too coarse for a motion.
    """

    angle: Float64
    noise: float
    plate: Float64 | None
    flags: tuple[str, ...] = ()
    is_plates: bool = False
    encoder: Float64 | None = None

    @staticmethod
    def of(columns: Mapping[str, Float64], model: Model) -> Angles:
        """Return the angles of columns (n) by role, of which one at least is an angle."""
        gear = model.values.gear_ratio
        if not model.device.is_throttle:
            its = next((role for role in ("linear_position", "drive_angle") if role in columns), None)
            step = 2.0 * np.pi / gear / model.sensors.motor_counts_per_turn
            return Angles(columns["motor_angle"] / gear if its is None else columns[its], step / np.sqrt(12.0), None)
        plate_noise = plate_rms(model.sensors)
        if "motor_angle" not in columns:
            return _plates(columns["throttle_angle"], plate_noise, "motor_angle is missing")
        plate = columns.get("throttle_angle")
        angle = columns["motor_angle"] / gear
        step = max(2.0 * np.pi / model.sensors.motor_counts_per_turn, grid_of(columns["motor_angle"])) / gear
        noise = step / np.sqrt(12.0)
        if plate is None:
            return Angles(angle, noise, None)
        if noise > plate_noise:
            # A bristle that moves with the steps of a coarse encoder is no friction.
            steps = f"motor_angle has steps of {math.degrees(step):.2g} deg at the plate"
            why = f"{steps}, the plate sensor a noise of {math.degrees(plate_noise):.2g} deg"
            return _plates(plate, plate_noise, why, angle)
        if abs(away := float(np.median(plate - angle))) <= _OTHER_ZERO:
            return Angles(angle, noise, plate)
        # An encoder counts from where it was switched on; the plate's sensor knows where that was.
        said = (
            f"the zeros of encoder and plate sensor differ by {math.degrees(away):.1f} deg: the encoder's was corrected"
        )
        return Angles(angle + away, noise, plate, (said,))


def must_count_turns(origin: str, seconds: Float64, columns: Mapping[str, Float64]) -> None:
    """Refuse an angle (n) that begins anew after each turn.

    Such an angle stays within a turn, and where it jumps it moves on as elsewhere once a turn is added. Bad samples and
    what moved in a gap do not.
    """
    for role in ("motor_angle", "drive_angle"):
        known = np.isfinite(columns.get(role, np.zeros(0)))
        if not known.any():
            continue
        angle, at = columns[role][known], seconds[known]
        moved, step = np.abs(np.diff(angle)), np.diff(at)
        follows = step < _NO_GAP * np.median(step)
        most = float(moved[follows & (moved <= math.pi)].max(initial=0.0))
        jumps = np.flatnonzero(follows & (moved > math.pi) & (np.abs(moved - 2.0 * math.pi) < _FASTER * most))
        if len(jumps) and float(np.ptp(np.quantile(angle, _OUTLIERS))) <= _A_TURN:
            value = f"{math.degrees(moved[jumps[0]]):.0f} deg at {at[jumps[0]]:.3f} s"
            what = f"{origin}: {role} jumps by about a turn: it begins anew after each turn"
            raise InputError(Problem(what, value=value, allowed="less than 180 deg", remedy=_COUNT_ON))


def grid_of(values: Float64) -> float:
    """Return the step of a quantised signal as its values show it; 0 if unquantised.

    Where a signal always moves by several steps at a time, their greatest common step is one apart.
    """
    steps = np.abs(np.diff(values))
    steps = steps[steps > 1e-9][: 1 << 16]
    if not len(steps) or np.unique(np.round(steps, 9)).size > 0.2 * len(steps):
        return 0.0
    least = float(steps.min())
    few = np.unique(np.round(steps[steps < _FEW * least] / least, 3))
    if float(np.abs(few - np.round(few)).max()) < _WHOLE:
        return least
    return least * float(np.diff(few).min())  # twelve and thirteen counts at a time


def between_steps(angle: Float64) -> Float64:
    """Return an angle (n, rad) with straight lines between the steps of its sensor.

    A sensor passes the middle of a step between the two samples that differ. Unquantised: as it is.
    """
    if not grid_of(angle):
        return angle
    before = np.flatnonzero(np.diff(angle))
    middles = 0.5 * (angle[before] + angle[before + 1])
    return np.interp(np.arange(len(angle)), before + 0.5, middles)


def _plates(plate: Float64, noise: float, why: str, encoder: Float64 | None = None) -> Angles:
    return Angles(plate, noise, None, (f"{why}: {_STANDS_FOR_IT}",), is_plates=True, encoder=encoder)
