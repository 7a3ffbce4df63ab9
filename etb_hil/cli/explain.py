"""`etb-hil explain`: what the simulation gets wrong of a measurement, and why."""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import chain, count
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from etb_hil.api.explaining import Explanation
    from etb_hil.base.errors import Problem


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument(
        "data",
        nargs="+",
        type=Path,
        help="session folders, CAN logs (with --bench), CSV, MAT, Parquet; the first is explained, the others test it",
    )
    parser.add_argument("--model", help="model file, or the name of a stock one (default: the first session's own)")
    parser.add_argument("--map", type=Path, help="which column of a table is which role")
    parser.add_argument("--bench", help="bench file that says which frame of a CAN log is which role")
    parser.add_argument("--limits", help="limits of the part (default: the first session's own, else default)")
    parser.add_argument(
        "--fit-on",
        type=_numbers,
        default=(),
        metavar="VALUES",
        help="of data too slow to name causes by: the conditions whose runs are fitted, for instance 10000,15000",
    )
    parser.add_argument(
        "--same-unit",
        action="store_true",
        help="all recordings are of one unit: each may distinguish causes (put the record of a next test first)",
    )
    parser.add_argument(
        "--out", type=Path, help="folder (default: explanation, or explanation_2 and so on where an answer is)"
    )
    parser.add_argument("--pictures", action="store_true", help="write the plots of the page as PNG files, too")


def run(options: argparse.Namespace) -> int:
    """Explain the data, write the answer and print its verdict."""
    with _saying("the data were being read; nothing was fitted and nothing was written"):
        from etb_hil.api.explaining import explain
        from etb_hil.api.models import as_limits, as_model
        from etb_hil.api.recordings import read
        from etb_hil.base.errors import InputError
        from etb_hil.base.outcome import ExitCode
        from etb_hil.discrepancy.slow.sweeps import slow_remark
        from etb_hil.report.explain_next_test import next_steps
        from etb_hil.report.explain_values import joined, words
        from etb_hil.report.explain_verdict import one_component, reason
        from etb_hil.report.residual_text import residual_text
        from etb_hil.store.address import sessions_among

        options.data = sessions_among(options.data)
        options.out = options.out or _free_folder()
        _must_take_an_answer(options.out, _inputs(options))
        model = as_model(_model(options))
        alone = len(options.data) == 1  # beside others, a session needs neither of what those are read with
        recordings = [
            read(path) if Path(path).is_dir() and not alone else read(path, bench=options.bench, columns=options.map)
            for path in options.data
        ]
        limits = as_limits(_limits(options))
        if remark := slow_remark(recordings[0]):
            print(remark, file=sys.stderr)
    answer = explain(
        recordings,
        model,
        progress=_progress,
        limits=limits,
        fit_on=options.fit_on,
        is_same_unit=options.same_unit,
    )
    with _saying("the report was being written; explanation.json may be there without it"):
        paths, problem = _write(answer, options)
    _progress("")
    found = answer.result
    print(f"verdict: {found.verdict.replace('_', ' ')}\n  {reason(found)}")
    if left := residual_text(found):
        print(f"  {left}")
    for lacking in found.data_quality:
        if isinstance(lacking, str):
            print(f"  {lacking}")
    for cause in found.causes:
        named = joined(map(words, (cause.id, *cause.not_isolable_from)), "or")
        print(f"  {named}: {100.0 * cause.share_of_error:.0f} % of the error")
    if shared := one_component(found):
        print(f"  {shared}")
    for step in next_steps(found):
        print(f"  next: {step}")
    if problem is not None:
        raise InputError(problem)
    print("\n".join(f"  {path}" for path in paths))
    if found.interrupted:
        print(f"interrupted while {found.interrupted}; {found.stages}", file=sys.stderr)
        return int(ExitCode.ABORTED)
    return int(ExitCode.INCONCLUSIVE if found.verdict == "insufficient_data" else ExitCode.DONE)


def _write(answer: Explanation, options: argparse.Namespace) -> tuple[list[Path], Problem | None]:
    """Return the files that hold an answer, or what kept it from being written.

    A full disk must not cost the answer.
    """
    from etb_hil.base.errors import InputError, Place, Problem

    try:
        return answer.write(options.out, _inputs(options), pictures=options.pictures), None
    except InputError as error:  # somebody put files of their own there meanwhile
        return [], error.problems[0]
    except OSError as error:
        remedy = "make room or give another folder with --out, and explain again"
        what = f"does not hold the whole answer, for it cannot be written: {error.strerror}"
        return [], Problem(what, Place(options.out), remedy=remedy)


@contextmanager
def _saying(what: str) -> Iterator[None]:
    """Let an interrupt say what was being done."""
    try:
        yield
    except KeyboardInterrupt:
        raise KeyboardInterrupt(what) from None


def _numbers(text: str) -> tuple[float, ...]:
    try:
        return tuple(float(one) for one in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"must be numbers with commas, as in 10000,15000 (got '{text}')") from None


def _inputs(options: argparse.Namespace) -> list[Path]:
    """Return the files that the command reads, each where it was found.

    InputError where a file of the data is missing.
    """
    from etb_hil.base.stock import find
    from etb_hil.base.userfile import require_file

    for path in options.data:
        if not path.is_dir():
            require_file(path)
    named = [_model(options), _limits(options), *options.data]
    if options.bench is not None:
        named.append(find("bench", options.bench))
    return named if options.map is None else [*named, options.map]


def _free_folder() -> Path:
    """Return the first folder of `explanation`, `explanation_2`, ... without files."""
    names = chain(["explanation"], (f"explanation_{number}" for number in count(2)))
    return next(path for path in map(Path, names) if not path.exists() or (path.is_dir() and not any(path.iterdir())))


def _must_take_an_answer(folder: Path, inputs: list[Path]) -> None:
    """Refuse a folder that cannot be written to, or would lose what people have there.

    What it tried is gone again.
    """
    from etb_hil.base.errors import InputError, Place, Problem
    from etb_hil.discrepancy.answer.folder import WRITTEN, must_not_lose
    from etb_hil.report.explain_report import REPORT_FILES

    missing = [one for one in (folder.absolute(), *folder.absolute().parents) if not one.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
        for one in missing:
            one.rmdir()
    except OSError as error:
        what = f"takes no answer: {error.strerror}"
        remedy = "give a folder that can be made and written to with --out"
        raise InputError(Problem(what, Place(folder), remedy=remedy)) from None
    must_not_lose(folder, inputs, (*WRITTEN, *REPORT_FILES))


def _model(options: argparse.Namespace) -> Path:
    from etb_hil.api.explaining import model_of
    from etb_hil.base.stock import find

    return find("model", str(options.model or model_of(_session(options))))


def _limits(options: argparse.Namespace) -> Path:
    from etb_hil.api.explaining import limits_of
    from etb_hil.base.stock import find

    return find("limits", str(options.limits or limits_of(_session(options))))


def _session(options: argparse.Namespace) -> Path | None:
    first: Path = options.data[0]
    return first if first.is_dir() else None


def _progress(what: str) -> None:
    if sys.stderr.isatty():
        print(f"\r\033[K{what}", end="", file=sys.stderr, flush=True)
