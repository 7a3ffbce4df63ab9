"""What else stands in stock: every position law and every model gives the verdict that is true."""

from dataclasses import replace
from functools import cache

import pytest
from whole_run import files, run_on

from etb_hil.base.stock import find
from etb_hil.bench.job import execute, prepare
from etb_hil.plant.parameters import load_model


def measured(finished, number_id):
    return next(n for n in finished.results.measurements.values() if n.id == number_id)


def number(finished, number_id):
    return measured(finished, number_id).value


@pytest.mark.parametrize("law", ["pid", "sliding-mode"])
@pytest.mark.parametrize(("unit", "verdict"), [("default", "pass"), ("faulty", "fail")])
def test_the_verdict_does_not_depend_on_the_position_law(tmp_path, law, unit, verdict):
    bench = tmp_path / "bench.yaml"
    bench.write_text(find("bench", "virtual_classic").read_text() + f"law: {law}\n")
    finished = run_on(tmp_path, bench=bench, unit=unit)
    assert finished.results.unit.verdict == verdict
    assert number(finished, "T_st") == pytest.approx(load_model(find("model", unit)).values.stiction, rel=0.03)


@pytest.mark.filterwarnings("ignore::etb_hil.plant.model_check.ParameterRangeWarning")
@pytest.mark.parametrize(("unit", "limits"), [("literal", "default"), ("dv_e5", "dv_e5")])
@pytest.mark.parametrize("known", [True, False], ids=["its own model", "the default model"])
def test_other_models_are_measured_right_whatever_the_bench_takes_them_for(tmp_path, unit, limits, known):
    finished = run_on(tmp_path, unit=unit, model=unit if known else "default", limits=limits)
    truth = load_model(find("model", unit)).values
    assert finished.results.unit.verdict != "fail"
    if known:
        assert finished.results.unit.verdict == "pass"
        assert number(finished, "T_st") == pytest.approx(truth.stiction, rel=0.03)
        coulomb = measured(finished, "T_c")
        if unit == "literal":  # its friction is a signal of 20 mA: no drop to T_c stands out, which is bounded above
            assert coulomb.is_bound
            assert truth.coulomb <= coulomb.high <= truth.stiction + 0.002
        else:
            assert coulomb.value == pytest.approx(truth.coulomb, rel=0.05)


@cache
def checked(scenario):
    """Return a job that was checked once, whatever unit it then tests."""
    return prepare(files(scenario=scenario))


def run_of(scenario, unit, folder):
    job, path = checked(scenario), find("model", unit)
    job = replace(job, files=replace(job.files, unit=path), unit=load_model(path))
    return execute(job, folder, "", 3)


@pytest.mark.parametrize(
    ("scenario", "unit", "verdict"),
    [
        *(
            (scenario, unit, verdict)
            for scenario in ("break_away", "multisine", "reversals_at_limp_home")
            for unit, verdict in (("default", "pass"), ("faulty", "fail"))
        ),
        pytest.param("warm_check", "default", "pass", marks=pytest.mark.study),
        pytest.param("warm_check", "faulty", "fail", marks=pytest.mark.study),
    ],
)
def test_no_stock_scenario_gives_a_wrong_verdict(tmp_path, scenario, unit, verdict):
    finished = run_of(scenario, unit, tmp_path)
    assert finished.results.bench.outcome == "ok"
    assert finished.results.unit.verdict in {verdict, "inconclusive"}
    if scenario in {"break_away", "warm_check"}:
        assert finished.results.unit.verdict == verdict
    if scenario == "warm_check":
        ends = {phase.id: phase.outcome for phase in finished.results.phases}
        assert ends["supply_is_up"] == ends["warm_up"] == "triggered"
