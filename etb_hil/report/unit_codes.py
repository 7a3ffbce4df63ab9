"""The unit's own trouble codes beside what was measured of it, as sentences."""

from __future__ import annotations

from typing import TYPE_CHECKING

from etb_hil.base.outcome import BenchOutcome, UnitVerdict
from etb_hil.results import shown
from etb_hil.uds.trouble_codes import CODES

if TYPE_CHECKING:
    from etb_hil.results.measurement import Measurement
    from etb_hil.results.run_result import RunResult
    from etb_hil.results.unit_diagnostics import TroubleCode, UnitDiagnostics

_AS_IT_SHOULD = " as it should be"


def code_sentences(results: RunResult) -> list[str]:
    """Return a sentence for each code that the unit reports after the run.

    The sentence has the code, and what was measured.
    """
    diagnostics = results.unit_diagnostics
    if diagnostics is None or diagnostics.codes_after is None or results.bench.outcome is not BenchOutcome.OK:
        return []
    told = [f"The unit reports {code.code}; {measured_for(code, results)}." for code in diagnostics.codes_after]
    if diagnostics.codes_left:
        left = codes_line(diagnostics.codes_left)
        told.append(f"After its trouble codes were cleared, the unit reported {left} again: what causes it is there.")
    return told


def measured_for(code: TroubleCode, results: RunResult) -> str:
    """Return what was measured of all that speaks for or against a code."""
    meaning = CODES.get(code.code)
    wanted = () if meaning is None else meaning.measurements
    found = [one for name in wanted if (one := results.measurements.get(name)) is not None and one.is_known]
    if not found:
        return "no measurement of this run speaks for or against it"
    return "measured: " + ", ".join(_said(one) for one in found)


def codes_line(codes: tuple[TroubleCode, ...] | None) -> str:
    """Return codes as a list: what was not read is said to be."""
    if codes is None:
        return "not read"
    return ", ".join(f"{one.code}{'' if one.is_failing else ' (stored)'}" for one in codes) or "none"


def facts(diagnostics: UnitDiagnostics) -> list[tuple[str, str]]:
    """Return what the unit reports, as names and texts."""
    rows = [
        (one.name.replace("_", " ").capitalize(), one.value + (f" (expected {one.expected})" if one.expected else ""))
        for one in diagnostics.identity
    ]
    cleared = ", then cleared" if diagnostics.cleared else ""
    if diagnostics.codes_left:
        cleared += f"; back at once: {codes_line(diagnostics.codes_left)}"
    rows += [
        ("Trouble codes before", codes_line(diagnostics.codes_before) + cleared),
        ("Trouble codes after", codes_line(diagnostics.codes_after)),
    ]
    for one in diagnostics.routines:
        name = one.name.replace("_", " ").capitalize()
        rows.append(
            (f"{name}, {one.when} the scenario", f"{one.outcome}, {shown.quantity(one.end_s - one.start_s, 's')}")
        )
    return rows


def _said(one: Measurement) -> str:
    value = f"{one.name} {shown.measured(one)}"
    if one.verdict is UnitVerdict.PASS:
        return value + _AS_IT_SHOULD
    if one.verdict is UnitVerdict.FAIL:
        return f"{value} (allowed {shown.limits(one)})"
    return f"{value} (undecided)" if one.verdict is UnitVerdict.INCONCLUSIVE else f"{value} (no limit)"
