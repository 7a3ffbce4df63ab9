"""`etb-hil explain`: a folder that takes no answer is found out first, and one that fills up costs no verdict."""

import errno
import json
import os
from pathlib import Path

import pytest

from etb_hil.base.errors import InputError
from etb_hil.base.stock import find
from etb_hil.cli.main import main
from etb_hil.discrepancy.explain import Answer, write
from etb_hil.results.explanation_file import explanation_from_dict

FOUND = {"schema": "etb_hil/explanation/3", "verdict": "explained", "data_quality": ["a reason"], "confounded": []}
CAUSE = {
    "id": "iron_loss",
    "not_isolable_from": ["viscous"],
    "share_of_error": 0.5,
    "probability": 1.0,
    "parameters": {},
}


@pytest.fixture
def table(tmp_path, monkeypatch):
    lines = ["time_s,motor_voltage_V,throttle_angle_deg"]
    lines += [f"{0.001 * k},{k % 7},{20 + k % 11}" for k in range(200)]
    (tmp_path / "data.csv").write_text("\n".join([*lines, ""]), "utf-8")
    monkeypatch.chdir(tmp_path)
    return "data.csv"


def _explained(*_, **__):
    return Answer(explanation_from_dict({**FOUND, "causes": [CAUSE]}))


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
    assert said.out.splitlines() == [
        "verdict: explained",
        "  The causes below explain the errors of the model.",
        "  a reason",
        "  iron loss or viscous friction: 50 % of the error",
    ]
    assert "there" in said.err
    assert "No space left on device" in said.err


def test_the_folder_is_made_with_all_above_it(table, monkeypatch):
    monkeypatch.setattr("etb_hil.discrepancy.explain.explain", lambda *_, **__: Answer(explanation_from_dict(FOUND)))
    assert main(["explain", table, "--model", "default", "--out", "not/there/yet"]) == 0
    assert {path.name for path in Path("not/there/yet").iterdir()} == {"explanation.json", "explanation.html"}


def test_an_earlier_answer_is_kept_where_no_folder_is_named(table, monkeypatch):
    monkeypatch.setattr("etb_hil.discrepancy.explain.explain", lambda *_, **__: Answer(explanation_from_dict(FOUND)))
    for _ in range(3):
        assert main(["explain", table, "--model", "default"]) == 0
    folders = [Path("explanation"), Path("explanation_2"), Path("explanation_3")]
    assert all((folder / "explanation.html").is_file() for folder in folders)


def _refused(words, capsys, monkeypatch):
    monkeypatch.setattr("etb_hil.discrepancy.explain.explain", _explained)
    assert main(["explain", *words]) == 2
    return capsys.readouterr().err


@pytest.mark.parametrize(("option", "name"), [("--model", "model.yaml"), ("--map", "next_test.yaml")])
@pytest.mark.parametrize("is_answers", [False, True])
def test_no_file_that_is_read_is_written_over(table, option, name, is_answers, monkeypatch, capsys):
    text = find("model", "default").read_text("utf-8")
    Path(name).write_text(text, "utf-8")
    if is_answers:
        Path("explanation.json").write_text(json.dumps(FOUND), "utf-8")
    model = [] if option == "--model" else ["--model", "default"]
    said = _refused([table, option, name, *model, "--out", "."], capsys, monkeypatch)
    assert f"{name}: is read here, and the output would take its place; give another folder with --out" in said
    assert Path(name).read_text("utf-8") == text


@pytest.mark.parametrize("name", ["model.yaml", "next_test.yaml", "explanation.html", "torque_over_time.png"])
@pytest.mark.parametrize("beside", [None, "{", "[]", '{"schema": "mine/1"}'])
def test_other_peoples_files_are_not_written_over(table, name, beside, monkeypatch, capsys):
    Path("there").mkdir()
    Path("there", name).write_text("mine", "utf-8")
    if beside is not None:
        Path("there/explanation.json").write_text(beside, "utf-8")
    said = _refused([table, "--model", "default", "--out", "there"], capsys, monkeypatch)
    assert name in said
    assert "no answer that an explanation wrote" in said
    assert Path("there", name).read_text("utf-8") == "mine"
    if name in ("model.yaml", "next_test.yaml"):
        with pytest.raises(InputError, match="no answer"):
            write(_explained(), Path("there"))


def test_an_answers_own_folder_is_written_again(table, monkeypatch):
    monkeypatch.setattr("etb_hil.discrepancy.explain.explain", lambda *_, **__: Answer(explanation_from_dict(FOUND)))
    for _ in range(2):
        assert main(["explain", table, "--model", "default", "--out", "there"]) == 0
        assert not Path("there/model.yaml").exists()
        Path("there/model.yaml").write_text("an earlier answer's", "utf-8")


def test_files_that_somebody_puts_there_meanwhile_cost_no_verdict(table, monkeypatch, capsys):
    def meanwhile(*_, **__):
        Path("there").mkdir()
        Path("there/model.yaml").write_text("mine", "utf-8")
        return _explained()

    monkeypatch.setattr("etb_hil.discrepancy.explain.explain", meanwhile)
    assert main(["explain", table, "--model", "default", "--out", "there"]) == 2
    assert "verdict: explained" in capsys.readouterr().out
    assert Path("there/model.yaml").read_text("utf-8") == "mine"
