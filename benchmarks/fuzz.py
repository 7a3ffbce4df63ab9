"""Every kind of file with wrong contents, given to the commands that read it, each in a process of its own.

    python benchmarks/fuzz.py [KIND ...] [--seconds 30] [--seed 0] [--first 0] [--keep FOLDER] [--list]

`--seconds` of processor time for all kinds together: 30 is the quick form, 300 a kind the nightly one, 3600 a kind
the whole. Ctrl-C and SIGTERM end it after the case that runs: the row of the table counts what was done, and `--first
N` goes on at case N of each kind. A finding is a traceback, 60 s of processor time, more than 1 GiB, an exit code
that is not documented, a message of more than 20,000 letters, or a verdict that became the other one. With one seed
the same files come again; `--keep` keeps those of the findings, and what was said.
Exit code 1 where there were findings.
"""

import argparse
import os
import random
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
from dataclasses import dataclass, field
from pathlib import Path

from fuzz_kinds import KINDS, seeds

from etb_hil.base.lean_imports import keep_imports_lean
from etb_hil.cli.main import main as etb_hil

MOST_S, MOST_WALL_S, MOST_BYTES, MOST_LETTERS = 60, 600, 1 << 30, 20_000
DOCUMENTED = {0, 2, 3, 4, 5, 10}
VERDICTS = {0, 10}


@dataclass
class Tally:
    """What came of one kind."""

    cases: int = 0
    seconds: float = 0.0
    codes: dict = field(default_factory=dict)
    longest_s: float = 0.0
    most_bytes: int = 0
    findings: list = field(default_factory=list)


def run_case(words, said):
    """Run a command in a child; return its exit code or signal, processor seconds and most bytes."""
    child = os.fork()
    if not child:
        code = 70  # of no command: what ends with it was not caught
        try:
            resource.setrlimit(resource.RLIMIT_CPU, (MOST_S, MOST_S + 1))
            signal.signal(signal.SIGALRM, signal.SIG_DFL)
            signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C of the terminal is for the parent
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
            signal.alarm(MOST_WALL_S)
            with said.open("wb") as file:
                for number in (1, 2):
                    os.dup2(file.fileno(), number)
            sys.stdout, sys.stderr = (
                os.fdopen(number, "w", encoding="utf-8", errors="backslashreplace") for number in (1, 2)
            )
            code = int(etb_hil(words))
        except SystemExit as stop:
            code = stop.code if isinstance(stop.code, int) else 1
        except BaseException:  # noqa: BLE001 (that is what is looked for)
            traceback.print_exc()
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(code)
    _, status, used = os.wait4(child, 0)
    return os.waitstatus_to_exitcode(status), used.ru_utime + used.ru_stime, used.ru_maxrss << 10


def finding(code, expected, spent, most, text):
    """What is wrong with an answer; empty where nothing is."""
    if "Traceback (most recent call last)" in text:
        return "traceback: " + next(
            (line for line in reversed(text.splitlines()) if line and not line.startswith(" ")), ""
        )
    bad = {
        f"hang: {spent:.0f} s": spent > MOST_S or code in {-signal.SIGXCPU, -signal.SIGALRM},
        f"memory: {most >> 20} MiB": most > MOST_BYTES,
        f"exit code {code}": code not in DOCUMENTED,
        f"says {len(text)} letters": len(text) > MOST_LETTERS,
        f"exit code {expected} became {code}": expected is not None and code in VERDICTS and code != expected,
    }
    return ", ".join(what for what, there in bad.items() if there)


def fuzz(kind, given, seconds, seed, keep, first, is_stopped):
    """Make and run cases of a kind for some seconds of processor time, or until it is stopped."""
    tally, number = Tally(), first
    begin = time.process_time()
    while tally.seconds + time.process_time() - begin < seconds and not is_stopped():
        rng = random.Random(f"{kind} {seed} {number}")  # noqa: S311 (what is wrong in a file is no secret)
        with tempfile.TemporaryDirectory(prefix="fuzz") as name:
            folder = Path(name)
            words, expected = KINDS[kind](rng, folder, given)
            inputs = folder / "inputs-of-case"
            if keep:
                shutil.copytree(folder, inputs, ignore=shutil.ignore_patterns("inputs-of-case"))
            code, spent, most = run_case(words, folder / "said.txt")
            text = (folder / "said.txt").read_text("utf-8", "replace")
            if what := finding(code, expected, spent, most, text):
                tally.findings.append(f"{kind} seed {seed} case {number}: {what}: etb-hil {' '.join(words)}")
                print(tally.findings[-1], flush=True)
                if keep:
                    shutil.copytree(inputs, keep / f"{kind}-{seed}-{number}", dirs_exist_ok=True)
                    (keep / f"{kind}-{seed}-{number}" / "said.txt").write_text(text + "\n" + " ".join(words), "utf-8")
        tally.cases, tally.seconds = tally.cases + 1, tally.seconds + spent
        tally.codes[code] = tally.codes.get(code, 0) + 1
        tally.longest_s, tally.most_bytes = max(tally.longest_s, spent), max(tally.most_bytes, most)
        number += 1
    tally.seconds += time.process_time() - begin
    return tally


def main():
    """Fuzz the kinds named, or all."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("kinds", nargs="*", choices=[[], *KINDS], metavar="KIND")
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--seed", default="0")
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--list", action="store_true")
    options = parser.parse_args()
    if options.list:
        print(*KINDS)
        return 0
    kinds = options.kinds or list(KINDS)
    keep_imports_lean()
    found, stops = 0, []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *received: stops.append(received))
    with tempfile.TemporaryDirectory(prefix="fuzz-seeds") as name:
        given = seeds(Path(name))
        print(
            "| kind | cases | s | longest s | most MiB | exit codes | findings |\n|---|---|---|---|---|---|---|",
            flush=True,
        )
        for kind in kinds:
            seconds = options.seconds / len(kinds)
            tally = fuzz(kind, given, seconds, options.seed, options.keep, options.first, lambda: bool(stops))
            codes = ", ".join(f"{code}: {count}" for code, count in sorted(tally.codes.items()))
            row = (
                kind,
                tally.cases,
                f"{tally.seconds:.0f}",
                f"{tally.longest_s:.1f}",
                tally.most_bytes >> 20,
                codes,
                len(tally.findings),
            )
            print("| " + " | ".join(map(str, row)) + " |", flush=True)
            found += len(tally.findings)
            if stops:
                print(f"stopped: go on with {kind} --first {options.first + tally.cases}", flush=True)
                break
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
