"""Set-points over time, as closed forms.

They are everything that a phase can ask of the controller.

Motions are chains of velocity pieces that rise or fall along half a cosine, so that a velocity is smooth and, where a
phase needs it, monotone (seed paper, property 3).
"""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import Protocol

from etb_hil.base.modes import Mode

SETTLE_S = 0.05  # half a cosine of this length starts and ends a ramp


_OFF, _POSITION = Mode.OFF, Mode.POSITION  # a member of an enum takes longer to look up than a set-point to make


# Not frozen: a bench in lock-step makes thousands of them a second, and freezing trebles what one costs.
@dataclass(slots=True, unsafe_hash=True)
class SetPoint:
    """One command to the controller; throttle shaft, SI units."""

    mode: Mode
    position: float = 0.0
    velocity: float = 0.0
    voltage: float = 0.0

    @property
    def enable(self) -> bool:
        """Whether the bridge has to be on."""
        return self.mode is not _OFF


OFF = SetPoint(_OFF)


class Trajectory(Protocol):
    """Set-points from the start of a phase to its end."""

    @property
    def duration(self) -> float:
        """Length in seconds."""
        ...

    def at(self, t: float) -> SetPoint:
        """Return the set-point t seconds after the start.

        The set-point depends on t alone: a simulated bench asks for several ahead, and may ask again.
        """
        ...


@dataclass(frozen=True, slots=True)
class Released:
    """The bridge is off; the plate goes where springs and friction leave it."""

    duration: float

    def at(self, t: float) -> SetPoint:  # noqa: ARG002 (a Trajectory's signature)
        """Return the same set-point at any time."""
        return OFF


@dataclass(frozen=True, slots=True)
class Held:
    """One position from start to end."""

    position: float
    duration: float

    def at(self, t: float) -> SetPoint:  # noqa: ARG002 (a Trajectory's signature)
        """Return the same set-point at any time."""
        return SetPoint(_POSITION, self.position)


@dataclass(frozen=True, slots=True)
class Piece:
    """A segment in which the velocity goes from `start` to `end` (rad/s).

    The velocity goes along half a cosine, in `length` seconds.
    """

    start: float
    end: float
    length: float

    def velocity(self, t: float) -> float:
        """Return rad/s after t seconds."""
        return self.start + (self.end - self.start) * 0.5 * (1.0 - math.cos(math.pi * t / self.length))

    @property
    def turns_at(self) -> float | None:
        """Seconds after which the velocity changes its sign; None where it keeps it."""
        if self.start * self.end >= 0.0:
            return None
        return self.length / math.pi * math.acos((self.start + self.end) / (self.end - self.start))

    def travel(self, t: float) -> float:
        """Return rad covered after t seconds."""
        swing = self.length / math.pi * math.sin(math.pi * t / self.length)
        return self.start * t + 0.5 * (self.end - self.start) * (t - swing)


class Motion:
    """A position trajectory made of velocity pieces, from `start` (rad)."""

    def __init__(self, start: float, pieces: list[Piece]) -> None:
        self._pieces = [piece for piece in pieces if piece.length > 0.0]
        self._times = [0.0, *accumulate(piece.length for piece in self._pieces)]
        self._positions = list(accumulate((p.travel(p.length) for p in self._pieces), initial=start))

    @property
    def duration(self) -> float:
        """Length in seconds."""
        return self._times[-1]

    @property
    def end(self) -> float:
        """Position at the end, in rad."""
        return self._positions[-1]

    @property
    def extremes(self) -> list[SetPoint]:
        """The set-points beyond whose positions and velocities none goes.

        A velocity is monotone along a piece, so they are at the ends of pieces, and where the motion turns back.
        """
        found = []
        for piece, (before, after) in zip(self._pieces, pairwise(self._positions), strict=True):
            found += [SetPoint(_POSITION, before, piece.start), SetPoint(_POSITION, after, piece.end)]
            turn = piece.turns_at
            if turn is not None:
                found.append(SetPoint(_POSITION, before + piece.travel(turn)))
        return found or [SetPoint(_POSITION, self.end)]

    def at(self, t: float) -> SetPoint:
        """Return position and velocity t seconds after the start."""
        if t >= self.duration:
            return SetPoint(_POSITION, self.end)
        index = bisect_right(self._times, max(t, 0.0)) - 1
        piece, since = self._pieces[index], max(t, 0.0) - self._times[index]
        return SetPoint(_POSITION, self._positions[index] + piece.travel(since), piece.velocity(since))


def move(start: float, end: float, speed: float) -> Motion:
    """Go from start to end (rad) at a speed (rad/s), with soft ends.

    Short ways stay below that speed.
    """
    way = abs(end - start)
    reached = min(speed, way / SETTLE_S)
    signed = math.copysign(reached, end - start)
    if way == 0.0:
        return Motion(start, [])
    cruise = way / reached - SETTLE_S
    return Motion(start, [Piece(0.0, signed, SETTLE_S), Piece(signed, signed, cruise), Piece(signed, 0.0, SETTLE_S)])


def dash(start: float, peak: float, against: float, rise: float, fall: float) -> Motion:
    """Move against the dash first, then rise monotonically to its peak, and stop.

    `start` rad; `peak` rad/s, its sign is the direction of the dash; `against` rad/s, the speed of the first, opposite
    motion; `rise`, `fall` s. Seed paper, properties 2 and 3: from one sign smoothly and monotonically to well beyond
    omega_s of the other, so that friction passes T_st and settles at T_c.
    """
    first = -math.copysign(against, peak)
    pieces = [
        Piece(0.0, first, SETTLE_S),
        Piece(first, first, SETTLE_S),
        Piece(first, peak, rise),
        Piece(peak, 0.0, fall),
    ]
    return Motion(start, pieces)


@dataclass(frozen=True, slots=True)
class Steps:
    """Positions that follow each other at once, each held for the same time."""

    positions: tuple[float, ...]
    hold: float

    @property
    def duration(self) -> float:
        """Length in seconds."""
        return self.hold * len(self.positions)

    def at(self, t: float) -> SetPoint:
        """Return the level that holds t seconds after the start."""
        index = min(int(t / self.hold), len(self.positions) - 1)
        return SetPoint(_POSITION, self.positions[index])


class Chain:
    """Trajectories, its `parts`, one after another."""

    def __init__(self, *parts: Trajectory) -> None:
        self.parts = parts
        self._starts = list(accumulate((part.duration for part in parts), initial=0.0))

    @property
    def duration(self) -> float:
        """Length in seconds."""
        return self._starts[-1]

    def at(self, t: float) -> SetPoint:
        """Return the set-point of the part that is due t seconds after the start."""
        index = min(max(bisect_right(self._starts, t) - 1, 0), len(self.parts) - 1)
        return self.parts[index].at(t - self._starts[index])
