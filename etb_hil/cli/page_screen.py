"""A run that an operator page asked for, and what both tell each other."""

from __future__ import annotations

import argparse
import os
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from etb_hil.base.errors import EtbHilError, InputError
from etb_hil.bench.job import execute
from etb_hil.cli.run_screen import limits_of, title_of
from etb_hil.page.channel import Channel
from etb_hil.page.feed import PageFeed
from etb_hil.page.operator import PageOperator
from etb_hil.page.outcome import outcome_of, refusal
from etb_hil.report.panel_watcher import PanelWatcher
from etb_hil.scenario.kinds.prompt import PromptPhase

if TYPE_CHECKING:
    from etb_hil.bench.job import Job
    from etb_hil.bench.stop_signals import StopSignals
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


def run_for_page(units: Units, options: argparse.Namespace) -> int:
    """Run one unit, and leave what came of it for the page, whatever that is.

    Return the exit code.
    """
    channel = Channel(options.page)
    outcome = refusal("BENCH FAULT", "The program failed.", "Repeat the test. Where it happens again, report it.")
    try:
        judged = units.run(units.check(options.serial) if options.serial else "")
        outcome = outcome_of(judged.results, judged.session, judged.next_step, judged.notes)
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
        "limits": asdict(limits_of(job)),
        "angles": list(job.setup.bench.limits.angle),
    }
