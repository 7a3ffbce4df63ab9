"""Samples of a recording with its drive and its angle, and whether it is held."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.errors import InputError, Problem
from etb_hil.discrepancy.measured.angles import Angles
from etb_hil.discrepancy.measured.measurement import voltage_rms
from etb_hil.plant.model_file import Sensors
from etb_hil.plant.parameters import Model
from etb_hil.recording.recording import Recording
from etb_hil.recording.samples import Float64

ANGLES = ("motor_angle", "throttle_angle")
FEWEST_SAMPLES = 100
_DRIVES = ("motor_voltage", "motor_duty")
# What tells a drive that is held: steps from sample to sample, in the voltmeter's noise (a duty is logged without any);
# what a drive is held within, in that noise, from the least to the most of thousands of samples; samples of a step;
# steps; and the share of them.
_JUMPS, _FLAT, _STANDS, _FEWEST, _NEARLY_ALL = 6.0, 10.0, 3, 10, 0.9


@dataclass(frozen=True, slots=True)
class DriveSamples:
    """Instants (n, ns) with the drive (n, V or duty) and angles (rad, throttle shaft)."""

    time_ns: NDArray[np.int64]
    drive: Float64
    is_duty: bool
    angles: Angles


def drive_samples(recording: Recording, model: Model) -> DriveSamples:
    """Return the samples with drive and angle; InputError if data are missing."""
    roles = [role for role in recording.roles if np.isfinite(recording.series(role).values).any()]
    drive = next((role for role in _DRIVES if role in roles), None)
    seen = [role for role in ANGLES if role in roles]
    if drive is None or not seen:
        what = "motor_voltage or motor_duty" if drive is None else "motor_angle or throttle_angle"
        raise InputError(Problem(f"{recording.origin} has no {what}", allowed=", ".join(roles)))
    samples = recording.joined([drive, *seen])
    good = np.all([np.isfinite(values) for values in samples.columns.values()], axis=0)
    columns = {role: values[good] for role, values in samples.columns.items()}
    count = int(np.count_nonzero(good))
    if count < FEWEST_SAMPLES:
        raise InputError(Problem(f"{recording.origin} has too few samples", value=count, allowed=f"{FEWEST_SAMPLES}"))
    return DriveSamples(samples.time_ns[good], columns[drive], drive == "motor_duty", Angles.of(columns, model))


def is_held(samples: DriveSamples, sensors: Sensors) -> bool:
    """Tell whether a drive moves in steps that are nearly all held for some samples.

    Only such a drive is known between two slow samples. Any other controller commands some ten times there, which the
    record does not show, and which is no fault. Steps are counted and not samples: a controlled plate rests most of the
    time, and few samples move it.
    """
    steps = np.abs(np.diff(samples.drive))
    noise = 0.0 if samples.is_duty else voltage_rms(sensors)
    cuts = np.flatnonzero(steps > _JUMPS * noise) + 1
    if len(cuts) < _FEWEST:
        return False
    stands = [len(part) >= _STANDS and float(np.ptp(part)) <= _FLAT * noise for part in np.split(samples.drive, cuts)]
    return float(np.mean(stands)) >= _NEARLY_ALL
