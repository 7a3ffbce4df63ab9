"""Watches what comes back while the plate moves, and says when the run must stop."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from etb_hil.base.compiled import njit
from etb_hil.base.outcome import BenchOutcome
from etb_hil.base.rewinding import Rewindable
from etb_hil.bench.safety_limits import SafetyLimits
from etb_hil.bench.speed_watch import SpeedWatch
from etb_hil.recording.samples import Float64, Int64, SampleBlock
from etb_hil.scenario.trajectory import SetPoint
from etb_hil.session.answer_time import AnswerWatch

MEASURED = {"current": ("motor_current",), "encoder": ("motor_angle", "throttle_angle")}  # what a request brings
STATUS_ROLES = frozenset({"enable", "mode", "faults", "temperature", "supply_voltage", "controller_time"})
TIMEOUT, OVER_CURRENT = 1, 8  # fault bits of the role `faults`, as `dbc/` lists them
ROUNDING = 1.0 + 1e-9  # a speed that is the limit may be computed a bit above it
MAX_NS = np.iinfo(np.int64).max
STATUSES = 2  # how many of them may be of before
TEMPERATURE_AGE_NS = 10_000_000_000  # a housing takes minutes to become warm
STATUS_AGE = 10  # times older than a sample may a status be: it comes at 100 Hz, samples at 1 kHz and more


@dataclass(frozen=True, slots=True)
class Trip:
    """A limit was passed: the reason's id, and the sentence for people.

    The sentence says what that means of the bench.
    """

    reason_id: str
    reason: str
    outcome: BenchOutcome = BenchOutcome.FAULT


class Supervisor(Rewindable):
    """Holds the newest measurements against the limits."""

    LIVES = (
        "_newest_ns", "_seen", "_newest_status_ns", "_newest_temperature_ns", "_newest_of_ns", "_statuses", "_answer",
        "_speed", "current", "angle", "velocity", "temperature", "enabled", "faults",
    )  # fmt: skip

    def __init__(
        self,
        limits: SafetyLimits,
        gear_ratio: float,
        start_ns: int,
        *,
        reports_status: bool = True,
        reports_temperature: bool = False,
        requested: Collection[str] = (),
        oldest_ns: Mapping[str, int] | None = None,
    ) -> None:
        """Watch from `start_ns` on.

        The roles `requested` are read by data identifier, and may pause at rest. `oldest_ns` has the roles of a status
        whose values decide, and how old the newest good one may be. Other messages may go on while theirs stops.
        """
        self._requested = frozenset(requested)
        self._reports_status = reports_status
        self._newest_temperature_ns = start_ns if reports_temperature else None
        self._limits = limits
        self._frame_age_ns = round(limits.frame_age * 1e9)
        self._gear_ratio = gear_ratio
        self._newest_ns: dict[str, int] = {}  # of the roles that are due
        self._seen: set[str] = set()
        self._start_ns = self._newest_status_ns = start_ns
        self._oldest_ns = dict(oldest_ns or {})
        self._newest_of_ns = dict.fromkeys(self._oldest_ns, start_ns)
        self._statuses = 0
        self._answer = AnswerWatch(self._frame_age_ns)
        self._speed = SpeedWatch()
        self.current = np.nan
        self.angle = np.nan
        self.velocity = 0.0
        self.temperature = np.nan
        self.enabled: bool | None = None
        self.faults = 0

    @property
    def newest_ns(self) -> int:
        """Stamp up to which everything that was asked for has been measured."""
        return min(self._newest_ns.values(), default=self._newest_status_ns)

    def expect(self, signals: Iterable[str], now_ns: int) -> None:
        """Let samples of these signals of a request be due from now on, and no others."""
        roles = [role for signal in dict.fromkeys(signals) for role in MEASURED[signal]]
        self._newest_ns = {role: max(self._newest_ns.get(role, 0), now_ns) for role in roles}

    @property
    def is_complete(self) -> bool:
        """Whether something was asked for, and every role of it has been measured since."""
        return bool(self._newest_ns) and self._seen >= self._newest_ns.keys()

    @property
    def has_answered(self) -> bool:
        """Whether all that was asked for has come, and a status if there is one.

        The first status may have been made before the controller heard of this bench.
        """
        return self.is_complete and (not self._reports_status or self._statuses > STATUSES)

    @property
    def is_told(self) -> bool:
        """Whether each role that decides has had a good value since the start."""
        return all(newest_ns > self._start_ns for newest_ns in self._newest_of_ns.values())

    def allows(self, set_point: SetPoint) -> Trip | None:
        """Return what limit a set-point would pass.

        Checked scenarios pass none, unless they start from elsewhere: from a plate that is outside of its range.
        """
        if not set_point.enable:
            return None
        low, high = self._limits.angle
        inside = (
            low <= set_point.position <= high
            and abs(set_point.velocity) <= self._limits.velocity * ROUNDING
            and abs(set_point.voltage) <= self._limits.voltage * ROUNDING
        )
        if inside:  # False where one of them is no number, too
            return None
        if (trip := self._outside(self.angle, self.angle)) is not None:
            return trip
        place = f"{math.degrees(set_point.position):.2f} deg"
        asked = f"{place}, {math.degrees(set_point.velocity):.1f} deg/s, {set_point.voltage:.2f} V"
        return Trip("set_point_limit", f"the next set-point ({asked}) is outside the bench's limits; it was not sent")

    def look(self, blocks: Iterable[SampleBlock], *, heed_faults: bool = True, moves: bool = True) -> Trip | None:
        """Take new samples; return what was passed, if anything.

        Fault bits that are not heeded are only noted. So are angle and velocity where the bench does not let the plate
        move: springs or a hand move it then, and nothing could be done but drive off.
        """
        reported = 0
        for block in blocks:
            if not len(block.stamp_ns):
                continue
            if (trip := self._look_at(block, moves=moves)) is not None:
                return trip
            if "faults" in block.columns:
                reported |= self._look_at_faults(block.columns["faults"])
        return _fault_trip(reported or self.faults) if (reported or self.faults) and heed_faults else None

    def age(self, now_ns: int, *, moves: bool = True) -> Trip | None:
        """Return a trip when the newest sample or status has a wrong age.

        The sample is too old to move on, or younger than the clock allows.

        With the drive off, readings may wait for an answer of the unit's diagnostics, which has its own limit.
        """
        status_ns = self._newest_status_ns if self._reports_status else now_ns
        for role, newest in self._newest_ns.items():
            if role in self._requested and not moves:
                continue
            if abs(now_ns - newest) > self._frame_age_ns:
                return self._age_trip(
                    f"measured sample of {role.replace('_', ' ')}", newest, now_ns, self._frame_age_ns
                )
        if not -self._frame_age_ns <= now_ns - status_ns <= self._frame_age_ns * STATUS_AGE:
            return self._age_trip("status frame", status_ns, now_ns, self._frame_age_ns * STATUS_AGE)
        for role, newest in self._newest_of_ns.items():
            allowed_ns = self._oldest_ns[role]
            if role in self._requested and not moves:
                continue
            if not -self._frame_age_ns <= now_ns - newest <= allowed_ns:
                return self._age_trip(f"status frame with {role.replace('_', ' ')}", newest, now_ns, allowed_ns)
        warm_ns = now_ns if self._newest_temperature_ns is None else self._newest_temperature_ns
        if now_ns - warm_ns > TEMPERATURE_AGE_NS:
            return self._age_trip("temperature", warm_ns, now_ns, TEMPERATURE_AGE_NS)
        return None

    def fresh_until_ns(self) -> int:
        """Return until when the newest status, its values and temperature are not too old."""
        ends = [MAX_NS, *(newest + self._oldest_ns[role] for role, newest in self._newest_of_ns.items())]
        if self._reports_status:
            ends.append(self._newest_status_ns + self._frame_age_ns * STATUS_AGE)
        if self._newest_temperature_ns is not None:
            ends.append(self._newest_temperature_ns + TEMPERATURE_AGE_NS)
        return min(ends)

    def measured_until_ns(self, blocks: Collection[SampleBlock], times_ns: Int64) -> Int64 | None:
        """Return what `newest_ns` becomes at times (n), while new samples come.

        Their stamps rise. None where a sample is too old by then, and where more than stamps decides: a role comes in
        several messages, or nothing was asked for.
        """
        if not self._newest_ns:
            return None
        measured_ns = np.full(len(times_ns), MAX_NS)
        for role, newest_ns in self._newest_ns.items():
            parts = [block for block in blocks if role in block.columns]
            if len({block.source for block in parts}) > 1:
                return None
            known_ns = np.full(len(times_ns), newest_ns)
            for block in parts:
                _renew(known_ns, block.stamp_ns, block.columns[role], times_ns)
            np.minimum(measured_ns, known_ns, out=measured_ns)
        return None if (times_ns - measured_ns > self._frame_age_ns).any() else measured_ns

    def _age_trip(self, name: str, stamp_ns: int, now_ns: int, allowed_ns: int) -> Trip:
        """Return what a stamp says that is so far ahead of the clock, or so far behind it."""
        ahead_ms = (stamp_ns - now_ns) * 1e-6
        if ahead_ms > 0:
            reason = f"a {name} is stamped {ahead_ms:.0f} ms ahead of the clock: nobody can tell how old it is"
            return Trip("clock_stepped", reason)
        if stamp_ns < self._start_ns:
            before_ms = (self._start_ns - stamp_ns) * 1e-6
            return Trip("clock_stepped", f"a {name} is stamped {before_ms:.0f} ms before the run began")
        return Trip("frames_stopped", f"no {name} for {-ahead_ms:.0f} ms (allowed: {allowed_ns * 1e-6:.0f} ms)")

    def _look_at(self, block: SampleBlock, *, moves: bool) -> Trip | None:
        columns = block.columns
        for role in self._newest_ns:
            if role in columns and (newest := _newest_good(columns[role])) >= 0:
                self._newest_ns[role] = int(block.stamp_ns[newest])
                self._seen.add(role)
        late = self._answer.push(block)
        return (
            self._look_at_motor(block)
            or self._look_at_plate(block, moves=moves)
            or self._look_at_status(block)
            or (None if late is None else Trip("answers_late", late))
        )

    def _look_at_motor(self, block: SampleBlock) -> Trip | None:
        columns, limits = block.columns, self._limits
        if "motor_current" in columns:
            self.current = float(columns["motor_current"][-1])
            if (peak := _peak(columns["motor_current"])) > limits.current:
                return Trip(
                    "current_limit", f"measured current {peak:.2f} A is above the limit of {limits.current:g} A"
                )
        if "motor_voltage" in columns and (peak := _peak(columns["motor_voltage"])) > limits.voltage:
            return Trip("voltage_limit", f"measured voltage {peak:.2f} V is above the limit of {limits.voltage:g} V")
        return None

    def _look_at_plate(self, block: SampleBlock, *, moves: bool) -> Trip | None:
        columns, limits = block.columns, self._limits
        if "throttle_angle" in columns:
            angle = columns["throttle_angle"]
            self.angle = float(angle[-1])
            if moves and (trip := self._outside(*_extremes(angle))) is not None:
                return trip
        if "motor_angle" in columns:
            newest, peak = self._speed.push(block)
            self.velocity, peak = newest / self._gear_ratio, peak / self._gear_ratio
            if moves and abs(peak) > limits.velocity:
                seen, most = math.degrees(peak), math.degrees(limits.velocity)
                return Trip("velocity_limit", f"plate at {seen:.0f} deg/s, above the limit of {most:.4g} deg/s")
        return None

    def _outside(self, lowest: float, highest: float) -> Trip | None:
        """Return what a range of angles passes; numbers that are NaN pass nothing."""
        low, high = self._limits.angle
        if not (lowest < low or highest > high):
            return None
        worst = lowest if lowest < low else highest
        seen, least, most = (math.degrees(value) for value in (worst, low, high))
        return Trip("angle_limit", f"plate at {seen:.2f} deg, outside {least:.2f} to {most:.2f} deg")

    def _look_at_status(self, block: SampleBlock) -> Trip | None:
        columns = block.columns
        if not STATUS_ROLES.isdisjoint(columns):
            self._newest_status_ns = int(block.stamp_ns[-1])
            self._statuses += len(block)
        for role in self._newest_of_ns:
            if role in columns and (newest := _newest_good(columns[role])) >= 0:
                self._newest_of_ns[role] = int(block.stamp_ns[newest])
        if "enable" in columns and (newest := _newest_good(columns["enable"])) >= 0:
            self.enabled = bool(columns["enable"][newest])
        if "temperature" in columns:
            values, limit = columns["temperature"], self._limits.temperature
            self.temperature = float(values[-1])
            if self._newest_temperature_ns is not None and (newest := _newest_good(values)) >= 0:
                self._newest_temperature_ns = int(block.stamp_ns[newest])
            if (peak := _extremes(values)[1]) > limit:
                return Trip("temperature_limit", f"housing at {peak:.0f} degC, above the limit of {limit:g} degC")
        return None

    def _look_at_faults(self, values: Float64) -> int:
        """Note the newest fault bits, and return all that were set meanwhile.

        A bad sample has none.
        """
        reported = 0
        for value in values.tolist():
            if math.isfinite(value):
                self.faults = int(value)
                reported |= self.faults
        return reported


def _fault_trip(faults: int) -> Trip:
    """Return what a fault of the controller says.

    Over-current alone is its protection at work, and no bench fault.
    """
    bits = f"fault bits {faults:#x}"
    if faults == OVER_CURRENT:
        reason = f"the controller took the drive off for over-current ({bits})"
        return Trip("controller_overcurrent", reason, BenchOutcome.OK)
    return Trip("controller_fault", f"the controller reports {bits}")


def _peak(values: Float64) -> float:
    """Return the largest absolute value, bad samples left out."""
    lowest, highest = _extremes(values)
    return max(-lowest, highest)


@njit(cache=True, error_model="numpy")
def _extremes(values: Float64) -> tuple[float, float]:
    """Return the lowest and the highest value, bad samples left out.

    Where all are bad, they are inside any limits.
    """
    low, high = np.inf, -np.inf
    for value in values:
        low = min(low, value)
        high = max(high, value)
    return low, high


@njit(cache=True, error_model="numpy")
def _renew(known_ns: Int64, stamp_ns: Int64, values: Float64, times_ns: Int64) -> None:
    """Bring the stamp of the newest good sample, as known at times (n), up to date."""
    newest = -1
    seen = 0
    for k in range(len(times_ns)):
        while seen < len(stamp_ns) and stamp_ns[seen] <= times_ns[k]:
            if not np.isnan(values[seen]):
                newest = seen
            seen += 1
        if newest >= 0:
            known_ns[k] = stamp_ns[newest]


@njit(cache=True, error_model="numpy")
def _newest_good(values: Float64) -> int:
    """Return the place of the newest sample that is no bad one, -1 where all are bad."""
    newest = len(values) - 1
    while newest >= 0 and np.isnan(values[newest]):
        newest -= 1
    return newest
