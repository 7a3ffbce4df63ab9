"""`etb-hil plot`: one command draws a session, a vehicle's log and a table from another rig."""

import os
from pathlib import Path

import pytest

from etb_hil.base.stock import find
from etb_hil.cli.main import main

CHECKOUT = Path(__file__).resolve().parents[2]
EXAMPLES = CHECKOUT / "docs" / "examples"
DATA = Path(os.environ.get("ETB_HIL_REAL_DATA", CHECKOUT.parent / "shared" / "data"))
PNG = b"\x89PNG\r\n"
TABLE = "t_s,throttle_angle_deg,motor_current_A\n0,1,0.5\n1,2,0.25\n2,3,nan\n"

needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="no measured data beside the checkout (ETB_HIL_REAL_DATA)")


def test_a_table_is_drawn_beside_the_reader(tmp_path, monkeypatch, capsys):
    (tmp_path / "rig.csv").write_text(TABLE)
    monkeypatch.chdir(tmp_path)
    assert main(["plot", "rig.csv"]) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[0].split() == ["throttle_angle", "3", "samples", "in", "2.0", "s,", "1", "to", "3", "deg"]
    assert said[1].split() == ["motor_current", "3", "samples", "in", "2.0", "s,", "0.25", "to", "0.5", "A"]
    assert said[-1] == "rig.svg"
    assert (tmp_path / "rig.svg").read_text("utf-8").startswith("<svg")


@pytest.mark.parametrize(
    "words",
    [
        ["plot", "rig.csv", "--out", "rig.csv"],
        ["plot", "rig.csv", "--map", "map.svg", "--out", "./map.svg"],
        ["simulate", "--voltage", "rig.csv", "--out", "rig.csv"],
        ["simulate", "--unit", "default", "--voltage", "rig.csv", "--map", "map.csv", "--out", "map.csv"],
        ["export", "log.asc", "own.csv", "--dbc", "own.csv"],
        ["export", "log.asc", "log.asc"],
        ["controller", "--unit", "unit.yaml", "--bench", "vcan_classic", "--log", "unit.yaml"],
    ],
)
def test_no_command_writes_over_what_it_reads(words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    unit = find("model", "default").read_text("utf-8")
    texts = {"rig.csv": TABLE, "map.svg": "", "map.csv": "", "log.asc": "", "own.csv": "", "unit.yaml": unit}
    for name, text in texts.items():
        Path(name).write_text(text, "utf-8")
    assert main(words) == 2
    assert "is read here, and the output would take its place; give" in capsys.readouterr().err
    assert {path.name: path.read_text("utf-8") for path in tmp_path.iterdir()} == texts


@needs_data
def test_a_vehicles_log_by_a_bench_file_that_only_listens(tmp_path, capsys):
    bench, passat = tmp_path / "passat.bench.yaml", DATA / "can_passat"
    bench.write_text((EXAMPLES / "passat.bench.yaml").read_text("utf-8"), "utf-8")
    (tmp_path / "vw_pq.dbc").symlink_to(passat / "vw_pq.dbc")
    page = tmp_path / "passat.png"
    assert main(["plot", str(passat / "passat-idling.trc"), "--bench", str(bench), "--out", str(page)]) == 0
    said = capsys.readouterr().out
    for role in ("pedal_position", "throttle_opening", "engine_speed"):
        assert role in said
    assert page.read_bytes().startswith(PNG)


@needs_data
def test_another_rigs_table_by_its_map(tmp_path, capsys):
    table, map_file = DATA / "etb_tbcp" / "tbcp_open_loop_duty_staircase.csv", EXAMPLES / "etb_tbcp.map.yaml"
    page = tmp_path / "sweep.png"
    words = ["plot", str(table), "--map", str(map_file), "--roles", "throttle_position", "motor_duty"]
    assert main([*words, "--out", str(page)]) == 0
    said = capsys.readouterr().out
    assert "45032 samples in 496.3 s, 0.25 to 3.1 V" in said
    assert "note: 68 rows had the time of the row before" in said
    assert "pwm_frequency" not in said
    assert page.read_bytes().startswith(PNG)


def test_what_cannot_be_drawn_is_said(tmp_path, capsys):
    log, table = tmp_path / "drive.trc", tmp_path / "rig.csv"
    log.write_text("")
    table.write_text(TABLE)
    for words, expected in (
        ([str(log)], "must have a suffix of a table (it is '.trc')"),
        ([str(log)], "of a CAN log, --bench (bench=) says which signal is which role"),
        ([str(log), "--bench", str(find("bench", "virtual_classic"))], "drive.trc"),
        ([str(table), "--roles", "temperature"], "no signal for the role 'temperature'"),
        ([str(table), "--out", str(tmp_path / "nowhere" / "x.png")], "cannot be written: No such file"),
        ([str(tmp_path / "gone.csv")], "gone.csv"),
    ):
        assert main(["plot", *words]) == 2
        assert expected in capsys.readouterr().err
