"""A new measurement is one file: limits judge it, and results, report, JUnit, baseline and history show it."""

import re

import pytest

from etb_hil.base.errors import InputError
from etb_hil.base.outcome import UnitVerdict
from etb_hil.base.stock import find
from etb_hil.bench.job import JobFiles, execute, prepare
from etb_hil.diagnosis import measurements
from etb_hil.diagnosis.limits_file import load_limits
from etb_hil.diagnosis.measurement_registry import measurement_kinds, name_of, phases_needed
from etb_hil.histories.history import histories
from etb_hil.histories.runs import read_runs
from etb_hil.histories.tables import rows
from etb_hil.report.history_page import write_history_page
from etb_hil.report.html_report import write_report
from etb_hil.report.junit import Reported, junit_text
from etb_hil.report.verdict import verdict_text
from etb_hil.session.baseline import baseline_text

FILE = '''
"""Mean current of the dashes."""

import numpy as np

from etb_hil.diagnosis.measurement_kind import Estimate, MeasurementKind


def compute(run):
    current = np.concatenate([np.abs(one.column("motor_current")) for one in run.of("dash")])
    mean = float(np.nanmean(current))
    return Estimate(mean, mean - 0.002, mean + 0.002)


MEASUREMENT = MeasurementKind(
    id="dash_current", name="mean current of the dashes", unit="A", compute=compute,
    order=400, phases=frozenset({"dash"}), too_high="Look for a tight bearing.",
)
'''
LIMITS = """\
schema: etb_hil/limits/2
part_number: A-1
revision: "2"
limits:
  T_st: {max: 0.26 N·m}
  dash_current: {max: 1 mA, source: chosen}
marginal_band: 3 %
"""


@pytest.fixture
def added(tmp_path, monkeypatch):
    """Add the file to those of the measurements, as if it stood there."""
    folder = tmp_path / "measurements"
    folder.mkdir()
    (folder / "dash_current.py").write_text(FILE)
    monkeypatch.setattr(measurements, "__path__", [*measurements.__path__, str(folder)])
    for known in (measurement_kinds, phases_needed):
        known.cache_clear()
    yield
    for known in (measurement_kinds, phases_needed):
        known.cache_clear()


@pytest.mark.usefixtures("added")
def test_everything_shows_a_measurement_that_one_file_adds(tmp_path):
    limits = tmp_path / "limits.yaml"
    limits.write_text(LIMITS)
    stock = {kind: find(kind, name) for kind, name in (("bench", "virtual_classic"), ("model", "default"))}
    finished = execute(prepare(JobFiles(find("scenario", "friction_check"), limits=limits, **stock)), tmp_path, "A1", 1)
    results = finished.results
    measured = results.measurements["dash_current"]
    assert measured.verdict is UnitVerdict.FAIL
    assert results.unit.verdict is UnitVerdict.FAIL
    assert results.unit.reason_id == "dash_current_beyond_limit"
    assert "Mean current of the dashes is" in verdict_text(results)
    assert "Look for a tight bearing." in verdict_text(results)
    assert "mean current of the dashes" in write_report(results, finished.series, tmp_path).read_text("utf-8")
    assert '<testcase name="dash_current"' in junit_text([Reported(results)])
    assert 'message="Mean current of the dashes is' in junit_text([Reported(results)])
    assert re.search(r"dash_current +mean current of the dashes +1\.1", repr(results.measurements))
    assert "dash_current: {value: " in baseline_text(results, "a run")
    runs, _ = read_runs([tmp_path])
    (history,) = histories(runs)
    assert [one.id for one in history.numbers] == ["T_st", "T_c", "dash_current"]
    page = write_history_page([history], tmp_path / "history.html", 5).read_text("utf-8")
    assert "<h2>Mean current of the dashes (dash_current)</h2>" in page
    assert name_of("dash_current") == "mean current of the dashes"
    assert rows([history])[0]["dash_current"] == measured.value
    assert {run.numbers["dash_current"].unit for run in runs} == {"A"}


def test_a_limit_of_an_unknown_measurement_is_refused_with_its_line(tmp_path):
    path = tmp_path / "limits.yaml"
    path.write_text(LIMITS)
    with pytest.raises(InputError, match=r"limits\.yaml:6: limits\.dash_current: no measurement has this id"):
        load_limits(path)


@pytest.mark.usefixtures("added")
def test_the_least_limit_of_a_unit_without_a_dimension_is_said(tmp_path):
    path, kind = tmp_path / "limits.yaml", tmp_path / "measurements" / "current_rate.py"
    rate = FILE.replace('unit="A"', 'unit="A/s"').replace("order=400", "order=400, least_limit=0.5")
    kind.write_text(rate.replace('id="dash_current"', 'id="current_rate"'))
    path.write_text(LIMITS.replace("dash_current: {max: 1 mA", "current_rate: {max: 0.4 A/s"))
    with pytest.raises(InputError, match=r"current_rate\.max: out of range .*allowed: from 0\.5"):
        load_limits(path)
