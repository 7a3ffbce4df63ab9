"""A record as the filter takes it: inputs, readings, and their noise."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from etb_hil.base.errors import InputError, Problem
from etb_hil.estimation import kalman
from etb_hil.estimation.rounding import lasting_share
from etb_hil.plant.effects.layout import EXTENDED
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import LIMP_HOME, STOP_HIGH, STOP_LOW
from etb_hil.recording.samples import Float64

_JITTER = 1e-6  # s rms between a sample's time and its stamp, where nothing else is known
# Share of T_c by which a bristle of a plate at rest is unsure after its own length of creep: vibration moves it, and
# samples show little of that. By 0.015 and 0.03 healthy records are as likely, without it up to 500 nats less, and
# a disturbance is needed in them then (`python benchmarks/explain_study.py nothing FIRST COUNT`).
_CREEP = 0.02
# The same share for bristles of any law, over their length. With 0.05 to 0.15 healthy units need no disturbance:
# LuGre's, elasto-plastic ones, those of Maxwell slip and of GMS (`python benchmarks/unit_faults.py --kinds none
# elasto-plastic maxwell-slip gms`).
_OPEN = 0.1
_COLUMNS = ("since", "heat", "dt", "voltage", "unsure", "temperature", "readings", "lasts")
_RESTS = 0.01  # of a record's rms velocity: a plate that is slower rests
_SLOWEST = 1e-12  # rad/s, of a plate that never moves
_SMOOTH = 0.05  # s over which that velocity is measured, so that the noise of a plate's sensor averages out
_FEW, _PARTS = 3_000, 12  # samples by which a start is tried, and the parts along a record that they are of
_JUMP = 0.1  # share by which the torque of limp-home's jump and of the stops may be another (explain.md, section 1)


class Term(NamedTuple):
    """What is added in a channel (`forces.BRAKING` ...) for a size of 1: a shape (n)."""

    channel: int
    shape: Float64


@dataclass(frozen=True, slots=True)
class Record:
    """Segments of samples without gaps, one after the other: columns (n) in SI.

    Angles are at the throttle shaft.

    `since`: where a segment begins, s since the sample before it, infinite where nothing is known of that time; 0
    elsewhere. `heat`: mean square of the current in that time, A^2. `dt`: s to the next sample; `voltage`: V, held as
    long; `unsure`: its variance beyond the reading's noise, V^2, infinite where the bridge is open; `temperature`:
    degC; `readings` (n, 3): current, motor's and plate's angle, NaN where there is none; `lasts`: see `lasting`.
    `settings`: see `kalman`; the two disturbances and the multiples of the noise are set for each run. `terms`: what
    may be added in proportion to sizes, which stand behind the parameters of all effects. Records that are joined have
    none.
    `is_read`: a reading of force or current stands for the voltage, and may be late. `sampled`: s between samples as
    the bench took them; 0 where that is `dt`.
    """

    since: Float64
    heat: Float64
    dt: Float64
    voltage: Float64
    unsure: Float64
    temperature: Float64
    readings: Float64
    lasts: Float64
    settings: Float64
    terms: tuple[Term, ...] = field(default=(), repr=False)
    is_read: bool = False
    sampled: float = 0.0

    def __len__(self) -> int:
        return len(self.dt)

    @property
    def time(self) -> Float64:
        """Time in s since the first sample (n)."""
        return np.concatenate([[0.0], np.cumsum(self.dt[:-1])])

    @property
    def elapsed(self) -> Float64:
        """Time in s since the first sample (n), between segments as far as it is known."""
        between = np.where(np.isfinite(self.since[1:]) & (self.since[1:] > 0.0), self.since[1:], self.dt[:-1])
        return np.concatenate([[0.0], np.cumsum(between)])

    @property
    def goes_both_ways(self) -> bool:
        """Whether the motion goes over half of its range in each direction, at least."""
        _, motor, plate = self.readings.T
        _, angle = _smooth(self.elapsed, motor if np.isfinite(motor).any() else plate)
        ways = np.diff(angle)
        return bool(min(ways[ways > 0.0].sum(), -ways[ways < 0.0].sum()) > 0.5 * np.ptp(angle)) if len(ways) else False

    def added(self, channel: int, parameters: Float64) -> Float64:
        """Return what the terms add in a channel (n)."""
        found = np.zeros(len(self))
        for term, size in zip(self.terms, parameters[EXTENDED:], strict=False):
            if term.channel == channel:
                found += size * term.shape
        return found

    def part(self, rows: slice) -> Record:
        """Return some of the samples that follow each other."""
        columns: dict[str, Any] = {name: getattr(self, name)[rows].copy() for name in _COLUMNS}
        found = replace(self, terms=tuple(Term(one.channel, one.shape[rows]) for one in self.terms), **columns)
        found.since[:1], found.heat[:1] = np.inf, 0.0
        return found

    def placed(self, parameters: Float64) -> Record:
        """Return the record with unsure torque where limp-home and stops are."""
        settings = self.settings.copy()
        settings[[kalman.HOME, kalman.LOW, kalman.HIGH]] = parameters[[LIMP_HOME, STOP_LOW, STOP_HIGH]]
        return replace(self, settings=settings)

    def with_open_bristles(self) -> Record:
        """Return the record with bristles whose law is open; only elasto-plastic ones are."""
        settings = self.settings.copy()
        settings[kalman.CREEP] *= (_OPEN / _CREEP) ** 2
        return replace(self, settings=settings)

    def thinned(self, most: int, parts: int) -> Record:
        """Return so many parts of the record, evenly along it.

        Together they have `most` samples. A record that has no more samples is returned whole. Terms are kept.
        """
        if len(self) <= most:
            return self
        length = most // parts
        starts = np.linspace(0, len(self) - length, parts).round().astype(int).tolist()
        return self.picked([slice(k, k + length) for k in starts])

    def picked(self, parts: Sequence[slice]) -> Record:
        """Return parts of the record, one after the other; terms are kept.

        Between two of them the time that passed is known, and the heat of it.
        """
        found = [self.part(rows) for rows in parts]
        time, squared = self.elapsed, np.nan_to_num(self.readings[:, 0]) ** 2
        for part, now, last in zip(found[1:], parts[1:], parts, strict=False):
            if not np.isinf(self.since[last.stop : now.start + 1]).any():
                part.since[0] = time[now.start] - time[last.stop - 1]
                part.heat[0] = np.mean(squared[last.stop - 1 : now.start])
        terms = zip(*(part.terms for part in found), strict=True)
        kept = tuple(Term(each[0].channel, np.concatenate([one.shape for one in each])) for each in terms)
        return replace(joined(found), terms=kept)

    @property
    def few(self) -> Record:
        """Few of the samples, by which another start of a fit is tried first."""
        return self.thinned(_FEW, _PARTS)


def joined(records: Sequence[Record]) -> Record:
    """Return several records of one unit, by the same sensors, as one."""
    columns: dict[str, Any] = {name: np.concatenate([getattr(one, name) for one in records]) for name in _COLUMNS}
    settings = records[0].settings.copy()
    settings[kalman.RESTS] = max(one.settings[kalman.RESTS] for one in records)
    return replace(records[0], settings=settings, terms=(), **columns)


def record(
    time: Float64,
    voltage: Float64,
    model: Model,
    *,
    current: Float64 | None = None,
    motor: Float64 | None = None,
    plate: Float64 | None = None,
    temperature: Float64 | float = 25.0,
    unsure: Float64 | float = 0.0,
) -> Record:
    """Return a record of columns (n) in SI.

    Time is in s, angles are at the throttle shaft, temperature is in degC. `unsure`: variance of the voltage in V^2
    beyond its reading's noise, infinite where the bridge is open.

    The noise is that of the model file's sensors. InputError where the time does not grow, or no angle was read.
    """
    if motor is None and plate is None:
        raise InputError(Problem("an estimate needs an angle", remedy="record the motor's or the plate's"))
    steps = np.diff(time)
    if len(time) < 2 or not np.all(steps > 0.0):
        raise InputError(
            Problem("the time of a record must grow from sample to sample", allowed="at least two samples")
        )
    none = np.full(len(time), np.nan)
    readings = np.column_stack([none if one is None else one for one in (current, motor, plate)])
    degrees, variance = (np.broadcast_to(np.asarray(one, float), (len(time),)).copy() for one in (temperature, unsure))
    settings = noise_settings(model)
    settings[kalman.RESTS] = max(_RESTS * _velocity(time, readings[:, 2 if motor is None else 1]), _SLOWEST)
    since = np.zeros(len(time))
    since[0] = np.inf
    return Record(
        since,
        np.zeros(len(time)),
        np.append(steps, steps[-1]),
        np.asarray(voltage, float),
        variance,
        degrees,
        readings,
        lasting(readings[:, 1]),
        settings,
    )


def _velocity(time: Float64, angle: Float64) -> float:
    """Return the rms velocity of a motion in rad/s."""
    time, angle = _smooth(time, angle)
    return float(np.sqrt(np.mean((np.diff(angle) / np.diff(time)) ** 2))) if len(time) > 1 else 0.0


def _smooth(time: Float64, angle: Float64) -> tuple[Float64, Float64]:
    """Return every so many samples of a motion that noise of the angle is small."""
    known = np.isfinite(angle)
    time, angle = time[known], angle[known]
    if len(time) < 2:
        return time, angle
    every = min(max(round(_SMOOTH * len(time) / (time[-1] - time[0])), 1), len(time) - 1)
    return time[::every], angle[::every]


def lasting(angle: Float64) -> Float64:
    """Return the share of an angle's rounding error (n) that the next sample has, too.

    Over n readings that stay the same the shaft turns by a step of the sensor, at most; so from one sample to the next
    by 1 / n of it. The share is the autocorrelation of a sawtooth after that way.
    """
    edges = np.flatnonzero(np.diff(angle, prepend=np.nan, append=np.nan) != 0.0)
    samples = np.repeat(np.diff(edges), np.diff(edges)).astype(np.float64)
    shares = np.maximum(1.0 - 6.0 / samples * (1.0 - 1.0 / samples), 0.0)
    shares[edges[1:] - 1] = 0.0
    return shares


def noise_settings(model: Model) -> Float64:
    """Return the filter's settings (`kalman.SETTINGS`) by a model file."""
    sensors, v = model.sensors, model.values
    s = np.zeros(kalman.SETTINGS)
    s[kalman.NOISE_CURRENT] = sensors.current_noise**2 + sensors.current_step**2 / 12.0
    s[kalman.STEP_MOTOR] = 2.0 * math.pi / sensors.motor_counts_per_turn / v.gear_ratio
    s[kalman.STEP_PLATE] = sensors.plate_range / 2**sensors.plate_bits
    s[kalman.NOISE_PLATE] = sensors.plate_noise**2
    s[kalman.LASTS_PLATE] = lasting_share(s[kalman.NOISE_PLATE], s[kalman.STEP_PLATE])
    s[kalman.NOISE_VOLTAGE] = sensors.voltage_noise**2 + sensors.voltage_step**2 / 12.0
    s[kalman.JITTER] = _JITTER
    s[kalman.HOME], s[kalman.NEAR] = v.limp_home, v.dead_zone + model.tolerance("limp_home")
    s[kalman.JUMP] = _JUMP * (v.preload_open + v.preload_close) / v.torque_per_ampere
    s[kalman.LOW], s[kalman.HIGH] = v.stop_low, v.stop_high
    s[kalman.STIFFNESS] = _JUMP * v.stop_stiffness / v.torque_per_ampere
    s[kalman.DAMPING] = _JUMP * v.stop_damping / v.torque_per_ampere
    s[kalman.CREEP] = _CREEP**2 * v.coulomb * v.bristle_stiffness / v.torque_per_ampere**2
    s[kalman.SCALE :] = 1.0
    return s
