"""What is kept of a log judged in parts: which part decides, what is summed, and what a file of progress gives back."""

import json
from dataclasses import replace

import pytest
from whole_run import run_on

from etb_hil.replays.outcome import JUDGED, REFUSED, Outcome, as_json, from_json, part_of, rank, together
from etb_hil.replays.parquet import write_parquet
from etb_hil.results.run_result import Exceedance

EPISODE = Exceedance("T_st", 1.0, 1.5, 0.3, 0.26, 0.7, 0.1, 25.0, "ramp", 0.02)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sessions")
    scenario = folder / "short.yaml"
    phases = "  - {id: zero, kind: current_zero, duration: 0.3 s}\n"
    scenario.write_text(f"schema: etb_hil/scenario/1\nname: short\nphases:\n{phases}")
    return run_on(folder, scenario=scenario, serial="A7")


@pytest.fixture(scope="module")
def part(finished):
    return part_of(finished, finished.record.start_ns - 2_000_000_000)


def test_a_part_is_what_its_results_say(finished, part):
    results, unit = finished.results, finished.results.unit
    assert (part.verdict, part.reason_id, part.reason) == ("inconclusive", unit.reason_id, unit.reason)
    assert (part.serial, part.part_number, part.revision) == ("A7", unit.part_number, unit.revision)
    assert (part.bench_outcome, part.exit_code, part.timestamp_grade) == ("ok", 4, results.timestamp_grade)
    assert part.frames == sum(message.frames for message in results.bus.messages) > 100
    assert (part.lost, part.crc_failures, part.exceedances) == (0, 0, ())
    assert part.duration_s == results.duration_s
    assert {name: row[0] for name, row in part.measurements.items()} == {
        one.id: one.value for one in results.measurements.values()
    }


def test_the_times_of_a_part_count_from_the_log_s_first_frame(finished):
    origin = finished.record.start_ns - 2_000_000_000
    with_one = replace(finished, results=replace(finished.results, exceedances=(EPISODE,)))
    part = part_of(with_one, origin)
    assert part.start_ns == origin
    assert part.deciding_s == pytest.approx(2.0)
    (episode,) = part.exceedances
    assert (episode.start_s, episode.end_s, episode.peak) == (pytest.approx(3.0), pytest.approx(3.5), EPISODE.peak)


@pytest.mark.parametrize(("first", "total"), [(2, 9), (0, 7), (None, None)])
def test_losses_and_broken_frames_of_all_messages_are_summed(finished, first, total):
    messages = [
        replace(one, frames=10, lost=lost, crc_failures=2)
        for one, lost in zip(finished.results.bus.messages, (first, 3, 4, *[0] * 9), strict=False)
    ]
    bus = replace(finished.results.bus, messages=tuple(messages))
    part = part_of(replace(finished, results=replace(finished.results, bus=bus)), 0)
    assert (part.frames, part.lost, part.crc_failures) == (10 * len(messages), total, 2 * len(messages))


def test_a_sum_with_an_unknown_part_is_unknown(part, tmp_path):
    """An unknown loss is null in the table, which a query tells from 0."""
    parts = [replace(part, lost=1, duration_s=2.0), replace(part, lost=None, duration_s=None)]
    whole = together(parts)
    assert (whole.lost, whole.duration_s) == (None, None)
    outcome = Outcome("k", "a.blf", JUDGED, judged=whole, segments=2)
    assert from_json(as_json(outcome)) == outcome
    logs, _ = write_parquet([outcome, replace(outcome, judged=parts[0])], tmp_path)
    table = pytest.importorskip("pyarrow.parquet").read_table(logs)
    assert (table["lost"].to_pylist(), table["duration_s"].to_pylist()) == ([None, 1], [None, 2.0])


def test_a_run_without_a_verdict_has_none(finished):
    unit = replace(finished.results.unit, verdict=None)
    assert part_of(replace(finished, results=replace(finished.results, unit=unit)), 0).verdict is None


def test_the_part_that_decides_gives_its_words_and_all_give_their_sums(part):
    passed = replace(part, verdict="pass", reason_id="within_limits", frames=5, lost=1, crc_failures=2, duration_s=2.0)
    failed = replace(passed, verdict="fail", reason_id="T_st_beyond_limit", exceedances=(EPISODE,), duration_s=2.0)
    little = replace(passed, verdict="inconclusive", reason_id="too_little_motion", exceedances=(EPISODE,))
    whole = together([passed, failed, little])
    assert (whole.verdict, whole.reason_id) == ("fail", "T_st_beyond_limit")
    assert (whole.frames, whole.lost, whole.crc_failures, whole.duration_s) == (15, 3, 6, 6.0)
    assert whole.exceedances == (EPISODE, EPISODE)
    assert together([little, passed]).verdict == "pass"
    first = replace(passed, deciding_s=7.0)
    assert together([first, passed]).deciding_s == 7.0  # of equals the first decides


@pytest.mark.parametrize(
    ("verdict", "reason", "place"),
    [
        ("fail", "samples_lost", 0),
        ("inconclusive", "samples_lost", 1),
        ("inconclusive", "T_st_local_undecided", 1),
        ("pass", "too_little_motion", 2),
        ("inconclusive", "one_way", 3),
        ("inconclusive", "T_c_undecided", 3),
        ("inconclusive", "T_c_not_measured", 3),
        ("inconclusive", "T_c_without_signal", 3),
        ("inconclusive", "T_c_without_interval", 3),
        (None, "samples_lost", 3),
    ],
)
def test_the_place_of_a_verdict_among_those_of_a_log(verdict, reason, place):
    assert rank(verdict, reason) == place


def test_an_outcome_comes_back_from_its_json(part):
    outcome = Outcome("k", "a.blf", JUDGED, "bench", 3, judged=replace(part, exceedances=(EPISODE,)), segments=2)
    assert from_json(as_json(outcome)) == outcome
    assert outcome.exceedances == (EPISODE,)
    refused = Outcome("k", "a.blf", REFUSED, error="no log")
    assert from_json(as_json(refused)) == refused
    assert (refused.exceedances, refused.segments) == ((), 0)


def test_an_outcome_of_another_version_is_none():
    assert from_json("{}") is None
    assert from_json(json.dumps({"key": "k", "path": "p", "status": 5})) is None
