"""results.json reads back as it was written, and a wrong key is named."""

import json

import numpy as np
import pytest
import sample_run

from etb_hil.base.errors import InputError
from etb_hil.base.outcome import BenchOutcome, UnitVerdict
from etb_hil.report.series import ReportSeries
from etb_hil.results.json_file import result_as_dict, result_from_dict, results_schema

LEAST = {"run_id": "r", "unit": {"verdict": None}, "bench": {"outcome": "aborted"}}


@pytest.mark.parametrize("stiction", [0.171, 0.567])
def test_results_survive_json(stiction):
    results = sample_run.results(stiction)
    assert result_from_dict(json.loads(json.dumps(result_as_dict(results)))) == results


def test_least_results_and_keys_of_later_versions():
    results = result_from_dict({**LEAST, "invented_later": 3})
    assert results.bench.outcome is BenchOutcome.ABORTED
    assert results.unit.verdict is None
    assert results.bus.load is None


def test_wrong_keys_are_all_named():
    wrong = {**LEAST, "unit": {"verdict": "good"}, "measurements": [{"id": "T_st", "name": "x", "unit": "N·m"}]}
    with pytest.raises(InputError) as caught:
        result_from_dict(wrong, "session/results.json")
    text = str(caught.value)
    assert "session/results.json: unit.verdict" in text
    assert "'good'" in text
    assert "measurements.0.value" in text


def test_a_newer_schema_is_refused_with_the_remedy():
    with pytest.raises(InputError, match=r"newer etb-hil \(it is 3\); allowed: up to 2; open them with the version"):
        result_from_dict({**LEAST, "schema_version": 3})


def test_results_of_the_first_schema_are_read():
    one = {"id": "T_st", "name": "stiction torque T_st", "value": 0.17, "unit": "N·m", "low": 0.16, "high": 0.18}
    results = result_from_dict({**LEAST, "schema_version": 1, "numbers": [one]})
    assert results.measurements["T_st"].interval == (0.16, 0.18)
    assert result_as_dict(results)["schema_version"] == 2


def test_schema_says_what_a_verdict_may_be():
    definitions = results_schema()["$defs"]
    assert set(definitions["UnitVerdict"]["enum"]) == {verdict.value for verdict in UnitVerdict}


def test_series_refuse_columns_of_other_lengths():
    with pytest.raises(ValueError, match="'friction' has 3 values, 'time' has 4"):
        ReportSeries.from_mapping({"time": np.arange(4.0), "friction": np.zeros(3)})


def test_series_take_lists_and_leave_unknown_columns():
    series = ReportSeries.from_mapping({"time": [0, 1], "angle": [2, 3], "invented_later": [1]})
    assert series.angle.dtype == np.float64
    assert len(series.friction) == 0
