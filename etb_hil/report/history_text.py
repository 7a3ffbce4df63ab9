"""Format a history as text of 80 columns: a table of the runs, then statistics."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator, Sequence

import numpy as np

from etb_hil.base.outcome import BenchOutcome
from etb_hil.histories.capability import ENOUGH, Capability, Index
from etb_hil.histories.control_chart import FEWEST, ControlChart
from etb_hil.histories.drift import FEWEST as LEAST
from etb_hil.histories.drift import Drift
from etb_hil.histories.gauge import ENOUGH_CATEGORIES, ENOUGH_UNITS, GOOD, USABLE, GaugeStudy
from etb_hil.histories.history import FRICTION, History, NumberHistory
from etb_hil.histories.rise import Rises
from etb_hil.histories.shift import RUN_LENGTH
from etb_hil.histories.temperature import FEWEST as FEWEST_UNITS
from etb_hil.histories.temperature import LEAST_SPREAD, REFERENCE, TemperatureEffect
from etb_hil.report.show import printable
from etb_hil.results.shown import heading, plain, quantity, unit_shown

WIDTH = 80
TESTS = "Nelson's rules, EWMA and CUSUM"
# Five categories are a share of the variation: one limit in two words.
GAUGE_LIMITS = (
    f"good: below {100 * GOOD:.0f} %; usable: at least {ENOUGH_CATEGORIES} categories, or at most {100 * USABLE:.0f} %"
)
UNRESOLVED = (
    "Repeats do not scatter: the resolution of the values hides the scatter of the gauge. "
    "Record values with more digits."
)
_INDENT = 17
_HELD = "\N{NO-BREAK SPACE}"


def history_text(history: History, rows: int) -> str:
    """Return a history as plain text; of the runs, the latest `rows`."""
    head = f"{printable(history.part_number, 30)} revision {printable(history.revision, 10)}"
    lines = ["", f"{head}, {printable(history.scenario, 30)}", *_table(history, rows)]
    numbers = [number for number in history.numbers if number.at]
    for number in numbers:
        said = list(statements(number))
        if said:
            lines += ["", heading(number.id, number.name)]
            lines += [line for name, text in said for line in _entry(name, text)]
    missing: dict[tuple[str, str], list[str]] = {}
    for number in numbers:
        for entry in lacking(number):
            missing.setdefault(entry, []).append(number.name)
    if missing:
        lines += ["", "Not enough runs for"]
    for (name, text), whose in missing.items():
        is_of_all = name == "Temperature" or len(whose) == len(numbers)
        lines += _entry(name, text if is_of_all else f"{', '.join(whose)}: {text}")
    return "\n".join(lines)


def _table(history: History, rows: int) -> Iterator[str]:
    runs = history.runs
    counting = sum(run.counts for run in runs)
    benches = len({run.bench for run in runs})
    yield f"  Runs {len(runs)}, units {history.units}, benches {benches}; runs that count {counting}"
    if counting < len(runs):
        yield "  (In brackets: bench faults, aborted runs, and those whose verdict was withheld.)"
    unnamed = sum(not run.serial for run in runs)
    if unnamed:
        yield f"  Runs without a serial number: {unnamed}; each stands for a unit of its own"
    yield ""
    taken = {number.id: history.at_reference(number) for number in history.numbers}
    yield f"  {'':29}{'as measured':>14}{'at 20 °C':>14}"
    columns = "".join(f"{name:>7}" for name in FRICTION)
    yield f"  {'date':11}{'serial':18}{columns}{columns}{'°C':>6} verdict"
    if rows < len(runs):
        yield f"  ... {len(runs) - rows} earlier ones"
    for place, run in list(enumerate(runs))[-rows:]:
        measured = [run.numbers[name].value if name in run.numbers else None for name in FRICTION]
        compared = [taken[name].get(place, (None, 0.0))[0] for name in FRICTION]
        values = "".join(f"{plain(value, 'N·m'):>7}" for value in (*measured, *compared))
        verdict = run.verdict if run.bench_outcome == BenchOutcome.OK else f"bench {run.bench_outcome}"
        said = verdict if run.counts else f"({verdict})"
        serial = printable(run.serial or "-", 17)
        yield f"  {run.started[:10]:11}{serial:18}{values}{plain(run.temperature, 'degC'):>6} {said}".rstrip()


def lacking(number: NumberHistory) -> Iterator[tuple[str, str]]:
    """Yield the statistics for which there are too few runs, and what they need."""
    if number.id in FRICTION and number.temperature is None:
        seen = f"fewer than {FEWEST_UNITS} units were seen at temperatures {LEAST_SPREAD:.0f} K apart"
        yield "Temperature", f"{seen}. Values are compared as measured."
    if number.chart is None:
        yield "Control chart", f"no limits from fewer than {FEWEST} units; there are {len(number.charted)}."
    if number.gauge is None:
        yield "Gauge R&R", "needs at least 2 different units with 2 runs each, on one bench or on several."
    if not number.drifts and not number.looked_at:
        yield "Drift", f"no unit and no bench has {LEAST} runs of units that were measured again."


def statements(number: NumberHistory) -> Iterator[tuple[str, str]]:
    """Yield the statistics of a measurement: a name and sentences each."""
    if number.temperature is not None:
        yield "Temperature", _temperature(number.temperature, int(np.count_nonzero(np.isnan(number.compared))))
    if number.chart is not None:
        yield "Control chart", _chart(number.chart, number)
        yield "Distribution", distribution_text(number)
    if number.tolerance_limit is not None:
        yield "Population", _population(number.tolerance_limit, len(number.charted), number.temperature)
    if number.capability is not None and number.shape is not None:
        yield "Capability", _capability(number.capability, number, by_quantiles=not number.shape.is_normal)
    elif number.chart is not None and number.differing_limits:
        yield "Capability", _no_limit(number)
    if number.gauge is not None:
        yield "Gauge R&R", _gauge(number.gauge, number.unit)
    if number.rises is not None:
        yield "Rise", _rises(number.rises)
    if number.drifts:
        yield "Drift", " ".join(map(_drift, number.drifts))
    elif number.looked_at:
        yield "Drift", f"none; looked for in {number.looked_at} series of {LEAST} or more runs of a unit or bench."


def _chart(chart: ControlChart, number: NumberHistory) -> str:
    found = dict(sorted({**chart.shifts.signals, **chart.signals}.items()))
    signals = [f"{printable(number.charted[k], 30)}: {reason}" for k, reason in found.items()]
    state = "NOT IN CONTROL: " + "; ".join(signals[:5]) if signals else f"in control by {TESTS}"
    more = f"; {len(signals) - 5} more in history.json" if len(signals) > 5 else ""
    unit = number.unit
    limits = f"limits {plain(chart.low, unit)} to {quantity(chart.high, unit)}"
    centre = f"{len(chart.values)} units, centre {quantity(chart.centre, unit)}"
    ranges = f"moving range {quantity(chart.mean_range, unit)}"
    chance = f"A process in control gives such a signal once in {RUN_LENGTH['all']} units" if signals else ""
    if signals and (number.shape is None or not number.shape.is_normal):
        chance += " where values are normally distributed; these are not, and give one more often"
    chance += "." if chance else ""
    return f"{centre}, {limits}, {ranges}: {state}{more}. {chance}".rstrip()


def distribution_text(number: NumberHistory) -> str:
    """Return the family that the units' values follow, and those rejected."""
    shape, chart = number.shape, number.chart
    if shape is not None:
        rejected = "".join(f"; {family} rejected (p {_p(p)})" for family, p in shape.rejected.items())
        return f"{shape.family}{'' if shape.p is None else f' (p {_p(shape.p)})'}{rejected}."
    if chart is None or chart.sigma == 0.0:
        return "unknown: the values do not scatter."
    return (
        "unknown: no family of distributions describes these units, so that no capability and no population limit is "
        "given. Look at units with signals first, then for two populations, as of two suppliers."
    )


def _p(p: float) -> str:
    return f"{p:.2f}" if p >= 0.01 else "< 0.01"


def _temperature(effect: TemperatureEffect, left_out: int) -> str:
    text = (
        f"{100 * effect.coefficient:+.2f} %/K (95 %: {100 * effect.low:+.2f} to {100 * effect.high:+.2f}), from "
        f"{effect.runs} runs of {effect.units} units at {effect.coldest:.0f} to {effect.warmest:.0f} °C; "
        f"corrected to {REFERENCE:.0f} °C."
    )
    if not left_out:
        return text
    beyond = f"their temperature is unknown, or too far from {REFERENCE:.0f} °C for this coefficient's interval"
    return f"{text} Runs left out below: {left_out}; {beyond}."


def _population(limit: float, units: int, law: TemperatureEffect | None) -> str:
    text = f"With 95 % confidence, 99 % of units lie below {quantity(limit, 'N·m')}"
    if law is None:
        return f"{text} as measured ({units} units)."
    stated = (
        f"coefficient: {100 * law.coefficient:.2f} %/K, reference: {REFERENCE:.0f} degC, "
        f"between: [{law.coldest:.0f} degC, {law.warmest:.0f} degC]"
    )
    at_reference = f"{text} at {REFERENCE:.0f} °C ({units} units)"
    return f"{at_reference}. Temperature law for a limits file: {{{stated}}}."


def _capability(found: Capability, number: NumberHistory, *, by_quantiles: bool) -> str:
    missing = "lower" if number.limit_low is None else "upper"
    index = "Ppk" if by_quantiles else "Cpk"
    text = "" if by_quantiles else f"Cpk {_index(found.cpk)}, "
    text += f"Ppk {_index(found.ppk)}{' by quantiles' if by_quantiles else ''}, "
    text += f"Cp is undefined: there is no {missing} limit" if found.cp is None else f"Cp {_index(found.cp)}"
    text += (
        f". Preliminary: {found.count} units, {ENOUGH} needed." if found.is_preliminary else f"; {found.count} units."
    )
    if not found.steady:
        text += f" The process is not in control, so {index} describes the past only."
    return text


def _no_limit(number: NumberHistory) -> str:
    sides = zip(("lower", "upper"), zip(*number.differing_limits, strict=True), strict=True)
    stated = "; ".join(_side(name, limits, number.unit) for name, limits in sides if len(set(limits)) > 1)
    if number.temperature is not None:
        why = f"and none of them within {LEAST_SPREAD:.0f} K of {REFERENCE:.0f} °C. Test a unit at that temperature."
    else:
        why = "and values are compared as measured. Judge all units by the same limits"
        if number.id in FRICTION:
            why += f", or test {FEWEST_UNITS} units at temperatures {LEAST_SPREAD:.0f} K apart for a temperature law"
        why += "."
    return f"none. The runs state different limits ({stated}), {why}"


def _side(name: str, limits: Sequence[float | None], unit: str) -> str:
    known = [limit for limit in limits if limit is not None]
    several = f"{plain(min(known), unit)} to " if len(set(known)) > 1 else ""
    return f"{name} {several}{quantity(max(known), unit)}{', or none' if len(known) < len(limits) else ''}"


def _index(index: Index) -> str:
    return f"{index.value:.2f} (95 %: {index.low:.2f} to {index.high:.2f})"


def _gauge(study: GaugeStudy, unit: str) -> str:
    text = ""
    if study.categories is not None:
        text = (
            f"{100 * study.share(study.gauge):.1f} % of the study's variation, {study.categories} distinct categories; "
        )
    text += (
        f"{study.units} units x {study.benches} benches x {study.trials} runs: "
        f"EV {_spread(study.repeatability, unit)}, "
    )
    if study.reproducibility is None:
        text += "AV unknown (one bench), "
    else:
        text += f"AV {_spread(study.reproducibility, unit)}, "
    text += f"PV {spread_text(study.part, unit)}"
    if study.units < ENOUGH_UNITS:
        text += f"; the MSA manual requires {ENOUGH_UNITS} units"
    if study.is_resolved:
        text += "."
    else:
        text += f". {UNRESOLVED}"
    if study.verdict == "unknown":
        return text
    return f"{text} This gauge is {study.verdict.upper()} ({GAUGE_LIMITS})."


def spread_text(value: float, unit: str) -> str:
    """Return a standard deviation with its unit, torques in mN·m."""
    return f"{_spread(value, unit)} {'mN·m' if unit == 'N·m' else unit_shown(unit)}".rstrip()


def _spread(value: float, unit: str) -> str:
    return f"{1e3 * value:.2f}" if unit == "N·m" else plain(value, unit)


def _drift(drift: Drift) -> str:
    text = (
        f"ALARM: {drift.kind} {printable(drift.name, 30)} moved by {100 * drift.change:+.1f} % (95 %: "
        f"{100 * drift.low:+.1f} to {100 * drift.high:+.1f}) over {drift.count} runs."
    )
    if drift.kind == "bench":
        return f"{text} Check it with a golden unit and look at its current sensor."
    return f"{text} The unit or its bench: no other unit was measured again." if drift.alone else text


def _rises(rises: Rises) -> str:
    again = f"{rises.looked_at} units that were measured again, alarm at {100 * rises.limit:+.0f} %"
    apart = ""
    if rises.apart:
        names = ", ".join(printable(unit, 30) for unit in rises.apart[:5])
        why = f"more than {LEAST_SPREAD:.0f} K from their first test or at unknown temperatures, and the other units"
        whose = f"latest run of {len(rises.apart)} ({names})"
        apart = f" Not compared: {whose}; measured {why} do not determine the coefficient well enough."
    if not rises.looked_at:
        return apart.lstrip()
    if not rises.found:
        return f"none of {again}.{apart}"
    risen = (f"{printable(r.unit, 30)} {100 * r.rise:+.0f} % since {r.since[:10]}" for r in rises.found[:5])
    more = f"; {len(rises.found) - 5} more in history.json" if len(rises.found) > 5 else ""
    return f"ALARM: {', '.join(risen)}{more}; of {again}.{apart}"


def _entry(name: str, text: str) -> list[str]:
    held = re.sub(r"(?<=\d) (?=[^\s\d(])", _HELD, text)  # a value stays with its unit
    lines = textwrap.wrap(held, WIDTH - _INDENT)
    return [f"  {name if k == 0 else '':{_INDENT - 2}}{line.replace(_HELD, ' ')}" for k, line in enumerate(lines)]
