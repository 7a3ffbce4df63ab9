"""The outcomes of bench and unit, their exit codes, and the safe state.

The two kinds of outcome are never mixed.
"""

from __future__ import annotations

from enum import IntEnum, StrEnum


class UnitVerdict(StrEnum):
    """What the run says of the unit."""

    PASS = "pass"  # noqa: S105 (a verdict, no password)
    FAIL = "fail"
    INCONCLUSIVE = "inconclusive"


class BenchOutcome(StrEnum):
    """What the run says of the bench."""

    OK = "ok"
    FAULT = "fault"
    ABORTED = "aborted"


class SafeState(StrEnum):
    """Whether the safe state was reached."""

    VERIFIED = "verified"
    NOT_VERIFIED = "not verified"


class ExitCode(IntEnum):
    """Exit codes of `etb-hil`.

    1 is left to Python's own crash, which must not blame a unit.
    """

    DONE = 0
    BAD_INPUT = 2
    BENCH_FAULT = 3
    INCONCLUSIVE = 4
    ABORTED = 5
    UNIT_FAILED = 10


def exit_code(bench: BenchOutcome, unit: UnitVerdict | None) -> ExitCode:
    """Return the exit code of a run.

    A bench fault outranks fail, fail outranks inconclusive.
    """
    if bench is BenchOutcome.FAULT:
        return ExitCode.BENCH_FAULT
    if bench is BenchOutcome.ABORTED:
        return ExitCode.ABORTED
    if unit is UnitVerdict.FAIL:
        return ExitCode.UNIT_FAILED
    if unit is UnitVerdict.INCONCLUSIVE:
        return ExitCode.INCONCLUSIVE
    return ExitCode.DONE
