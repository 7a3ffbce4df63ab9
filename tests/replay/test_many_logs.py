"""Many logs: one bad one costs only itself, interrupted work goes on, and the tables are those of a database."""

import contextlib
import hashlib
import json
import os
import platform
import re
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

import distributed
import duckdb
import numpy as np
import pytest
from whole_run import run_briskly_on

from etb_hil import plugins
from etb_hil.base.errors import BenchFault, InputError
from etb_hil.bench.unit_reasons import UNIT_REASONS
from etb_hil.canio.frames import concatenate_frames
from etb_hil.canio.logs.blf import BlfLog, read_blf
from etb_hil.cli import replay as command
from etb_hil.cli.main import main as command_line
from etb_hil.cli.progress_line import duration
from etb_hil.replays.log_replay import SEGMENT_S
from etb_hil.replays.many_logs import PROGRESS, judge_many, judge_task, tasks_for
from etb_hil.replays.outcome import CRASHED, JUDGED, REFUSED, SHOWS_TOO_LITTLE, Outcome, rank
from etb_hil.replays.parquet import write_parquet
from etb_hil.replays.progress import STATE, Watch, read_progress
from etb_hil.replays.session_replay import RuleFiles, rule_files
from etb_hil.replays.window import Window
from etb_hil.replays.workers import DaskWorkers, LocalProcesses


@pytest.fixture(scope="module")
def live(tmp_path_factory):
    return run_briskly_on(tmp_path_factory.mktemp("sessions"), unit="faulty", serial="A7")


@pytest.fixture(scope="module")
def sources(live, tmp_path_factory):
    folder = tmp_path_factory.mktemp("sources")
    log = folder / "log.blf"
    log.write_bytes(live.session.raw_log.read_bytes())
    bad = folder / "bad.blf"
    bad.write_bytes(b"nothing of a log")
    return [live.session.folder, bad, log]


@pytest.fixture(scope="module")
def tasks(live, sources):
    return tasks_for(sources, [(rule_files(live.session), None)], None, None)


JUDGED_BEFORE = {}  # by the task's key, which tells of each of its files and of the code that judges


def judged(task):
    """Judge a task, or return what came of it in another test: how often one is asked for is tested here."""
    outcome = JUDGED_BEFORE.get(task.key) or judge_task(task)
    if outcome.status == JUDGED:
        JUDGED_BEFORE[task.key] = outcome
    return outcome


def one_after_the_other(tasks):
    yield from map(judged, tasks)


def dies_at_bad_logs(task):
    if task.source.name == "bad.blf":
        os._exit(9)
    return Outcome(task.key, str(task.source), JUDGED)


def test_each_log_has_its_outcome(live, tasks, tmp_path):
    session, bad, log = judge_many(tasks, tmp_path / "out", one_after_the_other)
    assert (session.status, bad.status, log.status) == (JUDGED, REFUSED, JUDGED)
    assert "must be a BLF file" in bad.error
    assert session.judged.verdict == "fail"
    assert session.judged.serial == "A7"
    numbers = {n.id: (n.value, n.low, n.high) for n in live.results.measurements.values()}
    assert session.judged.measurements == numbers
    assert len(session.exceedances) == len(live.results.exceedances)
    assert log.judged.frames == session.judged.frames > 1000


def test_interrupted_work_goes_on(tasks, tmp_path):
    asked = []

    def stops_after_one(left):
        asked.append(len(left))
        for task in left:
            yield judged(task)
            if len(asked) == 1:
                raise KeyboardInterrupt

    folder = tmp_path / "out"
    with pytest.raises(KeyboardInterrupt):
        judge_many(tasks, folder, stops_after_one)
    with (folder / PROGRESS).open("a") as progress:
        progress.write('{"key": "half a li')
    outcomes = judge_many(tasks, folder, stops_after_one)
    assert asked == [3, 2]
    assert [outcome.key for outcome in outcomes] == [task.key for task in tasks]
    judge_many(tasks, folder, stops_after_one)
    assert asked == [3, 2, 1]  # a refused log may have been corrected


def test_a_verdict_that_was_edited_is_not_believed(tasks, tmp_path):
    folder = tmp_path / "out"
    truth = judge_many(tasks, folder, one_after_the_other)
    text = (folder / PROGRESS).read_text()
    assert '"verdict": "fail"' in text
    (folder / PROGRESS).write_text(text.replace('"verdict": "fail"', '"verdict": "pass"').replace(": 10,", ": 0,"))
    with pytest.warns(UserWarning, match=r"progress.jsonl: \d outcomes? do.* not match the checksum; the logs"):
        again = judge_many(tasks, folder, one_after_the_other)
    assert [outcome.judged and outcome.judged.verdict for outcome in again] == [
        outcome.judged and outcome.judged.verdict for outcome in truth
    ]
    assert [outcome.judged and outcome.judged.exit_code for outcome in again] == [
        outcome.judged and outcome.judged.exit_code for outcome in truth
    ]


@pytest.mark.parametrize(
    "damage",
    [
        b'{"key": []}',
        b"[" * 100_000,
        b"\xff\xfe\x00",
        b'{"sha256": "0", "outcome": {}}',
        b'{"key": "x"',
        b"7",
    ],
)
def test_damaged_progress_costs_only_time(tasks, tmp_path, damage):
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / PROGRESS).write_bytes(b"\n".join([damage, *(damage.replace(b"x", t.key.encode()) for t in tasks)]))
    assert [outcome.status for outcome in judge_many(tasks, folder, one_after_the_other)] == [
        JUDGED,
        REFUSED,
        JUDGED,
    ]


def test_an_outcome_of_another_version_is_judged_again(tasks, tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    text = json.dumps({"key": tasks[0].key, "status": JUDGED, "verdict": "pass"}).encode()
    line = b'{"sha256": "%s", "outcome": %s}\n' % (hashlib.sha256(text).hexdigest().encode(), text)
    (folder / PROGRESS).write_bytes(line)
    assert judge_many(tasks[:1], folder, one_after_the_other)[0].judged.verdict == "fail"


def test_a_pipe_in_the_place_of_progress_is_refused(tasks, tmp_path):
    os.mkfifo(tmp_path / PROGRESS)
    with pytest.raises(InputError, match=r"progress.jsonl: is a FIFO, no regular file; make room, or"):
        judge_many(tasks, tmp_path, one_after_the_other)


def processes_of(text):
    """Return the ids of processes whose environment holds a text; workers inherit that of their parent."""
    found = []
    for path in Path("/proc").glob("[0-9]*/environ"):
        with contextlib.suppress(OSError):
            if text.encode() in path.read_bytes():
                found.append(int(path.parent.name))
    return found


@pytest.mark.skipif(not Path("/proc/self/environ").exists(), reason="processes are found as Linux tells them")
@pytest.mark.parametrize(
    "ending", [signal.SIGKILL, signal.SIGTERM, pytest.param(signal.SIGINT, marks=pytest.mark.study)]
)
def test_workers_end_with_the_process_that_started_them(sources, tmp_path, ending):
    mark = f"ETB_HIL_MARK={tmp_path}"
    name, value = mark.split("=")
    logs = []
    for number in range(60):  # seconds of work
        logs.append(tmp_path / f"{number}.blf")
        shutil.copyfile(sources[2], logs[-1])
    command = [sys.executable, "-m", "etb_hil", "replay", *map(str, logs), "--jobs", "2", "--out", str(tmp_path / "o")]
    heard = {"preexec_fn": lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)}  # tests in the background ignore it
    with subprocess.Popen(command, env={**os.environ, name: value}, stderr=subprocess.PIPE, text=True, **heard) as work:
        progress = tmp_path / "o" / PROGRESS
        while not (progress.exists() and progress.stat().st_size):
            assert work.poll() is None
            time.sleep(0.02)
        assert len(processes_of(mark)) > 2
        work.send_signal(ending)
        said = work.communicate()[1]
    deadline = time.monotonic() + 60.0
    while processes_of(mark) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not processes_of(mark)
    assert work.returncode == (-ending if ending == signal.SIGKILL else 5)
    assert "Traceback" not in said
    assert len(progress.read_text().splitlines()) < len(logs)


def test_a_log_that_changed_or_other_limits_are_new_work(live, sources, tasks, tmp_path):
    limits = live.session.input_path("limits")
    other = tasks_for(sources, [(rule_files(live.session), None)], None, limits)
    assert not {task.key for task in tasks} & {task.key for task in other}
    changed = tmp_path / "log.blf"
    keys = []
    for content in (b"a log", b"something else"):
        changed.write_bytes(content)
        found = tasks_for([sources[0], changed, sources[2]], [(rule_files(live.session), None)], None, None)
        keys.append([task.key for task in found])
    assert [one == other for one, other in zip(*keys, strict=True)] == [True, False, True]
    assert (keys[0][0], keys[0][2]) == (tasks[0].key, tasks[2].key)


def test_a_process_that_dies_costs_only_its_log(tasks):
    outcomes = {outcome.path: outcome for outcome in LocalProcesses(2, dies_at_bad_logs)(tasks)}
    assert [outcomes[str(task.source)].status for task in tasks] == [JUDGED, CRASHED, JUDGED]


def test_units_on_channels_of_one_log_are_judged_each_by_itself(live, sources, tmp_path, capsys):
    frames = concatenate_frames(read_blf(sources[2]))
    other = replace(frames, stamp_ns=frames.stamp_ns + 300_000, channel=np.full_like(frames.channel, 1))
    both = concatenate_frames([frames, other])
    both = both.select(np.argsort(both.stamp_ns, kind="stable"))
    path = tmp_path / "both.blf"
    log = BlfLog(path, int(both.stamp_ns[0]))
    log.write(both)
    log.close()
    rules = rule_files(live.session)
    alone = judged(tasks_for([sources[2]], [(rules, None)], None, None)[0])
    tasks = tasks_for([path], [(rules, 0), (rules, 1)], None, None)
    outcomes = judge_many(tasks, tmp_path / "out", one_after_the_other)
    assert [outcome.channel for outcome in outcomes] == [0, 1]
    for outcome in outcomes:
        for key in ("verdict", "reason", "frames", "lost", "crc_failures", "measurements"):
            assert getattr(outcome.judged, key) == getattr(alone.judged, key)
    assert command_line(["replay", str(path), "--bench", str(rules.bench), "--channel", "0", "--channel", "1"]) == 10
    said = capsys.readouterr().out
    assert f"{rules.bench.name}, channel 1:" in said
    assert command_line(["replay", str(path), "--channel", "7"]) == 2
    assert "holds no frame on the channel (it is 7); allowed: 0, 1" in capsys.readouterr().err


def test_the_tables_open_in_a_database(tasks, tmp_path):
    outcomes = judge_many(tasks, tmp_path / "out", one_after_the_other)
    logs, exceedances = write_parquet(outcomes, tmp_path / "out")
    rows = duckdb.sql(f"select status, verdict, T_st, T_st_low from '{logs}'").fetchall()  # noqa: S608
    assert [row[:2] for row in rows] == [(JUDGED, "fail"), (REFUSED, None), (JUDGED, outcomes[2].judged.verdict)]
    assert rows[0][2:] == outcomes[0].judged.measurements["T_st"][:2]
    both = f"'{logs}' l join '{exceedances}' using (key)"
    found = duckdb.sql(f"select count(*) from {both} where l.path like '%log.blf'")  # noqa: S608
    assert found.fetchall() == [(len(outcomes[2].exceedances),)]
    write_parquet(outcomes[1:2], tmp_path / "out")  # none judged: the columns stay
    assert duckdb.sql(f"select count(*), count(verdict) from '{logs}'").fetchall() == [(1, 0)]  # noqa: S608


def test_a_dask_cluster_gives_the_same(tasks, tmp_path):
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, host="127.0.0.1", dashboard_address=None
    ) as cluster:
        there = judge_many(tasks, tmp_path / "dask", DaskWorkers(cluster.scheduler_address))
    here = judge_many(tasks, tmp_path / "here", one_after_the_other)
    for ours, theirs in zip(here, there, strict=True):
        assert replace(ours, wall_s=None, processor_s=None) == replace(theirs, wall_s=None, processor_s=None)


@contextlib.contextmanager
def listener(says):
    """Yield the port of a server that says something to whoever comes, or nothing."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve():
            with contextlib.suppress(OSError):
                while True:
                    guest, _ = server.accept()
                    guests.append(guest)  # before it may be gone
                    guest.sendall(says)

        guests = []
        threading.Thread(target=serve, daemon=True).start()
        yield server.getsockname()[1]
        for guest in guests:
            guest.close()


@pytest.mark.parametrize(
    ("says", "why"),
    [(b"", "says nothing for 2 s"), (b"HTTP/1.1 400 Bad Request\r\n\r\n", "another program listens there")],
)
def test_another_server_than_a_scheduler_is_said(says, why):
    with listener(says) as port, pytest.raises(BenchFault, match=f"no Dask scheduler answers at .*{port}: .*{why}"):
        DaskWorkers(f"127.0.0.1:{port}")


def test_a_wrong_cluster_address_is_said_by_the_command_before_any_log_is_read(sources, tmp_path, capsys):
    asked = ["replay", *map(str, sources), "--out", str(tmp_path / "out"), "--dask"]
    for address, code, why in (
        ("tcp://127.0.0.1:9", 3, "no Dask scheduler answers at tcp://127.0.0.1:9: .*refused"),
        ("no-such-host.invalid:8786", 3, "no Dask scheduler answers at tcp://no-such-host.invalid:8786"),
        ("http://127.0.0.1:9", 2, "must be the address of a Dask scheduler.*allowed: HOST:PORT or tcp://HOST:PORT"),
        ("127.0.0.1", 2, "must be the address of a Dask scheduler"),
    ):
        assert command_line([*asked, address]) == code
        assert re.search(why, capsys.readouterr().err)
    assert not (tmp_path / "out").exists()


def test_progress_names_what_failed(sources, tmp_path, capsys):
    asked = ["replay", *map(str, sources), "--jobs", "1", "--out", str(tmp_path / "out")]
    assert command_line(asked) == 2
    said = capsys.readouterr()
    assert re.search(r"^refused: .*bad.blf: must be a BLF file", said.out, re.MULTILINE)
    assert said.out.count("bad.blf") == 1
    state = read_progress(tmp_path / "out")
    assert (state.total, state.done, state.failures, state.left_s, state.ended) == (3, 3, 1, 0.0, True)
    assert [(Path(one.path).name, one.status) for one in state.failed] == [("bad.blf", REFUSED)]


def test_a_terminal_shows_how_far_the_work_is(sources, tmp_path):
    here, there = os.openpty()
    command = [sys.executable, "-m", "etb_hil", "replay", *map(str, sources), "--jobs", "1", "--out", str(tmp_path)]
    with subprocess.Popen(command, stdout=there, stderr=there) as work:
        os.close(there)
        said = b""
        with contextlib.suppress(OSError):  # the end of a terminal
            while some := os.read(here, 4096):
                said += some
        os.close(here)
    assert work.returncode == 2
    shown = said.decode().replace("\r\n", "\n").split("\r")
    assert any(re.match(r"0 of 3 logs", text) for text in shown)
    assert any(re.match(r"[12] of 3 logs, 1 could not be judged, \d+ s left", text) for text in shown)
    assert sum("refused: " in text for text in shown) == 1


def test_another_process_reads_how_far_the_work_is(tmp_path):
    assert read_progress(tmp_path) is None
    watch = Watch(tmp_path, 4, 1, None)
    begun = read_progress(tmp_path)
    assert (begun.done, begun.left_s, begun.ended) == (1, None, False)
    for number in range(3):
        watch.add(Outcome(str(number), f"{number}.blf", CRASHED, error="the process that read it died"))
    ended = read_progress(tmp_path)
    assert (ended.done, ended.failures, ended.ended) == (4, 3, True)
    assert [one.path for one in ended.failed] == ["0.blf", "1.blf", "2.blf"]
    naive = (tmp_path / STATE).read_text().replace("+00:00", "")
    for damage in (naive, "", "[]", "{}", '{"total": "many"}', "[" * 100_000):
        (tmp_path / STATE).write_text(damage)
        with pytest.raises(InputError, match=r"state.json: must be the state of a replay of many logs"):
            read_progress(tmp_path)


def test_the_time_left_is_that_of_what_is_left(tmp_path, monkeypatch):
    now = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    heard = []
    watch = Watch(tmp_path, 10, 4, lambda progress, outcome: heard.append((progress.left_s, outcome)))
    for number in range(2):
        now[0] += 3.0
        watch.add(Outcome(str(number), f"{number}.blf", JUDGED))
    assert [left for left, _ in heard] == [None, 15.0, 12.0]
    assert [outcome and outcome.key for _, outcome in heard] == [None, "0", "1"]


@pytest.mark.parametrize(("seconds", "words"), [(40.2, "40 s"), (150.0, "2 min"), (3600.0, "1 h 00 min")])
def test_a_time_left_is_said_in_words(seconds, words):
    assert duration(seconds) == words


def test_the_stretch_of_the_command_is_that_of_the_room():
    assert command.SEGMENT_S == SEGMENT_S


def test_the_times_of_a_log_count_from_its_first_frame(live, tmp_path):
    frames = concatenate_frames(read_blf(live.session.raw_log))
    frames.stamp_ns += 100_000_000_000  # the bench's clock starts at 0
    other = replace(
        frames.select(slice(1)), ident=np.full(1, 0x7A1, np.uint32), stamp_ns=frames.stamp_ns[:1] - 90_000_000_000
    )
    log = BlfLog(tmp_path / "log.blf", int(other.stamp_ns[0]))
    log.write(other)
    log.write(frames)
    log.close()
    rules = rule_files(live.session)
    found = judge_task(tasks_for([tmp_path / "log.blf"], [(rules, None)], None, None)[0])
    alone = judge_task(tasks_for([live.session.raw_log], [(rules, None)], None, None)[0])
    assert found.judged.start_ns == int(other.stamp_ns[0])
    assert (found.segments, found.judged.deciding_s) == (1, 90.0)
    assert "1 of 2 segments" in found.notes
    assert len(found.exceedances) > 0
    for episode, expected in zip(found.exceedances, alone.exceedances, strict=True):
        assert episode.start_s == pytest.approx(expected.start_s + 90.0, abs=1e-6)


def test_a_missing_log_is_an_outcome_and_is_tried_again(live, tmp_path):
    source, rules = tmp_path / "late.blf", rule_files(live.session)
    tasks = tasks_for([source], [(rules, None)], None, None)
    assert judge_many(tasks, tmp_path / "out", one_after_the_other)[0].status == REFUSED
    assert "no such file or folder" in judge_many(tasks, tmp_path / "out", one_after_the_other)[0].error
    source.write_bytes(live.session.raw_log.read_bytes())
    assert judge_many(tasks, tmp_path / "out", one_after_the_other)[0].status == JUDGED


def test_a_session_is_new_work_when_one_of_its_files_changed(live, tmp_path):
    folder = shutil.copytree(live.session.folder, tmp_path / "session")
    shutil.copytree(live.session.folder, folder / "attempts" / "1")
    keys = {tasks_for([folder], [], None, None)[0].key}
    names = [
        "session.json", "events.jsonl", "results.json", "SHA256SUMS", "raw.blf",
        f"inputs/{live.session.input_path('limits').name}",
        "attempts/1/session.json", "attempts/1/results.json", "attempts/1/SHA256SUMS",
    ]  # fmt: skip
    for name in names:
        with (folder / name).open("a") as file:
            file.write("\n")
        keys.add(tasks_for([folder], [], None, None)[0].key)
    assert len(keys) == 1 + len(names)


def test_results_that_were_changed_after_a_first_judgement_are_no_pass(tmp_path):
    passed = run_briskly_on(tmp_path, unit="default").session.folder
    asked = ["replay", str(passed), "--jobs", "1", "--out", str(tmp_path / "out")]
    assert command_line(asked) == 0
    results = passed / "results.json"
    results.write_text(results.read_text("utf-8").replace('"pass"', '"fail"'), "utf-8")
    assert command_line(asked) == 4


PEAK = """
from etb_hil.plugins.measurements import Estimate, MeasurementKind

def compute(run):
    return Estimate({0}, {0} - 0.1, {0} + 0.1)

MEASUREMENT = MeasurementKind(
    id="peak_current", name="peak current", unit="A", compute=compute, order=300, source="constant", too_high="look"
)
"""


@pytest.fixture
def peak(tmp_path):
    """Return what loads a plug-in that measures the given value, in place of the one before."""
    path = tmp_path / "peak.py"

    def loaded(value):
        for one in plugins.loaded():
            plugins.unload(one.file)
        path.write_text(PEAK.format(value), "utf-8")
        plugins.load(path)

    yield loaded
    for one in plugins.loaded():
        plugins.unload(one.file)


def test_an_edited_plug_in_judges_again(live, peak, tmp_path):
    values = []
    for value in (1.0, 5.0, 1.0):
        peak(value)
        tasks = tasks_for([live.session.raw_log], [(rule_files(live.session), None)], None, None)
        (outcome,) = judge_many(tasks, tmp_path / "out", one_after_the_other)
        values.append(outcome.judged.measurements["peak_current"][0])
    assert values == [1.0, 5.0, 1.0]
    assert (tmp_path / "out" / PROGRESS).read_text().count('"outcome"') == 2  # what was judged before is used again


def test_frames_that_sqlite_keeps_beside_a_log_are_new_work(live, tmp_path):
    log, rules = tmp_path / "log.db", [(rule_files(live.session), None)]
    log.write_bytes(b"frames")
    before = tasks_for([log], rules, None, None)[0].key
    (tmp_path / "log.db-wal").write_bytes(b"more frames")
    assert tasks_for([log], rules, None, None)[0].key != before


def test_a_wrong_file_to_judge_by_is_refused_once_before_the_work(sources, tmp_path, capsys):
    (tmp_path / "wrong.yaml").write_text("schema: another\n")
    for option in ("--limits", "--model", "--bench"):
        asked = ["replay", *map(str, sources), "--jobs", "1", "--out", str(tmp_path / "out")]
        assert command_line([*asked, option, str(tmp_path / "wrong.yaml")]) == 2
        assert capsys.readouterr().err.count("wrong.yaml:1: schema: must be") == 1
    assert not (tmp_path / "out").exists()


def test_another_version_of_a_library_judges_again(live, monkeypatch):
    def keys():
        return [task.key for task in tasks_for([live.session.folder, live.session.raw_log], rules, None, None)]

    rules = [(rule_files(live.session), None)]
    before = keys()
    assert keys() == before
    monkeypatch.setattr(platform, "python_version", lambda: "3.99.0")
    assert not {*keys()} & {*before}


def test_a_worker_with_other_code_judges_nothing(live, peak):
    tasks = tasks_for([live.session.folder, live.session.raw_log], [(rule_files(live.session), None)], None, None)
    peak(1.0)
    for task in tasks:
        outcome = judge_task(task)
        assert outcome.status == REFUSED
        assert re.search("other versions or plug-ins than the one that asked: peak.py; give all workers", outcome.error)


def test_what_of_a_session_could_not_be_read_stands_in_its_row(live, tmp_path):
    folder = shutil.copytree(live.session.folder, tmp_path / "session")
    raw = folder / "raw.blf"
    raw.write_bytes(raw.read_bytes()[:-300])
    assert "cut off" in judge_task(tasks_for([folder], [], None, None)[0]).notes


def test_a_session_that_gives_other_results_than_live_is_marked_and_no_pass(tmp_path):
    passed = run_briskly_on(tmp_path, unit="default").session.folder
    whole = judge_task(tasks_for([passed], [], None, None)[0])
    assert (whole.judged.verdict, whole.differs, whole.judged.exit_code) == ("pass", None, 0)
    kept = json.loads((passed / "results.json").read_text("utf-8"))
    kept["measurements"][0]["value"] *= 1.01  # as if the frames were not those of then
    (passed / "results.json").write_text(json.dumps(kept), "utf-8")
    other = judge_task(tasks_for([passed], [], None, None)[0])
    assert "measurements.0.value" in other.differs
    assert other.judged.exit_code == 4


@pytest.mark.parametrize(
    ("segments", "decides"),
    [
        ([("pass", "within_limits"), ("inconclusive", "too_little_motion")], 0),
        ([("pass", "within_limits"), ("inconclusive", "frames_corrupted")], 1),
        ([("inconclusive", "angles_disagree"), ("fail", "T_st_beyond_limit")], 1),
        ([("inconclusive", "too_little_motion"), ("inconclusive", "samples_lost")], 1),
    ],
)
def test_no_pass_outvotes_a_doubt_in_what_was_measured(segments, decides):
    assert min(range(len(segments)), key=lambda place: rank(*segments[place])) == decides


def test_what_shows_too_little_are_reasons_that_there_are():
    assert set(UNIT_REASONS) >= SHOWS_TOO_LITTLE
    for reason in (*SHOWS_TOO_LITTLE, "T_st_undecided", "T_st_break_away_undecided", "return_margin_not_measured"):
        assert rank("inconclusive", reason) > rank("pass", ""), reason
    for reason in ("T_st_local_undecided", "direction_undecided", "samples_lost", "model_contradicted"):
        assert rank("inconclusive", reason) < rank("pass", ""), reason


def test_tasks_mean_the_same_in_every_folder(live, monkeypatch, tmp_path):
    monkeypatch.chdir(live.session.folder)
    rules = RuleFiles(
        *(Path("inputs") / live.session.input_path(kind).name for kind in ("bench", "model", "limits", "dbc"))
    )
    task = tasks_for([Path("raw.blf")], [(rules, None)], None, Path("inputs") / rules.limits.name)[0]
    monkeypatch.chdir(tmp_path)
    assert judge_task(task).judged.verdict == "fail"


def test_a_window_of_each_log_is_judged(live):
    rules = [(rule_files(live.session), None)]
    whole, part = (
        judge_task(tasks_for([live.session.raw_log], rules, None, None, window=window)[0])
        for window in (None, Window(0, 5_000_000_000))
    )
    assert part.judged.duration_s == pytest.approx(5.0, abs=0.01)
    assert part.key != whole.key
