"""What a run of a store may hold, and which runs count: each rule on both sides of its edge."""

import math
from dataclasses import replace

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from made_up_runs import result

from etb_hil.base.errors import InputError
from etb_hil.base.outcome import BenchOutcome, UnitVerdict
from etb_hil.results.run_result import Bench, Unit
from etb_hil.store.row_values import rows_of
from etb_hil.store.run import Measured, require_outcome, run_of, waiting_run

RUN = ("id", "2026-11-28", "bench", "scenario")
UNIT = ("SN", "part", "revision")
OUTCOME = ("ok", "pass", "within_limits")
VALUES = (0.2, 0.1, 0.3, None, 0.26, "N·m")


def put(row, place, value):
    return (*row[:place], value, *row[place + 1 :])


@pytest.mark.parametrize(
    ("low", "high", "has"), [(None, None, False), (0.0, None, True), (None, 0.0, True), (0.1, 0.2, True)]
)
def test_a_measurement_has_a_limit_where_one_side_of_it_has(low, high, has):
    assert Measured(1.0, 0.9, 1.1, low, high).has_limit is has


@pytest.mark.parametrize(
    ("outcome", "counts"),
    [
        (("ok", "pass", "within_limits"), True),
        (("ok", "fail", "T_st_exceeded"), True),
        (("ok", "inconclusive", "T_st_undecided"), True),
        (("ok", "inconclusive", "T_st_without_interval"), True),
        (("ok", "inconclusive", "undecided_temperature"), False),
        (("ok", "inconclusive", "samples_lost"), False),
        (("ok", None, "T_st_undecided"), False),
        (("fault", "pass", "within_limits"), False),
        (("fault", "inconclusive", "T_st_undecided"), False),
        (("aborted", None, ""), False),
    ],
)
def test_only_what_was_measured_soundly_counts(outcome, counts):
    assert run_of(RUN, UNIT, outcome, {}).counts is counts


def test_a_run_has_its_columns_and_the_housings_temperature_apart():
    run = run_of(RUN, UNIT, OUTCOME, {"T_st": VALUES, "temperature": (21, None, None, None, None, "degC")})
    assert (run.run_id, run.started, run.bench, run.scenario) == RUN
    assert (run.serial, run.part_number, run.revision) == UNIT
    assert (run.bench_outcome, run.verdict, run.reason_id) == OUTCOME
    assert (run.temperature, run.numbers) == (21.0, {"T_st": Measured(*VALUES)})


def test_what_was_not_measured_is_no_number_of_a_run():
    none = (None, None, None, None, 0.26, "N·m")
    run = run_of(RUN, UNIT, OUTCOME, {"T_st": none, "T_c": VALUES, "temperature": none})
    assert (run.temperature, [*run.numbers]) == (None, ["T_c"])


def test_a_bound_is_no_number_that_histories_and_golden_units_compare():
    run = run_of(RUN, UNIT, OUTCOME, {"T_st": VALUES, "T_c": (None, 0.0, 0.13, None, 0.2, "N·m")})
    assert [*run.numbers] == ["T_st"]


@pytest.mark.parametrize("wrong", [None, 5, 0.5, b"text", ["text"]], ids=repr)
def test_names_times_verdicts_and_units_are_text(wrong):
    whole = {"run": RUN, "unit": UNIT, "outcome": OUTCOME, "numbers": {"T_st": VALUES}}
    run_of(*whole.values())
    changed = [("run", put(RUN, k, wrong)) for k in range(4)] + [("unit", put(UNIT, k, wrong)) for k in range(3)]
    changed += [("outcome", put(OUTCOME, k, wrong)) for k in range(3) if wrong is not None or k != 1]
    changed += [("numbers", {"T_st": put(VALUES, 5, wrong)})]
    for name, value in changed:
        with pytest.raises(TypeError, match="must be text"):
            run_of(*{**whole, name: value}.values())


def test_names_of_numbers_are_text():
    with pytest.raises(TypeError, match="must be text"):
        run_of(RUN, UNIT, OUTCOME, {"T_st": VALUES, 5: VALUES})


@pytest.mark.parametrize("place", range(5))
@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf, 1.01e100, -1.01e100, 10**101, "0.5", b"1"], ids=repr)
def test_a_value_whose_square_is_no_number_or_that_is_none_is_refused(place, wrong):
    with pytest.raises(TypeError, match="a value of a run must be a finite number"):
        run_of(RUN, UNIT, OUTCOME, {"T_c": VALUES, "T_st": put(VALUES, place, wrong)})


@example(values=(1e100, -1e100, 10**100, -(10**100), 0), is_temperature=False)
@given(
    values=st.tuples(*[st.floats(-1e100, 1e100) | st.integers(-(10**100), 10**100)] * 5), is_temperature=st.booleans()
)
def test_any_value_up_to_ten_to_the_hundredth_is_read(values, is_temperature):
    name = "temperature" if is_temperature else "T_st"
    run = run_of(RUN, UNIT, OUTCOME, {name: (*values, "N·m")})
    if is_temperature:
        assert (run.temperature, run.numbers) == (float(values[0]), {})  # an integer beyond 2^53, too
    else:
        assert run.numbers["T_st"] == (*(float(one) for one in values), "N·m")
        assert all(type(one) is float for one in run.numbers["T_st"][:5])


@pytest.mark.parametrize("outcome", [*BenchOutcome])
@pytest.mark.parametrize("verdict", [*UnitVerdict, None])
def test_every_outcome_that_a_run_writes_is_read(outcome, verdict):
    run = run_of(RUN, UNIT, (str(outcome), verdict and str(verdict), ""), {})
    assert (run.bench_outcome, run.verdict) == (outcome, verdict)


@pytest.mark.parametrize(("place", "column"), [(0, "bench_outcome"), (1, "verdict")])
@pytest.mark.parametrize("wrong", ["maybe", "", "PASS"])
def test_another_outcome_is_refused_with_run_and_column(place, column, wrong):
    with pytest.raises(InputError, match=rf"run id: runs\.{column}: must be an outcome that a run writes"):
        run_of(RUN, UNIT, put(OUTCOME, place, wrong), {})


def test_a_column_without_stated_outcomes_may_hold_any_text():
    require_outcome("phases", "outcome", "anything", "run id")
    require_outcome("runs", "reason", "anything", "run id")
    with pytest.raises(
        InputError, match=r"a\.db: run id, T_st: measurements\.verdict: .*pass, fail, inconclusive, null"
    ):
        require_outcome("measurements", "verdict", "ok", "run id, T_st", "a.db")


def test_a_run_that_waits_is_read_from_its_rows():
    unit = Unit(UnitVerdict.INCONCLUSIVE, "T_st_undecided", serial="SN 9", part_number="q", revision="2")
    written = replace(result(3, unit=unit), bench=Bench(BenchOutcome.FAULT, name="bench 7"))
    run = waiting_run(rows_of(written))
    assert (run.run_id, run.started, run.bench, run.scenario) == (
        "run-0003", "2026-11-24T08:00:03.000+00:00", "bench 7", "Friction check"
    )  # fmt: skip
    assert (run.serial, run.part_number, run.revision) == ("SN 9", "q", "2")
    assert (run.bench_outcome, run.verdict, run.reason_id) == ("fault", "inconclusive", "T_st_undecided")
    value = 0.17 + 3e-4
    assert run.numbers == {"T_st": Measured(value, value - 0.01, value + 0.01, None, 0.26)}
    assert run.temperature == 21.0


@pytest.mark.parametrize("count", [0, 2])
def test_what_waits_is_exactly_one_run(count):
    rows = rows_of(result(0))
    with pytest.raises(ValueError, match="values to unpack"):
        waiting_run({**rows, "runs": rows["runs"] * count})
