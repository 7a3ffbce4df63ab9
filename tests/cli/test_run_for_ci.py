"""What CI reads of a run: JUnit, JSON against its schema, a baseline, a time-out, exit codes."""

import argparse
import io
import json
import os
import signal
import subprocess
import sys
import time
import xml.etree.ElementTree as ET
from dataclasses import replace

import jsonschema
import pytest
import yaml

from etb_hil.base.errors import InputError
from etb_hil.base.plugins import remove_file
from etb_hil.base.stock import find
from etb_hil.bench.job import JobFiles, execute, prepare
from etb_hil.cli.ci_output import CiOutput
from etb_hil.cli.main import main
from etb_hil.cli.time_limit import TimeLimit
from etb_hil.results.json_file import result_from_dict, results_schema
from etb_hil.results.measurement import Measurement, Measurements
from etb_hil.session.analysis import Analysis
from etb_hil.session.baseline import baseline_text, compare, load_baseline

SHORT = """schema: etb_hil/scenario/1
name: short
phases:
  - {id: zero, kind: current_zero, duration: 0.3 s}
  - {id: held, kind: hold, position: 30 deg, duration: 60 s}
"""


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    """Run the friction check once on a healthy unit, with everything that CI can ask for."""
    folder = tmp_path_factory.mktemp("good")
    command = ["run", "--serial", "CI-1", "--seed", "7", "--yes", "--out", str(folder / "sessions")]
    assert main([*command, "--junit", str(folder / "run.xml"), "--json", str(folder / "results.json")]) == 0
    return folder


@pytest.fixture
def results(good):
    return result_from_dict(json.loads((good / "results.json").read_text()))


def written(tmp_path, text):
    path = tmp_path / "baseline.yaml"
    path.write_text(text)
    return path


def test_results_are_as_the_published_schema_says(good):
    results = json.loads((good / "results.json").read_text())
    schema = results_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.validate(results, schema)
    assert not undocumented(results, schema, schema["$defs"])
    (session,) = good.glob("sessions/*/results.json")
    assert json.loads(session.read_text()) == results
    assert (results["seed"], results["scenario"], results["model"]) == (
        7,
        "Friction check",
        "default throttle",
    )


def undocumented(value, schema, definitions):
    """Return keys of a file that its schema does not name."""
    if "$ref" in schema:
        schema = definitions[schema["$ref"].rsplit("/", 1)[-1]]
    for member in schema.get("anyOf", []):
        if "$ref" in member and isinstance(value, dict):
            return undocumented(value, member, definitions)
    if isinstance(value, list):
        return [name for entry in value for name in undocumented(entry, schema["items"], definitions)]
    if not isinstance(value, dict) or "properties" not in schema:
        return []
    found = [name for name in value if name not in schema["properties"]]
    known = [name for name in value if name in schema["properties"]]
    return found + [n for name in known for n in undocumented(value[name], schema["properties"][name], definitions)]


def test_junit_of_a_real_run(good):
    (suite,) = ET.parse(good / "run.xml").getroot()  # noqa: S314 (our own)
    assert (suite.get("failures"), suite.get("errors"), suite.get("skipped")) == ("0", "0", "0")
    told = {entry.get("name"): entry.get("value") for entry in suite.iter("property")}
    assert (told["serial"], told["seed"], told["bus_state"], told["lost_frames"]) == ("CI-1", "7", "error-active", "0")
    assert 0.1 < float(told["bus_load_peak"]) < 0.8
    assert {case.get("name") for case in suite.iter("testcase")} == {"bench", "unit", "T_st", "T_c", "return_margin"}


def test_a_run_agrees_with_the_baseline_that_was_made_from_it(results, tmp_path):
    baseline = load_baseline(written(tmp_path, baseline_text(results, "made here")))
    found = compare(baseline, results)
    assert {"verdict", "T_st", "T_c"} <= {comparison.name for comparison in found}
    assert all(comparison.agrees for comparison in found)


@pytest.mark.parametrize(
    ("entry", "agrees"),
    [
        ("{value: 0.2 N·m, tolerance: 50 %}", True),
        ("{value: 200 mN·m, tolerance: 50 mN·m}", True),
        ("{value: 0.2 Nm, tolerance: 0.001 Nm}", False),
        ("{value: 0.2 N·m, tolerance: 1 %}", False),
    ],
)
def test_tolerances_are_shares_or_amounts(results, tmp_path, entry, agrees):
    path = written(tmp_path, f"schema: etb_hil/baseline/1\nnumbers:\n  T_st: {entry}\n")
    (found,) = compare(load_baseline(path), results)
    assert found.agrees is agrees
    assert "T_st: expected 0.2 N" in str(found) or "200 mN" in str(found)


def test_what_was_not_measured_does_not_agree(results, tmp_path):
    path = written(
        tmp_path, "schema: etb_hil/baseline/1\nverdict: fail\nnumbers:\n  gone: {value: 1, tolerance: 1 %}\n"
    )
    verdict, gone = compare(load_baseline(path), results)
    assert (verdict.found, verdict.agrees, gone.found, gone.agrees) == ("pass", False, "not measured", False)


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ("{value: 1 furlong, tolerance: 1 %}", "must have a known unit"),
        ("{value: 1 N·m, tolerance: 0 %}", "above 0"),
        ("{value: '1,5 N·m', tolerance: 0.1 N·m}", "decimal point, for instance '1.5 N·m'"),
        ("{value: 1 N·m, tolerance: 1 V}", "must be a unit of torque .got 'V'"),
        ("{value: 1 A, tolerance: 1 %}", "is measured in N·m"),
    ],
)
def test_a_wrong_baseline_is_bad_input(results, tmp_path, entry, words):
    path = written(tmp_path, f"schema: etb_hil/baseline/1\nnumbers:\n  T_st: {entry}\n")
    with pytest.raises(InputError, match=words) as caught:
        compare(load_baseline(path), results)
    assert "baseline.yaml:3: numbers.T_st" in str(caught.value)


def test_only_the_baseline_disagreeing_is_inconclusive(good, tmp_path, capsys):
    (session,) = (path.parent for path in good.glob("sessions/*/session.json"))
    path = tmp_path / "baseline.yaml"
    assert main(["baseline", str(session), "--out", str(path)]) == 0
    assert main(["baseline", str(session), "--out", str(path)]) == 2  # not written over
    expected = yaml.safe_load(path.read_text())
    expected["numbers"] = {"T_st": {"value": "0.1 N·m", "tolerance": "1 %"}}
    path.write_text(yaml.safe_dump(expected, allow_unicode=True))
    code = main(["run", "--yes", "--out", str(tmp_path), "--baseline", str(path), "--junit", str(tmp_path / "j.xml")])
    assert code == 4
    assert "Baseline T_st: expected 0.1 N·m within 1 %, found 0.17" in capsys.readouterr().out
    cases = ET.parse(tmp_path / "j.xml").iter("testcase")  # noqa: S314
    failing = [case.get("name") for case in cases if case.find("failure") is not None]
    assert failing == ["baseline T_st"]


PEAK = """from etb_hil.plugins.measurements import Estimate, MeasurementKind


def compute(run):
    return Estimate(5.0, 4.9, 5.1)


MEASUREMENT = MeasurementKind(
    id="peak_current", name="peak current", unit="A", compute=compute, order=300, source="made up", too_high="x"
)
"""


@pytest.fixture
def with_plugin(tmp_path):
    """Write a bench file with a plug-in that measures in A, and a baseline that expects N·m of it."""
    plugin = tmp_path / "peak_current.py"
    plugin.write_text(PEAK, "utf-8")
    bench = tmp_path / "bench.yaml"
    bench.write_text(find("bench", "virtual_classic").read_text("utf-8") + f"plugins: [{plugin.name}]\n", "utf-8")
    numbers = "peak_current: {value: 1 N·m, tolerance: 5 %}"
    yield bench, written(tmp_path, f"schema: etb_hil/baseline/1\nnumbers:\n  {numbers}\n")
    remove_file(plugin)


def test_a_wrong_unit_of_what_a_plug_in_measures_is_refused_before_a_run(with_plugin, tmp_path, capsys):
    bench, baseline = with_plugin
    out = tmp_path / "sessions"
    assert main(["run", "--yes", "--bench", str(bench), "--baseline", str(baseline), "--out", str(out)]) == 2
    assert "peak_current is measured in A (it is '1 N·m'); correct the unit" in capsys.readouterr().err
    assert not out.exists()


def test_a_log_whose_bench_has_a_plug_in_is_held_against_a_baseline_as_a_run_is(good, with_plugin, capsys):
    (session,) = (path.parent for path in good.glob("sessions/*/session.json"))
    bench, baseline = with_plugin
    assert main(["replay", str(session / "raw.blf"), "--bench", str(bench), "--baseline", str(baseline)]) == 2
    said, words = capsys.readouterr()
    assert "peak_current is measured in A" in words
    assert "PASS" not in said


def test_results_are_written_whatever_unit_the_baseline_has(results, tmp_path):
    path = written(tmp_path, "schema: etb_hil/baseline/1\nnumbers:\n  own: {value: 1 N·m, tolerance: 5 %}\n")
    own = Measurement("own", "own", 1.0, "A", 0.9, 1.1)
    measured = Measurements([*results.measurements.values(), own])
    junit, told = tmp_path / "j.xml", tmp_path / "r.json"
    output = CiOutput(argparse.Namespace(junit=junit, json=told, baseline=path))
    output.read_baseline(path)
    assert output.add(replace(results, measurements=measured)) == 4
    assert json.loads(told.read_text())["unit"]["verdict"] == "pass"
    cases = ET.parse(junit).iter("testcase")  # noqa: S314
    assert [case.get("name") for case in cases if case.find("failure") is not None] == ["baseline own"]


def test_a_replay_is_held_against_a_baseline_as_a_run_is(good, tmp_path, capsys):
    (session,) = (path.parent for path in good.glob("sessions/*/session.json"))
    path = tmp_path / "baseline.yaml"
    assert main(["baseline", str(session), "--out", str(path)]) == 0
    log = [str(session / "raw.blf"), "--bench", "virtual_classic"]
    for source in ([str(session)], log):
        assert main(["replay", *source, "--baseline", str(path)]) == 0
        assert "expectations met" in capsys.readouterr().out
    path.write_text("schema: etb_hil/baseline/1\nnumbers:\n  T_st: {value: 0.1 N·m, tolerance: 1 %}\n")
    for source in ([str(session)], log):
        assert main(["replay", *source, "--baseline", str(path)]) == 4
        assert "Baseline T_st: expected 0.1 N·m within 1 %, found 0.17" in capsys.readouterr().out
    assert main(["replay", str(session), "--jobs", "1", "--baseline", str(path)]) == 2
    assert "--baseline does not go with --jobs" in capsys.readouterr().err
    assert main(["replay", str(session), "--baseline", str(tmp_path / "none.yaml")]) == 2


def test_a_queue_from_a_pipe_is_one_junit_file_in_plain_lines(tmp_path, monkeypatch, capfd):
    scenario = tmp_path / "short.yaml"
    scenario.write_text(SHORT.replace("60 s", "0.5 s"))
    monkeypatch.setattr(sys, "stdin", io.StringIO("A-1\n\nA-2\n"))
    junit = tmp_path / "j.xml"
    assert main(["run", str(scenario), "--batch", "--out", str(tmp_path), "--junit", str(junit)]) == 4
    out = capfd.readouterr().out
    assert "\x1b" not in out
    assert max(map(len, out.splitlines())) <= 200
    assert "Batch ended: 2 units: 2 inconclusive\n  inconclusive  A-1\n  inconclusive  A-2" in out
    assert [suite.get("name") for suite in ET.parse(junit).getroot()] == ["short - A-1", "short - A-2"]  # noqa: S314


def test_a_unit_that_was_judged_when_the_command_was_ended_is_in_the_tally(tmp_path, monkeypatch, capfd):
    scenario = tmp_path / "short.yaml"
    scenario.write_text(SHORT.replace("60 s", "0.5 s"))
    judge = Analysis.finish

    def struck(*arguments, **options):
        os.kill(os.getpid(), signal.SIGTERM)
        return judge(*arguments, **options)

    monkeypatch.setattr(Analysis, "finish", struck)
    monkeypatch.setattr(sys, "stdin", io.StringIO("A-1\nA-2\n"))
    assert main(["run", str(scenario), "--batch", "--out", str(tmp_path)]) == 5
    out, words = capfd.readouterr()
    assert "Batch ended: 1 unit: 1 inconclusive\n  inconclusive  A-1\n  not run       A-2" in out
    assert "SIGTERM came once the run was over; its results stand" in words


def test_files_of_an_earlier_run_are_gone_and_bad_places_refused_before_a_run(tmp_path, capsys):
    junit = tmp_path / "new" / "j.xml"
    junit.parent.mkdir()
    junit.write_text("of yesterday")
    assert main(["run", "no_such_scenario", "--junit", str(junit)]) == 2
    assert not junit.exists()
    assert main(["run", "--out", str(tmp_path / "s"), "--json", str(tmp_path)]) == 2
    assert "cannot be written: Is a directory" in capsys.readouterr().err
    assert not (tmp_path / "s").exists()


@pytest.mark.parametrize("option", ["--json", "--junit"])
@pytest.mark.parametrize("name", ["bench", "scenario", "model", "limits", "baseline", "unit", "plugin", "dbc"])
def test_a_file_that_a_run_reads_is_not_written_over(option, name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names = {kind: f"{kind}.yaml" for kind in ("bench", "scenario", "model", "limits", "baseline", "unit")}
    names |= {"plugin": "own_part.py", "dbc": "own.dbc"}
    bench = find("bench", "virtual_classic").read_text("utf-8").replace("dbc: etb_controller", "dbc: own.dbc")
    assert "own.dbc" in bench
    texts = {file: find("model", "default").read_text("utf-8") for file in names.values()}
    texts["bench.yaml"] = f"{bench}plugins: [own_part.py]\n"
    for file, text in texts.items():
        (tmp_path / file).write_text(text, "utf-8")
    (tmp_path / "link").symlink_to(names[name])
    files = [word for kind in ("bench", "model", "limits", "baseline", "unit") for word in (f"--{kind}", names[kind])]
    assert main(["run", names["scenario"], *files, "--yes", option, "link"]) == 2
    said = capsys.readouterr().err
    assert f"{names[name]}: is read here, and the output would take its place; give {option} another file" in said
    assert {path.name: path.read_text("utf-8") for path in tmp_path.iterdir() if path.name != "link"} == texts


def test_what_a_station_and_the_environment_name_is_not_written_over(tmp_path, monkeypatch, capsys):
    station = tmp_path / "line.yaml"
    limits = find("limits", "default").read_text("utf-8")
    (tmp_path / "own.yaml").write_text(limits, "utf-8")
    part = "{number: default-throttle, revision: '1', approver: x, serial: A, limits: own.yaml, model: default}"
    text = f"schema: etb_hil/station/1\nname: s\nbench: virtual_classic\nparts: [{part}]\nstore: own.db\n"
    station.write_text(text, "utf-8")
    plugin = tmp_path / "own_part.py"
    for path in (plugin, tmp_path / "own.db", tmp_path / "s" / "results.db"):
        path.parent.mkdir(exist_ok=True)
        path.write_text("# nothing", "utf-8")
    monkeypatch.setenv("ETB_HIL_PLUGINS", str(plugin))
    for path in (station, tmp_path / "own.yaml", tmp_path / "own.db", tmp_path / "s" / "results.db", plugin):
        before = path.read_bytes()
        command = ["run", "--station", str(station), "--serial", "A", "--out", str(tmp_path / "s")]
        assert main([*command, "--json", str(path)]) == 2
        assert "is read here" in capsys.readouterr().err
        assert path.read_bytes() == before


def test_json_and_junit_are_two_files(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "--yes", "--json", "a", "--junit", "./a"]) == 2
    assert "two outputs would be written to one file; give --junit another file" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_where_the_inputs_are_unknown_only_results_of_an_earlier_run_are_gone(good, tmp_path, capsys):
    bench, told, junit = (tmp_path / name for name in ("bench.yaml", "r.json", "j.xml"))
    bench.write_text("plugins: [", "utf-8")
    command = ["run", "--bench", str(bench), "--json", str(told), "--junit", str(junit)]
    for path, source in ((told, "results.json"), (junit, "run.xml")):
        path.write_bytes((good / source).read_bytes())
    assert main(command) == 2
    assert [path.name for path in tmp_path.iterdir()] == ["bench.yaml"]
    for path in (told, junit):
        path.write_text("of somebody", "utf-8")
    assert main(command) == 2
    assert told.read_text("utf-8") == junit.read_text("utf-8") == "of somebody"
    assert "is not YAML" in capsys.readouterr().err


def test_json_on_standard_output_stands_alone(tmp_path, capfd):
    scenario = tmp_path / "short.yaml"
    scenario.write_text(SHORT.replace("60 s", "0.5 s"))
    main(["run", str(scenario), "--yes", "--out", str(tmp_path), "--json", "-"])
    out, words = capfd.readouterr()
    assert json.loads(out)["scenario"] == "short"
    assert "INCONCLUSIVE" in words


def test_a_bench_that_is_not_there_leaves_junit_and_words(tmp_path, capfd):
    bench = tmp_path / "bench.yaml"
    text = find("bench", "slcan").read_text().replace("/dev/ttyACM0", str(tmp_path / "nowhere"))
    bench.write_text(text)
    scenario = tmp_path / "short.yaml"
    scenario.write_text(SHORT.replace("60 s", "0.5 s"))
    junit = tmp_path / "j.xml"
    command = ["run", str(scenario), "--bench", str(bench), "--yes", "--out", str(tmp_path), "--junit", str(junit)]
    assert main(command) == 3
    assert "BENCH FAULT" in capfd.readouterr().out
    (suite,) = ET.parse(junit).getroot()  # noqa: S314
    assert (suite.get("errors"), suite.get("failures")) == ("1", "0")


@pytest.mark.parametrize("during", ["etb_hil.cli.units.prepare", "etb_hil.cli.run_screen.execute"])
def test_a_time_out_before_anything_moves_is_told_to_ci_too(during, tmp_path, monkeypatch, capsys):
    def hangs(*_, **__):
        time.sleep(60.0)

    monkeypatch.setattr(during, hangs)
    junit, told = tmp_path / "j.xml", tmp_path / "r.json"
    files = ["--junit", str(junit), "--json", str(told)]
    assert main(["run", "--yes", "--serial", "CI-1", "--timeout", "3", "--out", str(tmp_path), *files]) == 5
    assert "aborted: the time-out" in capsys.readouterr().err
    (suite,) = ET.parse(junit).getroot()  # noqa: S314
    assert (suite.get("errors"), suite.get("failures")) == ("1", "0")
    results = json.loads(told.read_text())
    jsonschema.validate(results, results_schema())
    assert (results["exit_code"], results["bench"]["reason_id"], results["unit"]["serial"]) == (5, "time_out", "CI-1")


def test_a_run_out_of_time_ends_in_the_safe_state(tmp_path):
    scenario = tmp_path / "short.yaml"
    scenario.write_text(SHORT)
    files = {name: find(name, "default") for name in ("model", "limits")}
    job = prepare(JobFiles(scenario=scenario, bench=find("bench", "virtual_classic"), **files))

    def at_two_seconds(snapshot):
        if snapshot.time_s > 2.0:
            os.kill(os.getpid(), signal.SIGALRM)

    results = execute(job, tmp_path, "", 1, at_two_seconds).results
    bench = results.bench
    assert (results.exit_code, bench.outcome, bench.reason_id) == (5, "aborted", "time_out")
    assert bench.safe_state is True


def test_time_runs_out_before_a_run_too_and_only_while_it_is_entered():
    before = signal.getsignal(signal.SIGALRM)
    with pytest.raises(KeyboardInterrupt, match=r"time-out of 0\.05 s"), TimeLimit(0.05):
        time.sleep(60.0)
    assert signal.getsignal(signal.SIGALRM) is before
    with TimeLimit(0.05), TimeLimit(None):
        pass
    time.sleep(0.1)


def test_what_does_not_end_is_ended_as_a_bench_fault():
    hung = (
        "import signal, time\n"
        "from etb_hil.cli import time_limit\n"
        "time_limit.GRACE_S = 0.1\n"
        "with time_limit.TimeLimit(0.1):\n"
        "    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGALRM})\n"
        "    time.sleep(600)\n"
    )
    done = subprocess.run([sys.executable, "-c", hung], capture_output=True, text=True, check=False)
    assert done.returncode == 3
    assert done.stderr.startswith("bench fault: nothing has ended 0.1 s after the time-out of 0.1 s")


@pytest.mark.parametrize(
    ("option", "says"),
    [
        (["--timeout", "3parsecs"], "argument --timeout: must be a number (got '3parsecs')"),
        (["--seed", "1.5"], "argument --seed: must be a whole number (got '1.5')"),
    ],
)
def test_a_number_that_is_mistyped_is_answered_with_what_is_allowed(option, says, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["run", "friction_check", *option])
    assert ended.value.code == 2
    assert says in capsys.readouterr().err


@pytest.mark.parametrize("seconds", [0.0, -1.0, float("nan"), float("inf"), 1e9])
def test_a_time_that_is_none_is_refused(seconds):
    with pytest.raises(InputError, match=r"--timeout must be positive \(got \S+ s\)"):
        TimeLimit(seconds)
