"""The one path from frames to a verdict: live, in replay, and over logs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from etb_hil.base.rewinding import Rewindable
from etb_hil.canio.dbc.decoder import Decoder
from etb_hil.diagnosis.diagnosis import Diagnosis
from etb_hil.diagnosis.phase_use import RunPhase, Use
from etb_hil.diagnosis.plausibility import Plausibility
from etb_hil.diagnosis.sampling_error import with_sampling_error
from etb_hil.diagnosis.segments import BUS_TIME
from etb_hil.observer.registry import DEFAULT
from etb_hil.recording.recording import ClockGrade, Recording
from etb_hil.recording.samples import Joiner
from etb_hil.scenario.phase_watches import PhaseWatches
from etb_hil.scenario.phases import is_timed, use_of
from etb_hil.session.bus_time import BusTime
from etb_hil.session.interpolated_readings import InterpolatedReadings, at_readings
from etb_hil.session.read_quality import read_quality, words
from etb_hil.session.sample_hold import SampleHold
from etb_hil.session.verdict_policy import corruption_doubts, withheld

if TYPE_CHECKING:
    from etb_hil.base.errors import PartFault
    from etb_hil.canio.bus.budget import BusRates
    from etb_hil.canio.dbc.dialect import Dialect
    from etb_hil.canio.frames import FrameBlock
    from etb_hil.diagnosis.diagnosis import Snapshot
    from etb_hil.diagnosis.limits import Limits
    from etb_hil.diagnosis.result import DiagnosisResult
    from etb_hil.plant.parameters import Model
    from etb_hil.recording.samples import SampleBlock
    from etb_hil.results.run_result import Reading
    from etb_hil.scenario.condition import Condition
    from etb_hil.scenario.condition_watch import Firing

FITTED = ("motor_current", "motor_angle")  # the roles of which every sample has a value
_COMMANDS = ("command_mode", "command_position")
SLOW_ROLES = ("temperature", "supply_voltage", *_COMMANDS)
JUDGE_NS = 250_000_000  # samples are judged in segments of this length: each costs the same, long or short


@dataclass(frozen=True, slots=True)
class PhaseMark:
    """After this stamp, samples belong to this phase."""

    stamp_ns: int
    phase: RunPhase


class Analysis(Rewindable):
    """Decode frames, keep the Recording, and run observer and diagnosis on it.

    Both run while it grows.

    Its results depend on the frames, their stamps and the phases' marks alone, not on how they were cut into calls.
    Without `keep`, the Recording holds the samples' times alone: logs may be long. `bus` tells how long frames take.
    What `decode` does can be rewound, until `judge`.
    """

    LIVES = ("decoder", "_newest_ns", "_judged_ns", "_frames", "_ended")

    def __init__(
        self,
        dialect: Dialect,
        model: Model,
        limits: Limits,
        origin: str,
        *,
        keep: bool = True,
        observer: str = DEFAULT,
        bus: BusRates | None = None,
    ) -> None:
        self.model = model
        counted = any(message.counter is not None for message in dialect.messages)
        requested = [] if dialect.requested is None else dialect.requested.identifiers
        fitted = [one for one in requested if one.role in FITTED]
        is_counted = counted and not fitted
        self.recording = Recording(origin, ClockGrade.SAMPLE_COUNTER if is_counted else ClockGrade.RECEIVE_STAMPS)
        self.decoder = Decoder(dialect, gather=True)
        cyclic = list(dict.fromkeys(dialect.source_of(role) for role in FITTED if not dialect.is_requested(role)))
        self._bus_time = None if bus is None or fitted else BusTime(dialect, cyclic, bus)
        self.diagnosis = Diagnosis(model, limits, observer)
        self._plausibility = Plausibility(model)
        self._keep = keep
        self._judged_ns = 0
        self._parts = _Parts()
        self._newest_ns = 0
        self._frames: list[FrameBlock] = []  # of the segment that has not ended, for `_bus_time`
        self._ended: list[_Ended] = []
        self.dialect = dialect
        slow = {role: dialect.source_of(role) for role in SLOW_ROLES if dialect.has(role)}
        self._requested = [one.role for one in fitted]
        self._samples = (
            SampleHold(InterpolatedReadings(cyclic, fitted), slow)
            if fitted
            else SampleHold(Joiner(cyclic), slow, _COMMANDS)
        )
        self._half: _Half | None = None
        if fitted:
            half = SampleHold(InterpolatedReadings(cyclic, fitted, stride=2), slow)
            self._half = _Half(half, Diagnosis(model, limits, observer), limits.marginal_band)
        self._marks: list[PhaseMark] = []
        self._watches = PhaseWatches()

    def reports(self, role: str) -> bool:
        """Return whether the controller sends a signal of this role."""
        return self.dialect.has(role)

    def begin_phase(self, stamp_ns: int, phase_id: str, kind: str, until: Condition | None = None) -> int:
        """Let what is sampled from now on belong to a phase; return its begin.

        The part is what comes after this stamp, and after all that was pushed.

        Of the phase's samples, `fired` is the one that fires its condition.
        """
        begins_ns = max(stamp_ns, self._newest_ns)  # else a replay would give this phase what another one judged
        self._marks.append(PhaseMark(begins_ns, RunPhase(len(self._marks), phase_id, kind, use_of(kind))))
        known = until is not None and self.dialect.has(until.role)
        self._watches.begin(begins_ns, until, self.dialect.source_of(until.role) if until and known else None)
        return begins_ns

    def push(self, frames: FrameBlock) -> list[SampleBlock]:
        """Take frames in the order of their arrival; return the samples that they brought."""
        blocks = self.decode(frames)
        self.judge()
        return blocks

    def decode(self, frames: FrameBlock) -> list[SampleBlock]:
        """Take frames in the order of their arrival; return the samples that they brought.

        Segments that end wait for `judge`. Where they end is decided by the frames, not by the calls: stamps of a clock
        that was set back do not tell which command a sample came after, only the order of arrival within a segment
        does.
        """
        blocks: list[SampleBlock] = []
        while len(frames.stamp_ns):
            part, rest, newest_ns = frames, None, int(np.maximum.reduce(frames.stamp_ns))
            if newest_ns >= self.segment_end_ns:
                ends = int(np.argmax(frames.stamp_ns >= self.segment_end_ns)) + 1
                part, rest = frames.select(slice(0, ends)), frames.select(slice(ends, None))
                newest_ns = int(np.maximum.reduce(part.stamp_ns))
            self._newest_ns = max(self._newest_ns, newest_ns)
            found = self.decoder.push(part)
            if self._bus_time is not None:
                self._frames.append(part)
            self._watches.push(found, self._newest_ns)
            blocks += found
            if rest is None:
                break
            self._end_segment()
            frames = rest
        return blocks

    def judge(self) -> None:
        """Judge the segments that have ended."""
        ended, self._ended = self._ended, []
        for segment in ended:
            self._judge_segment(segment)

    @property
    def can_rewind(self) -> bool:
        """Whether no condition is looked for, and nothing is read by data identifier."""
        return self.decoder.can_rewind and not self._watches.is_watching

    @property
    def segment_end_ns(self) -> int:
        """The stamp from which on a frame ends the segment and has it judged."""
        return self._judged_ns + JUDGE_NS

    def snapshot(self) -> Snapshot:
        """Return friction now, and what is known of T_st and T_c so far."""
        return self.diagnosis.snapshot()

    @property
    def fired(self) -> Firing | None:
        """The sample that fired the newest phase's condition, once there is one."""
        return self._watches.fired

    @property
    def firings(self) -> list[Firing | None]:
        """The samples that fired the phases' conditions, in the order of the phases.

        None where none did.
        """
        return self._watches.firings

    @property
    def fault(self) -> PartFault | None:
        """Why the observer failed, where it is a plug-in's that did."""
        return self.diagnosis.fault or (None if self._half is None else self._half.diagnosis.fault)

    @property
    def frames_lost(self) -> int:
        """Frames that the counters say are missing, so far."""
        return self.decoder.lost

    def finish(self, *, complete: bool = True) -> DiagnosisResult:
        """Return the verdict on the unit, from all that was pushed.

        None where the measurement cannot be true.

        A run that is not `complete`, since it was ended early or its log is cut, never passes a unit.
        """
        self._end_segment()
        self.judge()
        found = self.diagnosis.finish(complete=complete)
        if self._half is not None:
            found = with_sampling_error(found, self._half.judged(complete), self._half.band, words(self._quality()))
        doubts = [
            *self._plausibility.doubts(),
            *corruption_doubts(self.decoder.statistics(), self.dialect),
        ]
        return withheld(found, doubts)

    def _end_segment(self) -> None:
        self._ended.append(_Ended(self.decoder.gathered(), self._frames))
        self._frames = []
        self._judged_ns = self._newest_ns

    def _judge_segment(self, segment: _Ended) -> None:
        blocks = segment.blocks
        self.recording.append(blocks if self._keep else [replace(block, columns={}) for block in blocks])
        for block in blocks:
            if "request_rate" in block.columns and self._half is None:
                for rate, stamp_ns in zip(block.columns["request_rate"], block.stamp_ns, strict=True):
                    self._plausibility.ask(float(rate), int(stamp_ns))
        if self._bus_time is not None:
            self._bus_time.begin_segment(segment.frames)
        samples = self._samples.push(blocks)
        if samples is not None:
            self._diagnose(samples)
        if self._half is not None and (samples := self._half.samples.push(blocks)) is not None:
            self._half.kept += self._half.parts.of(samples, self._marks)

    def _diagnose(self, samples: SampleBlock) -> None:
        """Hand each sample to the diagnosis as part of the phase that its stamp lies in.

        What came before all is left.
        """
        for index, mark, segment in self._parts.of(samples, self._marks):
            if self._bus_time is not None and is_timed(mark.phase.kind):
                segment.columns = {**segment.columns, BUS_TIME: self._bus_time.at(segment.stamp_ns)}
            self.diagnosis.push(segment, mark.phase)
            if self._half is None:
                self._plausibility.push(segment, index, moving=mark.phase.use is Use.FITTED)
            elif len(read := self._at_readings(segment)):
                self._plausibility.push(read, index, moving=False)  # gaps between readings are no missing samples

    def _at_readings(self, samples: SampleBlock) -> SampleBlock:
        """Return the samples with a reading, without the voltage.

        A balance of the voltage needs all of its samples.
        """
        requested = self.decoder.requested
        times = {} if requested is None else requested.times_ns
        read = at_readings(samples, times, self._requested)
        read.columns = {role: values for role, values in read.columns.items() if role != "motor_voltage"}
        return read

    def quality(self) -> tuple[Reading, ...]:
        """Return how the roles that are read by request came, while the phases lasted."""
        requested = self.decoder.requested
        if self.dialect.requested is None or requested is None:
            return ()
        return read_quality(self.dialect.requested, requested, [mark.stamp_ns for mark in self._marks], self._newest_ns)

    def _quality(self) -> list[Reading]:
        return [one for one in self.quality() if one.role in self._requested]


class _Ended(NamedTuple):
    """The samples and frames of a segment that has ended."""

    blocks: list[SampleBlock]
    frames: list[FrameBlock]


class _Parts:
    """Splits the samples where phases begin."""

    def __init__(self) -> None:
        self._newest_ns = 0

    def of(self, samples: SampleBlock, marks: list[PhaseMark]) -> Iterator[tuple[int, PhaseMark, SampleBlock]]:
        """Yield the parts of new samples, each with its phase and the phase's number."""
        stamp_ns = np.maximum.accumulate(samples.stamp_ns)  # a host's clock may be set back by a little
        stamp_ns = np.maximum(stamp_ns, self._newest_ns)
        self._newest_ns = int(stamp_ns[-1])
        edges = np.searchsorted(stamp_ns, [mark.stamp_ns for mark in marks], side="right")
        for index, mark in enumerate(marks):
            stop = int(edges[index + 1]) if index + 1 < len(edges) else len(samples)
            if stop > (start := int(edges[index])):
                yield index, mark, samples.select(slice(start, stop))


@dataclass(slots=True)
class _Half:
    """The run once more, with every second reading left out.

    Judged at the end, when no set-point waits for it.
    """

    samples: SampleHold
    diagnosis: Diagnosis
    band: float
    parts: _Parts = field(default_factory=_Parts)
    kept: list[tuple[int, PhaseMark, SampleBlock]] = field(default_factory=list)

    def judged(self, complete: bool) -> DiagnosisResult:
        """Return what the diagnosis says of all samples."""
        for _, mark, segment in self.kept:
            self.diagnosis.push(segment, mark.phase)
        self.kept.clear()
        return self.diagnosis.finish(complete=complete)
