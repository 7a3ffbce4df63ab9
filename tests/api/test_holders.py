"""Recordings, judgements and models as Python objects: compared, iterated, written and read back."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import etb_hil as etb
from etb_hil.base.stock import stock_names


def test_recordings_and_judgements_are_compared_by_identity(healthy):
    one, other = (etb.read(healthy.folder) for _ in range(2))
    assert one == one  # noqa: PLR0124 (the comparison is what is tested)
    assert one != other
    assert one in [other, one]
    assert one["motor_current"] != other["motor_current"]
    assert etb.diagnose(one) != etb.diagnose(other)
    assert len({one, other}) == 2


def test_a_recording_is_read_like_a_mapping(healthy):
    recording = etb.read(healthy.folder)
    assert list(recording) == recording.roles == recording.keys()
    assert len(recording) == len(recording.roles)
    assert dict(recording).keys() == set(recording.roles)
    assert recording


@pytest.mark.parametrize("name", stock_names("model"))
def test_a_stock_model_is_read_back_as_it_was(name, tmp_path):
    model = etb.Model.load(name)
    model.write(tmp_path / "model.yaml")
    again = etb.Model.load(tmp_path / "model.yaml")
    assert again == model
    assert np.array_equal(again.vector(), model.vector())


def test_submodules_and_version_are_there_without_an_import_of_their_own():
    code = "import etb_hil; print(etb_hil.plugins.loaded(), callable(etb_hil.testing.check_effect), dir(etb_hil))"
    environment = {**os.environ, "PYTHONPATH": str(Path(etb.__file__).parents[1])}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
    assert done.stdout.startswith("() True")
    for name in ("plugins", "testing", "__version__"):
        assert f"'{name}'" in done.stdout


def test_a_replay_has_measurements_of_the_same_type(faulty):
    (one,) = etb.replay([faulty.folder])
    stiction, live = one.measurements["T_st"], faulty.measurements["T_st"]
    assert isinstance(stiction, etb.Measurement)
    assert (stiction.value, stiction.interval, stiction.unit) == (live.value, live.interval, live.unit)
    assert stiction.name == live.name


def test_a_source_that_cannot_be_read_has_no_measurements(tmp_path):
    (one,) = etb.replay([tmp_path / "nosuch"])
    assert one.error
    assert dict(one.measurements) == {}


def test_a_script_without_a_guard_is_told_to_have_one(healthy, tmp_path):
    script = tmp_path / "script.py"
    script.write_text(
        f"import etb_hil\nS = {str(healthy.folder)!r}\nfor one in etb_hil.replay([S, S], jobs=2):\n    print(one)\n"
    )
    environment = {**os.environ, "PYTHONPATH": str(Path(etb.__file__).parents[1])}
    done = subprocess.run(
        [sys.executable, str(script)], capture_output=True, text=True, check=False, env=environment, timeout=300
    )
    assert done.returncode != 0
    last = done.stderr.strip().splitlines()[-1]
    assert "the processes that judge ended before their first log" in last
    assert 'if __name__ == "__main__":' in last


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda s: etb.read(s, bench="nosuch"), "bench goes with a CAN log (it is 'nosuch'); leave it out"),
        (lambda s: etb.read(s, columns="no.yaml"), "columns go with a table (it is 'no.yaml'); leave it out"),
        (lambda s: etb.read(s / "raw.blf", bench="virtual_classic", columns="no.yaml"), "columns go with a table"),
        (lambda _: etb.simulate(voltage="v.csv", law="nosuch"), "law: it goes with a scenario (it is 'nosuch')"),
        (lambda _: etb.simulate(voltage="v.csv", rate="nonsense"), "rate: it goes with a scenario"),
        (lambda _: etb.simulate(voltage="v.csv", seed=-5), "seed: it goes with a scenario (it is -5)"),
        (lambda _: etb.simulate(voltage="v.csv", model="nosuch"), "model: it goes with a scenario"),
        (lambda _: etb.simulate(start_angle="nonsense"), "start_angle: it goes with a voltage (it is 'nonsense')"),
        (lambda _: etb.simulate(columns="no.yaml"), "columns: it goes with a voltage from a table"),
        (lambda _: etb.simulate(rate="nonsense"), "rate: a frequency is expected"),
        (lambda _: etb.explain(np.array([1.0])), "recordings has the wrong type (it is [1.0]); allowed: a Recording"),
        (lambda s: etb.explain(s, fit_on=np.array(["x"])), "fit_on has the wrong type (it is ['x'])"),
        (lambda _: etb.simulate(rate=np.array([1000.0])), "rate has the wrong type"),
        (lambda s: etb.read(s).write(None), "path has the wrong type (it is None); allowed: a text, a path"),
        (lambda s: etb.read(s).to_numpy(5), "roles has the wrong type (it is 5)"),
        (lambda _: etb.Model.load(None), "source has the wrong type (it is None); allowed: a text, a path"),
        (lambda _: etb.plugins.load(None), "path has the wrong type (it is None); allowed: a text, a path"),
        (lambda _: etb.plugins.unload(5), "path has the wrong type (it is 5)"),
        (lambda s: etb.history(s, part="nosuch"), "there is no finished run of part 'nosuch'"),
        (
            lambda _: etb.connect().ramp("20 deg", "60 deg"),
            "between must be a pair of angles (it is '20 deg'); allowed",
        ),
        (lambda _: etb.connect().ramp(("1 deg", "2 deg", "3 deg"), "1 rad/s"), "between must be a pair of angles"),
        (lambda _: etb.connect().phase(None), "kind has the wrong type (it is None); allowed: a text"),
    ],
)
def test_an_argument_that_does_not_apply_or_fit_is_refused(call, says, healthy, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(etb.InputError) as refused:
        call(healthy.folder)
    assert says in str(refused.value)
    assert "--" not in str(refused.value)


@pytest.mark.parametrize("rate", [np.array(1000.0), np.float32(1000.0)])
def test_numbers_of_other_types_are_taken(rate):
    assert etb.simulate(scenario="paper_step", rate=rate).duration > 0.1


def test_what_can_be_read_once_only_names_roles(healthy):
    pytest.importorskip("pandas")
    recording = etb.read(healthy.folder)
    frame = recording.to_pandas(role for role in ["motor_current", "motor_angle"])
    assert frame.attrs["units"] == {"motor_current_A": "A", "motor_angle_rad": "rad"}


def test_a_misspelt_argument_names_the_function_and_the_nearest_one():
    with pytest.raises(TypeError, match=r"run\(\): .*'benhc'; did you mean 'bench'\?"):
        etb.run("friction_check", benhc="virtual_fd")
