"""Run units on a bench, one by one.

What decides on each, its run, and what is shown and kept of it.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, TextIO

from etb_hil.base.errors import BenchFault
from etb_hil.base.outcome import BenchOutcome
from etb_hil.bench.job import deliver, prepare
from etb_hil.bench.stop_signals import StopSignals
from etb_hil.cli.batch import Judged, checked_serial
from etb_hil.cli.files import job_files
from etb_hil.cli.first_start import compiling_shared
from etb_hil.cli.not_run import faulted, interrupted
from etb_hil.cli.page_screen import PageScreen
from etb_hil.cli.run_screen import RunScreen, Screen
from etb_hil.cli.show import show_finished
from etb_hil.report.verdict import verdict_text

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable

    from etb_hil.bench.job import JobFiles
    from etb_hil.cli.ci_output import CiOutput
    from etb_hil.cli.desk import Desk


@dataclass(frozen=True, slots=True)
class Units:
    """Runs units as the options say, or a station's desk where there is one.

    `output` keeps what CI reads.
    """

    options: argparse.Namespace
    output: CiOutput
    desk: Desk | None
    attended: bool
    screens: dict[JobFiles, Screen] = field(default_factory=dict)

    def check(self, text: str) -> str:
        """Return a serial number that may be tested; InputError says why not."""
        return checked_serial(text) if self.desk is None else self.desk.check(text)

    def screen_for(self, serial: str) -> Screen:
        """Return what runs a unit, its files read and checked.

        InputError lists what is wrong.
        """
        files = job_files(self.options) if self.desk is None else self.desk.files(serial)
        if files not in self.screens:
            try:
                with compiling_shared():
                    job = prepare(files, attended=self.attended)
            except KeyboardInterrupt as interrupt:
                self.output.add(interrupted(None, serial, str(interrupt)))
                raise
            if job.limits.hint:
                print(f"note: {files.limits}: {job.limits.hint}", file=sys.stderr)
            shown = not self.output.owns_standard_output
            options = self.options
            if options.page is not None:
                self.screens[files] = PageScreen(job, options.out, options.seed, options.page, options.operator)
            else:
                self.screens[files] = RunScreen(
                    job, options.out, options.seed, self.attended, shown=shown, operator=options.operator
                )
        return self.screens[files]

    def run(
        self,
        serial: str,
        before: str = "",
        count: Callable[[Judged], None] | None = None,
        held: StopSignals | None = None,
    ) -> Judged:
        """Run a unit and show its verdict; `before` is what came of those before it.

        `count` is called before an interrupt can end the command: what was judged is counted. Whoever gives `held`
        keeps holding it, and looks for an order that came too late.
        """
        words = sys.stderr if self.output.owns_standard_output else sys.stdout
        screen = self.screen_for(serial)
        signals = held or StopSignals()
        try:
            judged = self._judged(screen, serial, before, words, signals)
            if count is not None:
                count(judged)
        finally:
            if held is None:
                signals.let_go()
        is_too_late = held is None and judged.results.bench.outcome is BenchOutcome.OK
        return judged._replace(ended=signals.too_late if is_too_late else "")

    def _judged(self, screen: Screen, serial: str, before: str, words: TextIO, signals: StopSignals) -> Judged:
        try:
            if self.desk is not None and (note := self.desk.require_fit_bench(serial)):
                print(f"note: {note}", file=sys.stderr)
            finished, again = screen.run(serial, before, signals)
        except BenchFault as fault:
            results = faulted(screen.job, serial, fault)
            print(verdict_text(results), file=words)
            return Judged(results, self.output.add(results))
        except KeyboardInterrupt as interrupt:  # a run that has begun ends in order: it had not, or was over
            self.output.add(interrupted(screen.job, serial, str(interrupt)))
            raise
        said = None if self.desk is None else self.desk.conclusion(finished.results)
        if said is not None:
            finished = replace(finished, results=said.results)
        next_step = "" if said is None else said.next_step
        show_finished(finished, signals, words, next_step, pictures=self.options.pictures)
        for line in [] if said is None else said.lines:
            print(f"  Station  {line}", file=words)
        code = self.output.add(finished.results, finished.session.folder)
        for warning in deliver(screen.job, self.options.out):
            print(warning, file=sys.stderr)
        notes = () if said is None else tuple(said.lines)
        return Judged(finished.results, code, again, finished.session.folder, next_step, notes)
