"""`etb-hil explain`: a folder that takes no answer is found out first, and one that fills up costs no verdict."""

import errno
import os
from pathlib import Path

import pytest

from etb_hil.base.errors import InputError
from etb_hil.cli.main import main
from etb_hil.discrepancy.explain import Answer

FOUND = {"schema": "etb_hil/explanation/1", "verdict": "explained", "data_quality": ["a reason"], "confounded": []}
CAUSE = {"effect": "iron_loss", "class": ["viscous"], "share_of_error": 0.5}


@pytest.fixture
def table(tmp_path, monkeypatch):
    lines = ["time_s,motor_voltage_V,throttle_angle_deg"]
    lines += [f"{0.001 * k},{k % 7},{20 + k % 11}" for k in range(200)]
    (tmp_path / "data.csv").write_text("\n".join([*lines, ""]), "utf-8")
    monkeypatch.chdir(tmp_path)
    return "data.csv"


def _explained(*_, **__):
    return Answer({**FOUND, "causes": [CAUSE]})


@pytest.mark.parametrize("folder", ["/proc/foo", "data.csv", "data.csv/below", "/dev/null/x"])
def test_a_folder_that_takes_no_answer_is_refused_before_the_work(table, folder, monkeypatch, capsys):
    def begins(*_, **__):
        raise InputError("the long work began")

    monkeypatch.setattr("etb_hil.discrepancy.explain.explain", begins)
    assert main(["explain", table, "--model", "default", "--out", folder]) == 2
    said = capsys.readouterr().err
    assert "takes no answer" in said
    assert "--out" in said
    assert "the long work began" not in said


@pytest.mark.parametrize("writes", ["etb_hil.discrepancy.explain.write", "etb_hil.report.explain_report._page"])
def test_a_disk_that_is_full_costs_no_verdict(table, writes, monkeypatch, capsys):
    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("etb_hil.discrepancy.explain.explain", _explained)
    monkeypatch.setattr(writes, full)
    assert main(["explain", table, "--model", "default", "--out", "there"]) == 2
    said = capsys.readouterr()
    assert said.out.splitlines() == ["verdict: explained", "  a reason", "  iron_loss (or viscous): 50 % of the error"]
    assert "there" in said.err
    assert "No space left on device" in said.err


def test_the_folder_is_made_with_all_above_it(table, monkeypatch):
    monkeypatch.setattr("etb_hil.discrepancy.explain.explain", lambda *_, **__: Answer({**FOUND, "causes": []}))
    assert main(["explain", table, "--model", "default", "--out", "not/there/yet"]) == 0
    assert {path.name for path in Path("not/there/yet").iterdir()} == {"explanation.json", "explanation.html"}
