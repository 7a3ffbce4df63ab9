"""Parts of plug-ins where the project uses its own: in runs, results, reports, histories and replays."""

import json
import re
import shutil
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
import yaml

import etb_hil as etb
from etb_hil import plugins
from etb_hil.base.errors import InputError
from etb_hil.base.outcome import BenchOutcome, ExitCode, UnitVerdict
from etb_hil.base.stock import find
from etb_hil.canio.logs.reading import read_log
from etb_hil.cli.main import main
from etb_hil.histories.history import histories
from etb_hil.histories.runs import read_runs
from etb_hil.report.junit import Reported, junit_text
from etb_hil.report.verdict import verdict_text
from etb_hil.results.json_file import result_from_dict

NUDGES = "  - {kind: nudges, id: nudging, between: [20 deg, 40 deg], size: 5 deg, hold: 0.2 s}\n"
LIMITS = """\
schema: etb_hil/limits/2
part_number: A-1
revision: "2"
limits:
  nudge_current: {max: 10 mA, source: chosen}
marginal_band: 3 %
"""


@pytest.fixture
def scenario(tmp_path):
    stock = find("scenario", "friction_check").read_text("utf-8")
    path = tmp_path / "nudging.yaml"
    path.write_text(f"{stock}\n{NUDGES}", "utf-8")
    return path


@pytest.fixture
def limits(tmp_path):
    path = tmp_path / "limits.yaml"
    path.write_text(LIMITS, "utf-8")
    return path


def _bench(tmp_path, **more):
    stock = yaml.safe_load(find("bench", "virtual_classic").read_text("utf-8"))
    path = tmp_path / "bench.yaml"
    path.write_text(yaml.safe_dump({**stock, **more}, sort_keys=False), "utf-8")
    return path


def test_a_phase_is_run_and_a_measurement_is_judged_and_shown(part, scenario, limits, tmp_path):
    plugins.load(part("nudges"))
    plugins.load(part("nudge_current"))
    run = etb.run(scenario, limits=limits, serial="A1", folder=tmp_path / "sessions")
    assert [phase.id for phase in run.result.phases][-1] == "nudging"
    measured = run.measurements["nudge_current"]
    assert 0.1 < measured.value < 10.0
    assert measured.verdict is UnitVerdict.FAIL
    assert run.result.unit.reason_id == "nudge_current_beyond_limit"
    assert "Largest current of the nudges is" in str(run)
    assert "Look for a shaft that binds." in str(run)
    assert "largest current of the nudges" in run.report().read_text("utf-8")
    assert '<testcase name="nudge_current"' in junit_text([Reported(run.result)])
    (history,) = histories(read_runs([tmp_path / "sessions" / "results.db"])[0])
    assert "nudge_current" in [one.id for one in history.numbers]
    assert etb.Run.open(run.folder).measurements == run.measurements


@pytest.mark.parametrize(("bandwidth", "is_same"), [("180.0", True), ("90.0", False)])
def test_a_law_drives_the_virtual_controller(bandwidth, is_same, part, tmp_path, brisk):
    """At the bandwidth of the project's own PD it is that law, bit for bit."""
    _changed(part("soft_pd"), "BANDWIDTH = 90.0", f"BANDWIDTH = {bandwidth}")
    ours, usual = (
        etb.run(brisk, bench=_bench(tmp_path, law=law), folder=tmp_path).recording["motor_current"].values
        for law in ("soft-pd", "pd")
    )
    assert np.array_equal(ours, usual) is is_same


def test_an_observer_is_chosen_by_name(part, tmp_path, brisk):
    plugins.load(part("differences"))
    run = etb.run(brisk, observer="differences", folder=tmp_path)
    usual = etb.run(brisk, folder=tmp_path)
    assert run.result.bench.outcome is BenchOutcome.OK
    assert not np.array_equal(run.series["friction"], usual.series["friction"], equal_nan=True)
    assert etb.Run.open(run.folder).result == run.result


@pytest.fixture
def lines(tmp_path, brisk):
    """The frames of a session as lines of JSON."""
    run = etb.run(brisk, folder=tmp_path)
    path = tmp_path / "drive.frames"
    with path.open("w") as file:
        for block in read_log(run.folder / "raw.blf"):
            for k in range(len(block)):
                data = block.data[k, : block.length[k]].tobytes().hex()
                file.write(json.dumps({"t": block.stamp_ns[k] * 1e-9, "id": int(block.ident[k]), "data": data}) + "\n")
    return path, run


def test_a_reader_opens_a_log_for_every_command(part, lines, tmp_path):
    path, run = lines
    reader = part("frame_lines")
    plugins.load(reader)
    recording = etb.read(path, bench="virtual_classic")
    np.testing.assert_allclose(recording["motor_current"].values, run.recording["motor_current"].values)
    (one,) = etb.replay([path], bench="virtual_classic", jobs=1)
    assert one.error == ""
    assert one.measurements["T_c"].value == pytest.approx(run.measurements["T_c"].value, rel=0.05)
    other = Path(shutil.copy(path, tmp_path / "other.frames"))
    several = list(etb.replay([path, other], bench="virtual_classic", jobs=2))  # in processes of their own
    assert [found.measurements["T_c"] for found in several] == [one.measurements["T_c"]] * 2
    plugins.unload(reader)
    command = [sys.executable, "-m", "etb_hil", "replay", str(path), "--bench", "virtual_classic"]
    refused = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert (refused.returncode, "must have a suffix of a log format" in refused.stderr) == (2, True)
    done = subprocess.run(
        [*command, "--plugin", str(reader)], capture_output=True, text=True, check=False, cwd=tmp_path
    )
    assert done.returncode in {0, 4}, done.stderr
    assert f"{one.measurements['T_c'].value:.3f} N·m" in done.stdout


def test_a_bench_file_names_its_plugins_beside_itself(part, tmp_path, brisk):
    part("soft_pd")
    bench = _bench(tmp_path, plugins=["soft_pd.py"], law="soft-pd")
    run = etb.run(brisk, bench=bench, folder=tmp_path)
    (plugin,) = run.result.plugins
    assert (plugin.name, plugin.parts) == ("soft_pd.py", ("laws: soft_pd",))
    wrong = _bench(tmp_path, plugins=["nowhere.py"])
    with pytest.raises(InputError, match=r"bench\.yaml:\d+: plugins\[0\]: no such Python file \(it is 'nowhere\.py'\)"):
        etb.run(brisk, bench=wrong, folder=tmp_path)


def test_results_and_session_say_which_plugins_took_part(part, tmp_path, brisk):
    plugin = plugins.load(part("nudge_current"))
    run = etb.run(brisk, folder=tmp_path)
    assert run.result.plugins == (plugin,)
    manifest = json.loads((run.folder / "session.json").read_text("utf-8"))
    assert manifest["plugins"] == [json.loads(json.dumps(asdict(plugin)))]
    assert "nudge_current.py" in run.report().read_text("utf-8")


def test_a_limit_is_refused_where_its_measurement_names_no_kind_of_phase(part, scenario, limits, tmp_path):
    plugins.load(part("nudges"))
    _changed(part("nudge_current"), 'frozenset({"nudges"})', 'frozenset({"nugdes"})')
    with pytest.raises(InputError, match=r"nudge_current\.py: .*'nugdes'\); did you mean 'nudges'\?"):
        etb.run(scenario, limits=limits, folder=tmp_path / "sessions")
    assert not (tmp_path / "sessions").exists()


def test_a_replay_without_a_plugin_says_which_is_missing(part, scenario, limits, tmp_path):
    files = [part("nudges"), part("nudge_current")]
    for file in files:
        plugins.load(file)
    judged = etb.run(scenario, limits=limits, folder=tmp_path)
    for file in files:
        plugins.unload(file)
    with pytest.raises(InputError) as refused:
        etb.Run.open(judged.folder)
    assert "no measurement has this id" in str(refused.value)
    for file in files:
        assert f"the plug-in {file.name} took part in the run and is not here" in str(refused.value)


def test_a_replay_says_that_a_plugin_is_missing_that_nothing_asks_for(part, tmp_path, capsys, brisk):
    file = part("nudge_current")
    plugins.load(file)
    run = etb.run(brisk, folder=tmp_path)
    plugins.unload(file)
    (warning,) = etb.Run.open(run.folder).warnings
    assert "nudge_current.py took part in the run and is not here (measurements: nudge_current)" in warning
    file.write_text(file.read_text("utf-8") + "# another one\n", "utf-8")
    plugins.load(file)
    assert etb.Run.open(run.folder).warnings == ("the plug-in nudge_current.py was changed since the run",)
    capsys.readouterr()
    main(["replay", str(run.folder)])
    assert "the plug-in nudge_current.py was changed since the run" in " ".join(capsys.readouterr().out.split())


def test_a_session_from_elsewhere_never_runs_code(part, tmp_path, brisk):
    """Its copy of the bench file names a plug-in; only files that the user names are run."""
    file = part("soft_pd")
    bench = _bench(tmp_path, plugins=["soft_pd.py"])
    run = etb.run(brisk, bench=bench, folder=tmp_path)
    plugins.unload(file)
    witness = tmp_path / "it_ran"
    for place in (file, run.folder / "inputs" / "soft_pd.py"):
        place.write_text(f"open({str(witness)!r}, 'w')\nLAW = 1\n", "utf-8")
    assert etb.Run.open(run.folder).verdict is run.verdict
    assert not witness.exists()


def _changed(file, old, new):
    text = file.read_text("utf-8")
    assert old in text
    file.write_text(text.replace(old, new), "utf-8")
    plugins.load(file)


def test_a_measurement_that_fails_costs_only_itself(part, scenario, limits, tmp_path):
    plugins.load(part("nudges"))
    _changed(part("nudge_current"), "segments = run.of", "segments = 1 / 0 * run.of")
    run = etb.run(scenario, limits=limits, folder=tmp_path)
    assert run.verdict is UnitVerdict.INCONCLUSIVE
    assert run.measurements["T_c"].value > 0.0
    failed = run.measurements["nudge_current"]
    assert failed.value is None
    assert "nudge_current.py" in failed.note
    assert "ZeroDivisionError" in failed.note
    results = result_from_dict(json.loads((run.folder / "results.json").read_text("utf-8")))
    assert "measurement_failed" in results.unit.also
    assert "A measurement of a plug-in failed and has no value" in " ".join(verdict_text(results).split())


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("motor_current", "motor_curent", "did you mean 'motor_current'"),
        ("largest = max(", "largest = np.nan * max(", "values must be finite, or None"),
    ],
)
def test_what_a_measurement_gets_wrong_is_said(old, new, says, part, scenario, limits, tmp_path):
    plugins.load(part("nudges"))
    _changed(part("nudge_current"), old, new)
    failed = etb.run(scenario, limits=limits, folder=tmp_path).measurements["nudge_current"]
    assert failed.value is None
    assert says in failed.note


@pytest.mark.parametrize(
    ("new", "says"),
    [("return 1 / 0 #", "ZeroDivisionError"), ("return None #", "something else than FrictionEstimate")],
)
def test_an_observer_that_fails_is_a_bench_fault_and_the_drive_is_off(new, says, part, tmp_path, brisk):
    _changed(part("differences"), "return FrictionEstimate(", new + "(")
    run = etb.run(brisk, observer="differences", folder=tmp_path)
    _ended_by_a_part(run, rf"differences\.py: .*{says}")
    assert run.result.bench.safe_state


@pytest.mark.parametrize(("new", "says"), [("1 / 0", "ZeroDivisionError"), ("None", "AttributeError")])
def test_a_phase_that_fails_is_refused_before_anything_moves(new, says, part, scenario, tmp_path):
    _changed(part("nudges"), "return Chain(", f"return {new} and Chain(")
    with pytest.raises(InputError, match=rf"nudges\.py: .*its trajectory failed: {says}"):
        etb.run(scenario, folder=tmp_path / "sessions")
    assert not (tmp_path / "sessions").exists()


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("return np.array([", "return 1 / 0 * np.array([", "designing its gains failed: ZeroDivisionError"),
        ("return np.array([", "return 5 * [1.0] or ([", "its gains must be up to 4 finite numbers"),
        ("return np.array([", "return [np.nan] or ([", "its gains must be up to 4 finite numbers"),
        ("float(gain[0]", "nowhere(gain[0]", "compiling its torque failed"),
    ],
)
def test_a_law_that_fails_is_refused_before_anything_moves(old, new, says, part, tmp_path, brisk):
    _changed(part("soft_pd"), old, new)
    with pytest.raises(InputError, match=rf"soft_pd\.py: .*{says}"):
        etb.run(brisk, bench=_bench(tmp_path, law="soft-pd"), folder=tmp_path / "sessions")


@pytest.mark.parametrize(
    "new",
    ["1 / 0", "np.nan", *(pytest.param(one, marks=pytest.mark.study) for one in ("-np.inf", "int(memory[1:0].max())"))],
)
def test_a_law_that_fails_in_compiled_code_is_refused_before_anything_moves(new, part, tmp_path, capfd, brisk):
    _changed(part("soft_pd"), "return float(", f"return {new} if abs(error) > 0.01 else float(")
    with pytest.raises(InputError, match=r"soft_pd\.py: .*its torque was not finite"):
        etb.run(brisk, bench=_bench(tmp_path, law="soft-pd"), folder=tmp_path / "sessions")
    assert not (tmp_path / "sessions").exists()
    assert "Exception ignored" not in capfd.readouterr().err


@pytest.mark.spoilt  # its controller fails
def test_a_law_that_fails_on_a_unit_alone_ends_the_run_with_the_drive_off(part, tmp_path, brisk):
    _changed(part("soft_pd"), "return float(", "return 1 / 0 if abs(error) > 0.03 else float(")
    run = etb.run(brisk, bench=_bench(tmp_path, law="soft-pd"), unit="faulty", folder=tmp_path / "sessions")
    _ended_by_a_part(run, r"soft_pd\.py: .*its torque was not finite \(inf N·m\) at an angle error of -?1\.\d+ deg")
    assert run.result.bench.safe_state
    again = etb.Run.open(run.folder)
    assert (again.code, again.result.bench.reason) == (run.code, run.result.bench.reason)


LEANING = """\
import math

from etb_hil.plugins.effects import Balance, Effect, Need, Parity, Port, strength


def torque(theta: float, moment: float) -> float:
    if moment > 0.05 and theta > 1.2:
        FAILS
    return moment * math.sin(theta)


EFFECT = Effect(
    id="leaning", equation="m g l sin(theta)", balance=Balance.TORQUE, parity=Parity.EVEN,
    parameters=(strength("moment", "N·m", -0.3, 0.3, (0.02,), "0.1 kg at 2 cm"),), looks_like="gravity",
    check="turn it", look_alikes=("spring_nonlinear",), separated_by="turn it", source="a rigid body",
    terms={Port.PLATE_TORQUE: torque}, needs=frozenset({Need.THROTTLE}),
)
"""


FAILS = ["return math.nan", "return -math.inf", "raise ValueError('too far')"]


# One way to fail here; the others are met by a run of each kind of part, and every night.
@pytest.fixture(params=[FAILS[0], *(pytest.param(one, marks=pytest.mark.study) for one in FAILS[1:])])
def failing_unit(request, tmp_path):
    """Return a unit with an effect that fails beyond an angle, and only where it is strong."""
    path = tmp_path / "leaning.py"
    path.write_text(LEANING.replace("FAILS", request.param), "utf-8")
    plugins.load(path)
    stock = find("model", "default").read_text("utf-8")
    assert "\neffects: []" in stock
    unit = tmp_path / "unit.yaml"
    unit.write_text(
        stock.replace("\neffects: []", "\neffects: [{id: leaning, strengths: {moment: 0.06 N·m}}]"), "utf-8"
    )
    return unit


LEANING_FAILED = r"leaning\.py: .*effect 'leaning': it raised an exception, or was not finite, with the plate near 6\d"


@pytest.mark.spoilt  # its controller fails
def test_an_effect_that_fails_on_a_unit_alone_ends_the_run_and_is_named(failing_unit, tmp_path, capfd, brisk):
    _ended_by_a_part(etb.run(brisk, unit=failing_unit, folder=tmp_path / "sessions"), LEANING_FAILED)
    assert "Exception ignored" not in capfd.readouterr().err


def test_a_simulation_with_an_effect_or_a_law_that_fails_is_refused(failing_unit, part, tmp_path, capfd, brisk):
    with pytest.raises(InputError, match=LEANING_FAILED):
        etb.simulate(failing_unit)
    with pytest.raises(InputError, match=LEANING_FAILED):
        etb.simulate(failing_unit, voltage=etb.simulate())
    assert "Exception ignored" not in capfd.readouterr().err
    with pytest.raises(InputError, match=LEANING_FAILED):  # in the dry run, too
        etb.run(brisk, model=failing_unit, folder=tmp_path / "sessions")
    assert not (tmp_path / "sessions").exists()
    _changed(part("soft_pd"), "return float(", "return 1 / 0 if abs(error) > 0.03 else float(")
    with pytest.raises(InputError, match=r"soft_pd\.py: .*its torque was not finite"):
        etb.simulate("faulty", law="soft-pd")


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # of the arithmetic with what is not finite
def test_an_explanation_in_which_an_effect_fails_names_it(failing_unit):
    with pytest.raises(InputError, match=r"leaning\.py: .*the search failed with it"):
        etb.explain(etb.simulate(), model=failing_unit)


@pytest.mark.parametrize(
    ("new", "says"),
    [("1 / 0 or bytes(", "ZeroDivisionError"), ("None and bytes(", "it returned None in place of bytes")],
)
def test_a_key_that_fails_ends_the_run_and_is_named(new, says, part, tmp_path, brisk):
    _changed(part("turned_key"), "return bytes(", f"return {new}")
    bench = tmp_path / "uds.yaml"
    bench.write_text(
        find("bench", "virtual_uds").read_text("utf-8").replace("key: example", "key: turned-key"), "utf-8"
    )
    run = etb.run(brisk, bench=bench, folder=tmp_path / "sessions")
    _ended_by_a_part(run, rf"turned_key\.py: .*computing a key failed: .*{says}")
    assert run.result.bench.safe_state


@pytest.mark.spoilt  # its controller fails
def test_the_commands_say_a_part_that_failed_with_a_true_exit_code(part, tmp_path, capsys):
    _changed(part("soft_pd"), "return float(", "return 1 / 0 if abs(error) > 0.03 else float(")
    bench, sessions = str(_bench(tmp_path, law="soft-pd")), tmp_path / "sessions"
    words = ["run", "friction_check", "--bench", bench, "--unit", "faulty", "--yes", "--out", str(sessions)]
    assert main(words) == ExitCode.BENCH_FAULT
    said = " ".join(capsys.readouterr().out.split())
    assert "BENCH FAULT" in said
    assert "its torque was not finite (inf N·m) at an angle error of -1." in said
    assert "not seen to be off" not in said
    (session,) = sessions.glob("2*")
    assert main(["replay", str(session)]) == ExitCode.BENCH_FAULT
    assert "The same results as live" in capsys.readouterr().out
    assert main(["simulate", "--unit", "faulty", "--law", "soft-pd", "--out", str(tmp_path / "a.csv")]) == 2
    assert "soft_pd.py: the plug-in's law" in capsys.readouterr().err
    assert not (tmp_path / "a.csv").exists()


def _ended_by_a_part(run, says):
    """Check that a run is a bench fault that names its part, without a verdict, and kept what was recorded."""
    bench = run.result.bench
    assert (run.code, bench.outcome, bench.reason_id) == (ExitCode.BENCH_FAULT, BenchOutcome.FAULT, "part_failed")
    assert re.search(says, bench.reason), bench.reason
    assert run.verdict is None
    assert sum(len(block) for block in read_log(run.folder / "raw.blf")) > 0
    assert result_from_dict(json.loads((run.folder / "results.json").read_text("utf-8"))).bench == bench


def test_a_reader_that_fails_costs_nothing_that_came_before(part, lines):
    path, run = lines
    _changed(part("frame_lines"), "yield self._block(chunk)", "yield self._block(chunk); 1 / 0")
    recording = etb.read(path, bench="virtual_classic")
    assert 0 < len(recording["motor_current"].values) < len(run.recording["motor_current"].values)
    assert any("frame_lines.py" in note and "ZeroDivisionError" in note for note in recording.notes)
    path.write_text("", "utf-8")


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("yield self._block(chunk)", "yield chunk", "it yielded list in place of FrameBlock"),
        ("channel=np.zeros(count, np.uint8)", "channel=np.zeros(1, np.uint8)", "the columns of a FrameBlock have 1, "),
    ],
)
def test_a_reader_that_yields_something_else_is_refused(old, new, says, part, lines):
    path, _ = lines
    _changed(part("frame_lines"), old, new)
    with pytest.raises(InputError, match=rf"frame_lines\.py: .*{says}"):
        etb.read(path, bench="virtual_classic")
