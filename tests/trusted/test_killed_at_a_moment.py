"""kill -9 at the moments at which files change hands: what is left is whole, and the next run goes on beside it."""

import os
import signal
import sqlite3
from pathlib import Path

import can
import pytest
from whole_run import files

from etb_hil.bench import tap
from etb_hil.bench.job import deliver, execute, prepare
from etb_hil.bench.operator import Unattended
from etb_hil.canio.logs.blf import BlfLog
from etb_hil.replays.session_replay import replay
from etb_hil.session import attempts
from etb_hil.session.differences import first_difference
from etb_hil.session.events import EventLog, read_events
from etb_hil.store import queue
from etb_hil.store.address import STORE
from etb_hil.store.queue import Queue

SCENARIO = """schema: etb_hil/scenario/1
name: Short
retry: {attempts: 2, after: [inconclusive]}
phases:
  - {id: zero, kind: current_zero, duration: 0.2 s}
  - {id: home, kind: home, speed: 2 rad/s, press: 1 deg, release: 0.1 s}
  - {id: clamped, kind: prompt, text: 'Clamped?', answers: [yes, no], unattended: yes}
  - {id: hold, kind: hold, position: 30 deg, duration: 0.2 s}
"""


def die(*_, **__):
    os.kill(os.getpid(), signal.SIGKILL)


def at_call(owner, name, number=1):
    """Return what makes a process die in the given call of a function, before it does anything."""

    def arm():
        original, calls = getattr(owner, name), []

        def called(*arguments, **named):
            calls.append(1)
            return die() if len(calls) == number else original(*arguments, **named)

        setattr(owner, name, called)

    return arm


def at_event(event, phase=None):
    """Return what makes a process die right after it has written an event."""

    def arm():
        add = EventLog.add

        def added(self, stamp_ns, name, /, **details):
            add(self, stamp_ns, name, **details)
            if name == event and phase in {None, details.get("id")}:
                die()

        EventLog.add = added

    return arm


def after_call(owner, name):
    """Return what makes a process die once a function has returned."""

    def arm():
        original = getattr(owner, name)

        def called(*arguments, **named):
            original(*arguments, **named)
            die()

        setattr(owner, name, called)

    return arm


FILES = 7  # six inputs and the manifest, written when a session begins

MOMENTS = {  # and how many of the four phases have ended by then
    "before the first beat": (at_event("start"), 0),
    "homing": (at_event("phase", "home"), 1),
    "between two phases": (at_event("phase_end", "home"), 2),
    "asking": (at_call(Unattended, "ask"), 2),
    "asked": (at_event("prompt"), 2),
    "drive off": (at_event("safe_stop"), 4),
    "before the checksums": (at_call(Path, "write_bytes", FILES + 1), 4),
    "half the checksums": (at_call(Path, "replace", FILES + 1), 4),
    "before the results": (at_call(Path, "write_bytes", FILES + 2), 4),
    "half the results": (at_call(Path, "replace", FILES + 2), 4),
    "before it waits for the store": (at_call(Queue, "add"), 4),
    "in the store's transaction": (at_call(queue, "read_bytes", 2), 4),  # the first one reads the run that waits
    "in the store, and waiting": (after_call(queue, "write_run"), 4),
    "closing the log": (at_call(BlfLog, "_header", 2), 4),
    "before the second attempt": (at_call(attempts.shutil, "copytree"), 4),
    "naming the first attempt": (at_call(Path, "rename"), 4),
    "taking away the first attempt": (
        at_call(Path, "unlink", FILES + 4),
        4,
    ),  # after the temporary names of checksums, results and waiting run
}


# attempts of the killed run whose results were written, and wait for the store or are in it
STORED = {
    "before the second attempt": 1, "naming the first attempt": 1,
    "taking away the first attempt": 1, "in the store's transaction": 2, "in the store, and waiting": 2,
}  # fmt: skip


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    path = tmp_path_factory.mktemp("scenario") / "short.yaml"
    path.write_text(SCENARIO)
    prepared = prepare(files(scenario=path))
    execute(prepared, path.parent, "", 1)  # so that what is forked from here has everything compiled and loaded
    return prepared


@pytest.mark.parametrize("moment", MOMENTS)
def test_what_is_left_is_whole_and_the_next_run_goes_on(job, tmp_path, moment):
    arm, ended = MOMENTS[moment]
    child = os.fork()
    if not child:
        try:
            tap.FLUSH_S = 0.0  # virtual time runs ahead of the machine's
            arm()
            execute(job, tmp_path, "SN 1", 1)
            deliver(job, tmp_path)
        finally:
            os._exit(1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == -signal.SIGKILL

    (session,) = (path.parent for path in tmp_path.glob("*/session.json"))
    first = session / "attempts" / "1"
    whole = first if first.is_dir() else session
    with can.BLFReader(whole / "raw.blf") as reader:
        assert ended == 0 or len(list(reader)) > 100
    phases = [event.details["id"] for event in read_events(whole / "events.jsonl") if event.event == "phase_end"]
    assert len(phases) == ended
    again = replay(whole)
    has_sums = (whole / "SHA256SUMS").exists()  # they cover the end of a run, and are written right before its results
    assert again.record.is_complete == has_sums
    assert has_sums or moment not in {"before the results", "half the results"}
    assert again.results.unit.verdict == ("inconclusive" if again.record.is_complete else None)
    if again.session.has_results:
        assert first_difference(again) is None

    after = execute(job, tmp_path, "SN 2", 1)
    assert after.results.bench.outcome == "ok"
    assert deliver(job, tmp_path) == ()
    connection = sqlite3.connect(tmp_path / STORE)
    rows = connection.execute("SELECT serial, verdict, run_id FROM runs ORDER BY started").fetchall()
    assert connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)
    connection.close()
    assert len({run_id for _, _, run_id in rows}) == len(rows)
    assert ("SN 2", "inconclusive", after.session.run_id) in rows
    assert sum(serial == "SN 1" for serial, _, _ in rows) == STORED.get(moment, 0)
    assert not Queue(tmp_path).paths()
