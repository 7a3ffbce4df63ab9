"""Output of a run for a CI server: JUnit, JSON, comparison to a baseline."""

from __future__ import annotations

import argparse
import json
import os
import sys
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from etb_hil.base.errors import InputError, Place, Problem
from etb_hil.base.files import refused_by_name, write_text
from etb_hil.base.outcome import ExitCode

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from etb_hil.base.yamlfile import Document
    from etb_hil.report.junit import Reported
    from etb_hil.results.run_result import RunResult
    from etb_hil.session.baseline import Baseline, Comparison

STANDARD_OUTPUT = Path("-")
_HEAD = 200  # bytes of a file that tell whether a run wrote it


def add_ci_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options that name what a CI server reads."""
    group = parser.add_argument_group("for CI")
    group.add_argument("--junit", type=Path, metavar="FILE", help="write the run as JUnit's XML")
    group.add_argument(
        "--json",
        type=Path,
        metavar="FILE",
        help="write results.json here too; '-' is standard output, with nothing else",
    )
    add_baseline_argument(group)
    group.add_argument(
        "--timeout", type=float, metavar="SECONDS", help="end the run in the safe state when it takes longer"
    )


def add_baseline_argument(parser: argparse._ActionsContainer) -> None:
    """Add the option that names a baseline."""
    parser.add_argument(
        "--baseline", type=Path, metavar="FILE", help="compare the numbers to what they were ('etb-hil baseline')"
    )


def held_against(comparisons: Sequence[Comparison], code: ExitCode, screen: TextIO | None = None) -> ExitCode:
    """Say what of a baseline is not met, or cannot be compared.

    Return the exit code, inconclusive where only the baseline disagrees or nothing of it can be compared.
    """
    for comparison in comparisons:
        if not comparison.agrees:
            print(f"  Baseline {comparison}", file=screen)
    agrees = [comparison.agrees for comparison in comparisons if comparison.agrees is not None]
    if agrees and all(agrees):
        print(f"  Baseline all {len(agrees)} expectations met", file=screen)
    is_met = not comparisons or (bool(agrees) and all(agrees))
    return code if is_met or code is not ExitCode.DONE else ExitCode.INCONCLUSIVE


class CiOutput:
    """Writes the files that the options name, anew after every run.

    Raises InputError before anything is run, where a file cannot be written.
    """

    def __init__(self, options: argparse.Namespace) -> None:
        self._junit: Path | None = options.junit
        self._json: Path | None = options.json
        self._baseline: Document[Baseline] | None = None
        self._runs: list[Reported] = []

    @property
    def files(self) -> list[tuple[Path, str]]:
        """The files that are written, each with what to do where it cannot be."""
        named = [("--json", None if self.owns_standard_output else self._json), ("--junit", self._junit)]
        return [(path, f"give {option} another file") for option, path in named if path is not None]

    @contextmanager
    def checking(self) -> Iterator[None]:
        """Take away what an earlier run left, once a block has checked the inputs.

        Where the block refuses the run, the files that are inputs may be unknown: only what a run wrote is taken away.
        """
        try:
            yield
        except BaseException:
            for path, _ in self.files:
                if _is_of_a_run(path):
                    with suppress(InputError):
                        _clear(path)
            raise
        for path, _ in self.files:
            _clear(path)

    def read_baseline(self, path: Path) -> None:
        """Read what each run is held against; InputError where it is wrong.

        The bench's plug-ins are taken in by then: the units of what they measure are known.
        """
        from etb_hil.session.baseline import load_baseline

        self._baseline = load_baseline(path)

    @property
    def owns_standard_output(self) -> bool:
        """Whether nothing else may be printed there."""
        return self._json == STANDARD_OUTPUT

    def add(self, results: RunResult, session: Path | None = None) -> ExitCode:
        """Write what came of a run.

        The results are written before they are held against the baseline. Return its
        exit code, inconclusive where only the baseline disagrees.
        """
        from etb_hil.report.junit import Reported, junit_text
        from etb_hil.results.json_file import result_as_dict
        from etb_hil.session.baseline import compare

        if self._json is not None:
            # A screen's encoding may lack characters that a file has.
            text = json.dumps(result_as_dict(results), indent=1, ensure_ascii=self.owns_standard_output)
            print(text) if self.owns_standard_output else _write(self._json, f"{text}\n")
        self._runs.append(Reported(results, session, []))
        if self._junit is not None:
            _write(self._junit, junit_text(self._runs))
        comparisons = [] if self._baseline is None else compare(self._baseline, results)
        if comparisons and self._junit is not None:
            self._runs[-1] = Reported(results, session, comparisons)
            _write(self._junit, junit_text(self._runs))
        screen = sys.stderr if self.owns_standard_output else sys.stdout
        return held_against(comparisons, results.code, screen)


def _is_of_a_run(path: Path) -> bool:
    """Return whether a file begins as the results of a run do, in JSON or JUnit's XML."""
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD)
    except OSError:
        return False
    return head.startswith(b'{\n "run_id": ') or (head.startswith(b"<?xml") and b'<testsuites name="etb-hil"' in head)


def _clear(path: Path) -> None:
    """Take away what an earlier run left, lest it be read as this one's.

    Find out whether a file can stand there.
    """
    if path.exists() and not (path.is_file() or path.is_dir()):  # else /dev/null would be gone for everybody
        raise InputError(Problem("must be a regular file", Place(path), remedy="choose another file"))
    if not path.parent.is_dir():
        raise InputError(Problem("no such folder", Place(path.parent), remedy="create it, or correct the path"))
    with refused_by_name(path):
        target = Path(os.path.realpath(path))  # a link stays
        target.touch()
        target.unlink()


def _write(path: Path, text: str) -> None:
    """Write what CI reads.

    Where that fails, say so: the exit code stays that of the verdict.
    """
    try:
        write_text(path, text, "make room, then take the results from the session")
    except InputError as error:
        print(error, file=sys.stderr)
