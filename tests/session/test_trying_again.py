"""Attempts of a run: which result asks for another one, and what an attempt that was set aside still holds."""

from pathlib import Path

import pytest

from etb_hil.base.errors import InputError
from etb_hil.base.outcome import BenchOutcome, UnitVerdict
from etb_hil.results.run_result import Attempt, Bench, FrameAge, Lateness, RunResult, Unit
from etb_hil.scenario.scenario_file import Retry
from etb_hil.session.attempts import earlier_attempts, is_tried_again, set_aside
from etb_hil.session.session import create, open_session

OK, FAULT, ABORTED = BenchOutcome.OK, BenchOutcome.FAULT, BenchOutcome.ABORTED
INCONCLUSIVE, PASS, FAIL = UnitVerdict.INCONCLUSIVE, UnitVerdict.PASS, UnitVerdict.FAIL
BOTH = ("inconclusive", "bench_fault")


def result(outcome=OK, verdict=INCONCLUSIVE, safe_state=True):
    punctual = {"lateness": Lateness(0.0, 0.0), "frame_age": FrameAge(1.0, 1.0)}
    bench = Bench(outcome, "bench_reason", safe_state=safe_state, **punctual)
    return RunResult("run", Unit(verdict, "unit_reason"), bench, duration_s=1.0, timestamp_grade="receive stamps")


@pytest.mark.parametrize(
    ("outcome", "verdict", "after", "is_again"),
    [
        (OK, INCONCLUSIVE, ("inconclusive",), True),
        (OK, INCONCLUSIVE, ("bench_fault",), False),
        (FAULT, None, ("bench_fault",), True),
        (FAULT, None, ("inconclusive",), False),
        (FAULT, INCONCLUSIVE, ("inconclusive",), False),
        (OK, PASS, BOTH, False),
        (OK, FAIL, BOTH, False),
        (OK, None, BOTH, False),
        (ABORTED, None, BOTH, False),
        (ABORTED, INCONCLUSIVE, BOTH, False),
    ],
)
def test_what_gave_no_verdict_is_tried_again_where_the_scenario_says_so(outcome, verdict, after, is_again):
    retry = Retry(attempts=3, after=after)
    assert [is_tried_again(retry, result(outcome, verdict), attempt) for attempt in (1, 2, 3)] == [
        is_again, is_again, False,
    ]  # fmt: skip
    assert not is_tried_again(None, result(outcome, verdict), 1)


@pytest.mark.parametrize("safe_state", [False, None])
@pytest.mark.parametrize(("outcome", "verdict"), [(OK, INCONCLUSIVE), (FAULT, None)])
def test_nothing_is_tried_again_where_the_drive_was_not_seen_off(outcome, verdict, safe_state):
    assert not is_tried_again(Retry(attempts=3, after=BOTH), result(outcome, verdict, safe_state), 1)


@pytest.fixture
def session(tmp_path):
    scenario = tmp_path / "scenario.yaml"
    scenario.write_text("name: x\n")
    return create(tmp_path / "out", "x", "", {"scenario": scenario})


def finish(session, outcome=OK, verdict=INCONCLUSIVE, photo=False):
    """Write what a run writes: log, events, results, and perhaps a photo of a prompt."""
    session.raw_log.write_bytes(b"log")
    session.events.write_bytes(b"events")
    session.write_results(result(outcome, verdict))
    if photo:
        (session.folder / "photos").mkdir()
        (session.folder / "photos" / "label.jpg").write_bytes(b"photo")


def names(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


@pytest.mark.parametrize("photo", [False, True])
def test_an_attempt_set_aside_is_a_session_of_its_own_and_makes_room_for_the_next(session, photo):
    before = names(session.folder)
    finish(session, photo=photo)
    whole, written = names(session.folder), session.read_results()
    folder = set_aside(session, 1)
    assert folder == session.folder / "attempts" / "1"
    assert names(folder) == whole
    assert names(session.folder) == sorted([*before, *(f"attempts/1/{name}" for name in whole)])
    kept = open_session(folder)
    assert (kept.raw_log.read_bytes(), kept.events.read_bytes()) == (b"log", b"events")
    assert kept.input_path("scenario").read_text() == "name: x\n"
    assert kept.read_results() == written
    (folder / "results.json").write_text((folder / "results.json").read_text().replace("unit_reason", "other"))
    with pytest.raises(InputError, match="was changed after the run"):
        kept.read_results()


def test_a_disk_without_second_names_keeps_copies(session, monkeypatch):
    def refused(*_):
        raise OSError(95, "Operation not supported")

    monkeypatch.setattr(Path, "hardlink_to", refused)
    finish(session)
    assert open_session(set_aside(session, 1)).raw_log.read_bytes() == b"log"


def test_the_earlier_attempts_are_told_in_their_order_with_what_decided_each(session):
    assert earlier_attempts(session) == ()
    for number, (outcome, verdict) in enumerate([(OK, INCONCLUSIVE), (FAULT, None), (OK, INCONCLUSIVE)], 1):
        finish(session, outcome, verdict)
        set_aside(session, number)
    assert earlier_attempts(session) == (
        Attempt(1, OK, INCONCLUSIVE, "unit_reason", "attempts/1"),
        Attempt(2, FAULT, None, "bench_reason", "attempts/2"),
        Attempt(3, OK, INCONCLUSIVE, "unit_reason", "attempts/3"),
    )


def test_an_attempt_that_cannot_be_set_aside_stays_where_it_is(session):
    finish(session, photo=True)
    (session.folder / "attempts").write_bytes(b"")  # as a full disk, this lets no folder be made
    before = names(session.folder)
    with pytest.raises(OSError, match="attempts") as caught:
        set_aside(session, 1)
    assert caught.value.__context__ is None  # the reason itself, and not what tidying met
    assert names(session.folder) == before


def test_what_was_copied_before_an_attempt_could_not_be_set_aside_is_taken_away(session):
    finish(session)
    session.events.unlink()
    before = names(session.folder)
    with pytest.raises(FileNotFoundError):
        set_aside(session, 1)
    assert names(session.folder) == before
