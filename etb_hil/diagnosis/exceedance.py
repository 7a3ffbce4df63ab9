"""Live detection of friction above its thresholds.

Samples are compared as they arrive (seed paper, section III.C). Exceedances are episodes with hysteresis.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.diagnosis.current_zero import ANGLE_ERROR
from etb_hil.plant.parameters import Model, ThrottleParameters
from etb_hil.plant.physics import (
    DEAD_ZONE,
    INERTIA,
    LIMP_HOME,
    STOP_HIGH,
    STOP_LOW,
    STRIBECK_VELOCITY,
    TORQUE_PER_AMPERE,
    VISCOUS,
    spring_torque,
)
from etb_hil.plant.values import FAR_ABOVE
from etb_hil.recording.samples import Float64, Int64

# False and missed episodes: benchmarks/exceedance_rates.py.
_RELEASE = 0.9  # an episode ends below this share of the limit
_SHORTEST_NS = 3_000_000  # shorter than the observer resolves
_SURE = 2.0  # standard deviations of the friction that count as its error
_DELAYS = 4.0  # the observer's delays after which 2 % of a jump of the spring's torque are left, e^-4

STICTION, COULOMB = 0, 1
KINDS = ("T_st", "T_c")

# Settings of the detector
_LIMIT_STICTION, _LIMIT_COULOMB, _TOL_CONSTANT, _TOL_SPRING, _TOL_INERTIA, _TOL_ANGLE, _TOL_VISCOUS = range(7)
# An open episode, one column a kind: whether, since when, until when; its peak
_OPEN, _START, _LAST = range(3)
_PEAK = 0  # then angle, velocity, temperature and allowance at the peak
_EPISODE = 6  # a closed one: kind and peak


@dataclass(frozen=True, slots=True)
class Exceedance:
    """An episode of friction above its limit, at the throttle shaft.

    `kind` is the number whose limit it is, `T_st` or `T_c`; instants in ns; `peak` N·m with `allowance` N·m, how far
    the bench's model may be off there (only what stands out above that counts), at `angle` rad, `velocity` rad/s and
    `temperature` degC (NaN where unknown); `phase` names the kind of phase.
    """

    kind: str
    start_ns: int
    end_ns: int
    peak: float
    allowance: float
    limit: float
    angle: float
    velocity: float
    temperature: float
    phase: str


class ExceedanceDetector:
    """A detector that compares each estimate of friction with its limit.

    Below omega_s that is the limit of T_st. Far above it, that is the limit of T_c; the viscous torque is taken off
    before.
    """

    def __init__(self, model: Model, throttle: ThrottleParameters, stiction: float, coulomb: float) -> None:
        spring = max(model.tolerance("preload_open"), model.tolerance("preload_close"))
        spring += max(model.tolerance("slope_open"), model.tolerance("slope_close")) * throttle.stop_high
        angle = model.tolerance("limp_home") + model.tolerance("dead_zone") + ANGLE_ERROR
        self._p = throttle.vector()
        self._settings = np.array(
            [
                stiction,
                coulomb,
                model.tolerance("torque_per_ampere"),
                spring,
                model.tolerance("inertia") / throttle.inertia,
                angle,
                model.tolerance("viscous"),
            ]
        )
        self._limits = (stiction, coulomb)
        self._times = np.zeros((3, 2), np.int64)
        self._peaks = np.zeros((5, 2))
        self._phase = ""
        self.episodes: list[Exceedance] = []

    @property
    def open_episodes(self) -> int:
        """How many episodes go on at present."""
        return int(np.count_nonzero(self._times[_OPEN]))

    def push(
        self,
        time_ns: Int64,
        current: Float64,
        angle: Float64,
        temperature: Float64,
        velocity: Float64,
        friction: Float64,
        delay_ns: Int64,
        deviation: Float64 | None,
        phase: str,
    ) -> None:
        """Take samples (n) of one phase with the observer's estimates at them.

        An estimate is NaN where the observer has none. An observer that states the standard deviation of its friction
        is believed in that; the friction of another is off by what the model's tolerances allow.
        """
        if phase != self._phase:
            self.close()
        self._phase = phase
        closed, instants = _room_for(len(time_ns) + len(KINDS))
        count = _detect(
            time_ns,
            current,
            angle,
            temperature,
            velocity,
            friction,
            delay_ns,
            np.full(len(time_ns), np.nan) if deviation is None else deviation,
            self._p,
            self._settings,
            self._times,
            self._peaks,
            closed,
            instants,
        )
        for row in range(count):
            self._keep(closed[row], instants[row])

    def close(self) -> None:
        """End the episodes that are open, at their last sample; a phase has ended."""
        for kind in (STICTION, COULOMB):
            closed, instants = _room_for(1)
            if _end(kind, self._times, self._peaks, closed, instants, 0):
                self._keep(closed[0], instants[0])

    def _keep(self, values: Float64, instants: Int64) -> None:
        kind, peak, angle, velocity, temperature, allowance = (float(v) for v in values)
        self.episodes.append(
            Exceedance(
                KINDS[int(kind)],
                int(instants[0]),
                int(instants[1]),
                peak,
                allowance,
                self._limits[int(kind)],
                angle,
                velocity,
                temperature,
                self._phase,
            )
        )


def _room_for(episodes: int) -> tuple[Float64, Int64]:
    """Return arrays for what is kept of closed episodes, and for their instants."""
    return np.empty((episodes, _EPISODE)), np.empty((episodes, 2), np.int64)


@njit(cache=True, error_model="numpy")
def _end(kind: int, times: Int64, peaks: Float64, closed: Float64, instants: Int64, row: int) -> int:
    """Close an episode; return 1 where one was open that was long enough to count."""
    counts = times[_OPEN, kind] and times[_LAST, kind] - times[_START, kind] >= _SHORTEST_NS
    times[_OPEN, kind] = 0
    if not counts:
        return 0
    closed[row, 0] = kind
    for k in range(5):
        closed[row, 1 + k] = peaks[k, kind]
    instants[row, 0], instants[row, 1] = times[_START, kind], times[_LAST, kind]
    return 1


@njit(cache=True, error_model="numpy")
def _go_on(kind: int, time_ns: int, place: tuple[float, ...], times: Int64, peaks: Float64) -> None:
    """Start an episode, or carry it on to one more sample.

    `place` holds what `_PEAK` and its neighbours keep.
    """
    if not times[_OPEN, kind]:
        times[_OPEN, kind], times[_START, kind] = 1, time_ns
        peaks[_PEAK, kind] = 0.0
    times[_LAST, kind] = time_ns
    if place[_PEAK] > peaks[_PEAK, kind]:
        for k in range(5):
            peaks[k, kind] = place[k]


@njit(cache=True, error_model="numpy")
def _allowance(
    i: float,
    theta: float,
    omega: float,
    acceleration: float,
    delay: float,
    deviation: float,
    p: Float64,
    settings: Float64,
) -> float:
    """Return by how much the friction may be off, in N·m.

    The uncertainty is that by the observer's own deviation, else by the model's tolerances.
    """
    blur = settings[_TOL_ANGLE] + abs(omega) * _DELAYS * delay
    if theta < p[STOP_LOW] + blur or theta > p[STOP_HIGH] - blur:
        return np.inf
    spring, viscous = 0.0, settings[_TOL_VISCOUS] * abs(omega)
    if abs(theta - p[LIMP_HOME]) < blur + p[DEAD_ZONE]:
        spring = abs(spring_torque(theta + blur, p) - spring_torque(theta - blur, p))
    if not math.isnan(deviation):
        return spring + _SURE * deviation + viscous
    spring += settings[_TOL_SPRING]
    motor = settings[_TOL_CONSTANT] * abs(i)
    inertia = settings[_TOL_INERTIA] * p[INERTIA] * abs(acceleration)
    return motor + spring + inertia + viscous


@njit(cache=True, error_model="numpy")
def _detect(
    time_ns: Int64,
    current: Float64,
    angle: Float64,
    temperature: Float64,
    velocity: Float64,
    friction: Float64,
    delay_ns: Int64,
    deviation: Float64,
    p: Float64,
    settings: Float64,
    times: Int64,
    peaks: Float64,
    closed: Float64,
    instants: Int64,
) -> int:
    count = 0
    slow, fast = p[STRIBECK_VELOCITY], FAR_ABOVE * p[STRIBECK_VELOCITY]
    for k in range(len(time_ns)):
        if math.isnan(friction[k]):
            for kind in range(2):
                count += _end(kind, times, peaks, closed, instants, count)
            continue
        acceleration = (p[TORQUE_PER_AMPERE] * current[k] - spring_torque(angle[k], p) - friction[k]) / p[INERTIA]
        # Friction lags, velocity does not: hold them together at the instant that the friction speaks of.
        delay = delay_ns[k] * 1e-9
        omega = velocity[k] - acceleration * delay
        speed = abs(omega)
        for kind in range(2):
            applies = speed < slow if kind == STICTION else speed > fast
            torque = abs(friction[k]) - (p[VISCOUS] * speed if kind == COULOMB else 0.0)
            limit = settings[_LIMIT_STICTION + kind]
            allowance = np.inf
            if applies and torque > _RELEASE * limit:
                allowance = _allowance(current[k], angle[k], omega, acceleration, delay, deviation[k], p, settings)
            if not torque - allowance > _RELEASE * limit:  # NaN too
                count += _end(kind, times, peaks, closed, instants, count)
            if times[_OPEN, kind] or torque - allowance > limit:
                place = (torque, angle[k], omega, temperature[k], allowance)
                _go_on(kind, time_ns[k], place, times, peaks)
    return count
