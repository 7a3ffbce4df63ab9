"""A recording as runs of the drive: one a condition, at any sampling rate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etb_hil.base.compiled import njit
from etb_hil.base.errors import InputError, Problem
from etb_hil.discrepancy.measured.measurement import SLOWEST
from etb_hil.discrepancy.measured.plausibility import must_be_driven
from etb_hil.discrepancy.slow.drive_samples import ANGLES, FEWEST_SAMPLES, drive_samples
from etb_hil.plant.extended import advance_extended, new_extended_state
from etb_hil.plant.integrator import THETA, TICK_NS
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import Vector
from etb_hil.recording.recording import Recording
from etb_hil.recording.samples import Float64

CONDITIONS = ("pwm_frequency", "supply_voltage")  # what a test sets in steps
SPLIT = 10  # runs of equal length where no condition was set
_SHORTEST = 10.0  # s
_LONGEST_GAP = 10.0  # median steps
_MOST_CONDITIONS = 100
_REST_KEPT = 2.0  # s of a rest that a fit looks at
_MOVES = 0.03  # of the whole travel
_ON_END = 5  # samples
_FAR = 10.0  # times slower than balances need: rather another unit of time than another rate


@dataclass(frozen=True, slots=True)
class Sweep:
    """One run: columns (n) in SI, angle at the throttle shaft.

    `ticks`: how long each voltage lasts. `condition` is what was set (`role`, "" where nothing was), `start_s` when it
    began; motion begins after `first`.
    """

    role: str
    condition: float
    start_s: float
    seconds: Float64
    ticks: NDArray[np.int64]
    voltage: Float64
    angle: Float64
    temperature: Float64
    first: int

    @property
    def step(self) -> int:
        """Ticks from one sample to the next, as a median."""
        return int(np.median(self.ticks))

    def simulated(self, p: Vector, *, first: int = 0, pull: float = 0.0, late: int = 0) -> Float64:
        """Return the angle (from sample `first` on) for `p`, by the voltage alone.

        `pull`: the share of the error by which each sample pulls the model to the measured angle, against local minima.
        `late`: ticks by which the voltage acts later than its sample, or the angle was taken earlier.
        """
        out = np.empty(len(self.angle) - first)
        state = new_extended_state(float(self.angle[first]), float(self.temperature[first]), p)
        samples, rest = divmod(late, self.step)
        early = np.concatenate([np.full(samples + 1, self.voltage[0]), self.voltage])[: len(self.voltage)]
        now = np.concatenate([np.full(samples, self.voltage[0]), self.voltage])[: len(self.voltage)]
        _run(
            state, p, self.ticks[first:], rest, early[first:], now[first:], self.temperature[first:],
            self.angle[first:], pull, out,
        )  # fmt: skip
        return out


def is_slow(recording: Recording) -> bool:
    """Tell whether a recording's angle is too slow for balances, but long enough."""
    seen = next((role for role in ANGLES if role in recording.roles), None)
    if seen is None:
        return False
    time_ns = recording.series(seen).time_ns
    if len(time_ns) < FEWEST_SAMPLES or float(time_ns[-1] - time_ns[0]) * 1e-9 < _SHORTEST:
        return False
    return float(np.median(np.diff(time_ns))) * 1e-9 > 1.0 / SLOWEST


def slow_remark(recording: Recording) -> str:
    """Say that a recording is too slow to name causes; empty if it is not.

    The remark also says whether its time may be in another unit.
    """
    if not is_slow(recording):
        return ""
    seen = next(role for role in ANGLES if role in recording.roles)
    rate = 1e9 / float(np.median(np.diff(recording.series(seen).time_ns)))
    says = f"{recording.origin} has {rate:.3g} samples a second: naming a cause needs {SLOWEST:g} a second"
    if rate > SLOWEST / _FAR:
        return f"{says}; these data allow free runs only, which takes minutes"
    asks = "check the time's unit in the column's header or in the map (ms that are read as s?)"
    return f"{says}; {asks}. These data allow free runs only, which takes minutes"


def sweeps_of(recording: Recording, model: Model) -> list[Sweep]:
    """Return the runs of a recording; InputError if roles or data are missing."""
    samples = drive_samples(recording, model)
    time_ns, angle = samples.time_ns, samples.angles.angle
    voltage = samples.drive
    if samples.is_duty:
        voltage = voltage * _values(recording, time_ns, "supply_voltage", model.values.supply_voltage)
    must_be_driven(recording.origin, voltage, angle, model.sensors)
    temperature = _values(recording, time_ns, "temperature", 25.0)
    role, condition = _condition(recording, time_ns)
    found = []
    for part in np.split(np.arange(len(time_ns)), _cuts(time_ns, condition, split=not role)):
        if len(part) < FEWEST_SAMPLES:
            continue
        own = time_ns[part]
        steps = np.diff(np.round((own - own[0]) / TICK_NS).astype(np.int64))
        ticks = np.append(steps, int(np.median(steps)))
        place = angle[part]
        moves = _first_motion(place, float(np.ptp(angle)))
        begin = 0 if moves is None else int(np.searchsorted(own, own[moves] - _REST_KEPT * 1e9))
        found.append(
            Sweep(
                role,
                float(np.median(condition[part])) if role else float("nan"),
                float(own[0] - time_ns[0]) * 1e-9,
                (own - own[0]) * 1e-9,
                ticks,
                voltage[part],
                place,
                temperature[part],
                begin,
            )
        )
    if not found:
        raise InputError(Problem(f"{recording.origin} has only runs of less than {FEWEST_SAMPLES} samples"))
    return found


def breaks_away(sweep: Sweep, angle: Float64) -> float | None:
    """Return the voltage (V) at which an angle (n) leaves its rest; None if never."""
    first = _first_motion(angle, float(np.ptp(sweep.angle)))
    return None if first is None or sweep.seconds[first] < _REST_KEPT else float(sweep.voltage[first])


def _first_motion(angle: Float64, span: float) -> int | None:
    """Return the sample from which an angle (n) is away from rest for some samples."""
    away = np.abs(angle - np.median(angle[:10])) > _MOVES * span
    counts = np.convolve(away, np.ones(_ON_END), "full")[_ON_END - 1 :]
    found = np.flatnonzero(counts > _ON_END - 0.5)
    return int(found[0]) if len(found) else None


def _values(recording: Recording, time_ns: NDArray[np.int64], role: str, otherwise: float) -> Float64:
    """Return a role's values (n) at some instants, with a default."""
    if role in recording.roles:
        series = recording.series(role)
        known = np.isfinite(series.values)
        if known.any():
            return np.interp(time_ns, series.time_ns[known], series.values[known])
    return np.full(len(time_ns), otherwise)


def _condition(recording: Recording, time_ns: NDArray[np.int64]) -> tuple[str, Float64]:
    """Return the role that was set in steps, with its values (n); "" if none was."""
    for role in CONDITIONS:
        values = _values(recording, time_ns, role, 0.0)
        levels = len(np.unique(values))
        changes = int(np.count_nonzero(np.diff(values)))  # a supply's noise has few levels, too
        if 2 < levels <= _MOST_CONDITIONS and changes < len(time_ns) // FEWEST_SAMPLES:
            return role, values
    return "", np.zeros(len(time_ns))


def _cuts(time_ns: NDArray[np.int64], condition: Float64, *, split: bool) -> NDArray[np.int64]:
    """Return the samples at which a new run begins."""
    if split:
        return (np.arange(1, SPLIT) * len(time_ns)) // SPLIT
    steps = np.diff(time_ns)
    return np.flatnonzero((steps > _LONGEST_GAP * np.median(steps)) | (np.diff(condition) != 0.0)) + 1


@njit(cache=True, error_model="numpy", nogil=True)
def _run(
    state: Vector,
    p: Vector,
    ticks: NDArray[np.int64],
    rest: int,
    early: Vector,
    now: Vector,
    temperature: Vector,
    angle: Vector,
    pull: float,
    out: Float64,
) -> None:
    for k in range(now.size):
        state[THETA] += pull * (angle[k] - state[THETA])
        out[k] = state[THETA]
        first = min(rest, ticks[k])
        if first > 0:
            advance_extended(state, p, early[k], first, temperature[k])
        if ticks[k] > first:
            advance_extended(state, p, now[k], ticks[k] - first, temperature[k])
