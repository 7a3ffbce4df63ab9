"""A session judged again: the raw frames and the events, through the same analysis as live."""

from __future__ import annotations

import json
from pathlib import Path

from etb_hil.bench.analysis import Analysis
from etb_hil.bench.bench_file import load_bench
from etb_hil.bench.events import read_events
from etb_hil.bench.finished import Finished
from etb_hil.bench.record import record_of
from etb_hil.bench.results import results_of
from etb_hil.bench.session import open_session
from etb_hil.canio.blf import read_blf
from etb_hil.diagnosis.limits import load_limits
from etb_hil.plant.parameters import load_model


def replay(folder: Path) -> Finished:
    """Judge a recorded session again with its own inputs; the results are those of the live run."""
    session = open_session(folder)
    setup = load_bench(session.input_path("bench"), session.input_path("dbc"))
    limits = load_limits(session.input_path("limits")).content
    record = record_of(read_events(session.events))
    analysis = Analysis(setup.dialect, load_model(session.input_path("model")), limits, str(folder))
    for phase in record.phases:
        analysis.begin_phase(phase.start_ns, phase.id, phase.kind)
    for frames in read_blf(session.raw_log):
        analysis.push(frames)
    found = analysis.finish()
    results = results_of(session, setup.bench, limits, record, analysis, found)
    return Finished(session, results, record, analysis, found)


def first_difference(finished: Finished) -> str | None:
    """Return the first key whose value is not the one that the session's `results.json` holds, or None."""
    return _difference(finished.session.read_results(), json.loads(json.dumps(finished.results)), "")


def _difference(before: object, now: object, key: str) -> str | None:
    if isinstance(before, dict) and isinstance(now, dict):
        names = [name for name in (*before, *(n for n in now if n not in before)) if f"{key}{name}" != "versions"]
        pairs = [(f"{key}{name}", before.get(name), now.get(name)) for name in names]
    elif isinstance(before, list) and isinstance(now, list) and len(before) == len(now):
        pairs = [(f"{key}{index}", *pair) for index, pair in enumerate(zip(before, now, strict=True))]
    else:
        return None if before == now or (before != before and now != now) else f"{key}: {before!r} live, {now!r} now"  # noqa: PLR0124 (NaN)
    return next(
        (found for name, a, b in pairs if (found := _difference(a, b, f"{name}." if _nested(a) else name))), None
    )


def _nested(value: object) -> bool:
    return isinstance(value, dict | list)
