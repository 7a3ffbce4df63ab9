"""Files of a run for a CI server, without a run: what is taken away, written, and held against a baseline."""

import argparse
import json
import os
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from etb_hil.base.errors import InputError
from etb_hil.base.outcome import BenchOutcome, ExitCode, UnitVerdict
from etb_hil.cli.ci_output import CiOutput, add_ci_arguments, held_against
from etb_hil.results.measurement import Measurement, Measurements
from etb_hil.results.run_result import Bench, RunResult, Unit
from etb_hil.session.baseline import Comparison

AGREES, DIFFERS, UNKNOWN = (Comparison("T_st", "1 N·m", "1 N·m", agrees=agrees) for agrees in (True, False, None))


def output(json_file=None, junit=None):
    return CiOutput(argparse.Namespace(json=json_file, junit=junit))


def results(value=0.2, unit="N·m", verdict=UnitVerdict.PASS):
    measured = Measurements([Measurement("T_st", "break-away friction", value, unit)])
    return RunResult("run", Unit(verdict), Bench(BenchOutcome.OK), measurements=measured, exit_code=0)


def test_the_options_of_a_ci_server_are_files_and_a_time():
    parser = argparse.ArgumentParser()
    add_ci_arguments(parser)
    given = parser.parse_args(["--json", "-", "--junit", "j.xml", "--baseline", "b.yaml", "--timeout", "1.5"])
    assert (given.json, given.junit, given.baseline) == (Path("-"), Path("j.xml"), Path("b.yaml"))
    assert given.timeout == 1.5
    assert set(vars(parser.parse_args([])).values()) == {None}


@pytest.mark.parametrize(
    ("comparisons", "code", "expected", "said"),
    [
        ([], ExitCode.DONE, ExitCode.DONE, ""),
        ([AGREES, AGREES], ExitCode.DONE, ExitCode.DONE, "  Baseline all 2 expectations met\n"),
        ([AGREES, DIFFERS], ExitCode.DONE, ExitCode.INCONCLUSIVE, f"  Baseline {DIFFERS}\n"),
        ([DIFFERS], ExitCode.UNIT_FAILED, ExitCode.UNIT_FAILED, f"  Baseline {DIFFERS}\n"),
        ([UNKNOWN], ExitCode.DONE, ExitCode.INCONCLUSIVE, f"  Baseline {UNKNOWN}\n"),
        ([UNKNOWN], ExitCode.ABORTED, ExitCode.ABORTED, f"  Baseline {UNKNOWN}\n"),
        (
            [UNKNOWN, AGREES],
            ExitCode.DONE,
            ExitCode.DONE,
            f"  Baseline {UNKNOWN}\n  Baseline all 1 expectations met\n",
        ),
    ],
)
def test_a_difference_makes_a_pass_inconclusive_and_nothing_else(comparisons, code, expected, said, capsys):
    assert held_against(comparisons, code) is expected
    assert capsys.readouterr().out == said


@pytest.mark.parametrize(("value", "unit", "code"), [(0.2, "N·m", 0), (0.3, "N·m", 4), (0.2, "A", 4)])
def test_results_are_written_whatever_the_baseline_says(value, unit, code, tmp_path, capsys):
    baseline, told, junit = (tmp_path / name for name in ("b.yaml", "r.json", "j.xml"))
    baseline.write_text("schema: etb_hil/baseline/1\nnumbers: {T_st: {value: 0.2 N·m, tolerance: 5 %}}\n", "utf-8")
    out = output(told, junit)
    out.read_baseline(baseline)
    assert out.add(results(value, unit)) == code
    assert json.loads(told.read_text("utf-8"))["unit"]["verdict"] == "pass"
    failing = [case.get("name") for case in ET.parse(junit).iter("testcase") if case.find("failure") is not None]  # noqa: S314
    assert failing == (["baseline T_st"] if code else [])
    assert out.add(results(value, unit)) == code
    assert len(ET.parse(junit).getroot()) == 2  # noqa: S314
    assert "Baseline" in capsys.readouterr().out


def test_json_on_standard_output_leaves_words_to_standard_error(tmp_path, capsys):
    baseline = tmp_path / "b.yaml"
    baseline.write_text("schema: etb_hil/baseline/1\nnumbers: {T_st: {value: 0.1 N·m, tolerance: 5 %}}\n", "utf-8")
    out = output(json_file=Path("-"))
    assert out.owns_standard_output
    assert out.files == []
    out.read_baseline(baseline)
    assert out.add(results()) == 4
    said, words = capsys.readouterr()
    assert json.loads(said)["run_id"] == "run"
    assert "Baseline T_st: expected 0.1" in words
    assert not output(tmp_path / "r.json").owns_standard_output


def test_a_file_that_cannot_be_written_after_a_run_is_said_and_the_code_stays(tmp_path, capsys):
    assert output(tmp_path / "gone" / "r.json").add(results()) == 0
    assert "make room, then take the results from the session" in capsys.readouterr().err


def test_what_an_earlier_run_left_is_gone_once_the_inputs_are_checked(tmp_path):
    told, junit, target = tmp_path / "r.json", tmp_path / "j.xml", tmp_path / "target"
    target.write_text("of yesterday", "utf-8")
    told.symlink_to(target)
    out = output(told, junit)
    with out.checking():
        assert target.exists()
    assert told.is_symlink()
    assert not target.exists()
    assert not junit.exists()


def test_a_refused_run_takes_away_only_what_a_run_wrote(tmp_path):
    told, junit = tmp_path / "r.json", tmp_path / "j.xml"
    out = output(told, junit)

    def refused():
        with out.checking():
            raise InputError

    others = ("", "{}", "<?xml version='1.0'?><other/>", '<testsuites name="etb-hil"/>', '{"run_id": 1')
    for text in others:
        for path in (told, junit):
            path.write_text(text, "utf-8")
        with pytest.raises(InputError):
            refused()
        assert told.read_text("utf-8") == junit.read_text("utf-8") == text
    out.add(results())
    with pytest.raises(InputError):
        refused()
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(InputError):
        refused()


@pytest.mark.parametrize(
    ("name", "said"),
    [("folder", "folder: cannot be written: Is a directory"), ("pipe", "pipe: must be a regular file"),
     ("gone/r.json", "gone: no such folder; create it")],
)  # fmt: skip
def test_a_place_that_takes_no_file_is_refused_before_a_run(name, said, tmp_path):
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match=said), output(tmp_path / name).checking():
        pass
    assert sorted(path.name for path in tmp_path.iterdir()) == ["folder", "pipe"]
