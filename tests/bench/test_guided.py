"""A run whose steps a program gives: in this process, and over the lines by which its own process is commanded."""

import io
import json
import math
import os
import signal
import sys
import threading
import time
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from whole_run import files

from etb_hil.base.errors import BenchFault
from etb_hil.base.stock import find
from etb_hil.bench import guided_process
from etb_hil.bench import job as job_room
from etb_hil.bench.guided import End, GuidedRunner, Seen
from etb_hil.bench.guided_process import OrdersOnAPipe
from etb_hil.bench.job import JobFiles, execute, prepare
from etb_hil.canio.logs.blf import read_blf
from etb_hil.scenario.phases import read_phase
from etb_hil.scenario.scenario_file import Step

ZERO = {"id": "zero", "kind": "current_zero", "duration": "0.1 s"}
HOLD = {"id": "hold", "kind": "hold", "position": "30 deg", "duration": "0.1 s"}
GONE = ("program_gone", "the program that commanded the bench ended without leaving it")
SEEN = Seen(1.5, 0.2, 0.0, 0.1, math.nan)


def step(entry):
    phase = read_phase(entry)
    return Step(phase.id, phase, ("phases", 0))


class Program:
    """Gives orders one by one: a phase, None where it is not ready, End; then it is never heard of again."""

    heard_s = -math.inf

    def __init__(self, *orders):
        self.orders, self.patience, self.told, self.frames = list(orders), [], [], []

    def next(self, patience):
        self.patience.append(patience)
        order = self.orders.pop(0) if self.orders else None
        if isinstance(order, End):
            raise order
        if order is None:
            time.sleep(0.002)
        return None if order is None else step(order)

    def tell(self, seen, folder):
        self.told.append((seen, folder))
        self.frames.append(sum(len(block) for block in read_blf(Path(folder, "raw.blf"))))


@pytest.fixture(scope="module")
def job():
    stock = files()
    return prepare(JobFiles(None, stock.bench, stock.model, stock.limits))


@pytest.fixture
def run(job, tmp_path):
    def guided(program, *, is_virtual=True, idle=0.02, watcher=lambda _: None):
        runner = partial(GuidedRunner, orders=program, idle=idle, is_virtual=is_virtual)
        return execute(job, tmp_path, "", 1, watcher, runner=runner)

    return guided


def test_a_program_is_told_what_was_seen_and_where_the_frames_are(run):
    program = Program(ZERO, HOLD, End())
    finished = run(program)
    assert (finished.results.bench.outcome, finished.results.bench.safe_state) == ("ok", True)
    assert [phase.id for phase in finished.results.phases] == ["zero", "hold"]
    seen = [one for one, _ in program.told]
    assert {folder for _, folder in program.told} == {str(finished.session.folder)}
    assert seen[0].time < 0.06
    assert 0.1 <= seen[1].time - seen[0].time < 0.13
    assert seen[2].angle == pytest.approx(math.radians(30.0), abs=0.03)
    assert seen[1].angle == pytest.approx(finished.analysis.model.values.limp_home, abs=0.03)
    assert abs(seen[2].velocity) < 0.5
    assert abs(seen[1].current) < 0.05 < abs(seen[2].current)
    assert seen[2].temperature == pytest.approx(25.0, abs=15.0)
    assert program.frames[0] < program.frames[1] < program.frames[2]  # what was received so far lies on the disk


def test_a_run_is_ended_for_a_reason_of_the_program(run):
    bench = run(Program(ZERO, End("program_failed", "it failed"))).results.bench
    assert (bench.outcome, bench.reason_id, bench.reason) == ("aborted", "program_failed", "it failed")
    assert bench.safe_state


@pytest.mark.parametrize("is_virtual", [True, False])
def test_without_an_order_the_run_ends_in_the_safe_state(run, is_virtual):
    program = Program(ZERO)
    begun = time.monotonic()
    finished = run(program, is_virtual=is_virtual, idle=0.05)
    bench = finished.results.bench
    assert (bench.outcome, bench.reason_id, bench.safe_state) == ("aborted", "nobody_commands", True)
    assert bench.reason == "the program gave no order for 0.05 s"
    assert time.monotonic() - begun > 0.05
    assert set(program.patience) == {0.05 if is_virtual else 0.0}


@pytest.mark.parametrize("is_virtual", [True, False])
def test_a_program_that_works_on_its_next_order_is_waited_for(run, is_virtual):
    class Working(Program):
        @property
        def heard_s(self):
            return time.monotonic() if len(self.patience) < 60 else -math.inf

    begun = time.monotonic()
    program = Working(ZERO)
    finished = run(program, is_virtual=is_virtual, idle=0.02)
    assert finished.results.bench.reason_id == "nobody_commands"
    assert len(program.patience) >= 60
    assert time.monotonic() - begun > 0.1  # 0.02 s alone would have ended it after ten looks


def test_a_bench_at_wall_clock_holds_the_plate_while_it_waits(run):
    finished = run(Program(ZERO, None, None, HOLD, None, None, None, End()), is_virtual=False, idle=60.0)
    assert finished.results.bench.outcome == "ok"
    ends = [(phase.start_s, phase.end_s) for phase in finished.results.phases]
    assert ends[1][0] - ends[0][1] == pytest.approx(0.02, abs=5e-3)  # two beats of 10 ms
    recording = finished.analysis.recording
    origin = finished.record.start_ns
    mode, position = recording.series("command_mode"), recording.series("command_position")
    after = (position.time_ns - origin) * 1e-9 > ends[1][1]
    held = mode.values[after] == 1.0
    assert held[:3].all()
    assert position.values[after][:3] == pytest.approx(math.radians(30.0), abs=1e-3)
    between = ((mode.time_ns - origin) * 1e-9 > ends[0][1]) & ((mode.time_ns - origin) * 1e-9 < ends[1][0])
    assert np.count_nonzero(between) >= 2
    assert (mode.values[between] == 0.0).all()  # before anything moved the drive is off


def test_a_bench_in_virtual_time_stands_still_while_it_waits(run):
    finished = run(Program(ZERO, None, None, None, HOLD, End()), idle=60.0)
    first, second = finished.results.phases
    assert second.start_s - first.end_s < 0.005


def test_times_count_from_the_begin_of_the_run(run, monkeypatch):
    connect = job_room.connect

    def later(job, seed):
        link, clock = connect(job, seed)
        clock.sleep_until_ns(1_000_000_000)
        return link, clock

    monkeypatch.setattr(job_room, "connect", later)
    program = Program(ZERO, End())
    assert run(program).record.start_ns == 1_000_000_000
    assert [seen.time < 0.2 for seen, _ in program.told] == [True, True]


def test_a_watcher_is_told_how_long_the_step_takes(run):
    shown = []
    run(Program(ZERO, {**HOLD, "duration": "1 s"}, End()), watcher=shown.append)
    left = [one.total_s - one.time_s for one in shown if one.phase == "hold"]
    assert 0.8 < left[0] < 1.5
    assert left[-1] < 0.2


@pytest.fixture
def pipe():
    """Lines to a bench, which stay open until a test closes them, and what it answers."""
    reader, writer = os.pipe()
    answers = io.BytesIO()
    with os.fdopen(reader) as orders, os.fdopen(writer, "w") as program:
        yield OrdersOnAPipe(orders, answers), program, answers
        program.close()


def write(program, *orders):
    for order in orders:
        program.write(json.dumps(order) + "\n")
    program.flush()


def test_orders_come_line_by_line(pipe):
    orders, program, _ = pipe
    write(program, {"phase": HOLD}, {"end": "", "reason": ""})
    given = orders.next(60.0)
    assert (given.id, given.phase.kind, given.key) == ("hold", "hold", ("phases", 0))
    with pytest.raises(End) as ended:
        orders.next(60.0)
    assert (ended.value.reason_id, ended.value.reason) == ("", "")


def test_a_program_is_heard_when_it_says_that_it_works(pipe):
    orders, program, _ = pipe
    assert orders.heard_s == -math.inf
    begun = time.monotonic()
    write(program, {"working": True})
    while orders.heard_s == -math.inf and time.monotonic() < begun + 60.0:
        time.sleep(0.001)
    assert begun <= orders.heard_s <= time.monotonic()
    assert orders.next(0.0) is None  # it asks for nothing


def test_the_thread_that_reads_orders_keeps_no_process_alive(pipe):
    assert [
        thread for thread in threading.enumerate() if thread is not threading.main_thread() and not thread.daemon
    ] == []
    assert pipe[0].next(0.0) is None


def test_an_end_has_the_reason_that_the_program_gives(pipe):
    orders, program, _ = pipe
    write(program, {"end": "program_failed", "reason": "it failed"})
    with pytest.raises(End) as ended:
        orders.next(60.0)
    assert (ended.value.reason_id, str(ended.value)) == ("program_failed", "it failed")


@pytest.mark.parametrize("patience", [0.0, 0.03, 0.25])
def test_nobody_waits_longer_than_the_patience(pipe, patience):
    orders, _, _ = pipe
    begun = time.monotonic()
    assert orders.next(patience) is None
    assert time.monotonic() - begun >= patience


def test_an_order_is_taken_as_soon_as_it_comes(pipe):
    orders, program, _ = pipe
    threading.Timer(0.25, write, (program, {"phase": HOLD})).start()
    assert orders.next(600.0).id == "hold"
    write(program, {"phase": ZERO})
    deadline = time.monotonic() + 60.0
    while (given := orders.next(0.0)) is None and time.monotonic() < deadline:
        time.sleep(0.001)
    assert given.id == "zero"


@pytest.mark.parametrize("patience", [0.0, 600.0])
def test_a_program_that_is_gone_ends_the_run(pipe, monkeypatch, patience):
    orders, program, _ = pipe
    assert orders.next(0.0) is None
    monkeypatch.setattr(os, "getppid", lambda: 1)  # it left a child behind, which has the pipe open still
    begun = time.monotonic()
    with pytest.raises(End) as ended:
        orders.next(patience)
    assert time.monotonic() - begun < 300.0  # it does not wait for as long as it has patience
    assert (ended.value.reason_id, ended.value.reason) == GONE
    monkeypatch.undo()
    program.close()
    with pytest.raises(End) as ended:
        orders.next(60.0)
    assert (ended.value.reason_id, ended.value.reason) == GONE


def test_an_answer_is_a_line_and_what_was_not_seen_is_null(pipe):
    orders, _, answers = pipe
    orders.tell(SEEN, "folder")
    orders.say({"ended": "ä"})
    first, second = (json.loads(line) for line in answers.getvalue().splitlines())
    assert first == {
        "seen": {"time": 1.5, "angle": 0.2, "velocity": 0.0, "current": 0.1, "temperature": None}, "folder": "folder",
    }  # fmt: skip
    assert second == {"ended": "ä"}


def test_answers_that_nobody_reads_stop_nothing():
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "wb", buffering=0) as answers:
        orders = OrdersOnAPipe(io.StringIO(""), answers)
        orders.tell(SEEN, "folder")
        with pytest.raises(End) as ended:
            orders.next(600.0)
    assert (ended.value.reason_id, ended.value.reason) == GONE  # by the end of the orders alone


@pytest.fixture
def commanded(monkeypatch, tmp_path):
    """Run the process's main function on lines of orders; return its answers."""

    def main(*orders, **given):
        shown = {kind: str(find(kind, "virtual_classic" if kind == "bench" else "default"))
                 for kind in ("bench", "model", "limits")}  # fmt: skip
        first = {"files": {**shown, "unit": None, "dbc": None}, "observer": None, "folder": str(tmp_path)}
        first |= {"serial": "A7", "seed": 3, "idle": 60.0, **given}
        monkeypatch.setattr(sys, "stdin", io.StringIO("".join(json.dumps(line) + "\n" for line in (first, *orders))))
        kept, answers = os.dup(1), tmp_path / "answers"
        try:
            with answers.open("wb") as file:
                os.dup2(file.fileno(), 1)
            guided_process.main()
        finally:
            os.dup2(kept, 1)
            os.close(kept)
            said = [json.loads(line) for line in answers.read_text("utf-8").splitlines()]
        return said

    return main


def test_a_process_runs_a_bench_from_its_first_line_to_its_last(commanded, tmp_path):
    entered, moved, ended = commanded({"phase": ZERO}, {"end": "", "reason": ""})
    assert entered["seen"]["time"] < moved["seen"]["time"]
    (session,) = tmp_path.glob("*/session.json")
    assert ended == {
        "ended": str(session.parent), "outcome": "ok", "reason": "", "safe_state": True, "warnings": [],
    }  # fmt: skip
    manifest = json.loads(session.read_text("utf-8"))
    assert manifest["serial"] == "A7"
    assert (tmp_path / "store.sqlite").exists() or list(tmp_path.glob("*.db"))


def test_a_process_leaves_the_signals_as_they_were(commanded):
    before = [signal.getsignal(one) for one in (signal.SIGTERM, signal.SIGINT, signal.SIGUSR1)]
    commanded({"end": "", "reason": ""})
    assert [signal.getsignal(one) for one in (signal.SIGTERM, signal.SIGINT, signal.SIGUSR1)] == before


def test_what_is_printed_by_mistake_is_no_answer(commanded, monkeypatch):
    is_stderr = []

    def prints(*_, **__):
        is_stderr.append(os.path.samestat(os.fstat(1), os.fstat(2)))
        os.write(1, b"printed by mistake\n")
        raise BenchFault("no bench")

    monkeypatch.setattr(guided_process, "prepare", prints)
    assert commanded() == [{"failed": "no bench", "kind": "BenchFault"}]
    assert is_stderr == [True]


def test_a_process_whose_orders_end_says_so(commanded):
    *_, ended = commanded({"phase": ZERO})
    assert (ended["outcome"], ended["reason"], ended["safe_state"]) == ("aborted", GONE[1], True)


def test_a_process_says_what_of_its_files_is_wrong(commanded):
    (answer,) = commanded(observer="nosuch")
    assert answer["kind"] == "InputError"
    assert "nosuch" in answer["failed"]


def test_an_internal_error_is_said_as_a_fault_of_the_bench(commanded, monkeypatch, tmp_path):
    def broken(*_, **__):
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr(guided_process, "prepare", broken)
    with pytest.raises(ZeroDivisionError, match="a bug"):
        commanded()
    answer = json.loads((tmp_path / "answers").read_text("utf-8"))
    assert answer == {"failed": "internal error: ZeroDivisionError: a bug", "kind": "BenchFault"}


def test_a_fault_of_the_bench_is_said_as_one(commanded, monkeypatch):
    def held(*_, **__):
        raise BenchFault("somebody else commands it")

    monkeypatch.setattr(guided_process, "execute", held)
    assert commanded() == [{"failed": "somebody else commands it", "kind": "BenchFault"}]
