"""Break-aways in ticks made to measure, their mean, the law of rest, and T_st of a unit on a simulated bench."""

import math
from dataclasses import replace

import numpy as np
import pytest
from throttle_as_model import phase_of

from etb_hil.base.outcome import UnitVerdict
from etb_hil.base.stock import find
from etb_hil.bench.simulation import Simulation
from etb_hil.diagnosis.break_away import BreakAway, at_rates, break_away_torque, break_aways
from etb_hil.diagnosis.diagnosis import Diagnosis
from etb_hil.diagnosis.limit_laws import DwellLaw
from etb_hil.diagnosis.limits_file import load_limits
from etb_hil.diagnosis.ticks import Ticks
from etb_hil.plant.parameters import load_model
from etb_hil.recording.samples import SampleBlock
from etb_hil.scenario.scenario_file import load_scenario

MODEL = load_model(find("model", "default"))
THROTTLE = MODEL.values
LEVEL = 0.17


def ticks_of(rests, *, speeds=(0.1,), per_decade=0.0, per_rate=0.0, even=0.0, noise=0.0, at=0.6, bend=0.0):
    """Creep to and fro with rests (s) between: friction climbs to its peak within 3 mrad, then stays at LEVEL.

    At each of the `speeds` (rad/s) in turn, there and back. With `bend` in rad, bristles bend so far instead: friction
    comes to LEVEL like an exponential of the way, from the other direction's.
    """
    rng = np.random.default_rng(8)
    angle, friction, place = [], [], at
    for number, rest in enumerate(rests):
        way = 1.0 if number % 2 == 0 else -1.0
        speed = speeds[number // 2 % len(speeds)]
        peak = LEVEL * (1.0 + per_decade * math.log10(rest / 0.1) + per_rate * math.log10(speed / 0.1))
        angle += [place] * round(rest * 1000)
        friction += [0.2 * way * LEVEL] * round(rest * 1000)
        moved = np.arange(1, round(60 / speed) + 1) * 1e-3 * speed
        climb = np.minimum(moved / 0.003, 1.0) * np.where(moved < 0.006, peak, min(peak, LEVEL))
        if bend:
            climb = LEVEL * (1.0 - 2.0 * np.exp(-moved / bend))
        angle += (place + way * moved).tolist()
        friction += (way * np.maximum(climb, 0.2 * LEVEL)).tolist()
        place = angle[-1]
    angle, friction = np.array(angle), np.array(friction) + even + noise * rng.standard_normal(len(angle))
    velocity, none = np.gradient(angle, 1e-3), np.zeros(len(angle))
    time = np.arange(len(angle)) * 1e-3
    return Ticks(time, angle, none, none, none, velocity, friction, none + 1.0, np.ones(len(angle), np.int64))


def test_one_for_every_rest_and_a_spring_that_is_off_cancels():
    found = break_aways(ticks_of([0.3, 0.5, 0.4, 0.3, 0.5, 0.4], even=0.02), THROTTLE)
    assert [one.direction for one in found] == [1, -1, 1, -1, 1, -1]
    assert [one.rest for one in found] == pytest.approx([0.3, 0.5, 0.4, 0.3, 0.5, 0.4], abs=0.03)
    assert [one.torque for one in found[:2]] == pytest.approx([LEVEL + 0.02, LEVEL - 0.02], abs=2e-3)
    assert break_away_torque(found).value == pytest.approx(LEVEL, abs=1e-3)
    assert break_away_torque(found).per_decade is None
    assert found[0].rate == pytest.approx(0.1 * LEVEL / 0.003, rel=0.15)


def test_intervals_of_few_break_aways_are_students():
    # Two of each direction: 4.303 standard errors with two degrees of freedom. Four and three rests: one over a line.
    def one(torque, direction, rest=0.5):
        return BreakAway(torque, direction, rest, 0.6, math.nan, 0.08)

    torque = break_away_torque([one(0.16, 1), one(0.18, 1), one(0.17, -1), one(0.17, -1)])
    assert torque.value == pytest.approx(0.17)
    assert torque.high - torque.value == pytest.approx(4.303 * math.sqrt(0.25 * (2e-4 / 2) * (1 / 2 + 1 / 2)), rel=1e-3)

    rests = [one(0.16, 1, 0.1), one(0.18, 1, 1.0), one(0.165, -1, 0.1), one(0.175, -1, 1.0)]
    slope, low, high = break_away_torque(rests).per_decade
    left = 2 * (0.0025**2 + 0.0025**2)  # of lines through either direction's mean, about their common slope
    assert slope == pytest.approx(0.015 / 0.17)
    assert high - slope == pytest.approx(slope - low)
    assert high - slope == pytest.approx(12.706 * math.sqrt(left / 1.0) / 0.17, rel=1e-3)


def test_law_of_rest():
    rests = [0.2, 0.2, 1.0, 1.0, 4.0, 4.0, 0.4, 0.4]
    for law in (0.0, 0.12):
        found = break_away_torque(break_aways(ticks_of(rests, per_decade=law, noise=1e-3), THROTTLE))
        slope, low, high = found.per_decade
        assert low < slope < high
        assert slope == pytest.approx(law, abs=0.02)
        assert (low > 0.0) == (law > 0.0)


def test_several_rates_are_told_apart_each_with_both_directions():
    for law in (0.0, -0.05):
        ticks = ticks_of([0.3] * 12, speeds=(0.03, 0.1, 0.25), per_rate=law, noise=5e-4)
        found = break_aways(ticks, THROTTLE)
        told = at_rates(found)
        assert [torque.count for _, torque in told] == [4, 4, 4]
        # Friction climbs to its peak over 3 mrad
        expected = [(speed, LEVEL * (1.0 + law * math.log10(speed / 0.1))) for speed in (0.03, 0.1, 0.25)]
        assert [rate for rate, _ in told] == pytest.approx([v * peak / 0.003 for v, peak in expected], rel=0.25)
        assert [torque.value for _, torque in told] == pytest.approx([peak for _, peak in expected], rel=0.01)
        slope, low, high = break_away_torque(found).per_rate
        assert low < slope < high
        assert slope == pytest.approx(law, abs=0.01)
    alike = break_aways(ticks_of([0.3] * 4), THROTTLE)
    assert at_rates(alike) == []
    assert break_away_torque(alike).per_rate is None


def test_without_a_single_rate_there_is_no_law_of_it():
    """Friction that stood as high at rest, as where a current of the wrong sign makes it, has none."""
    found = break_aways(ticks_of([0.3] * 4), THROTTLE)
    torque = break_away_torque([replace(one, rate=math.nan) for one in found])
    assert torque.value == break_away_torque(found).value
    assert torque.per_rate is None


def test_a_plate_that_stops_within_the_bristles_has_not_broken_away_twice():
    ticks = ticks_of([0.3] * 4)
    begun = int(np.flatnonzero(ticks.angle > 0.6 + 0.012)[0])
    halted = [np.insert(column, begun, np.full(200, column[begun])) for column in (ticks.angle, ticks.friction)]
    angle, friction = halted
    none = np.zeros(len(angle))
    time = np.arange(len(angle)) * 1e-3
    velocity = np.gradient(angle, 1e-3)
    stopped = Ticks(time, angle, none, none, none, velocity, friction, none + 1.0, np.ones(len(angle), np.int64))
    assert len(break_aways(stopped, THROTTLE)) == len(break_aways(ticks, THROTTLE)) == 4


@pytest.mark.parametrize("bend", [0.003, 0.0095])
def test_bristles_that_bend_far_are_followed_to_the_end_of_it(bend):
    """A sticky unit's keep 3 % of their way 0.04 rad from where they turned round."""
    found = break_aways(ticks_of([0.3] * 4, bend=bend), THROTTLE)
    assert len(found) == 4
    assert break_away_torque(found).value == pytest.approx(LEVEL, rel=0.004)


def test_known_law_of_rest_brings_break_aways_to_its_reference():
    law = DwellLaw(per_decade="12 %", reference="0.1 s", between=["0.1 s", "10 s"])
    assert [law.factor(rest) for rest in (0.01, 0.1, 1.0, 100.0)] == pytest.approx([1.0, 1.0, 1.12, 1.24])
    found = break_aways(ticks_of([0.2, 0.2, 1.0, 1.0, 4.0, 4.0], per_decade=0.12), THROTTLE)
    assert break_away_torque(found).value > 1.05 * LEVEL
    assert break_away_torque(found, law.factor).value == pytest.approx(LEVEL, rel=0.01)


def test_quick_starts_stops_and_short_rests_are_none():
    quick = ticks_of([0.3, 0.3])
    angle = np.where(quick.angle > 0.6, 0.6 + 20.0 * (quick.angle - 0.6), quick.angle)
    assert break_aways(replace(quick, angle=angle, velocity=np.gradient(angle, 1e-3)), THROTTLE) == []
    assert break_aways(ticks_of([0.3, 0.3], at=THROTTLE.stop_low + 0.01), THROTTLE)[1:] == []
    assert break_aways(ticks_of([0.05, 0.05]), THROTTLE) == []
    assert break_away_torque([]) is None


def test_stock_scenario_measures_break_away():
    scenario = load_scenario(find("scenario", "break_away")).content
    steps = [step for step in scenario.steps if step.phase.kind in {"current_zero", "home", "break_away"}]
    time_ns, columns = Simulation(MODEL, MODEL, law="pd", seed=2, rate=20000.0).run(steps)
    limits = load_limits(find("limits", "default"))
    law = DwellLaw(per_decade="5 %", reference="0.5 s", between=["0.1 s", "100 s"])
    strict = replace(limits.by_id["T_st"], high=0.16, dwell=law)
    # Judged only by limits that know the law of rest
    judges = [Diagnosis(MODEL, known) for known in (limits, replace(limits, by_id={**limits.by_id, "T_st": strict}))]
    none = np.zeros(20_000, np.int64)
    for part, kind in ((slice(20_000), "current_zero"), (slice(20_000, None), "break_away")):
        rows = {role: values[part] for role, values in columns.items() if not role.startswith("command")}
        stamps = time_ns[part]
        for diagnosis in judges:
            diagnosis.push(SampleBlock("samples", stamps, stamps, rows, np.resize(none, len(stamps))), phase_of(kind))
    number, judged = (diagnosis.finish().measurements["T_st_break_away"] for diagnosis in judges)
    assert number.low < THROTTLE.stiction < number.high
    assert number.value == pytest.approx(THROTTLE.stiction, rel=0.03)
    assert (number.limit_high, number.verdict) == (None, None)
    assert (judged.limit_high, judged.verdict) == (0.16, UnitVerdict.FAIL)
    assert judged.value == pytest.approx(number.value, rel=0.01)
    result = diagnosis.finish()
    at_rate = [number for number in result.measurements.values() if number.id.startswith("T_st_at_rate_")]
    assert [number.note for number in at_rate] == ["mean of 6"] * 3
    assert all(number.low < THROTTLE.stiction < number.high for number in at_rate)
    assert len(result.series["break_away_rate"]) == 18
    assert np.all(np.diff(result.series["ramp_rate"]) > 0.0)
