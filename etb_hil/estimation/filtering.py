"""Filter a record under parameters: likelihood, states, and sensitivities.

Sensitivities are those of the innovations.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from etb_hil.estimation import forces, kalman
from etb_hil.estimation.kalman import SIZE
from etb_hil.estimation.record import Record
from etb_hil.estimation.smoother import smooth
from etb_hil.estimation.tangents import normal_matrix
from etb_hil.estimation.throttle import FORCES, OMEGA, TORQUE, VOLTAGE
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.effect import Effect
from etb_hil.plant.effects.port import Port
from etb_hil.recording.samples import Float64, Int64

_READ = (forces.AT_CURRENT, forces.AT_MOTOR, forces.AT_PLATE)


class Noise(NamedTuple):
    """Variances of noise as multiples of what is stated of it.

    They are those of the current, the plate's angle, the voltage, and the clock's jitter. An encoder has no noise but
    its rounding, which is known.
    """

    current: float = 1.0
    plate: float = 1.0
    voltage: float = 1.0
    jitter: float = 1.0


AS_STATED = Noise()


@dataclass(frozen=True, slots=True)
class Disturbance:
    """Standard deviations of what the equations lack, in N·m and in V, and the noise."""

    torque: float
    voltage: float
    noise: Noise = AS_STATED


@dataclass(frozen=True, slots=True)
class Filtered:
    """A filtered record of n samples; see `kalman.run`.

    `read` (3, 2): see `forces.along`. `states` (n, `SIZE`) after the readings;
    `whitened` and `roots` (n, 3); `rests`: velocity in rad/s below which the plate rests; `voltage_noise`: rms in V of
    what is stated of the voltage; `voltage_variance`: V^2 of its reading, as fitted; the rest is there for
    sensitivities only.
    """

    parameters: Float64
    active: Int64
    disturbance: Disturbance
    log_likelihood: float
    rescued: int
    outlying: int
    read: Float64
    states: Float64
    whitened: Float64
    roots: Float64
    rests: float
    voltage_noise: float
    voltage_variance: float
    slopes: Float64
    gains: Float64
    moves: Float64
    responses: Float64
    ahead: Float64
    noises: Float64
    levels: Float64
    apart: Float64

    @property
    def needed(self) -> tuple[float, float]:
        """Rms of the disturbances that the filter needs, in N·m and in V.

        The torque is that of a plate that moves: at rest nothing tells it from the bristles' torque.
        """
        moves = np.abs(self.states[:, OMEGA]) > self.rests
        torque = self.states[moves, TORQUE] if moves.any() else np.zeros(1)
        return float(np.sqrt(np.mean(torque**2))), float(np.sqrt(np.mean(self.states[:, VOLTAGE] ** 2)))


@dataclass(frozen=True, slots=True)
class Column:
    """What sensitivities are asked of.

    A parameter of the vector, an effect's strength, a term of the record, or a unit in one channel.

    `place` of the parameter; an effect's moves by `step`, from `parameters` where they are given; -1 for a unit in a
    channel (`forces.BRAKING` ...). `effect`: it belongs to. `term`: the number of the record's term, -1 for none.
    `tied`: the place of a base parameter that moves along in proportion, -1 for none.
    """

    name: str
    step: float
    place: int = -1
    effect: Effect | None = None
    channel: int = -1
    parameters: Float64 | None = field(default=None, repr=False)
    term: int = -1
    tied: int = -1


@dataclass(frozen=True, slots=True)
class Normal:
    """Normal matrix (c, c) and gradient (c) of the columns, in their units.

    `rows` (n, 3, c) are there where they were kept.
    """

    matrix: Float64
    gradient: Float64
    rows: Float64


def active_in(parameters: Float64) -> Int64:
    """Return the indices of the effects that a vector has."""
    there = [one for one in CATALOGUE.values() if parameters[list(one.acting_indices)].any()]
    return np.array(sorted({forces.index_of(effect) for effect in there}), np.int64)


def filtered(record: Record, parameters: Float64, disturbance: Disturbance, *, is_kept: bool = False) -> Filtered:
    """Filter a record; `is_kept`: with what sensitivities need."""
    found, *_ = _run(record, parameters, disturbance, is_kept=is_kept, has_covariances=False)
    return found


def smoothed(record: Record, parameters: Float64, disturbance: Disturbance) -> Float64:
    """Return the states (n, `SIZE`) of a record by all of its readings."""
    found, covariances = _run(record, parameters, disturbance, is_kept=True, has_covariances=True)
    states = found.states.copy()
    smooth(states, covariances, found.moves, found.slopes, found.gains, found.whitened, found.roots)
    return states


def _run(
    record: Record, parameters: Float64, disturbance: Disturbance, *, is_kept: bool, has_covariances: bool
) -> tuple[Filtered, Float64]:
    n, kept, all_ = len(record), len(record) if is_kept else 0, len(record) if has_covariances else 0
    p, active = parameters.copy(), active_in(parameters)
    settings = record.settings.copy()
    settings[kalman.Q_TORQUE], settings[kalman.Q_VOLTAGE] = disturbance.torque**2, disturbance.voltage**2
    noise = disturbance.noise
    settings[kalman.SCALE], settings[kalman.SCALE + 2] = noise.current, noise.plate
    settings[kalman.NOISE_VOLTAGE] *= noise.voltage
    settings[kalman.JITTER] *= math.sqrt(noise.jitter)
    read = forces.lateness(p)
    readings, later, lasts, keeps = read_without_lag(record, p, read)
    _make_noisier(settings, keeps, float(lasts.mean()))
    apart = _apart(record.since, readings)
    voltage, noisier = driving(record, read[0])
    settings[kalman.NOISE_VOLTAGE] *= noisier
    states, whitened, roots = np.empty((n, SIZE)), np.empty((n, 3)), np.empty((n, 3))
    slopes, gains = np.empty((kept, 3, 4)), np.empty((kept, 3, SIZE))
    moves, responses = np.empty((kept, SIZE, SIZE)), np.empty((kept, SIZE, FORCES))
    covariances, ahead, noises = np.empty((all_, SIZE, SIZE)), np.empty((kept, SIZE)), np.empty((kept, 3, 2))
    levels = np.empty(kept)
    totals = np.zeros(kalman.TOTALS)
    kalman.run(
        record.since, record.heat, record.dt, voltage, record.unsure, record.temperature,
        record.added(forces.LEVEL, p), readings, apart, later, lasts, p,
        active[forces.ADDS[active]], settings, is_kept, states, whitened, roots, slopes, gains, moves, responses,
        covariances, ahead, noises, levels, totals,
    )  # fmt: skip
    # The density of the readings themselves, so that models with a lag and without one can be compared.
    likelihood = float(totals[kalman.LIKELIHOOD]) - np.count_nonzero(roots, axis=0) @ np.log1p(-keeps)
    found = Filtered(
        p, active, disturbance, likelihood, int(totals[kalman.RESCUED]),
        int(totals[kalman.OUTLYING]), read, states, whitened, roots, float(settings[kalman.RESTS]),
        math.sqrt(record.settings[kalman.NOISE_VOLTAGE]), float(settings[kalman.NOISE_VOLTAGE]),
        slopes, gains, moves, responses, ahead, noises, levels, apart,
    )  # fmt: skip
    return found, covariances


def driving(record: Record, late: Float64) -> tuple[Float64, float]:
    """Return the voltage (n) that drives, and the factor of its noise's variance.

    Where a reading of force or current stands for it, `late` (2) is its delay and its lag in s: behind a first-order
    lag tau, f + tau df/dt was there. The derivative is that to the next sample, so that it holds the noise of two.
    """
    delay, lag = late
    if not record.is_read or not late.any():
        return record.voltage, 1.0
    found, last = record.voltage, np.append(record.since[1:] > 0.0, True)
    if delay != 0.0:
        segment, time = np.cumsum(record.since > 0.0), record.time
        found = np.interp(time + delay, time, found)
        there = np.minimum(np.searchsorted(time, time + delay), len(record) - 1)
        found = np.where(segment[there] == segment, found, record.voltage)
    grows = np.where(last, 0.0, np.roll(found, -1) - found)
    return found + grows * lag / record.dt, _noisier(record, lag)


def _noisier(record: Record, lag: float) -> float:
    """Return the factor of a driving reading's variance, its lag in s taken off."""
    return 1.0 + 2.0 * (lag / float(np.median(record.dt))) ** 2


def drive_noise(record: Record, at: Filtered, columns: Sequence[Column]) -> Float64:
    """Return what a unit of each column adds to a driving reading's noise (c).

    It is a share of the variance.
    """
    found = np.zeros(len(columns))
    for k, one in enumerate(columns):
        if _delays_drive(record, one):
            moved = forces.lateness(_moved(at.parameters, one))[0, 1]
            found[k] = (_noisier(record, moved) / _noisier(record, at.read[0, 1]) - 1.0) / one.step
    return found


def read_without_lag(record: Record, parameters: Float64, read: Float64) -> tuple[Float64, Float64, Float64, Float64]:
    """Return readings (n, 3) without a lag, at the samples that they tell of.

    What terms add to them is taken off. Behind a lag a reading keeps a share of the one before; with that taken off, a
    mean of what was there between is left (`forces.without_lag`). Of a delay, `later` (n, 3) is left: how long behind
    its sample a reading was true, s. The others are `Record.lasts` (n) of the motor's angle, and the share (3) that
    each reading keeps.
    """
    found, later, lasts, keeps = record.readings, np.zeros((len(record), 3)), record.lasts, np.zeros(3)
    if any(term.channel in _READ for term in record.terms):
        found = found - np.column_stack([record.added(channel, parameters) for channel in _READ])
    if not read.any():
        return found, later, lasts, keeps
    found, segment, at = found.copy(), np.cumsum(record.since > 0.0), np.arange(len(record))
    for m, (delay, lag) in enumerate(read):
        late = delay + min(lag, 0.0)  # a lag below 0 is a delay
        if lag > 0.0:
            share = np.exp(-np.roll(record.dt, 1) / lag)
            before = np.where(record.since > 0.0, np.nan, np.roll(found[:, m], 1))
            found[:, m] = (found[:, m] - share * before) / (1.0 - share)
            share = np.exp(-record.dt / lag)
            late, keeps[m] = late + lag - record.dt * share / (1.0 - share), np.median(share)
        arrives = forces.arrivals(m, np.broadcast_to(late, record.dt.shape), record.dt)
        later[:, m] = arrives * record.dt - late
        there = np.clip(at + arrives, 0, len(record) - 1)
        is_there = (there == at + arrives) & (segment[there] == segment)
        found[:, m] = np.where(is_there, found[there, m], np.nan)
        if m == 1:
            lasts = lasts[there]
    return found, later, lasts, keeps


def _apart(since: Float64, readings: Float64) -> Float64:
    """Return by how much the plate's reading is above the motor's (n), in rad.

    Where a segment begins at rest, it is the mean over the time in which the motor's stays: one of them is noisy.
    """
    _, motor, plate = readings.T
    found, begins = plate - motor, np.flatnonzero(since > 0.0)
    for begin, end in zip(begins, [*begins[1:], len(since)], strict=True):
        rests = int(np.argmax(np.append(motor[begin:end] != motor[begin], True)))
        known = found[begin : begin + rests]
        if np.isfinite(known).any():
            found[begin] = np.nanmean(known)
    return found


def _make_noisier(settings: Float64, keeps: Float64, lasts: float) -> None:
    """Give readings without their lags the noise of two readings each, in place.

    What lasts of the motor's rounding error is the same in both. That neighbours share one of them is not used.
    """
    more, less = (1.0 + keeps**2) / (1.0 - keeps) ** 2, 2.0 * keeps / (1.0 - keeps) ** 2
    settings[kalman.NOISE_CURRENT] *= more[0]
    for m, noise, step in ((1, kalman.NOISE_MOTOR, kalman.STEP_MOTOR), (2, kalman.NOISE_PLATE, kalman.STEP_PLATE)):
        rounding = settings[step] ** 2 / 12.0
        lasting = lasts if m == 1 else 0.0
        settings[noise] = more[m] * settings[noise] + (more[m] - 1.0 - less[m] * lasting) * rounding


def sensitivities(
    record: Record,
    at: Filtered,
    columns: Sequence[Column],
    *,
    is_kept: bool = False,
    groups: Sequence[int] | None = None,
) -> Normal:
    """Return what the innovations of a filtered record know of some columns.

    Base parameters may come in any order.

    `groups` (c): of effects' columns, those of one number follow each other; products between groups are left 0. What
    has a negative one comes first and is there with each of the others.
    """
    base = [k for k, one in enumerate(columns) if one.effect is None and one.place >= 0]
    rest = [k for k in range(len(columns)) if k not in set(base)]
    used = _used_by([columns[k] for k in base], at.active)
    moving = [*(columns[base[j]] for j, _ in used), *(columns[k] for k in rest)]
    width, count = len(at.parameters), len(base) + len(moving)
    places, tied = np.array([(columns[k].place, columns[k].tied) for k in base], np.int64).reshape(len(base), 2).T
    away = np.array([_moved(at.parameters, one) for one in moving]).reshape(len(moving), width)
    voltage, _ = driving(record, at.read[0])
    shapes, modulations = _shapes(record, at, moving, voltage)
    effects = np.array([*(index for _, index in used), *(_index(record, columns[k]) for k in rest)], np.int64)
    kinds = np.array([*(1 for _ in used), *(_kind(record, columns[k], at) for k in rest)], np.int64)
    numbers = [*(-1 for _ in used), *(0 if groups is None else groups[k] for k in rest)]
    ends = [len(moving) if one < 0 else len(moving) - numbers[::-1].index(one) for one in numbers]
    until = np.array(ends, np.int64)
    matrix, gradient = np.zeros((count, count)), np.zeros(count)
    rows = np.zeros((len(record) if is_kept else 0, 3, count))
    normal_matrix(
        record.since, record.heat, record.dt, voltage, record.temperature, at.apart, at.parameters,
        at.states, at.ahead, at.whitened, at.roots, at.slopes, at.read, at.gains, at.moves, at.responses,
        at.levels, places.copy(), tied.copy(), effects, away,
        np.array([one.step if one.place >= 0 else 1.0 for one in moving], float), kinds, shapes,
        modulations, until, matrix, gradient, rows,
    )  # fmt: skip
    if used:  # what a base parameter changes in the terms of effects is a part of its column
        joins = np.zeros((count, len(columns)))
        joins[np.arange(count), [*range(len(base)), *(j for j, _ in used), *range(len(base), len(columns))]] = 1.0
        matrix, gradient, rows = joins.T @ matrix @ joins, joins.T @ gradient, rows @ joins
    order = np.argsort([*base, *rest])
    if rest and base and max(base) > min(rest):  # else they are in order, and the rows are many
        matrix, gradient, rows = matrix[np.ix_(order, order)], gradient[order], rows[:, :, order]
    return Normal(matrix, gradient, rows)


def _used_by(base: Sequence[Column], active: Int64) -> list[tuple[int, int]]:
    """Return base columns by number, with active effects that depend on each."""
    return [
        (j, index)
        for index in active.tolist()
        for j, one in enumerate(base)
        if not forces.base_of(index).isdisjoint((one.place, one.tied))
    ]


def _moved(parameters: Float64, column: Column) -> Float64:
    found = (parameters if column.parameters is None else column.parameters).copy()
    if column.place >= 0:
        if column.tied >= 0:
            found[column.tied] *= 1.0 + column.step / found[column.place]
        found[column.place] += column.step
    return found


def _index(record: Record, column: Column) -> int:
    if column.term >= 0:
        return -1 - record.terms[column.term].channel
    if _delays_drive(record, column):
        return -1 - forces.LOST
    return -1 - column.channel if column.effect is None else forces.index_of(column.effect)


def _delays_drive(record: Record, column: Column) -> bool:
    """Tell whether a column is of the lateness of a reading that drives."""
    return record.is_read and column.effect is not None and column.effect.acts_at(Port.CURRENT_LATENESS)


def _kind(record: Record, column: Column, at: Filtered) -> int:
    """Return whether an effect is there without being moved."""
    if _delays_drive(record, column):
        return 0
    return int(column.effect is not None and forces.index_of(column.effect) in at.active)


def _shapes(record: Record, at: Filtered, columns: Sequence[Column], voltage: Float64) -> tuple[Int64, Float64]:
    """Return each column's row of the modulations, and those (m, n).

    The row is -1 where there is none. `voltage` (n) drives.
    """
    shapes, rows = [], np.full(len(columns), -1, np.int64)
    for k, one in enumerate(columns):
        if one.term >= 0:
            shapes.append(record.terms[one.term].shape)
        elif _delays_drive(record, one):
            shapes.append(voltage - driving(record, forces.lateness(_moved(at.parameters, one))[0])[0])
        else:
            continue
        rows[k] = len(shapes) - 1
    return rows, np.array(shapes).reshape(len(shapes), len(record))
