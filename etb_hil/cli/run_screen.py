"""One run as somebody sees it: the live panel, prompts, then its verdict."""

from __future__ import annotations

import os
import sys
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from etb_hil.bench.job import execute
from etb_hil.cli.keyboard import Keyboard
from etb_hil.cli.terminal_operator import TerminalOperator
from etb_hil.report.panel_feed import PanelFeed
from etb_hil.report.panel_watcher import PanelLimits, PanelWatcher

if TYPE_CHECKING:
    from etb_hil.bench.job import Job
    from etb_hil.bench.snapshot import Snapshot
    from etb_hil.bench.stop_signals import StopSignals
    from etb_hil.session.finished import Finished


class Screen(Protocol):
    """Runs units on a bench where somebody sees them."""

    @property
    def job(self) -> Job:
        """The files of the run."""
        ...

    def run(self, serial: str, before: str, signals: StopSignals) -> tuple[Finished, bool]:
        """Run the scenario on the unit of this serial number, as `RunScreen.run` does."""
        ...


_NO_SCREEN = {"", "dumb", "unknown"}


@dataclass(frozen=True, slots=True)
class RunScreen:
    """Runs units on a bench.

    `attended` says that somebody is at the keyboard, `shown` that the run may be watched.
    """

    job: Job
    folder: Path
    seed: int
    attended: bool
    shown: bool = True
    operator: str = "operator"

    def run(self, serial: str, before: str, signals: StopSignals) -> tuple[Finished, bool]:
        """Run the scenario on the unit of this serial number.

        `before` is what came of the units before it.

        `signals` end the run, and are held once it has begun. Also returns whether somebody ended it by the
        key that wants it from the start again.
        """
        with ExitStack() as open_things:
            feed = PanelFeed()
            watcher = PanelWatcher(feed, title_of(self.job, serial), limits_of(self.job), before=before)
            operator = None
            if self.attended:
                keyboard = open_things.enter_context(Keyboard(sys.stdin.fileno()))
                has_panel = self.shown and sys.stdout.isatty() and os.environ.get("TERM", "") not in _NO_SCREEN
                screen = None if has_panel else sys.stderr
                operator = TerminalOperator(keyboard, screen, waits=self.job.is_virtual, name=self.operator)
                watcher.keys = lambda: operator.hint

            def watch(snapshot: Snapshot) -> None:
                if operator is not None:
                    operator.heed_keys()
                watcher(snapshot)

            if self.shown:
                open_things.enter_context(feed)
            finished = execute(self.job, self.folder, serial, self.seed, watch, operator, signals)
            return finished, operator is not None and operator.wants_repeat


def title_of(job: Job, serial: str) -> str:
    """Return the title under which a run is shown."""
    names = (job.scenario.content.name, f"serial {serial}" if serial else "", job.setup.bench.name)
    return " - ".join(filter(None, names))


def limits_of(job: Job) -> PanelLimits:
    """Return the limits that friction is held against while the run lasts."""
    throttle, most = job.model.values, job.limits.most
    gear = throttle.gear_ratio
    return PanelLimits(most("T_st", gear), most("T_c", gear), throttle.stribeck_velocity)
