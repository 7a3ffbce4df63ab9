"""The statistics against published examples, and against runs whose causes are known."""

from dataclasses import replace

import made_up
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from etb_hil.histories.capability import capability
from etb_hil.histories.control_chart import control_chart
from etb_hil.histories.distribution import distribution
from etb_hil.histories.drift import deviations, drifts
from etb_hil.histories.gauge import balanced, gauge_study
from etb_hil.histories.history import histories
from etb_hil.histories.tables import rows
from etb_hil.histories.temperature import MOST_UNCERTAINTY, REFERENCE, unit_laws
from etb_hil.histories.tolerance import tolerance_limit
from etb_hil.report.history_text import history_text
from etb_hil.store.run import Measured

# AIAG, Measurement Systems Analysis, 4th edition (2010), figure III-B 15: ten parts, three appraisers, three trials.
AIAG = """
 0.29 -0.56 1.34 0.47 -0.80  0.02 0.59 -0.31 2.26 -1.36   0.41 -0.68 1.17 0.50 -0.92 -0.11 0.75 -0.20 1.99 -1.25
 0.64 -0.58 1.27 0.64 -0.84 -0.21 0.66 -0.17 2.01 -1.31   0.08 -0.47 1.19 0.01 -0.56 -0.20 0.47 -0.63 1.80 -1.68
 0.25 -1.22 0.94 1.03 -1.20  0.22 0.55  0.08 2.12 -1.62   0.07 -0.68 1.34 0.20 -1.28  0.06 0.83 -0.34 2.19 -1.50
 0.04 -1.38 0.88 0.14 -1.46 -0.29 0.02 -0.46 1.77 -1.49  -0.11 -1.13 1.09 0.20 -1.07 -0.67 0.01 -0.56 1.45 -1.77
-0.15 -0.96 0.67 0.11 -1.45 -0.49 0.21 -0.49 1.87 -2.16
"""
PARTS = np.array(AIAG.split(), float).reshape(3, 3, 10).transpose(2, 0, 1)

# Montgomery, Introduction to Statistical Quality Control, individuals chart of the viscosity of a primer paint.
VISCOSITY = "33.75 33.05 34.00 33.81 33.46 34.02 33.68 33.27 33.49 33.20 33.62 33.00 33.54 33.12 33.84"


def test_gauge_study_as_published():
    study = gauge_study(PARTS)
    rows = {row.source: row for row in study.anova}
    published = {  # degrees of freedom, sum of squares, F
        "benches": (2, 3.1673, 79.41),
        "units": (9, 88.3619, 492.29),
        "units x benches": (18, 0.3590, 0.434),
        "repeatability": (60, 2.7589, None),
    }
    for source, (freedom, squares, ratio) in published.items():
        assert rows[source].freedom == freedom
        assert rows[source].squares == pytest.approx(squares, abs=5e-5)
        if ratio is not None:
            assert rows[source].ratio == pytest.approx(ratio, rel=2e-3)
    assert study.pooled  # as in the manual: the interaction's p-value is 0.974
    assert rows["units x benches"].p == pytest.approx(0.974, abs=1e-3)
    assert study.repeatability == pytest.approx(0.199933, abs=1e-6)
    assert study.reproducibility == pytest.approx(0.226838, abs=1e-6)
    assert study.gauge == pytest.approx(0.302373, abs=2e-6)  # the root of the two above, which are rounded
    assert study.part == pytest.approx(1.042327, abs=1e-6)
    assert study.share(study.gauge) == pytest.approx(0.279, abs=5e-4)
    assert study.categories == 4


def test_gauge_study_keeps_an_interaction_that_is_there():
    rng = np.random.default_rng(5)
    unit, bench, both = rng.normal(0, 3, (12, 1, 1)), rng.normal(0, 1, (1, 4, 1)), rng.normal(0, 2, (12, 4, 1))
    study = gauge_study(unit + bench + both + rng.normal(0, 0.5, (12, 4, 3)))
    assert not study.pooled
    assert study.repeatability == pytest.approx(0.5, rel=0.2)
    assert study.reproducibility > 1.5  # units and benches together count as reproducibility


def test_one_bench_tells_nothing_of_reproducibility():
    study = gauge_study(PARTS[:, :1, :])
    assert study.reproducibility is None
    assert study.gauge == study.repeatability


def test_the_largest_balanced_study_is_taken():
    cells = {(u, b): [1.0, 2.0] for u in "abc" for b in ("x", "y")} | {("a", "z"): [1.0] * 9, ("d", "x"): [1.0]}
    cells["a", "x"] = [0.0, 1.0, 2.0]
    units, benches, values = balanced(cells)
    assert (units, benches, values.shape) == (["a", "b", "c"], ["x", "y"], (3, 2, 2))
    assert values[0, 0].tolist() == [1.0, 2.0]  # the latest ones
    assert balanced({("a", "x"): [1.0] * 9}) is None
    assert balanced({}) is None


def test_units_that_are_all_alike_tell_nothing_of_a_gauge():
    runs = [made_up.run(k, f"U{k % 2}", 0.17) for k in range(4)]
    assert histories(runs)[0].numbers[0].gauge is None
    assert "Gauge R&R" in history_text(histories(runs)[0], 5)


def test_control_chart_as_published():
    chart = control_chart(np.array(VISCOSITY.split(), float))
    assert chart.centre == pytest.approx(33.52, abs=5e-3)
    assert chart.mean_range == pytest.approx(0.48, abs=5e-3)
    assert (chart.low, chart.high) == (pytest.approx(32.24, abs=0.02), pytest.approx(34.80, abs=0.02))
    assert chart.range_high == pytest.approx(1.57, abs=0.01)
    assert chart.signals == {}
    assert control_chart(np.arange(7.0)) is None


@pytest.mark.parametrize(
    ("values", "at", "reason"),
    [
        ([0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 9, 0], 10, "beyond the limits"),
        ([0, 3, 0, 3, 0, 3, 0, 3, 0, *[2, 3] * 5], 17, "9 in a row on one side of the centre"),
        ([5, 1, 5, 1, 5, 2, 3, 3.5, 4, 5, 6, 1, 5, 1], 10, "6 in a row rising"),
        ([5, 1, 5, 1, 6, 5, 4, 3.5, 3, 2, 5, 1, 5], 9, "6 in a row falling"),
    ],
)
def test_signals_of_a_chart(values, at, reason):
    assert control_chart(np.array(values, float)).signals[at] == reason


@given(st.lists(st.floats(-1e6, 1e6), min_size=8, max_size=60), st.floats(0.1, 10.0), st.floats(-1e3, 1e3))
def test_a_chart_knows_no_unit(values, scale, shift):
    values = np.round(np.array(values), 3)
    chart, other = control_chart(values), control_chart(values * scale + shift)
    assert other.sigma == pytest.approx(chart.sigma * scale, rel=1e-6, abs=1e-6)
    assert other.centre == pytest.approx(chart.centre * scale + shift, rel=1e-6, abs=1e-3)


def test_capability_intervals_hold_what_they_say():
    rng = np.random.default_rng(11)
    held = {"cpk": 0, "ppk": 0, "cp": 0}
    for _ in range(400):
        found = made_up.of_normal(control_chart(rng.normal(10.0, 1.0, 40)), 6.0, 15.0)  # Cpk 4/3, Cp 9/6
        held["cpk"] += found.cpk.low <= 4 / 3 <= found.cpk.high
        held["ppk"] += found.ppk.low <= 4 / 3 <= found.ppk.high
        held["cp"] += found.cp.low <= 1.5 <= found.cp.high
    assert all(370 <= count <= 394 for count in held.values()), held  # 380 of 400, plus or minus three sigma


def test_capability_says_what_it_rests_on():
    chart = control_chart(np.array([1.0, 2.0] * 5))
    few = made_up.of_normal(chart, None, 9.0)
    assert few.is_preliminary
    assert few.steady
    assert few.cp is None
    assert made_up.of_normal(chart, None, None) is None
    assert made_up.of_normal(control_chart(np.ones(9)), None, 2.0) is None
    assert not made_up.of_normal(control_chart(np.arange(30.0)), 0.0, 40.0).steady


def test_less_than_one_percent_exceed_a_tolerance_limit():
    assert tolerance_limit(distribution(np.full(7, 0.17), by_shares=True)) is None
    assert tolerance_limit(distribution(np.array([0.17] * 8 + [0.0]), by_shares=True)) is None
    rng = np.random.default_rng(12)
    true = 0.17 * np.exp(0.1 * 2.3263)
    held = sum(made_up.of_shares(0.17 * np.exp(0.1 * rng.standard_normal(20))) >= true for _ in range(400))
    assert 0.92 * 400 <= held <= 0.98 * 400
    runs = made_up.production(3, 12, coefficient=-0.003, warm=30.0)
    number = histories(runs)[0].numbers[0]
    assert number.tolerance_limit == tolerance_limit(number.shape)
    text = " ".join(history_text(histories(runs)[0], 5).split())
    assert f"With 95 % confidence, 99 % of units lie below {number.tolerance_limit:.3f} N·m at 20 °C" in text
    assert f"coefficient: {100 * number.temperature.coefficient:.2f} %/K, reference: 20 degC" in text
    text = " ".join(history_text(histories(made_up.production(3, 12))[0], 5).split())
    assert "N·m as measured (12 units)" in text


def test_capability_is_of_one_temperature():
    """Limits that follow the temperature are taken where values were brought to; what the law leaves unsure widens."""

    def limited(run):
        limit = 0.26 * (1.0 - 0.003 * (run.temperature - 20.0))
        return replace(run, numbers={"T_st": run.numbers["T_st"]._replace(limit_high=limit)})

    runs = [limited(run) for run in made_up.production(6, 12, coefficient=-0.003, warm=40.0, noise=0.002)]
    number = histories(runs)[0].numbers[0]
    assert runs[-1].numbers["T_st"].limit_high < 0.25
    assert number.limit_high == pytest.approx(0.26, rel=0.015)
    plain = capability(number.chart, number.shape, None, number.limit_high)
    low, high = number.capability.cpk.low, number.capability.cpk.high
    assert low < plain.cpk.low < plain.cpk.high < high
    surely = replace(number.shape, free=None)  # a lognormal distribution for certain
    off = capability(number.chart, surely, None, number.limit_high, 0.01).cpk
    known = capability(number.chart, surely, None, number.limit_high).cpk
    half, without = 0.5 * (off.high - off.low), 0.5 * (known.high - known.low)
    reach = (number.shape.high - number.shape.median) * number.chart.sigma / number.chart.values.std(ddof=1)
    assert half == pytest.approx(np.hypot(without, 0.01 / reach))
    warm = [run for run in runs if run.temperature > 25.0]
    of_warm = histories(warm)[0]
    assert of_warm.numbers[0].temperature is not None
    assert (of_warm.numbers[0].limit_high, of_warm.numbers[0].capability) == (None, None)
    assert number.differing_limits == []
    assert of_warm.numbers[0].differing_limits == [
        (None, limit) for limit in dict.fromkeys(run.numbers["T_st"].limit_high for run in warm)
    ]
    text = " ".join(history_text(of_warm, 5).split())
    assert "Capability none. The runs state different limits (upper 0." in text
    assert "and none of them within 5 K of 20 °C. Test a unit at that temperature." in text


def with_limits(run, low, high):
    return replace(run, numbers={"T_st": run.numbers["T_st"]._replace(limit_low=low, limit_high=high)})


@pytest.mark.parametrize(
    ("low", "high", "words"),
    [
        (None, 0.4, "upper 0.260 to 0.400 N·m"),
        (None, None, "upper 0.260 N·m, or none"),
        (0.05, 0.26, "lower 0.050 N·m, or none"),
        (0.05, 0.4, "lower 0.050 N·m, or none; upper 0.260 to 0.400 N·m"),
    ],
)
def test_without_a_law_of_temperature_a_limit_applies_to_all_charted_units_or_to_none(low, high, words):
    """One more unit at -20 degC, where another limit holds, leaves no limit for the others at 20 degC."""
    runs = [with_limits(run, None, 0.26) for run in made_up.production(13, 26, repeats=1)]
    alike = histories(runs)[0].numbers[0]
    assert (alike.temperature, alike.limit_high, alike.differing_limits) == (None, 0.26, [])
    assert alike.capability is not None
    for place in (0, 13, 26):
        cold = with_limits(made_up.run(100, "cold", 0.17, temperature=-20.0), low, high)
        history = histories([*runs[:place], cold, *runs[place:]])[0]
        number = history.numbers[0]
        assert number.temperature is None
        assert (number.limit_low, number.limit_high, number.capability) == (None, None, None)
        assert set(number.differing_limits) == {(None, 0.26), (low, high)}
        assert len(number.differing_limits) == 2
        text = " ".join(history_text(history, 5).split())
        assert f"Capability none. The runs state different limits ({words}), and values are compared as" in text
        assert "as measured. Judge all units by the same limits, or test 3 units at temperatures 5 K apart" in text


def test_the_limit_of_an_earlier_run_does_not_matter_to_the_latest_one_of_its_unit():
    runs = [with_limits(run, None, 0.26) for run in made_up.production(13, 12, repeats=2)]
    earlier = with_limits(made_up.run(-1, "U003", 0.17), None, 0.4)
    number = histories([earlier, *runs])[0].numbers[0]
    assert (number.limit_high, number.differing_limits) == (0.26, [])
    assert number.capability == histories(runs)[0].numbers[0].capability


def test_of_few_units_differing_limits_are_not_said():
    runs = [with_limits(made_up.run(k, f"U{k}", 0.17 + 0.001 * k), None, 0.26 + 0.01 * k) for k in range(7)]
    assert "Capability" not in history_text(histories(runs)[0], 5)
    assert histories(runs)[0].numbers[0].limit_high is None


def test_temperature_is_found_inside_units_alone():
    rng = np.random.default_rng(3)
    unit = [f"u{k % 6}" for k in range(48)]
    warmth = rng.uniform(10.0, 50.0, 48)
    level = 0.15 + 0.01 * (np.arange(48) % 6)
    values = level * np.exp(-0.004 * (warmth - 20.0)) * np.exp(rng.normal(0.0, 0.01, 48))
    effect = unit_laws(values, warmth, unit).together()
    assert effect.low < -0.004 < effect.high
    assert effect.high - effect.low < 0.0015
    assert np.std(effect.taken_out(values, warmth) / level) < 0.02

    alone = [f"v{k}" for k in range(48)]  # each unit at one temperature: nothing tells units from temperature
    assert unit_laws(values, warmth, alone).together() is None
    assert unit_laws(values, 20.0 + rng.normal(0, 0.5, 48), unit).together() is None
    assert unit_laws(values, np.full(48, np.nan), unit).together() is None
    assert unit_laws(np.empty(0), np.empty(0), []).together() is None


@pytest.mark.parametrize(
    ("warmth", "is_told"),
    [((20.0, 20.0, 24.0), False), ((20.0, 20.0, 24.9), False), ((20.0, 25.0), True), ((22.4, 17.4, 20.0), True)],
)
def test_five_kelvin_lie_between_two_tests_of_one_unit(warmth, is_told):
    count = len(warmth)
    values = np.linspace(0.17, 0.18, 4 * count)
    laws = unit_laws(values, np.tile(warmth, 4), [f"u{k // count}" for k in range(4 * count)])
    assert (laws.together() is not None) == is_told
    assert laws.together("u1") is None or len(laws.name) == 4


def test_the_laws_interval_holds_the_law_where_units_have_laws_of_their_own():
    held, count = 0, 300
    for seed in range(count):
        rng = np.random.default_rng([7, seed])
        unit = np.repeat(np.arange(6), 4)
        warmth = rng.uniform(10.0, 50.0, 24)
        law = -0.003 * (1.0 + 0.3 * rng.standard_normal(6))
        values = np.exp(law[unit] * (warmth - 20.0) + 0.003 * rng.standard_normal(24))
        effect = unit_laws(values, warmth, [f"u{k}" for k in unit]).together()
        held += effect.low < -0.003 < effect.high
    assert 0.92 * count <= held <= 0.99 * count


def test_a_reading_brought_to_another_temperature_is_as_unsure_as_the_law():
    rng = np.random.default_rng(5)
    values, warmth = 0.17 * np.exp(0.004 * rng.standard_normal(8)), np.tile([20.0, 28.0], 4)
    effect = unit_laws(values, warmth, [f"u{k // 2}" for k in range(8)]).together()
    half = 0.5 * (effect.high - effect.low)
    assert effect.uncertainty(-8.0) == pytest.approx(8.0 * half)
    assert np.isnan(effect.taken_out(values[:1], np.array([70.0]))[0])  # far beyond what was seen
    far = REFERENCE - 1.01 * MOST_UNCERTAINTY / half
    assert np.isnan(replace(effect, coldest=far, warmest=20.0).taken_out(values[:1], np.array([far]))[0])
    runs = made_up.production(6, 12, coefficient=-0.004, warm=40.0, noise=0.002)
    number = histories(runs)[0].numbers[0]
    assert number.uncertainty == pytest.approx(
        number.compared * number.temperature.uncertainty([r.temperature - 20.0 for r in runs])
    )
    for row, value, doubt in zip(rows(histories(runs)), number.compared, number.uncertainty, strict=True):
        assert row["T_st_20_degC_high"] == pytest.approx(value + np.hypot(0.004, doubt))
        assert row["T_st_20_degC_low"] == pytest.approx(value - np.hypot(0.004, doubt))


def drifts_of(runs):
    return histories(runs)[0].numbers[0].drifts


def test_a_bench_and_a_unit_that_drift_are_told_apart():
    of_bench = drifts_of(made_up.golden(1, 40, bench_moves=0.06))
    assert [(d.kind, d.name) for d in of_bench] == [("bench", "bench 1")]
    assert of_bench[0].low < 0.06 < of_bench[0].high
    of_unit = drifts_of(made_up.golden(2, 40, unit_moves=0.06))
    assert [(d.kind, d.name, d.alone) for d in of_unit] == [("unit", "G1", False)]
    alone = drifts_of(made_up.golden(3, 40, ("G1",), bench_moves=0.06))
    assert [(d.kind, d.name, d.alone) for d in alone] == [("unit", "G1", True)]


def test_of_many_runs_a_bench_drifts_where_no_single_unit_is_the_reason():
    rng = np.random.default_rng(17)
    count = 1500
    time = np.arange(float(count))
    units = ["G" if k % 2 else f"U{k % 60}" for k in range(count)]
    noise = 0.17 * (1.0 + 0.01 * rng.standard_normal(count))
    moved = 1.0 + 0.02 * time / count
    alone = np.where(np.array(units) == "G", moved, 1.0)
    shared, _ = drifts(deviations(time, noise * moved, units, ["a"] * count))
    assert ("bench", "a") in [(one.kind, one.name) for one in shared]
    assert shared[0].low < 0.02 < shared[0].high
    of_one, _ = drifts(deviations(time, noise * alone, units, ["a"] * count))
    assert [(one.kind, one.name) for one in of_one] == [("unit", "G")]


def test_no_drift_no_alarm():
    alarms = sum(bool(drifts_of(made_up.golden(seed, 24, ("G1", "G2", "G3")))) for seed in range(150))
    assert alarms <= 5  # 1 % of 150 is 1.5; more than 5 would be seen once in 250 times


def test_the_more_measurements_a_report_has_the_surer_a_drift_has_to_be():
    """Twelve measurements that are independent, three series each: 1 % of reports hold an alarm, not 1 % of each."""
    rng = np.random.default_rng(4)
    alarms, reports = 0, 150
    for _ in range(reports):
        runs = [
            made_up.run(
                k,
                "uv"[k % 2],
                0.17,
                numbers={
                    f"made_up_{j:02d}": Measured(float(value), None, None, None, 9.0, "V")
                    for j, value in enumerate(1.0 + 0.02 * rng.standard_normal(12))
                },
            )
            for k in range(20)
        ]
        numbers = [number for number in histories(runs)[0].numbers if number.at]
        assert [number.looked_at for number in numbers] == [3] * 12
        alarms += any(number.drifts for number in numbers)
    assert alarms <= 5  # 1 % of 150 is 1.5; of 12 % are 18


def test_a_drift_is_an_alarm_by_all_that_the_report_looks_at():
    """Eight values of which one pair is exchanged: p is 16/8!, or 4.0e-4; 24 series leave it an alarm, 26 do not."""
    shares = [0.0, 0.01, 0.02, 0.04, 0.03, 0.05, 0.06, 0.07]

    def numbers(more):
        """Return a report whose first measurement drifts: two series, and two of each other measurement."""
        return histories(
            [
                made_up.run(
                    k,
                    "u",
                    0.17,
                    numbers={"T_st": Measured(0.17 * (1.0 + share), None, None, None, None)}
                    | {f"other_{j:02d}": Measured(1.0, None, None, None, 9.0, "V") for j in range(more)},
                )
                for k, share in enumerate(shares)
            ]
        )[0].numbers

    assert [one.name for one in numbers(11)[0].drifts] == ["u"]  # 24 series, 2 x 12
    assert numbers(12)[0].drifts == []  # 26
    assert all(not number.drifts for number in numbers(11)[1:])


def test_values_at_one_instant_have_no_trend():
    points = deviations(np.zeros(20), np.arange(20.0) + 1.0, ["u"] * 20, ["b"] * 20)
    assert drifts(points) == ([], 2)


def test_units_are_charted_once_and_only_what_was_measured_soundly():
    runs = made_up.production(4, 10, repeats=2)
    runs.append(made_up.run(99, "U000", 9.0, bench_outcome="fault", verdict=None))
    runs.append(made_up.run(100, "U001", 9.0, verdict="inconclusive", reason_id="tracks_disagree"))
    runs.append(made_up.run(101, "U002", 0.24, verdict="inconclusive", reason_id="T_st_undecided"))
    number = histories(runs)[0].numbers[0]
    assert sorted(number.charted) == [f"U{k:03d}" for k in range(10)]
    assert number.charted[-1] == "U002"
    assert number.chart.values[-1] == 0.24
    assert len(number.at) == 21


def test_parts_and_scenarios_are_kept_apart():
    runs = [
        *made_up.production(5, 2),
        made_up.run(50, "X", 0.2, part_number="B"),
        made_up.run(51, "X", 0.2, scenario="s"),
    ]
    assert [(h.part_number, h.scenario, len(h.runs)) for h in histories(runs)] == [
        ("A 113", "Friction check", 6),
        ("A 113", "s", 1),
        ("B", "Friction check", 1),
    ]


def test_the_return_margin_follows_the_temperature_of_friction():
    runs = made_up.production(6, 12, coefficient=-0.004, warm=40.0, noise=0.0005)
    stiction, _, margin = histories(runs)[0].numbers
    assert np.ptp(margin.values + stiction.values) < 1e-12
    assert margin.compared + stiction.compared == pytest.approx(0.35)


def _risen(runs):
    return [rise.unit for rise in histories(runs)[0].numbers[0].rises.found]


def test_a_unit_that_has_risen_by_what_matters_is_named_alone():
    runs = made_up.production(3, units=40, noise=0.002)
    risen = [made_up.run(900, "U003", 1.25 * next(r for r in runs if r.serial == "U003").numbers["T_st"].value)]
    assert _risen(runs) == []
    assert _risen(runs + risen) == ["U003"]
    few = [r for r in runs if r.serial in {"U003", "U004"}]
    assert _risen(few + risen) == ["U003"]


def test_units_that_scatter_widely_raise_no_alarm_over_it():
    rng = np.random.default_rng(8)
    alarms = 0
    for _ in range(20):
        runs = [made_up.run(k, f"U{k % 50}", 0.17 * np.exp(rng.normal(0.0, 0.1))) for k in range(100)]
        alarms += len(_risen(runs))
    assert alarms <= 0.01 * 20 * 50


def test_warmth_is_no_rise():
    """The same unit cold and warm, its law unknown: not held against each other; its law known: taken out."""
    cold_and_warm = [made_up.run(0, "A", 0.17, temperature=60.0), made_up.run(1, "A", 0.20, temperature=10.0)]
    told = histories(cold_and_warm)[0].numbers[0].rises
    assert (told.looked_at, told.found, told.apart) == (0, [], ["A"])
    unknown = [made_up.run(k, "A", 0.17, temperature=None) for k in range(2)]
    assert histories(unknown)[0].numbers[0].rises.apart == ["A"]
    known = made_up.production(5, units=20, coefficient=-0.003, warm=50.0, noise=0.0005)
    assert histories(known)[0].numbers[0].temperature is not None
    assert _risen(known) == []


@pytest.mark.parametrize("rise", [1.25, 1.6])
def test_units_that_have_risen_tell_no_law_for_others_either(rise):
    rng = np.random.default_rng(int(100 * rise))
    for _ in range(20):
        warmth, law = rng.uniform(0.0, 80.0, (2, 40)), -0.003 * (1.0 + 0.1 * rng.standard_normal(40))
        values = 0.17 * np.exp(law * warmth + 0.1 * rng.standard_normal(40) + 0.003 * rng.standard_normal((2, 40)))
        values[1, :5] *= rise
        runs = [
            made_up.run(40 * again + k, f"U{k:02d}", values[again, k], temperature=warmth[again, k])
            for again in range(2)
            for k in range(40)
        ]
        number = histories(runs)[0].numbers[0]
        assert number.temperature.coefficient == pytest.approx(-0.003, abs=0.0003)
        assert [found.unit for found in number.rises.found] == [f"U{k:02d}" for k in range(5)]
        assert number.rises.apart == []


def test_a_latest_run_that_cannot_be_compared_is_said():
    """An earlier run is held against the first, and nobody takes it for the latest."""
    warmth = (20.0, 21.0, 45.0)
    runs = [made_up.run(k, "A", 0.17 + 0.05 * (k == 2), temperature=each) for k, each in enumerate(warmth)]
    told = histories(runs)[0].numbers[0].rises
    assert (told.looked_at, told.found, told.apart) == (1, [], ["A"])


def test_what_was_measured_at_twenty_degrees_needs_no_law():
    runs = [made_up.run(k, f"U{k}", 0.17, temperature=each) for k, each in enumerate((20.0, 23.0, None))]
    told = histories(runs)
    assert [row["T_st_20_degC"] for row in rows(told)] == [0.17, None, None]
    assert rows(told)[0]["T_st_20_degC_high"] == pytest.approx(0.174)
    lines = [line for line in history_text(told[0], 5).splitlines() if "pass" in line]
    assert [line.count("0.170") for line in lines] == [2, 1, 1]


@pytest.mark.parametrize("rise", [1.25, 1.6])
@pytest.mark.parametrize("warm_as_well", [0, 3])
def test_a_unit_that_was_tested_warm_after_it_had_risen_tells_no_law_for_itself(rise, warm_as_well):
    rng = np.random.default_rng(int(100 * rise) + warm_as_well)
    runs = []
    for again in range(2):
        for k in range(12):
            warmth = 25.0 if again and k <= warm_as_well else float(again)
            value = 0.17 * np.exp(-0.003 * warmth + 0.005 * rng.standard_normal()) * (rise if again and k == 0 else 1.0)
            runs.append(made_up.run(len(runs), f"U{k}", value, temperature=20.0 + warmth))
    number = histories(runs)[0].numbers[0]
    if warm_as_well:
        assert [found.unit for found in number.rises.found] == ["U0"]
        assert number.temperature.low < -0.003 < number.temperature.high
    else:  # nobody else tells the law
        assert number.temperature is None
        assert (number.rises.looked_at, number.rises.found, number.rises.apart) == (11, [], ["U0"])
        assert "Not compared: latest run of 1 (U0)" in " ".join(history_text(histories(runs)[0], 30).split())
