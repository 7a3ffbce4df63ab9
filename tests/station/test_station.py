"""Stations: their files, which units they take, when their bench is fit, and which sessions they keep."""

import json
import sqlite3
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from etb_hil.base.errors import BenchFault, InputError
from etb_hil.base.outcome import BenchOutcome, UnitVerdict
from etb_hil.base.stock import find
from etb_hil.cli.main import main
from etb_hil.page.survey import survey
from etb_hil.results.json_file import result_from_dict
from etb_hil.results.measurement import Measurement, Measurements
from etb_hil.results.run_result import Bench, RunResult, Unit
from etb_hil.session.session import create, open_session
from etb_hil.station.admission import admitted_part, compared, require_fit_bench
from etb_hil.station.retention import expired
from etb_hil.station.station_file import Retention, load_station
from etb_hil.store.address import STORE, StoreAddress
from etb_hil.store.queue import Queue
from etb_hil.store.run import Measured, Run

EXAMPLE = Path(__file__).parents[2] / "docs" / "examples" / "line.station.yaml"
NOW = datetime(2026, 11, 20, 12, 0, tzinfo=UTC)


@pytest.fixture
def station():
    return load_station(EXAMPLE).content


def run(serial, verdict="pass", *, hours=1.0, outcome="ok", stiction=0.171, coulomb=0.145, bench="b", part=None):
    numbers = {name: Measured(value, None, None, None, None) for name, value in (("T_st", stiction), ("T_c", coulomb))}
    started = (NOW - timedelta(hours=hours)).isoformat()
    part = part or "default-throttle"
    return Run(f"run-{hours}", started, bench, "s", serial, part, "1", outcome, verdict, "", 20.0, numbers)


def written(tmp_path, *changes):
    text = EXAMPLE.read_text("utf-8")
    for before, after in changes:
        assert before in text
        text = text.replace(before, after)
    path = tmp_path / "station.yaml"
    path.write_text(text, "utf-8")
    return path


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (('revision: "1"', 'revision: "2"'), "limits are of another part (it is 'default-throttle revision 1')"),
        (("limits: default", "limits: nowhere"), "parts[0].limits: no limits file 'nowhere'"),
        (("serial: GOLD-1\n  part: default-throttle", "serial: GOLD-1\n  part: other"), "golden.part: no such part"),
        (('"ETB-[0-9]{4}"', '"ETB-["'), "no regular expression"),
        (("due: 2099-03-01", "due: 1.3.2099"), "no date; write it as 2027-03-01"),
        (("passed: 90 d", "passed: 900 d"), "kept as long as what passed"),
        (("every: 24 h", "every: 24"), "unit"),
        (("approver: A. Quality, 2026-10-02", "unheard: 1"), "approver"),
    ],
)
def test_what_is_wrong_in_a_station_file(change, said, tmp_path):
    path = written(tmp_path, change)
    with pytest.raises(InputError) as caught:
        load_station(path)
    assert said in str(caught.value)
    assert f"{path}:" in str(caught.value)  # the line, too


def test_a_part_is_found_by_its_serial_number(station):
    assert admitted_part(station, "ETB-0042", [], NOW).number == "default-throttle"
    assert admitted_part(station, "GOLD-1", [run("GOLD-1")] * 50, NOW).number == "default-throttle"
    for serial in ("", "ETB-42", "xETB-0042", "ETB-00421", "etb-0042"):
        with pytest.raises(InputError, match="serial number"):
            admitted_part(station, serial, [], NOW)


@pytest.mark.parametrize("verdict", ["pass", "fail"])
def test_a_judged_unit_does_not_come_again(verdict, station):
    with pytest.raises(InputError, match=f"judged already .*{verdict} on 2026-11-20"):
        admitted_part(station, "ETB-0042", [run("ETB-0042", verdict)], NOW)


def test_what_judged_nothing_does_not_count(station):
    earlier = [run("ETB-0042", None, outcome="fault"), run("ETB-0042", None, outcome="aborted")] * 5
    assert admitted_part(station, "ETB-0042", earlier, NOW)
    assert admitted_part(station, "ETB-0042", [run("ETB-0042", part="another"), run("ETB-0043", "fail")], NOW)


def test_a_unit_is_not_tested_until_it_passes(station):
    once = [run("ETB-0042", "inconclusive", hours=3.0)]
    assert admitted_part(station, "ETB-0042", once, NOW)
    with pytest.raises(InputError, match="as often as it may be"):
        admitted_part(station, "ETB-0042", [*once, run("ETB-0042", "inconclusive")], NOW)


def test_the_golden_unit_makes_the_bench_fit(station):
    def fit(*runs, serial="ETB-0042", now=NOW):
        require_fit_bench(station, "b", serial, runs, now)

    with pytest.raises(BenchFault, match="has not checked itself"):
        fit()
    with pytest.raises(BenchFault, match="has not checked itself"):
        fit(run("GOLD-1", bench="another bench"), run("GOLD-1", None, outcome="fault"))
    fit(run("GOLD-1", hours=23.9))
    fit(serial="GOLD-1")
    with pytest.raises(BenchFault, match=r"24.1 h ago \(allowed: 24 h\)"):
        fit(run("GOLD-1", hours=24.1))
    with pytest.raises(BenchFault, match=r"came out wrong .*T_st 0.178 N·m, expected 0.171 within 0.006"):
        fit(run("GOLD-1", hours=2.0), run("GOLD-1", stiction=0.178))
    fit(run("GOLD-1", hours=2.0, stiction=0.178), run("GOLD-1"))
    fit(run("GOLD-1", "fail"))  # a golden unit may be a bad one: what counts is what is expected of it


def test_a_serial_number_of_two_parts_is_refused(station):
    both = station.model_copy(update={"parts": (station.parts[0], station.parts[0])})
    with pytest.raises(InputError, match=r"fits several parts .*make the patterns of the station file exclude"):
        admitted_part(both, "ETB-0042", [], NOW)
    assert admitted_part(both.model_copy(update={"parts": station.parts}), "ETB-0042", [], NOW) == station.parts[0]


def test_a_number_that_is_missing_is_not_as_expected(station):
    lacking = run("GOLD-1")
    lacking = Run(*(getattr(lacking, name) for name in Run.__slots__[:-1]), {})
    assert [good for _, good in compared(station.golden, lacking)] == [False, False]


def test_an_overdue_calibration_stops_even_the_golden_unit(station):
    with pytest.raises(BenchFault, match=r"overdue since: current sensor \(certificate K-4711\): 2099-03-01"):
        require_fit_bench(station, "b", "GOLD-1", [], datetime(2099, 3, 2, tzinfo=UTC))
    require_fit_bench(station, "b", "GOLD-1", [], datetime(2099, 3, 1, 23, tzinfo=UTC))  # the day itself is fine


def session(folder, name, verdict):
    made = create(folder, name, "", {"limits": find("limits", "default")})
    if verdict is not None:
        unit = Unit(UnitVerdict(verdict))
        made.write_results(RunResult(made.run_id, unit, Bench(BenchOutcome.OK)))
    return made


def test_sessions_are_kept_as_long_as_they_must(tmp_path):
    rules = Retention(passed="90 d", other="730 d")
    made = {verdict: session(tmp_path, str(verdict), verdict) for verdict in ("pass", "fail", None)}
    ids = {each.run_id for each in made.values()}
    now = datetime.now(UTC)
    assert expired(tmp_path, rules, ids, now + timedelta(days=89)) == []
    (passed,) = expired(tmp_path, rules, ids, now + timedelta(days=91))
    assert passed.folder == made["pass"].folder
    assert passed.size > 100
    assert len(expired(tmp_path, rules, ids, now + timedelta(days=731))) == 3
    assert expired(tmp_path, rules, [], now + timedelta(days=731)) == []  # their numbers are nowhere else

    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    linked = session(elsewhere, "linked", "pass")
    (tmp_path / "link").symlink_to(linked.folder)
    (made["fail"].folder / "session.json").write_text("{")
    late = expired(tmp_path, rules, ids | {linked.run_id}, now + timedelta(days=731))
    assert {each.folder for each in late} == {made["pass"].folder, made[None].folder}


def in_store(folder, serial, *, stiction=0.171):
    """Put a run of a golden unit into a store, as the runner does."""
    made = create(folder, "Friction check", serial, {"limits": find("limits", "default")})
    measured = Measurements(
        Measurement(name, name, value, "N·m") for name, value in (("T_st", stiction), ("T_c", 0.145))
    )
    unit = Unit(UnitVerdict.PASS, "within_limits", serial=serial, part_number="default-throttle", revision="1")
    bench = Bench(BenchOutcome.OK, name="Virtual bench on classic CAN")
    queue = Queue(folder)
    queue.add(RunResult(made.run_id, unit, bench, started=made.started, measurements=measured), made.folder)
    assert queue.deliver(StoreAddress(folder / STORE)).arrived == 1


def restamped(folder, started):
    """Give the runs of a store another start, as a bench whose clock is wrong does."""
    with sqlite3.connect(folder / STORE) as file:
        file.execute("UPDATE runs SET started = ?", (started,))
    file.close()


def test_a_golden_unit_of_a_wrong_clock_is_told_by_command_run_and_page(tmp_path, capsys):
    in_store(tmp_path, "GOLD-1")
    restamped(tmp_path, "2099-01-05T12:00:00.000+00:00")
    look = ["station", str(EXAMPLE), "--out", str(tmp_path)]
    assert main(look) == 3
    said = capsys.readouterr().out
    assert "NOT FIT   the bench has not checked itself" in said
    assert "stamped after now" in said
    assert command(tmp_path, "--serial", "ETB-0001") == 3
    assert "2099-01-05 12:00 UTC" in " ".join(capsys.readouterr().out.split())
    assert "stamped after now" in survey(None, EXAMPLE, tmp_path)["unfit"]
    in_store(tmp_path, "GOLD-1")
    assert main(look) == 0
    said = capsys.readouterr().out
    assert "fit       the bench may judge units\nnote      the run 20" in said
    assert survey(None, EXAMPLE, tmp_path)["unfit"] == ""


def test_a_page_holds_the_numbers_of_the_golden_unit_against_what_is_expected(tmp_path):
    in_store(tmp_path, "GOLD-1")
    assert survey(None, EXAMPLE, tmp_path)["unfit"] == ""
    in_store(tmp_path, "GOLD-1", stiction=0.2)
    assert "T_st 0.200 N·m, expected 0.171" in survey(None, EXAMPLE, tmp_path)["unfit"]


def command(tmp_path, *words):
    return main(["run", "--station", str(EXAMPLE), "--out", str(tmp_path), "--yes", *words])


def test_a_station_at_work(tmp_path, capsys):
    assert command(tmp_path, "--serial", "ETB-0001") == 3
    assert "has not checked itself" in capsys.readouterr().out.replace("\n           ", " ")
    assert command(tmp_path, "--serial", "GOLD-1") == 0  # a real run
    assert "Station  the bench is fit to judge units for 24 h" in capsys.readouterr().out
    (folder,) = tmp_path.glob("*gold-1")
    assert open_session(folder).input_path("station").read_bytes() == EXAMPLE.read_bytes()
    assert "approver: A. Quality" in (folder / "report.html").read_text("utf-8")
    assert command(tmp_path, "--serial", "nothing of ours") == 2
    assert "no part of this station has such a serial number" in capsys.readouterr().err
    in_store(tmp_path, "ETB-0001")
    assert command(tmp_path, "--serial", "ETB-0001") == 2
    assert "judged already" in capsys.readouterr().err
    in_store(tmp_path, "GOLD-1", stiction=0.2)
    assert command(tmp_path, "--serial", "ETB-0002") == 3
    assert main(["station", str(EXAMPLE), "--out", str(tmp_path)]) == 3
    assert "NOT FIT   the golden unit came out wrong" in capsys.readouterr().out


def test_a_golden_unit_that_came_out_wrong_is_the_bench_s_fault_in_every_word(tmp_path, capsys):
    path = written(tmp_path, ("T_c: {value: 145 mN·m", "T_c: {value: 160 mN·m"))
    words = ["run", "--station", str(path), "--out", str(tmp_path / "s"), "--yes", "--serial", "GOLD-1"]
    assert main([*words, "--json", str(tmp_path / "g.json"), "--junit", str(tmp_path / "g.xml")]) == 3
    said = capsys.readouterr().out
    assert "BENCH FAULT - serial GOLD-1" in said
    assert "expected 0.160 within 0.006 N·m" in said
    results = result_from_dict(json.loads((tmp_path / "g.json").read_text("utf-8")))
    assert (results.exit_code, results.bench.reason_id) == (3, "golden_unit_wrong")
    assert results.unit.verdict is None
    assert 'failures="0" errors="1"' in (tmp_path / "g.xml").read_text("utf-8")


def test_nobody_overrides_a_station(tmp_path, capsys):
    for words in (["--limits", "dv_e5"], ["paper_step"], ["--bench", "virtual_fd"]):
        assert command(tmp_path, *words, "--serial", "ETB-0001") == 2
        assert "the station file decides on this" in capsys.readouterr().err
    assert command(tmp_path) == 2
    assert "wants a serial number" in capsys.readouterr().err


def test_a_station_file_beside_the_bench_file_is_found(tmp_path, capsys):
    bench = tmp_path / "bench.yaml"
    bench.write_text(find("bench", "virtual_classic").read_text("utf-8"), "utf-8")
    written(tmp_path, ("bench: virtual_classic", "bench: bench.yaml"))
    assert main(["run", "--bench", str(bench), "--out", str(tmp_path / "s"), "--serial", "nothing of ours"]) == 2
    assert "no part of this station" in capsys.readouterr().err


def test_tidying_deletes_what_need_not_be_kept(tmp_path, capsys):
    sessions, queue = tmp_path / "sessions", Queue(tmp_path / "sessions")
    old, new = session(sessions, "ETB-0001", "pass"), session(sessions, "ETB-0002", "pass")
    for made in (old, new):
        queue.add(made.read_results(), made.folder)
    assert queue.deliver(StoreAddress(sessions / STORE)).arrived == 2
    manifest = old.folder / "session.json"
    manifest.write_text(manifest.read_text("utf-8").replace(old.started, "2020-01-01T00:00:00+00:00"), "utf-8")
    main(["station", str(EXAMPLE), "--out", str(sessions)])
    assert f"expired   {old.folder.name}" in capsys.readouterr().out
    main(["station", str(EXAMPLE), "--out", str(sessions), "--tidy"])
    assert f"deleted   {old.folder.name}" in capsys.readouterr().out
    assert not old.folder.exists()
    assert new.folder.is_dir()


def test_a_run_that_cannot_be_read_keeps_units_out(tmp_path, capsys):
    in_store(tmp_path, "GOLD-1")
    unit = Unit(UnitVerdict.FAIL, "T_st_beyond_limit", serial="ETB-0001", part_number="default-throttle", revision="1")
    Queue(tmp_path).add(RunResult("failed", unit, Bench(BenchOutcome.OK)), tmp_path / "failed")
    (path,) = Queue(tmp_path).paths()
    path.write_text("{", "utf-8")
    assert command(tmp_path, "--serial", "ETB-0001") == 2
    said = capsys.readouterr().err
    assert "earlier runs cannot be read, so whether a unit may be tested is not known" in said
    assert "failed.json: must hold a run that waits for the store" in said
    assert main(["station", str(EXAMPLE), "--out", str(tmp_path)]) == 2
    assert "failed.json" in capsys.readouterr().err
    bench = find("bench", "virtual_classic")
    assert "earlier runs cannot be read" in survey(str(bench), EXAMPLE, tmp_path)["unfit"]
