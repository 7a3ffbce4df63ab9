"""Many logs: one bad one costs only itself, interrupted work goes on, and the tables are those of a database."""

import json
import os
from dataclasses import replace

import dask
import distributed
import duckdb
import numpy as np
import pytest
from whole_run import run_on

from etb_hil.base.errors import BenchFault
from etb_hil.canio.frames import concatenate_frames
from etb_hil.canio.logs.blf import BlfLog, read_blf
from etb_hil.cli import replay as command
from etb_hil.cli.main import main as command_line
from etb_hil.replay.log_replay import STRETCH_S
from etb_hil.replay.many_logs import CRASHED, JUDGED, PROGRESS, REFUSED, judge_many, judge_task, tasks_for
from etb_hil.replay.parquet import write_parquet
from etb_hil.replay.session_replay import rule_files
from etb_hil.replay.workers import DaskWorkers, LocalProcesses


@pytest.fixture(scope="module")
def live(tmp_path_factory):
    return run_on(tmp_path_factory.mktemp("sessions"), unit="faulty", serial="A7")


@pytest.fixture
def sources(live, tmp_path):
    log = tmp_path / "log.blf"
    log.write_bytes(live.session.raw_log.read_bytes())
    bad = tmp_path / "bad.blf"
    bad.write_bytes(b"nothing of a log")
    return [live.session.folder, bad, log]


@pytest.fixture
def tasks(live, sources):
    return tasks_for(sources, [(rule_files(live.session), None)], None, None)


def one_after_the_other(tasks):
    yield from map(judge_task, tasks)


def dies_at_bad_logs(task):
    if task.source.name == "bad.blf":
        os._exit(9)
    return {"key": task.key, "path": str(task.source), "status": JUDGED, "exceedances": []}


def test_each_log_has_its_outcome(live, tasks, tmp_path):
    session, bad, log = judge_many(tasks, tmp_path / "out", one_after_the_other)
    assert (session["status"], bad["status"], log["status"]) == (JUDGED, REFUSED, JUDGED)
    assert "is no BLF file" in bad["error"]
    assert session["verdict"] == "fail"
    assert session["serial"] == "A7"
    numbers = {n["id"]: [n["value"], n["low"], n["high"]] for n in live.results["numbers"]}
    assert session["numbers"] == numbers
    assert len(session["exceedances"]) == len(live.results["exceedances"])
    assert log["frames"] == session["frames"] > 1000


def test_interrupted_work_goes_on(tasks, tmp_path):
    asked = []

    def stops_after_one(left):
        asked.append(len(left))
        for task in left:
            yield judge_task(task)
            if len(asked) == 1:
                raise KeyboardInterrupt

    folder = tmp_path / "out"
    with pytest.raises(KeyboardInterrupt):
        judge_many(tasks, folder, stops_after_one)
    with (folder / PROGRESS).open("a") as progress:
        progress.write('{"key": "half a li')
    outcomes = judge_many(tasks, folder, stops_after_one)
    assert asked == [3, 2]
    assert [outcome["key"] for outcome in outcomes] == [task.key for task in tasks]
    judge_many(tasks, folder, stops_after_one)
    assert asked == [3, 2, 0]


def test_a_log_that_changed_or_other_limits_are_new_work(live, sources, tasks):
    limits = live.session.input_path("limits")
    other = tasks_for(sources, [(rule_files(live.session), None)], None, limits)
    assert not {task.key for task in tasks} & {task.key for task in other}
    sources[1].write_bytes(b"something else")
    keys = [task.key for task in tasks_for(sources, [(rule_files(live.session), None)], None, None)]
    assert [key == task.key for key, task in zip(keys, tasks, strict=True)] == [True, False, True]


def test_a_process_that_dies_costs_only_its_log(tasks):
    outcomes = {outcome["path"]: outcome for outcome in LocalProcesses(2, dies_at_bad_logs)(tasks)}
    assert [outcomes[str(task.source)]["status"] for task in tasks] == [JUDGED, CRASHED, JUDGED]


def test_units_on_channels_of_one_log_are_judged_each_by_itself(live, sources, tmp_path, capsys):
    frames = concatenate_frames(read_blf(sources[2]))
    other = replace(frames, stamp_ns=frames.stamp_ns + 300_000, channel=np.full_like(frames.channel, 1))
    both = concatenate_frames([frames, other])
    both = both.rows(np.argsort(both.stamp_ns, kind="stable"))
    path = tmp_path / "both.blf"
    log = BlfLog(path, int(both.stamp_ns[0]))
    log.write(both)
    log.close()
    rules = rule_files(live.session)
    alone = judge_task(tasks_for([sources[2]], [(rules, None)], None, None)[0])
    tasks = tasks_for([path], [(rules, 0), (rules, 1)], None, None)
    outcomes = judge_many(tasks, tmp_path / "out", one_after_the_other)
    assert [outcome["channel"] for outcome in outcomes] == [0, 1]
    for outcome in outcomes:
        for key in ("verdict", "reason", "frames", "lost", "crc_failures", "numbers"):
            assert outcome[key] == alone[key]
    assert command_line(["replay", str(path), "--bench", str(rules.bench), "--channel", "0", "--channel", "1"]) == 10
    said = capsys.readouterr().out
    assert f"{rules.bench.name}, channel 1:" in said
    assert command_line(["replay", str(path), "--channel", "7"]) == 2
    assert "holds no frame on the channel (it is 7); allowed: 0, 1" in capsys.readouterr().err


def test_the_tables_open_in_a_database(tasks, tmp_path):
    outcomes = judge_many(tasks, tmp_path / "out", one_after_the_other)
    logs, exceedances = write_parquet(outcomes, tmp_path / "out")
    rows = duckdb.sql(f"select status, verdict, T_st, T_st_low from '{logs}'").fetchall()  # noqa: S608
    assert [row[:2] for row in rows] == [(JUDGED, "fail"), (REFUSED, None), (JUDGED, outcomes[2]["verdict"])]
    assert rows[0][2:] == tuple(outcomes[0]["numbers"]["T_st"][:2])
    both = f"'{logs}' l join '{exceedances}' using (key)"
    found = duckdb.sql(f"select count(*) from {both} where l.path like '%log.blf'")  # noqa: S608
    assert found.fetchall() == [(len(outcomes[2]["exceedances"]),)]
    write_parquet(outcomes[1:2], tmp_path / "out")  # none judged: the columns stay
    assert duckdb.sql(f"select count(*), count(verdict) from '{logs}'").fetchall() == [(1, 0)]  # noqa: S608


def test_a_dask_cluster_gives_the_same(tasks, tmp_path):
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, host="127.0.0.1", dashboard_address=None
    ) as cluster:
        there = judge_many(tasks, tmp_path / "dask", DaskWorkers(cluster.scheduler_address))
    here = judge_many(tasks, tmp_path / "here", one_after_the_other)
    for ours, theirs in zip(here, there, strict=True):
        for cost in ("wall_s", "processor_s"):
            ours.pop(cost), theirs.pop(cost)
        assert json.dumps(ours) == json.dumps(theirs)


def test_a_cluster_that_does_not_answer_is_said(tasks):
    with dask.config.set({"distributed.comm.timeouts.connect": "1s"}), pytest.raises(BenchFault, match="no Dask"):
        next(DaskWorkers("tcp://127.0.0.1:9")(tasks))


def test_the_stretch_of_the_command_is_that_of_the_room():
    assert command.STRETCH_S == STRETCH_S
