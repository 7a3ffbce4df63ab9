"""Sessions and logs that each release wrote keep opening, and keep their verdict. A release adds its folder."""

from pathlib import Path

import numpy as np
import pytest

from etb_hil.canio.frames import FrameFlag, concatenate_frames
from etb_hil.canio.logs.reading import read_log
from etb_hil.histories.runs import read_runs
from etb_hil.replays.log_frames import Frames
from etb_hil.replays.log_replay import LogJob, judge
from etb_hil.replays.session_replay import replay, rule_files
from etb_hil.session.session import open_session

RELEASES = sorted((Path(__file__).resolve().parents[1] / "releases").iterdir())
IN_LOGS = slice(1000, 1120)  # frames of the session that the logs hold
STEP_NS = {".asc": 1000, ".log": 1000, ".trc": 1000, ".csv": 1000, ".db": 1000, ".mf4": 1, ".blf": 1}
FROM_ITS_START = (".asc", ".trc")
WITHOUT_DIRECTION = (".csv", ".db")


@pytest.mark.parametrize("release", RELEASES, ids=lambda path: path.name)
def test_a_session_is_judged_as_it_was(release):
    session = open_session(release / "session")
    before = session.read_results()
    finished = replay(session.folder)
    assert finished.results.unit.verdict == before.unit.verdict
    assert finished.results.unit.reason_id == before.unit.reason_id
    assert finished.results.bench.outcome == before.bench.outcome
    counts = [{m.name: m.frames for m in results.bus.messages} for results in (before, finished.results)]
    assert counts[0] == counts[1]
    assert len(finished.record.phases) == 3
    now = finished.results.measurements
    for name, one in before.measurements.items():
        if one.interval is not None:
            assert one.low <= now[name].value <= one.high, name


@pytest.mark.parametrize("release", RELEASES, ids=lambda path: path.name)
def test_a_session_counts_in_the_history(release):
    (run,), notes = read_runs([release / "session"])
    before = open_session(release / "session").read_results()
    assert notes == []
    assert run.verdict == before.unit.verdict
    assert run.numbers["T_st"].value == before.measurements["T_st"].value


@pytest.mark.parametrize("release", RELEASES, ids=lambda path: path.name)
def test_its_raw_log_is_judged_as_a_log(release):
    session = open_session(release / "session")
    files = rule_files(session)
    finished = judge(LogJob((session.raw_log,), files, files.read()), Frames([session.raw_log]))
    assert finished.results.unit.verdict == "fail"


LOGS = [path for release in RELEASES for path in sorted((release / "logs").iterdir())]


@pytest.mark.parametrize("path", LOGS, ids=lambda path: f"{path.parents[1].name}-{path.name}")
def test_a_log_of_any_format_gives_its_frames(path):
    expected = concatenate_frames(read_log(path.parents[1] / "session" / "raw.blf")).select(IN_LOGS)
    log = read_log(path)
    got = concatenate_frames(log)
    assert log.notes == []
    suffix = path.name.removeprefix("log").removesuffix(".gz")
    held = 0xFF & ~FrameFlag.SENT if suffix in WITHOUT_DIRECTION else 0xFF
    np.testing.assert_array_equal(got.flags, expected.flags & held)
    assert not got.channel.any()
    for column in ("ident", "length", "data"):
        np.testing.assert_array_equal(getattr(got, column), getattr(expected, column), err_msg=column)
    shift = int(got.stamp_ns[0] - expected.stamp_ns[0]) if suffix in FROM_ITS_START else 0
    assert np.abs(got.stamp_ns - expected.stamp_ns - shift).max() <= STEP_NS[suffix]
