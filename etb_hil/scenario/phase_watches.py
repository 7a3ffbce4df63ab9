"""The conditions of a run's phases, live and in replay.

Each is held against the samples of its own phase.
"""

from __future__ import annotations

from etb_hil.recording.samples import SampleBlock
from etb_hil.scenario.condition import Condition
from etb_hil.scenario.condition_watch import ConditionWatch, Firing


class PhaseWatches:
    """One watch for each phase that has a condition.

    A sample belongs to the phase that its stamp lies in.
    """

    def __init__(self) -> None:
        self._watches: list[ConditionWatch | None] = []
        self._open: list[ConditionWatch] = []

    def begin(self, stamp_ns: int, condition: Condition | None, source: str | None) -> None:
        """Let samples after this stamp belong to the next phase.

        `source` is what brings the condition's role.
        """
        last = self._watches[-1] if self._watches else None
        if last is not None:
            last.until_ns = stamp_ns
        watch = None if condition is None else ConditionWatch(condition, stamp_ns, source)
        self._watches.append(watch)
        if watch is not None:
            self._open.append(watch)

    def push(self, blocks: list[SampleBlock], newest_ns: int) -> None:
        """Take samples in the order of reception, the last one stamped `newest_ns`."""
        for watch in self._open:
            watch.push(blocks)
        if self._open:
            self._open = [w for w in self._open if w.fired is None and (w.until_ns is None or newest_ns <= w.until_ns)]

    @property
    def is_watching(self) -> bool:
        """Whether a sample may still fire a condition."""
        return bool(self._open)

    @property
    def firings(self) -> list[Firing | None]:
        """What fired in each phase so far; None where nothing did."""
        return [None if watch is None else watch.fired for watch in self._watches]

    @property
    def fired(self) -> Firing | None:
        """What fired in the phase that began last."""
        return self._watches[-1].fired if self._watches and self._watches[-1] is not None else None
