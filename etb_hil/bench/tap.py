"""The one place through which the bench talks to its bus.

Commands go out, frames come in, and all of it goes into the raw log.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from etb_hil.base.clock import Clock
from etb_hil.base.errors import BenchFault, RecordingFault
from etb_hil.base.rewinding import Marks, rewind
from etb_hil.bench.interlock import ROLE as INTERLOCK
from etb_hil.bench.supervision import STATUS_ROLES
from etb_hil.canio.bus.health import BusHealth
from etb_hil.canio.bus.link import Link, VirtualLink
from etb_hil.canio.dbc.commands import CommandEncoder
from etb_hil.canio.frames import FrameBlock
from etb_hil.recording.samples import Int64, SampleBlock
from etb_hil.scenario.phase import Measure
from etb_hil.scenario.trajectory import SetPoint
from etb_hil.session.analysis import JUDGE_NS, Analysis
from etb_hil.session.events import EventSink

if TYPE_CHECKING:
    from etb_hil.bench.unit_talk import UnitTalk

FLUSH_S = 0.02  # what a killed run may lose is this and one beat, and as long as the host stalls
SIGNAL_BITS = {"current": 1, "encoder": 2}
_COMMANDED = ("command_mode", "command_enable", "command_position", "command_velocity", "command_voltage")


class RawLog(Protocol):
    """Where frames are written while they arrive."""

    def write(self, frames: FrameBlock) -> None:
        """Take frames in the order in which they were seen."""
        ...

    def flush(self) -> None:
        """Hand all that was written to the operating system."""
        ...

    def close(self) -> None:
        """Flush and close."""
        ...


class Ahead(NamedTuple):
    """What came while a bench lived ahead.

    The frames are not in the raw log yet. `marks` undo everything.
    """

    frames: FrameBlock
    blocks: list[SampleBlock]
    marks: Marks


class Tap:
    """Send commands, receive frames, log both, and hand frames to the analysis."""

    def __init__(
        self,
        link: Link,
        encoder: CommandEncoder,
        analysis: Analysis,
        log: RawLog,
        events: EventSink,
        clock: Clock,
        talk: UnitTalk | None = None,
    ) -> None:
        self._link = link
        self._encoder = encoder
        self._carried = encoder.roles
        self._analysis = analysis
        self._log = log
        self._clock = clock
        self._flushed = time.monotonic()
        self._lost: RecordingFault | None = None
        self._virtual = link if isinstance(link, VirtualLink) else None
        self.talk = talk
        self._asked: FrameBlock | None = None  # frames to the unit's diagnostics that wait for the next command
        self.events = events
        requested = analysis.dialect.requested
        self.requested = () if requested is None else tuple(one.role for one in requested.identifiers)
        current = None if requested is None else requested.of("motor_current")
        self.current_every_s = 0.0 if current is None else current.every_ns * 1e-9  # 0: it comes in cyclic frames
        self.reports_enable = analysis.reports("enable")
        self.reports_interlock = analysis.reports(INTERLOCK)
        self.reports_temperature = analysis.reports("temperature")
        self.reports_status = any(analysis.reports(role) for role in STATUS_ROLES)

    def reports(self, role: str) -> bool:
        """Return whether the controller sends a signal of this role."""
        return self._analysis.reports(role)

    def cycle_ns(self, role: str) -> int:
        """Return how often a role comes, 0 where nothing says so."""
        dialect = self._analysis.dialect
        requested = None if dialect.requested is None else dialect.requested.of(role)
        return dialect.message(dialect.source_of(role)).cycle_ns if requested is None else requested.every_ns

    def command(self, set_point: SetPoint) -> None:
        """Send one set-point."""
        self._send(dict(zip(_COMMANDED, _row_of(set_point), strict=True)))
        self._ask()  # behind the set-point, which waits for nothing

    @property
    def ahead_until_ns(self) -> int:
        """Until when `ahead` may live at most: the end of the next segment.

        It is 0 where the bench may not live ahead.
        """
        if self._virtual is None or self.talk is not None:
            return 0
        can = self._virtual.network.can_rewind and self._analysis.can_rewind
        return self._analysis.segment_end_ns + JUDGE_NS if can else 0

    def ahead(self, set_points: Sequence[SetPoint], sent_ns: Int64, until_ns: int) -> Ahead | None:
        """Send set-points (n) at their times, and live until a time after all of them.

        None where one of them cannot be sent, or something fails: nothing has happened then. What came is neither
        logged nor judged before `keep_ahead`.
        """
        link = self._virtual
        if link is None:
            return None
        marks: Marks = [(part, part.mark()) for part in (link.network, self._encoder, self._analysis)]
        try:
            values = np.array([_row_of(one) for one in set_points], np.float64).T
            columns = {role: each for role, each in zip(_COMMANDED, values, strict=True) if role in self._carried}
            commands = self._encoder.encode(columns, sent_ns)
            link.ahead(commands, until_ns, marks[0][1])
            frames = link.receive()
            return Ahead(frames, self._analysis.decode(frames), marks)
        except Exception:  # noqa: BLE001 (whatever fails, the beat that it belongs to meets it again)
            rewind(marks)
            return None

    def keep_ahead(self, came: Ahead) -> None:
        """Log and judge what came ahead."""
        self.keep(came.frames)
        self._analysis.judge()

    def request(self, measure: Measure) -> None:
        """Ask the controller for samples until told otherwise."""
        self._send(
            {
                "request_signals": float(sum(SIGNAL_BITS[name] for name in set(measure.signals))),
                "request_rate": measure.rate,
                "request_burst": float(measure.burst),
                "request_duration": 0.0,
            }
        )

    def receive(self) -> list[SampleBlock]:
        """Return the samples of all frames that arrived since the last call.

        This method does so whether or not the raw log could be kept.

        A run that is no longer recorded still has to be seen to end safely: `check` says that it is not.
        """
        frames = self._link.receive()
        self.keep(frames)
        if self.talk is not None:
            self._ask()  # what no command has taken along
            self._asked = self.talk.hear(frames)
        return self._analysis.push(frames)

    @property
    def current_zero(self) -> float:
        """What the current sensor shows in A without a current, where measured."""
        return self._analysis.diagnosis.current_zero

    def health(self) -> BusHealth:
        """Return how the bus fares."""
        return self._link.health()

    def finish(self) -> None:
        """Hand all frames to the operating system, for judging takes seconds.

        RecordingFault where some are lost.
        """
        if self._lost is not None:
            raise self._lost
        self._log.flush()

    def check(self) -> None:
        """Raise RecordingFault where a received frame is not in the raw log.

        PartFault where the observer failed.
        """
        if self._lost is not None:
            raise self._lost
        if (fault := self._analysis.fault) is not None:
            raise fault

    def keep(self, frames: FrameBlock) -> None:
        """Write frames to the raw log until it refuses some: from then on there is none."""
        if self._lost is not None:
            return
        try:
            if len(frames):
                self._log.write(frames)
            if time.monotonic() - self._flushed > FLUSH_S:  # the machine's time: it is the machine that may be killed
                self._log.flush()
                self._flushed = time.monotonic()
        except BenchFault as fault:
            self._lost = RecordingFault(str(fault))

    def _ask(self) -> None:
        if self._asked is not None:
            self._link.send(self._asked)
            self._asked = None

    def _send(self, values: dict[str, float]) -> None:
        """Send what this controller can be told.

        What a scenario needs of it was checked before.
        """
        if not self._carried.issuperset(values):
            values = {role: value for role, value in values.items() if role in self._carried}
            if not values:
                return
        self._link.send(self._encoder.encode(values, self._clock.now_ns()))


def _row_of(set_point: SetPoint) -> tuple[float, float, float, float, float]:
    """Return the values of the commanded roles."""
    mode, enable = float(set_point.mode), float(set_point.enable)
    return mode, enable, set_point.position, set_point.velocity, set_point.voltage
