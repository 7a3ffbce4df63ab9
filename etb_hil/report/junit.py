"""Runs as JUnit's XML, which every CI server shows.

A unit is a test suite. What the bench did and what is said of the unit are test cases of their own, so that a bench
that failed is an error, and never a unit's failure; so is every number that has a limit, and every attempt.
A cause fails once: the unit's case states the measurement that is the reason of the verdict.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from etb_hil.base.outcome import BenchOutcome, UnitVerdict
from etb_hil.bench.wording import bench_wording
from etb_hil.diagnosis.measurement_registry import kind_of
from etb_hil.report import show
from etb_hil.report.unit_codes import codes_line
from etb_hil.report.verdict import unit_line, verdict_of
from etb_hil.results import shown

if TYPE_CHECKING:
    from etb_hil.results.measurement import Measurement
    from etb_hil.results.run_result import Attempt, RunResult
    from etb_hil.session.baseline import Comparison

_LONGEST = 2000


@dataclass(frozen=True, slots=True)
class Reported:
    """A run with its session's folder, and what a comparison to a baseline found."""

    results: RunResult
    session: Path | None = None
    comparisons: Sequence[Comparison] = ()


def junit_text(runs: Iterable[Reported]) -> str:
    """Return the XML document of some runs, one test suite each, in their order."""
    root = ET.Element("testsuites", name="etb-hil")
    for run in runs:
        root.append(_suite(run))
    _count(root, root.iter("testcase"))
    ET.indent(root)
    return ET.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _suite(run: Reported) -> ET.Element:
    results = run.results
    suite = ET.Element("testsuite", name=_plain(" - ".join(filter(None, (results.scenario, results.unit.serial)))))
    if results.started:
        suite.set("timestamp", results.started.partition(".")[0].removesuffix("+00:00"))
    properties = ET.SubElement(suite, "properties")
    for name, value in _properties(run):
        ET.SubElement(properties, "property", name=name, value=_plain(value))
    cases = [
        *(_attempt(attempt) for attempt in results.attempts),
        _bench(results),
        _unit(results),
        *(_measurement(one, results) for one in results.judged),
        *(_comparison(comparison) for comparison in run.comparisons),
    ]
    class_name = _plain(f"{results.bench.name}.{results.scenario}" if results.scenario else results.bench.name)
    for case in cases:
        case.set("classname", class_name)
        case.attrib.setdefault("time", "0")
        suite.append(case)
    _count(suite, cases)
    suite.set("time", _seconds(results))
    return suite


def _properties(run: Reported) -> Iterable[tuple[str, object]]:
    results = run.results
    yield "serial", results.unit.serial
    yield "part_number", results.unit.part_number
    yield "revision", results.unit.revision
    yield "bench", results.bench.name
    yield "scenario", results.scenario
    yield "model", results.model
    yield "seed", results.seed
    yield "run_id", results.run_id
    yield "session", run.session or ""
    yield "attempts", len(results.attempts) + 1
    for one in results.measurements.values():
        yield one.id, one.value
        yield f"{one.id}.unit", one.unit
        for key in ("low", "high", "limit_low", "limit_high"):
            if (value := getattr(one, key)) is not None:
                yield f"{one.id}.{key}", value
    if (says := results.unit_diagnostics) is not None:
        for identity in says.identity:
            yield f"unit.{identity.name}", identity.value
        yield "unit.codes_before", codes_line(says.codes_before)
        yield "unit.codes_after", codes_line(says.codes_after)
        if says.cleared:
            yield "unit.codes_left", codes_line(says.codes_left)
        for routine in says.routines:
            yield f"unit.{routine.name}.{routine.when}", routine.outcome
    bus = results.bus
    yield "bus", bus.name
    yield "bus_load", bus.load
    yield "bus_load_peak", bus.load_peak
    yield "bus_state", bus.state
    yield "error_frames", bus.error_frames
    lost = [message.lost for message in bus.messages]
    yield "lost_frames", None if None in lost else sum(filter(None, lost))
    yield "timestamp_grade", results.timestamp_grade
    for name, version in results.versions.items():
        yield f"version.{name}", version
    for plugin in results.plugins:
        yield f"plugin.{plugin.name}", f"{plugin.version} sha256:{plugin.sha256}".strip()


def _bench(results: RunResult) -> ET.Element:
    case = ET.Element("testcase", name="bench", time=_seconds(results))
    if results.bench.outcome is not BenchOutcome.OK:
        words = bench_wording(results)
        kind = "bench fault" if results.bench.outcome is BenchOutcome.FAULT else "aborted"
        _outcome(case, "error", kind, words.reason, words.next_step)
    return case


def _unit(results: RunResult) -> ET.Element:
    case = ET.Element("testcase", name="unit")
    if results.bench.outcome is not BenchOutcome.OK:
        _outcome(case, "skipped", "", "The unit was not judged.", "")
        return case
    verdict = verdict_of(results)
    if results.unit.verdict is not UnitVerdict.PASS:
        element = "failure" if results.unit.verdict is UnitVerdict.FAIL else "error"
        _outcome(case, element, verdict.headline.lower(), verdict.reason, verdict.next_step)
    lines = [f"{verdict.headline} - {unit_line(results)}", verdict.reason, *verdict.further, verdict.next_step]
    ET.SubElement(case, "system-out").text = _plain("\n".join(lines))
    return case


def _measurement(one: Measurement, results: RunResult) -> ET.Element:
    case = ET.Element("testcase", name=_plain(one.id))
    found = f"{one.name} is {shown.measured(one)}, allowed {shown.limits(one)}"
    if results.bench.outcome is not BenchOutcome.OK:
        _outcome(case, "skipped", "", "The unit was not judged.", found)
    elif one.verdict is not UnitVerdict.PASS and _is_the_reason(one, results):
        ET.SubElement(case, "system-out").text = _plain(f"{one.verdict}: {found}; see the case 'unit'")
    elif one.verdict is not UnitVerdict.PASS:
        element = "failure" if one.verdict is UnitVerdict.FAIL else "error"
        interval = "" if one.is_bound else f"95 % interval: {shown.interval(one) or shown.UNKNOWN}"
        _outcome(case, element, str(one.verdict), found, interval)
    return case


def _is_the_reason(one: Measurement, results: RunResult) -> bool:
    """Return whether the verdict rests on a measurement.

    Friction torques are one cause, together with the margins that friction above its limit reduces.
    """
    reason = results.unit.reason_id
    of_reason = next((k for k in results.judged if reason.startswith(k.id)), None)
    if of_reason is None or one.id == of_reason.id:
        return of_reason is not None
    failing = [each for each in results.judged if each.verdict is UnitVerdict.FAIL]
    of_friction = {each.id for each in results.judged if _is_friction(each)}
    if any(map(_is_friction, (of_reason, *failing))):
        of_friction |= {each.id for each in results.judged if (kind := kind_of(each.id)) and kind.friction_of}
    return {one.id, of_reason.id} <= of_friction


def _is_friction(one: Measurement) -> bool:
    kind = kind_of(one.id)
    return kind is not None and kind.is_friction


def _attempt(attempt: Attempt) -> ET.Element:
    """Return an attempt that was tried again: no failure, and not hidden either."""
    case = ET.Element("testcase", name=f"attempt {attempt.number}")
    what = "bench fault" if attempt.outcome is BenchOutcome.FAULT else str(attempt.verdict or attempt.outcome)
    _outcome(case, "skipped", "", f"{what} ({attempt.reason_id}), tried again", attempt.folder)
    return case


def _comparison(comparison: Comparison) -> ET.Element:
    case = ET.Element("testcase", name=_plain(f"baseline {comparison.name}"))
    if comparison.agrees is None:
        _outcome(case, "skipped", "", str(comparison), "")
    elif not comparison.agrees:
        _outcome(case, "failure", "baseline", str(comparison), "")
    return case


def _outcome(case: ET.Element, element: str, kind: str, message: str, text: str) -> None:
    child = ET.SubElement(case, element, message=_plain(message))
    if kind:
        child.set("type", kind)
    child.text = _plain(text) or None


def _count(suite: ET.Element, cases: Iterable[ET.Element]) -> None:
    kinds = [child.tag for case in cases for child in [*case, case] if child.tag != "system-out"]
    suite.set("tests", str(kinds.count("testcase")))
    for attribute, tag in (("failures", "failure"), ("errors", "error"), ("skipped", "skipped")):
        suite.set(attribute, str(kinds.count(tag)))


def _seconds(results: RunResult) -> str:
    return "0" if results.duration_s is None else f"{results.duration_s:.3f}"


def _plain(value: object) -> str:
    """Return a text that XML can hold; what is unknown is said to be."""
    text = shown.UNKNOWN_WORD if value is None else str(value)
    return "\n".join(show.printable(line, _LONGEST) for line in text.split("\n"))
