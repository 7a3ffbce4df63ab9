"""Values that a plug-in returns: what does not fit is the failure of that part, and what fits is ours from then on."""

import json

import numpy as np
import pytest

import etb_hil as etb
from etb_hil import plugins
from etb_hil.base.outcome import BenchOutcome

MEASUREMENT = """
from decimal import Decimal
import numpy as np
from etb_hil.plugins.measurements import Estimate, MeasurementKind

def compute(run):
    dashes = run.of("dash")
    return FOUND

MEASUREMENT = MeasurementKind(
    id="mine", name="mine", unit="A", compute=compute, order=1, phases=frozenset({"dash"}), source="chosen" MORE
)
"""
OBSERVER = """
import numpy as np
from etb_hil.plugins.observers import FrictionEstimate, ObserverKind

class Mean:
    def push(self, time_ns, current, angle):
        velocity, friction = 0.0 * angle, 0.1 * current
        delay_ns = np.zeros(len(time_ns), np.int64)
        DOING
        return FrictionEstimate(FOUND)

OBSERVER = ObserverKind("a tenth of the current", lambda model, throttle, noise: Mean())
"""


@pytest.fixture(scope="module")
def session(brisk, tmp_path_factory):
    return etb.run(brisk, unit="faulty", seed=3, folder=tmp_path_factory.mktemp("sessions"))


def _measured(tmp_path, session, found, more=""):
    """Judge a session again with a measurement, and return all measurements of the replay."""
    path = tmp_path / "mine.py"
    path.write_text(MEASUREMENT.replace("FOUND", found).replace(" MORE", more), "utf-8")
    plugins.load(path)
    again = etb.Run.open(session.folder)
    assert [again.measurements[id_] for id_ in session.measurements] == [*session.measurements.values()]
    assert again.verdict is session.verdict
    return again.measurements


@pytest.mark.parametrize(
    "found",
    [
        "Estimate(np.float64(2.0), np.float32(1.5), np.array(2.5))",
        "Estimate(np.int64(2), Decimal('1.5'), 2.5)",
        "[Estimate(2, 1.5, 2.5)]",
    ],
)
def test_numbers_of_other_types_are_pythons(found, session, tmp_path):
    mine = _measured(tmp_path, session, found)["mine"]
    assert [(type(one), one) for one in (mine.value, mine.low, mine.high)] == [(float, 2.0), (float, 1.5), (float, 2.5)]
    json.dumps([mine.value, mine.low, mine.high])


@pytest.mark.parametrize(
    ("found", "more", "says"),
    [
        ("Estimate(True)", "", "`value` must be a number, or None (it is True)"),
        ("Estimate('3')", "", "`value` must be a number, or None (it is '3')"),
        ("Estimate(1j)", "", "`value` must be a number, or None (it is 1j)"),
        ("Estimate(np.array([1.0]))", "", "`value` must be a number, or None"),
        ("Estimate(1.0, 2.0, 3.0)", "", "mine = 1.0 lies outside its interval, 2.0 to 3.0"),
        ("Estimate(1.0, 1.1, 0.9)", "", "mine = 1.0 lies outside its interval, 1.1 to 0.9"),
        ("Estimate(None, 2.0, 1.0)", "", "lies outside its interval"),
        ("[Estimate(1.0), Estimate(2.0)]", "", "it returned 2 values with the id 'mine'; a `suffix` sets each apart"),
        ("Estimate(1.0, suffix=5)", "", "`suffix` must be a text (it is 5)"),
        ("Estimate(1.0, suffix='_x')", "", "`suffixes` declares no pattern"),
        ("Estimate(1.0, suffix='_c')", ", suffixes='a|b'", "allowed: '_' and then 'a|b'"),
        ("Estimate(1.0, note=5)", "", "`note` must be a text (it is 5)"),
        ("1.0", "", "it returned something else than Estimate"),
    ],
)
def test_a_value_that_does_not_fit_costs_only_itself(found, more, says, session, tmp_path):
    mine = _measured(tmp_path, session, found, more)["mine"]
    assert mine.value is None
    assert says in mine.note


def test_a_suffix_must_not_make_the_id_of_another_measurement(session, tmp_path):
    path = tmp_path / "mine.py"
    text = MEASUREMENT.replace("FOUND", "Estimate(1.0, suffix='_st')").replace(" MORE", ", suffixes='[a-z]+'")
    path.write_text(text.replace('"mine", name', '"T", name'), "utf-8")
    plugins.load(path)
    measurements = etb.Run.open(session.folder).measurements
    assert measurements["T_st"] == session.measurements["T_st"]
    assert "'T_st' is an id of the measurement 'T_st'; choose another suffix" in measurements["T"].note


@pytest.mark.parametrize(
    "found",
    [
        "dashes[0].column('motor_current').fill(0.0) or Estimate(1.0)",
        "dashes[0].column('angle').__isub__(1.0) is None or Estimate(1.0)",
        "dashes[0].time.sort() or Estimate(1.0)",
        "run.series['friction'].fill(0.0) or Estimate(1.0)",
        "run.assessment.fit.parameters.fill(0.0) or Estimate(1.0)",
        "run.series.clear() or Estimate(1.0)",
        "run.segments.clear() or Estimate(1.0)",
        "dashes[0].columns.clear() or Estimate(1.0)",
    ],
)
def test_a_measurement_that_writes_to_what_it_gets_fails_alone(found, session, tmp_path):
    mine = _measured(tmp_path, session, found)["mine"]
    assert mine.value is None
    assert "mine.py" in mine.note


def test_arrays_can_be_written_to_again_after_a_measurement(session, tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(MEASUREMENT.replace("FOUND", "Estimate(1.0)").replace(" MORE", ""), "utf-8")
    plugins.load(path)
    assert etb.Run.open(session.folder).series["friction"].flags.writeable


def _observed(tmp_path, session, found="time_ns, velocity, friction, delay_ns", doing="pass"):
    path = tmp_path / "mean.py"
    path.write_text(OBSERVER.replace("FOUND", found).replace("DOING", doing), "utf-8")
    plugins.load(path)
    return etb.Run.open(session.folder, observer="mean")


@pytest.mark.parametrize(
    "found",
    [
        "list(time_ns), list(velocity), list(friction), [0] * len(time_ns)",
        "time_ns, velocity.astype('f4'), friction, 1.0 * delay_ns",
    ],
)
def test_columns_of_other_types_are_taken(found, session, tmp_path):
    assert _observed(tmp_path, session, found).result.bench.outcome is BenchOutcome.OK


@pytest.mark.parametrize(
    ("found", "says"),
    [
        ("time_ns, velocity[:, None], friction[:, None], delay_ns", "`velocity` must have one dimension of"),
        ("time_ns, velocity + 0j, friction, delay_ns", "`velocity` must hold real numbers (it has complex128)"),
        ("0 * time_ns, velocity, friction, delay_ns", "`time_ns` must be the instants of the samples"),
        ("time_ns, velocity[1:], friction, delay_ns", "values of velocity for"),
        ("time_ns, velocity, friction, delay_ns * np.nan", "`delay_ns` must be finite"),
        ("time_ns, velocity, friction, delay_ns, 0.1", "`deviation` must have one dimension of"),
        ("time_ns, velocity, friction > 0, delay_ns", "`friction` must hold real numbers (it has bool)"),
    ],
)
def test_columns_that_do_not_fit_are_a_bench_fault(found, says, session, tmp_path):
    bench = _observed(tmp_path, session, found).result.bench
    assert bench.outcome is BenchOutcome.FAULT
    assert says in bench.reason


@pytest.mark.parametrize("doing", ["current *= 0", "angle.fill(0.0)", "time_ns[:] = 0"])
def test_an_observer_that_writes_to_its_samples_is_a_bench_fault(doing, session, tmp_path):
    run = _observed(tmp_path, session, doing=doing)
    assert run.result.bench.outcome is BenchOutcome.FAULT
    assert "read-only" in run.result.bench.reason
    assert np.array_equal(
        run.recording["motor_current"].values, session.recording["motor_current"].values, equal_nan=True
    )


def test_the_signals_of_a_recording_are_read_only(session):
    current = session.recording["motor_current"]
    for array in (current.values, current.time_ns):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    changed = current.values.copy()
    changed[0] = 7.0
    assert session.recording["motor_current"].values[0] != 7.0
