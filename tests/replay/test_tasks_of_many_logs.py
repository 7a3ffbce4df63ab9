"""Tasks of many logs: what each is judged by, what is kept on the disk and when, and what of it is believed."""

import hashlib
import json
import os
import re
import shutil
import time
import warnings
from dataclasses import replace
from pathlib import Path

import pytest
from whole_run import run_on

from etb_hil.base.errors import InputError
from etb_hil.base.stock import find
from etb_hil.canio.frames import concatenate_frames
from etb_hil.canio.logs.blf import BlfLog, read_blf
from etb_hil.observer.registry import OBSERVERS
from etb_hil.replays.many_logs import PROGRESS, judge_many, judge_task, tasks_for
from etb_hil.replays.outcome import CRASHED, JUDGED, REFUSED, Outcome
from etb_hil.replays.session_replay import RuleFiles, rule_files
from etb_hil.replays.window import Window

SHORT = """schema: etb_hil/scenario/1
name: Short
phases:
  - {id: zero, kind: current_zero, duration: 0.3 s}
"""
RULES = RuleFiles(find("bench", "virtual_classic"), find("model", "default"), find("limits", "default"))


@pytest.fixture(scope="module")
def live(tmp_path_factory):
    place = tmp_path_factory.mktemp("sessions")
    (place / "short.yaml").write_text(SHORT)
    return run_on(place, scenario=place / "short.yaml", serial="A7")


@pytest.fixture
def tasks(tmp_path):
    return tasks_for([tmp_path / f"{name}.blf" for name in "abc"], [(RULES, None)], None, None)


def outcome_of(task, status=JUDGED):
    return Outcome(task.key, str(task.source), status)


class Pool:
    """Answers each task with the status of its turn, and keeps which tasks it was asked for."""

    def __init__(self, *statuses):
        self.asked = []
        self._statuses = statuses

    def __call__(self, tasks):
        self.asked.append([task.key for task in tasks])
        for task, status in zip(tasks, self._statuses or [JUDGED] * len(tasks), strict=True):
            yield outcome_of(task, status)


def asked_next(tasks, folder):
    """Return which tasks are left in a folder, and the warnings."""
    pool = Pool()
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        judge_many(tasks, folder, pool)
    return pool.asked[0], [str(one.message) for one in said]


def test_a_session_has_its_own_rules_and_a_log_is_a_task_of_each_unit(live, tmp_path):
    log = tmp_path / "a.blf"
    found = tasks_for([live.session.folder, log], [(RULES, 0), (RULES, 1)], None, None, 7.0, Window(0, 5), "linear")
    assert [(task.source, task.channel) for task in found] == [(live.session.folder, None), (log, 0), (log, 1)]
    assert [task.rules and task.rules.bench for task in found] == [None, RULES.bench, RULES.bench]
    assert {(task.segment_s, task.window, task.observer) for task in found} == {(7.0, Window(0, 5), "linear")}
    assert len({task.key for task in found}) == 3


def test_a_source_that_is_named_twice_is_one_task(live, tmp_path):
    twice = [live.session.folder, tmp_path / "a.blf"] * 2
    assert len(tasks_for(twice, [(RULES, None)], None, None)) == 2


def test_what_a_judgement_depends_on_makes_another_task(tmp_path):
    limits, model = (
        Path(shutil.copy(find(kind, "default"), tmp_path / f"{kind}.yaml")) for kind in ("limits", "model")
    )
    log = [tmp_path / "a.blf"]

    def key(channel=None, **changes):
        asked = {"model": model, "limits": limits, "segment_s": 60.0, "window": None, "observer": None} | changes
        return tasks_for(log, [(RULES, channel)], **asked)[0].key

    keys = [
        key(), key(1), key(model=None), key(limits=None), key(segment_s=30.0), key(window=Window(0, 1)),
        key(observer="another"),
    ]  # fmt: skip
    for file in (limits, model):
        with file.open("a") as text:
            text.write("\n")
        keys.append(key())
    log[0].write_bytes(b"frames")
    keys.append(key())
    assert len({*keys}) == len(keys)
    assert key() == keys[-1]


@pytest.mark.parametrize("kind", ["bench", "model", "limits"])
def test_a_wrong_file_to_judge_by_is_refused_before_any_log(kind, tmp_path):
    wrong = tmp_path / "wrong.yaml"
    wrong.write_text("schema: another\n")
    rules, others = (replace(RULES, bench=wrong), {}) if kind == "bench" else (RULES, {kind: wrong})
    with pytest.raises(InputError, match=r"wrong.yaml:1: schema: must be"):
        tasks_for([], [(rules, None)], **{"model": None, "limits": None, **others})


def test_paths_are_absolute(tmp_path, monkeypatch):
    for kind in ("model", "limits"):
        shutil.copy(find(kind, "default"), tmp_path / f"{kind}.yaml")
    monkeypatch.chdir(tmp_path)
    (task,) = tasks_for([Path("a.blf")], [(RULES, None)], Path("model.yaml"), Path("limits.yaml"))
    assert (task.source, task.model, task.limits) == tuple(tmp_path / n for n in ("a.blf", "model.yaml", "limits.yaml"))


def test_outcomes_come_in_the_order_of_the_tasks(tasks, tmp_path):
    def backwards(left):
        yield from (outcome_of(task) for task in reversed(left))

    assert judge_many(tasks, tmp_path, backwards) == [outcome_of(task) for task in tasks]


def test_only_what_was_judged_is_not_asked_again(tasks, tmp_path):
    judge_many(tasks, tmp_path, Pool(JUDGED, REFUSED, CRASHED))
    assert asked_next(tasks, tmp_path) == ([task.key for task in tasks[1:]], [])
    assert asked_next(tasks, tmp_path) == ([], [])
    assert judge_many(tasks, tmp_path, Pool()) == [outcome_of(task) for task in tasks]


def test_each_outcome_is_on_the_disk_before_the_next_is_asked_for(tasks, tmp_path):
    kept = []

    def pool(left):
        for task in left:
            yield outcome_of(task)
            kept.append((tmp_path / PROGRESS).read_bytes().count(b'"outcome"'))

    judge_many(tasks, tmp_path, pool)
    assert kept == [1, 2, 3]


def test_half_a_line_of_a_killed_run_costs_no_outcome_after_it(tasks, tmp_path):
    judge_many(tasks[:1], tmp_path, Pool())
    path = tmp_path / PROGRESS
    with path.open("ab") as file:
        file.write(path.read_bytes()[:-20])
    assert asked_next(tasks, tmp_path) == ([task.key for task in tasks[1:]], [])
    assert asked_next(tasks, tmp_path) == ([], [])


def test_how_far_the_work_is_counts_what_was_judged_before(tasks, tmp_path):
    heard = []
    judge_many(tasks[:1], tmp_path, Pool())
    judge_many(
        tasks, tmp_path, Pool(), lambda progress, outcome: heard.append((progress.done, progress.total, outcome))
    )
    assert heard == [(1, 3, None), (2, 3, outcome_of(tasks[1])), (3, 3, outcome_of(tasks[2]))]


@pytest.mark.parametrize(("count", "said"), [(1, "1 outcome does not"), (2, "2 outcomes do not")])
def test_outcomes_that_were_changed_are_counted_and_judged_again(tasks, tmp_path, count, said):
    judge_many(tasks, tmp_path, Pool())
    path = tmp_path / PROGRESS
    path.write_text(path.read_text().replace("blf", "BLF", count))
    asked, warned = asked_next(tasks, tmp_path)
    assert asked == [task.key for task in tasks[:count]]
    assert warned == [f"{path}: {said} match the checksum; the logs concerned are judged again"]


def test_a_sound_outcome_of_another_form_is_judged_again_without_a_word(tasks, tmp_path):
    text = json.dumps({"key": tasks[0].key, "status": JUDGED})
    digest = hashlib.sha256(text.encode()).hexdigest()
    (tmp_path / PROGRESS).write_text(f'{{"sha256": "{digest}", "outcome": {text}}}\n')
    assert asked_next(tasks, tmp_path) == ([task.key for task in tasks], [])


def test_a_log_is_judged_with_its_bench_channel_and_times(live):
    (task,) = tasks_for([live.session.raw_log], [(rule_files(live.session), 0)], None, None)
    wall, processor = time.perf_counter(), time.process_time()
    found = judge_task(task)
    assert (found.key, found.path, found.status, found.error) == (task.key, str(task.source), JUDGED, None)
    assert (found.bench, found.channel, found.segments) == (task.rules.bench.name, 0, 1)
    assert 0.0 <= found.wall_s <= time.perf_counter() - wall
    assert 0.0 <= found.processor_s <= time.process_time() - processor  # some kernels count by ticks


def test_a_logs_times_count_from_its_first_stamp(live, tmp_path):
    frames = concatenate_frames(read_blf(live.session.raw_log))
    for first_ns in (0, 1_000_000, 5_000_000_000):
        frames.stamp_ns += first_ns - frames.stamp_ns[0]
        log = BlfLog(tmp_path / "log.blf", first_ns)
        log.write(frames)
        log.close()
        part = judge_task(tasks_for([tmp_path / "log.blf"], [(RULES, None)], None, None)[0]).judged
        assert (part.start_ns, part.deciding_s) == (first_ns, 0.0)


def test_a_long_log_is_judged_in_segments(live):
    whole, parts = (
        judge_task(tasks_for([live.session.raw_log], [(rule_files(live.session), None)], None, None, length)[0])
        for length in (60.0, 0.1)
    )
    assert parts.segments > whole.segments
    assert parts.judged.frames == whole.judged.frames


def test_a_session_is_judged_as_it_was_live(live):
    found = judge_task(tasks_for([live.session.folder], [], None, None)[0])
    assert (found.status, found.bench, found.channel, found.segments) == (JUDGED, None, None, 1)
    assert (found.judged.serial, found.judged.exit_code, found.differs) == ("A7", int(live.results.code), None)
    assert found.judged.start_ns == live.record.start_ns


@pytest.fixture
def edited(live, tmp_path):
    """Return a session whose results are not those that its frames give."""
    folder = shutil.copytree(live.session.folder, tmp_path / "session")
    kept = json.loads((folder / "results.json").read_text("utf-8"))
    kept["unit"]["verdict"] = "pass"
    (folder / "results.json").write_text(json.dumps(kept), "utf-8")
    return folder


def test_other_results_than_live_are_said(edited):
    found = judge_task(tasks_for([edited], [], None, None)[0])
    assert (found.status, found.judged.exit_code) == (JUDGED, 4)
    assert "verdict" in found.differs


@pytest.mark.parametrize(
    "other",
    [
        {"model": find("model", "default")},
        {"limits": find("limits", "default")},
        {"observer": OBSERVERS.names()[0]},
        {"window": Window(0, 10_000_000_000)},
    ],
    ids=lambda other: next(iter(other)),
)
def test_what_is_judged_by_other_rules_is_not_held_against_the_live_results(edited, other):
    found = judge_task(tasks_for([edited], [], **{"model": None, "limits": None, **other})[0])
    assert (found.status, found.differs, found.judged.verdict) == (JUDGED, None, "inconclusive")


def test_live_results_that_cannot_be_read_are_named_as_utf8(live, tmp_path_factory):
    """The folder of a session may have any name."""
    folder = shutil.copytree(live.session.folder, tmp_path_factory.mktemp("any") / os.fsdecode(b"lo\xe9"))
    (folder / "results.json").write_text("{")
    found = judge_task(tasks_for([folder], [], None, None)[0])
    assert found.status == JUDGED
    assert "lo\\udce9/results.json" in found.differs
    found.differs.encode()


def test_a_session_without_results_is_judged_alone(edited):
    (edited / "results.json").unlink()
    found = judge_task(tasks_for([edited], [], None, None)[0])
    assert (found.status, found.differs) == (JUDGED, None)


def test_what_goes_wrong_with_one_log_is_its_outcome(live, tmp_path):
    (tmp_path / "bad.blf").write_bytes(b"nothing of a log")
    rules = [(rule_files(live.session), None)]
    refused = judge_task(tasks_for([tmp_path / "bad.blf"], rules, None, None)[0])
    assert (refused.status, refused.judged) == (REFUSED, None)
    assert "must be a BLF file" in refused.error
    crashed = judge_task(replace(tasks_for([live.session.raw_log], rules, None, None)[0], segment_s=0.0))
    assert (crashed.status, crashed.judged) == (CRASHED, None)
    assert re.match("[A-Za-z]*Error: ", crashed.error)


def test_other_code_than_the_tasks_judges_nothing(live):
    for source in (live.session.folder, live.session.raw_log):
        (task,) = tasks_for([source], [(rule_files(live.session), None)], None, None)
        other = task.made_by._replace(versions=(("numpy", "0.1"), *task.made_by.versions[1:]))
        found = judge_task(replace(task, made_by=other))
        assert found.status == REFUSED
        assert "has other versions or plug-ins than the one that asked" in found.error
        assert "give all workers the same ones" in found.error
