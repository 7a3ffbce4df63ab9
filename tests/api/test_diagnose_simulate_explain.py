"""A log judged, explained, and the extended model simulated, as an engineer's script does it."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import etb_hil as etb
from etb_hil.cli.main import main


def test_a_recording_judged_is_the_log_judged(faulty):
    recording = etb.read(faulty.folder / "raw.blf", bench="virtual_classic")
    result = etb.diagnose(recording)
    (one,) = etb.replay(faulty.folder / "raw.blf", bench="virtual_classic")
    assert result.verdict is one.verdict
    judged, replayed = (
        {id_: (m.value, m.low, m.high, m.unit) for id_, m in found.measurements.items()} for found in (result, one)
    )
    assert judged == replayed


def test_a_notebook_shows_the_judgement(faulty):
    result = etb.diagnose(faulty.recording)
    page = result._repr_html_()
    assert page.startswith("<div")
    assert "FAIL: " in page
    assert "T_st" in page
    assert page.count("<svg") == 1
    assert result.figure().axes


def test_limits_and_model_may_be_objects(faulty):
    limits = etb.Run.open(faulty.folder)
    model = etb.Model.load("default")
    assert etb.diagnose(faulty.recording, model=model).verdict is etb.diagnose(faulty.recording).verdict
    assert limits.verdict is etb.UnitVerdict.FAIL


def test_a_recording_without_a_current_is_refused(tmp_path):
    table = tmp_path / "x.csv"
    table.write_text("time_s,motor_voltage_V\n0,1\n0.001,2\n0.002,1\n")
    with pytest.raises(etb.InputError, match="needs motor_current and motor_angle"):
        etb.diagnose(etb.read(table))


def test_a_model_is_written_and_read_back(tmp_path):
    model = etb.Model.load("default")
    parameters = {**model.parameters, "stiction": replace(model.parameters["stiction"], value=0.3)}
    changed = replace(model, parameters=parameters)
    changed.write(tmp_path / "own.yaml")
    again = etb.Model.load(tmp_path / "own.yaml")
    assert again.values == changed.values
    with pytest.raises(etb.InputError, match="no model file 'nosuch'"):
        etb.Model.load("nosuch")


def test_a_scenario_and_a_voltage_simulated():
    found = etb.simulate("default", "friction_check", rate="500 Hz", seed=4)
    assert {"motor_voltage", "motor_current", "throttle_angle"} <= set(found.roles)
    assert np.diff(found["throttle_angle"].time_ns) == pytest.approx(2_000_000)
    again = etb.simulate("default", voltage=found, start_angle=float(found["throttle_angle"].values[0]))
    assert again["motor_voltage"].values == pytest.approx(found["motor_voltage"].values)
    error = again["throttle_angle"].values - found["throttle_angle"].values
    assert np.sqrt(np.mean(error**2)) < 0.2


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"rate": 1e6}, "no rate of samples"),
        ({"rate": "5 m"}, "rate: "),
        ({"scenario": "friction_check", "voltage": "x.csv"}, "a scenario and a voltage were given"),
        ({"unit": "nosuch"}, "no model file 'nosuch'"),
    ],
)
def test_what_cannot_be_simulated_is_refused(wrong, said):
    with pytest.raises(etb.InputError, match=said):
        etb.simulate(**wrong)


@pytest.mark.parametrize(
    ("recordings", "said"),
    [([], "nothing to explain"), ("nosuch.csv", "nosuch.csv: cannot be read"), (["nosuch.csv"], "cannot be read")],
)
def test_what_cannot_be_explained_is_refused(recordings, said):
    with pytest.raises(etb.InputError, match=said):
        etb.explain(recordings)


@pytest.fixture(scope="module")
def why(faulty):
    """The answer, stopped where the unit is about to be judged with the causes."""

    def progress(what):
        threads_of_blas.append(blas_threads())
        if what.startswith("judging the unit"):
            raise KeyboardInterrupt

    with threadpool_limits(2, "blas"):
        found = etb.explain(faulty.folder, progress=progress)
        assert blas_threads() == {2}
    return found


threads_of_blas = []


def blas_threads():
    return {one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"}


def test_the_threads_of_a_search_are_its_own(why):
    assert why.causes
    assert len(threads_of_blas) > 2
    assert all(threads == {1} for threads in threads_of_blas)


def test_an_explanation_that_is_stopped_keeps_what_it_knows(why):
    assert why.result.interrupted.startswith("judging the unit")
    assert why.causes


def test_a_faulty_units_session_is_explained_by_its_friction(why):
    assert why.verdict == "explained"
    (cause,) = why.causes
    assert (cause.id, cause.not_isolable_from) == ("parameter:stiction", ())
    assert cause.share_of_error > 0.5
    for estimate in cause.parameters.values():
        assert estimate.low <= estimate.value <= estimate.high
        assert estimate.unit
    assert why.ambiguity_groups == tuple((c.id, *c.not_isolable_from) for c in why.causes if c.not_isolable_from)
    assert why.result.verdict == why.verdict


def test_a_deprecated_name_warns_and_still_works(why):
    with pytest.warns(
        DeprecationWarning, match=r"Explanation.data is deprecated and goes in etb-hil 0\.3; use .*result"
    ):
        found = why.data
    assert found["verdict"] == why.verdict
    assert found["causes"][0]["id"] == why.causes[0].id


def test_the_signals_in_a_table_are_those_of_the_session(faulty, tmp_path):
    """Of all that an explanation reads, to the digits of the table."""
    table = tmp_path / "signals.csv"
    assert main(["export", str(faulty.folder), str(table)]) == 0
    read, kept = etb.read(table), faulty.recording
    for role in ("motor_voltage", "motor_current", "motor_angle", "throttle_angle", "temperature"):
        assert read[role].unit == kept[role].unit
        ends = [max(one[role].time_ns[0] for one in (read, kept)), min(one[role].time_ns[-1] for one in (read, kept))]
        times = np.arange(ends[0], ends[1], 1_000_000)
        values = [np.interp(times, one[role].time_ns, one[role].values) for one in (read, kept)]
        assert values[0] == pytest.approx(values[1], rel=1e-6, abs=1e-6), role


@pytest.mark.study
def test_the_signals_in_a_table_are_explained_as_the_session_is(why, faulty, tmp_path):
    table = tmp_path / "signals.csv"
    subprocess.run([sys.executable, "-m", "etb_hil", "export", faulty.folder, table], check=True, capture_output=True)
    again = etb.explain(table, model="default")
    assert again.verdict == why.verdict
    assert [one.id for one in again.causes] == [one.id for one in why.causes]
    for one, other in zip(again.causes, why.causes, strict=True):
        assert one.not_isolable_from == other.not_isolable_from
        for name, size in one.parameters.items():
            assert size.value == pytest.approx(other.parameters[name].value, rel=1e-3)


def test_the_extended_model_is_simulated_and_written(why, faulty, tmp_path):
    assert why.model.values.stiction > 1.2 * etb.Model.load("default").values.stiction
    simulated = etb.simulate(why.model, voltage=faulty.recording)
    assert len(simulated["throttle_angle"].values) == len(faulty.recording["motor_voltage"].values)
    names = {path.name for path in why.write(tmp_path / "answer")}
    assert {"explanation.json", "model.yaml", "explanation.html"} <= names
    assert etb.Model.load(tmp_path / "answer" / "model.yaml").values.stiction == pytest.approx(
        why.model.values.stiction
    )


def test_a_notebook_shows_causes_and_a_picture_in_degrees(why):
    page = why._repr_html_()
    assert why.causes[0].id in page
    assert page.count("<svg") == 1
    assert [axes.get_ylabel() for axes in why.figure().axes] == ["angle / deg", "error / deg"]
    assert why.figure().axes[0].lines[0].get_ydata().max() > 10.0
    labels = [text.get_text() for one in why.residual_figures() for text in (one.axes[-1].xaxis.label,)]
    assert "position / deg" in labels
    assert not any("rad" in label for label in labels)
