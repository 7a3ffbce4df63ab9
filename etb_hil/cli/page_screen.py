"""A run that an operator page asked for, and what both tell each other."""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from etb_hil.base.errors import EtbHilError, InputError
from etb_hil.base.outcome import BenchOutcome
from etb_hil.bench.job import execute
from etb_hil.bench.stop_signals import StopSignals
from etb_hil.cli.run_screen import limits_of, title_of
from etb_hil.page.channel import Channel
from etb_hil.page.feed import PageFeed
from etb_hil.page.operator import PageOperator
from etb_hil.page.outcome import outcome_of, refusal
from etb_hil.page.stops import held_back, take_stops
from etb_hil.plant.values import FAR_ABOVE
from etb_hil.report.panel_watcher import PanelWatcher
from etb_hil.scenario.kinds.prompt import PromptPhase

if TYPE_CHECKING:
    from etb_hil.bench.job import Job
    from etb_hil.cli.batch import Judged
    from etb_hil.cli.units import Units
    from etb_hil.session.finished import Finished


@dataclass(frozen=True, slots=True)
class PageScreen:
    """Run units on a bench for the operator page.

    Its channel lies in the folder `page`.
    """

    job: Job
    folder: Path
    seed: int
    page: Path
    operator: str

    def run(self, serial: str, before: str, signals: StopSignals) -> tuple[Finished, bool]:
        """Run the scenario on the unit of this serial number.

        Nobody asks here for it to be repeated.
        """
        channel = Channel(self.page)
        with ExitStack() as open_things:
            operator = open_things.enter_context(PageOperator(channel, self.operator, waits=self.job.is_virtual))
            feed = open_things.enter_context(PageFeed(channel, lambda: operator.asked))
            feed.tell({"run": _run(self.job, serial, self.operator)})
            watcher = PanelWatcher(feed, title_of(self.job, serial), limits_of(self.job), before=before)
            finished = execute(self.job, self.folder, serial, self.seed, watcher, operator, signals)
        return finished, False


def run_for_page(open_units: Callable[[], Units], options: argparse.Namespace) -> int:
    """Run one unit, and leave what came of it for the page, whatever that is.

    Return the exit code. A press of STOP ends it before the run begins; the run heeds one; after the run none changes
    what is told.
    """
    channel, signals = Channel(options.page), StopSignals()
    outcome = refusal("BENCH FAULT", "The program failed.", "Repeat the test. Where it happens again, report it.")
    with held_back():
        try:
            try:
                take_stops()
                units = open_units()
                judged = units.run(units.check(options.serial) if options.serial else "", held=signals)
            finally:
                signals.hold()  # never let go: the process ends with the run
            outcome = outcome_of(
                judged.results, judged.session, judged.next_step, (*judged.notes, *_late(judged, signals))
            )
        except InputError as error:
            outcome = refusal("REFUSED", str(error))
            raise
        except KeyboardInterrupt as interrupt:
            reason = str(interrupt) or "The operator stopped the run before the plate moved."
            outcome = refusal("ABORTED", reason, "Repeat the test.")
            raise
        except EtbHilError as error:
            outcome = refusal("BENCH FAULT", str(error), "Correct what is named, then repeat.")
            raise
        finally:
            known = channel.read_state()
            run = known.get("run") or {"serial": options.serial, "operator": options.operator}
            with PageFeed(channel, lambda: None) as feed:
                feed.tell({"run": run, "outcome": outcome})
    return judged.code


def _late(judged: Judged, signals: StopSignals) -> tuple[str, ...]:
    """Return the sentence for an order that came once the run was over."""
    is_late = signals.verb is not None and judged.results.bench.outcome is BenchOutcome.OK
    return ("STOP came after the run had ended. The verdict stands.",) if is_late else ()


def _run(job: Job, serial: str, operator: str) -> dict[str, Any]:
    throttle = job.model.values
    steps = [
        {
            "id": step.id,
            "kind": step.phase.kind,
            "expected_s": None
            if isinstance(step.phase, PromptPhase)
            else step.phase.trajectory(throttle.limp_home, throttle).duration,
        }
        for step in job.scenario.content.steps
    ]
    return {
        "process": os.getpid(),
        "serial": serial,
        "operator": operator,
        "scenario": job.scenario.content.name,
        "part": " ".join(filter(None, (job.limits.part_number, job.limits.revision))),
        "bench": job.setup.bench.name,
        "phases": steps,
        "limits": {**asdict(limits_of(job)), "far_above": FAR_ABOVE},
        "angles": list(job.setup.bench.limits.angle),
    }
