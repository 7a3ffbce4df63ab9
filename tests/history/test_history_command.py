"""`etb-hil history`: stores and sessions say the same, tables hold what the screen shows, bad sources are refused."""

import csv
import json
import subprocess
import sys
from dataclasses import replace

import made_up
import numpy as np
import pytest

from etb_hil.base.outcome import BenchOutcome, UnitVerdict
from etb_hil.base.stock import find
from etb_hil.cli.main import main
from etb_hil.histories.history import histories
from etb_hil.histories.runs import read_runs
from etb_hil.histories.tables import write_tables
from etb_hil.report.history_page import write_history_page
from etb_hil.report.history_plot import plot_history
from etb_hil.report.history_temperature_plot import plot_over_temperature
from etb_hil.report.history_text import history_text
from etb_hil.results.measurement import Measurement, Measurements
from etb_hil.results.run_result import Bench, RunResult, Unit
from etb_hil.session.session import create
from etb_hil.store.address import QUEUE, STORE, StoreAddress, sessions_among
from etb_hil.store.queue import Queue
from etb_hil.store.run import Measured


def results(session, value):
    measured = {"T_st": value, "temperature": 21.0, "T_c": None}
    return RunResult(
        session.run_id,
        Unit(UnitVerdict.PASS, "within_limits", serial="A1", part_number="p", revision="1"),
        Bench(BenchOutcome.OK, "finished", name="b"),
        started=session.started,
        scenario=session.scenario,
        duration_s=1.0,
        exit_code=0,
        measurements=Measurements(Measurement(name, name, one, "N·m") for name, one in measured.items()),
    )


@pytest.fixture
def sessions(tmp_path):
    for value in (0.17, 0.18):
        session = create(tmp_path, "Friction check", "A1", {"scenario": find("scenario", "friction_check")})
        session.write_results(results(session, value))
        Queue(tmp_path).add(results(session, value), session.folder)
    Queue(tmp_path).deliver(StoreAddress(tmp_path / STORE))
    create(tmp_path, "killed", "", {"scenario": find("scenario", "friction_check")})
    return tmp_path


def test_store_and_sessions_say_the_same(sessions):
    from_store, _ = read_runs([sessions / STORE])
    together, notes = read_runs([sessions])
    (sessions / STORE).unlink()
    from_sessions, _ = read_runs([sessions])
    assert from_store == from_sessions == together
    assert [run.numbers["T_st"].value for run in together] == [0.17, 0.18]
    assert together[0].temperature == 21.0
    assert "T_c" not in together[0].numbers
    assert notes == ["1 sessions have no results: replay them to have them counted"]


def test_what_a_shell_makes_of_all_in_the_folder_says_the_same(sessions, capsys):
    assert main(["history", str(sessions)]) == 0
    of_folder = capsys.readouterr().out
    for kept in (f"{STORE}-wal", f"{STORE}-shm"):
        (sessions / kept).touch()
    named = sorted(sessions.glob("*"))
    assert {STORE, QUEUE} < {path.name for path in named}
    assert main(["history", *map(str, named)]) == 0
    histories_said = [said.partition("\nnote:")[0] for said in (capsys.readouterr().out, of_folder)]
    assert histories_said[0] == histories_said[1]
    assert [path.name for path in sessions_among(named)] == [path.name for path in named if path.is_dir()][:-1]
    stored = [str(sessions / STORE), str(sessions / QUEUE)]
    assert sessions_among(stored) == stored
    assert sessions_among(stored, or_store=True) == stored[:1]


def test_the_command(sessions, tmp_path, capsys):
    assert main(["history", str(sessions), "--out", str(tmp_path / "out")]) == 0
    shown = capsys.readouterr().out
    assert "Runs 2, units 1, benches 1; runs that count 2" in shown
    assert max(map(len, shown[: shown.index("note:")].splitlines())) <= 80
    written = {path.name for path in (tmp_path / "out").iterdir()} - {"history.parquet"}  # which needs an extra
    assert written == {"history.html", "history.csv", "history.json", "history.png"}


def test_tables_hold_every_run(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet", reason="the extra `history` is not installed")
    runs = made_up.production(8, 12, coefficient=-0.003, warm=30.0, benches=("x", "y"))
    runs.append(made_up.run(999, "<b>\x1b[2J" * 9, 0.2, bench_outcome="fault", verdict=None))
    found = histories(runs)
    write_tables(found, tmp_path)
    with (tmp_path / "history.csv").open(encoding="utf-8", newline="") as file:
        from_csv = list(csv.DictReader(file))
    from_parquet = parquet.read_table(tmp_path / "history.parquet").to_pylist()
    assert [row["run_id"] for row in from_csv] == [run.run_id for run in runs]
    for text, row, run in zip(from_csv, from_parquet, runs, strict=True):
        assert float(text["T_st"]) == row["T_st"] == run.numbers["T_st"].value
        assert (text["T_st_20_degC"] == "") == (row["T_st_20_degC"] is None) == (not run.counts)
    said = json.loads((tmp_path / "history.json").read_text("utf-8"))
    number = said["parts"][0]["numbers"][0]
    assert number["temperature"]["low"] < -0.003 < number["temperature"]["high"]
    assert number["gauge"]["units"] == 12
    assert len(number["control_chart"]["values"]) == 12


def test_tables_hold_scenarios_that_measure_different_things(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet", reason="the extra `history` is not installed")
    check, more = made_up.run(1, "U1", 0.17), made_up.run(2, "U1", 0.17, scenario="End of line")
    more = replace(more, numbers=more.numbers | {"step_delay_small_opening": Measured(0.02, 0.019, 0.021, None, 0.031)})
    for runs in ([check, more], [more, check]):
        write_tables(histories(runs), tmp_path)
        with (tmp_path / "history.csv").open(encoding="utf-8", newline="") as file:
            from_csv = {row["scenario"]: row["step_delay_small_opening"] for row in csv.DictReader(file)}
        rows = parquet.read_table(tmp_path / "history.parquet").to_pylist()
        assert from_csv == {"Friction check": "", "End of line": "0.02"}
        assert {row["scenario"]: row["step_delay_small_opening"] for row in rows} == {
            "Friction check": None,
            "End of line": 0.02,
        }


def test_what_few_runs_do_not_tell_is_said_once():
    text = history_text(histories([made_up.run(k, f"U{k}", 0.17) for k in range(2)])[0], 20)
    assert text.count("Control chart") == text.count("Gauge R&R") == text.count("Drift") == 1
    assert text.index("Not enough runs for") < text.index(
        "Control chart  no limits from fewer than 8 units; there are 2."
    )
    assert "Break-away friction (T_st)" not in text
    assert "Not enough runs for" not in history_text(
        histories(made_up.production(9, 30, warm=30.0, benches=("x", "y")))[0], 5
    )


def test_text_is_plain_and_narrow():
    runs = made_up.production(9, 30, coefficient=-0.003, warm=30.0, benches=("x", "y"))
    text = history_text(histories(runs)[0], 5)
    assert "Cpk" in text
    assert "Cp is undefined: there is no lower limit" in " ".join(text.split())
    runs += [made_up.run(900 + k, "\x1b[31m" * 20, 0.17 + 0.004 * k) for k in range(12)]
    text = history_text(histories(runs)[0], 500)
    assert max(map(len, text.splitlines())) <= 80
    assert "\x1b" not in text
    for word in ("%/K", "NOT IN CONTROL", "Distribution", "distinct categories", "ALARM: unit"):
        assert word in text


def test_a_history_of_nothing_is_drawn(tmp_path):
    plot_history(histories([made_up.run(1, "", 0.17, verdict=None, bench_outcome="fault")])[0], tmp_path / "a.png")
    plot_history(histories(made_up.golden(1, 12))[0], tmp_path / "b.png")
    assert (tmp_path / "b.png").stat().st_size > (tmp_path / "a.png").stat().st_size > 1000


def test_the_time_axis_of_a_single_run_is_an_hour_about_it(tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr("etb_hil.report.history_plot.save_png", lambda figure, _: drawn.append(figure))
    plot_history(histories([made_up.run(1, "A1", 0.17)])[0], tmp_path / "a.png")
    plot_history(histories(made_up.golden(1, 12))[0], tmp_path / "b.png")
    spans = [
        [np.ptp(axes.get_xlim()) for axes in figure.axes if axes.get_label().endswith(" time")] for figure in drawn
    ]
    assert spans[0] == pytest.approx([1.0 / 24.0] * len(spans[0]))
    assert all(22.0 / 24.0 < days < 30.0 / 24.0 for days in spans[1])
    assert any("units so far: 1 of the 8" in text.get_text() for axes in drawn[0].axes for text in axes.texts)


def test_friction_over_temperature_is_drawn_where_its_law_is_known(tmp_path):
    alike = histories(made_up.production(3, 8))[0]
    assert not plot_over_temperature(alike, tmp_path / "none.png")
    assert not (tmp_path / "none.png").exists()
    runs = made_up.production(3, 8, coefficient=-0.003, warm=30.0)
    runs.append(made_up.run(900, "", 0.17, temperature=None))
    assert plot_over_temperature(histories(runs)[0], tmp_path / "law.png")
    assert (tmp_path / "law.png").stat().st_size > 1000


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda folder: folder / "nowhere", "no such file or folder"),
        (lambda folder: folder, "there is no finished run"),
        (lambda folder: _written(folder / "a.db", b"no database" * 99), "must be a store of results: file is not"),
        (lambda folder: _written(folder / "empty.db", b""), "must be a store of results"),
    ],
)
def test_what_is_no_source(make, words, tmp_path, capsys):
    assert main(["history", str(make(tmp_path))]) == 2
    assert words in capsys.readouterr().err


def _written(path, content):
    path.write_bytes(content)
    return path


@pytest.mark.parametrize(("serial", "written"), [("=1+1", "'=1+1"), ("@SUM(A1)", "'@SUM(A1)"), ("A-1", "A-1")])
def test_a_serial_number_is_no_formula(tmp_path, serial, written):
    write_tables(histories([made_up.run(1, serial, 0.17)]), tmp_path)
    with (tmp_path / "history.csv").open(encoding="utf-8", newline="") as file:
        assert next(csv.DictReader(file))["serial"] == written


def test_without_scipy_the_command_says_how_to_get_it(tmp_path):
    code = "import sys; sys.modules['scipy'] = None; from etb_hil.cli.main import main; sys.exit(main(['history']))"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (2, "scipy is not installed; pip install 'etb-hil[history]'\n")


def test_a_damaged_session_costs_itself_alone(sessions, capsys):
    (sessions / STORE).unlink()
    first, second = sorted(path.parent for path in sessions.glob("*/results.json"))
    (first / "session.json").write_text("{")
    runs, notes = read_runs([sessions])
    assert [run.run_id for run in runs] == [second.name]
    assert any(note.startswith("left out: ") and str(first) in note for note in notes)
    assert main(["history", str(sessions)]) == 0
    assert f"{first}" in capsys.readouterr().out
    assert main(["history", str(first)]) == 2  # it alone was asked for


@pytest.mark.parametrize("words", [["--latest", "0"], ["--latest", "-1"], ["--rows", "0"], ["--since", "yesterday"]])
def test_an_invalid_selection_is_refused(sessions, capsys, words):
    assert main(["history", str(sessions), *words]) == 2
    assert words[0].removeprefix("--") in capsys.readouterr().err


@pytest.mark.parametrize("bench_apart", [0.0, 0.05])
def test_a_gauge_whose_repeats_do_not_scatter_has_no_verdict(bench_apart, tmp_path):
    """Values of 10 mN·m: three runs of a unit are equal, and nobody knows how far the gauge scatters below that."""
    runs = [
        made_up.run(3 * (2 * k + j) + trial, f"G{k}", 0.1 + 0.01 * k + bench_apart * j, bench=bench)
        for k in range(10)
        for j, bench in enumerate("AB")
        for trial in range(3)
    ]
    history = histories(runs)[0]
    write_tables([history], tmp_path)
    found = json.loads((tmp_path / "history.json").read_text("utf-8"))["parts"][0]["numbers"][0]["gauge"]
    text = " ".join(history_text(history, 5).split())
    page = write_history_page([history], tmp_path / "history.html", 5).read_text("utf-8")
    for shown in (text, page):
        assert "Repeats do not scatter: the resolution of the values hides the scatter of the gauge." in shown
    if bench_apart:
        assert found["verdict"] == "unsuitable"
        assert "This gauge is UNSUITABLE (good: below 10 %; usable: at least 5 categories, or at most 27 %)." in text
        return
    assert (found["verdict"], found["categories"], found["gauge"]) == ("unknown", None, 0.0)
    assert "UNSUITABLE" not in text
    assert "distinct categories" not in text
    assert "gauge unknown" in page


def test_values_that_do_not_scatter_are_in_control():
    runs = [made_up.run(k, f"U{k}", 0.3) for k in range(11)]
    text = " ".join(history_text(histories(runs)[0], 5).split())
    assert "in control by Nelson's rules" in text
    assert "NOT IN CONTROL" not in text
    assert "Distribution unknown: the values do not scatter." in text


@pytest.mark.parametrize(("serials", "units"), [(("", "", ""), 3), (("A1", "", "A1", ""), 3), (("A1", "A2", "A1"), 2)])
def test_a_run_without_a_serial_number_counts_as_a_unit_of_its_own(tmp_path, serials, units):
    (history,) = histories([made_up.run(k, serial, 0.15 + 0.001 * k) for k, serial in enumerate(serials)])
    assert f"Runs {len(serials)}, units {units}, benches 1" in history_text(history, 5)
    assert history.units == units == len(history.numbers[0].charted)
    page = write_history_page([history], tmp_path / "history.html", 5).read_text("utf-8")
    assert f"Runs {len(serials)}, units {units}, benches 1" in page
