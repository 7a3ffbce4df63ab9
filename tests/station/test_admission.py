"""Which unit may be tested now, and on which bench: each rule on both sides of its edge."""

from datetime import UTC, date, datetime, timedelta

import pytest

from etb_hil.base.errors import BenchFault, InputError
from etb_hil.base.outcome import UnitVerdict
from etb_hil.station.admission import admitted_part, compared, require_fit_bench, stamped_later
from etb_hil.station.serial_pattern import LONGEST
from etb_hil.station.station_file import Calibration, Expected, Golden, Part, Retest, Station
from etb_hil.store.run import Measured, Run

NOW = datetime(2026, 11, 20, 12, 0, tzinfo=UTC)
PART = Part(number="P", revision="1", approver="a", serial="ETB-[0-9]+", limits="l", model="m")
GOLDEN = Golden(serial="G", part="P", every="24 h", expect={"T_st": {"value": "0.5 N·m", "within": "0.125 N·m"}})
STATION = Station(schema="etb_hil/station/1", name="s", bench="b", parts=(PART,), golden=GOLDEN)


def run(verdict="pass", serial="ETB-1", *, outcome="ok", hours=1.0, bench="b", part="P", stiction=0.5, started=None):
    started = started or (NOW - timedelta(hours=hours)).isoformat()
    numbers = {"T_st": Measured(stiction, None, None, None, None)}
    return Run(f"run-{hours}", started, bench, "s", serial, part, "1", outcome, verdict, "", 20.0, numbers)


def refused(station, serial, runs=()):
    with pytest.raises(InputError) as caught:
        admitted_part(station, serial, runs, NOW)
    return str(caught.value)


def test_a_station_wants_a_number_of_one_of_its_parts():
    assert admitted_part(STATION, "ETB-1", [], NOW) is PART
    assert refused(STATION, "") == "this station wants a serial number; give one with --serial"
    said = refused(STATION, "XYZ")
    assert "no part of this station has such a serial number (it is 'XYZ')" in said
    assert "allowed: P: ETB-[0-9]+" in said


def test_a_number_as_long_as_two_labels_is_said_to_be_too_long():
    longest = "ETB-" + "1" * (LONGEST - 4)
    assert admitted_part(STATION, longest, [], NOW) is PART
    assert f"the serial number has {LONGEST + 1} characters; allowed: {LONGEST} at most" in refused(
        STATION, longest + "1"
    )
    assert "no part of this station" in refused(STATION, "X" * LONGEST)
    golden = GOLDEN.model_copy(update={"serial": "G" * (LONGEST + 1)})
    assert admitted_part(STATION.model_copy(update={"golden": golden}), golden.serial, [], NOW) is PART


def test_a_number_of_two_parts_is_refused_with_both():
    other = PART.model_copy(update={"number": "Q", "serial": "ETB-1"})
    both = STATION.model_copy(update={"parts": (PART, other)})
    assert "fits several parts (P: ETB-[0-9]+; Q: ETB-1)" in refused(both, "ETB-1")
    assert admitted_part(both, "ETB-2", [], NOW) is PART


@pytest.mark.parametrize("verdict", ["pass", "fail"])
def test_a_unit_that_was_judged_stays_judged(verdict):
    said = refused(STATION, "ETB-1", [run("inconclusive", hours=3.0), run(verdict, hours=2.0)])
    assert f"the unit was judged already (it is 'ETB-1: {verdict} on 2026-11-20 10:00 UTC')" in said
    assert "allowed: again after: inconclusive" in said


def test_the_last_judgement_decides_and_what_judged_nothing_is_passed_over():
    again = STATION.model_copy(update={"retest": Retest(after=(UnitVerdict.FAIL,), most=3)})
    assert admitted_part(again, "ETB-1", [run("pass"), run("fail")], NOW) is PART
    assert "again after: fail" in refused(again, "ETB-1", [run("fail"), run("pass")])
    assert admitted_part(again, "ETB-1", [run("fail"), run("pass", outcome="fault"), run(None)], NOW) is PART
    never = STATION.model_copy(update={"retest": Retest(after=(), most=3)})
    assert "again after: never" in refused(never, "ETB-1", [run("fail")])


def test_a_run_that_is_stamped_after_now_neither_admits_a_unit_nor_refuses_it():
    later = [run("inconclusive", hours=-hours) for hours in (1.0, 900.0)]
    assert "judged already (it is 'ETB-1: fail on" in refused(STATION, "ETB-1", [run("fail"), *later])
    assert admitted_part(STATION, "ETB-1", [run("fail", hours=-1.0), *later], NOW) is PART
    assert "judged already" in refused(STATION, "ETB-1", [run("fail", hours=0.0)])


def test_runs_are_ordered_by_time_and_not_as_they_come_or_are_written():
    again = STATION.model_copy(update={"retest": Retest(after=(UnitVerdict.FAIL,), most=9)})
    east = run("pass", started="2026-11-20T11:30:00+02:00")  # 9:30 UTC
    assert admitted_part(again, "ETB-1", [run("fail", started="2026-11-20T10:00:00+00:00"), east], NOW) is PART
    bare = run("pass", started="2026-11-20T11:00:00")
    said = refused(again, "ETB-1", [bare, run("fail", started="2026-11-20T10:59:59+00:00")])
    assert "pass on 2026-11-20 11:00 UTC" in said
    earliest = run("pass", started="0001-01-01T00:00:00+05:00")
    assert "pass on" in refused(again, "ETB-1", [earliest])


def test_what_is_stamped_after_now_is_said():
    past = [run("pass"), run("pass", hours=0.0), run(None, hours=-1.0)]
    assert stamped_later(past, NOW) == ""
    assert stamped_later([*past, run("fail", hours=-2.5)], NOW) == (
        "the run run--2.5 on 2026-11-20 14:30 UTC is stamped after now (2026-11-20 12:00 UTC), so it does not count; "
        "set the clocks of the benches right"
    )
    said = stamped_later([run("fail", hours=-2.5), run("fail", hours=-1.0)], NOW)
    assert said.startswith("2 runs, the last run--2.5 on 2026-11-20 14:30 UTC, are stamped after now (")
    assert "so they do not count;" in said


def test_only_runs_of_the_same_unit_count():
    others = [run("fail", "ETB-2"), run("fail", part="Q")]
    assert admitted_part(STATION, "ETB-1", others, NOW) is PART


@pytest.mark.parametrize(("before", "most", "comes"), [(1, 2, True), (2, 2, False), (2, 3, True), (1, 1, False)])
def test_a_unit_is_judged_so_many_times_at_most(before, most, comes):
    station = STATION.model_copy(update={"retest": Retest(most=most)})
    runs = [run("inconclusive")] * before + [run(None, outcome="aborted")]
    if comes:
        assert admitted_part(station, "ETB-1", runs, NOW) is PART
    else:
        said = refused(station, "ETB-1", runs)
        assert f"ETB-1: {before} times, at last inconclusive on" in said
        assert f"allowed: {most} times" in said


def test_the_golden_unit_comes_as_often_as_it_is_wanted():
    assert admitted_part(STATION, "G", [run("pass", "G")] * 9, NOW) is PART
    without = STATION.model_copy(update={"golden": None})
    assert "no part of this station" in refused(without, "G")
    assert admitted_part(without, "ETB-1", [], NOW) is PART


def fit(*runs, station=STATION, serial="ETB-1", now=NOW):
    require_fit_bench(station, "b", serial, runs, now)


def unfit(*runs, **changed):
    with pytest.raises(BenchFault) as caught:
        fit(*runs, **changed)
    return str(caught.value)


def test_a_bench_without_a_golden_unit_needs_none():
    fit(station=STATION.model_copy(update={"golden": None}))


def test_a_bench_is_fit_for_as_long_as_its_check_holds():
    first = "test the golden unit, serial number G, first"
    assert unfit() == f"the bench has not checked itself with the golden unit yet; {first}"
    fit(serial="G")
    fit(run("pass", "G", hours=24.0))
    said = unfit(run("pass", "G", hours=24.01))
    assert said.startswith("the golden unit was measured 24.0 h ago (allowed: 24 h); test the golden unit")
    fit(run("pass", "G", hours=24.01), run("pass", "G", hours=23.0))


def test_a_check_that_is_stamped_after_now_makes_no_bench_fit_and_hides_no_other():
    later = run("pass", "G", hours=-900.0)
    assert "came out wrong in run-1.0" in unfit(run("pass", "G", stiction=9.0), later)
    assert "was measured 25.0 h ago" in unfit(run("pass", "G", hours=25.0), later)
    said = unfit(later)
    assert "has not checked itself" in said
    assert "the run run--900.0 on 2026-12-28 00:00 UTC is stamped after now" in said
    fit(run("pass", "G"), run("pass", "G", hours=-1.0, stiction=9.0))
    fit(run("pass", "G", hours=0.0))


def test_a_start_without_an_offset_is_utc():
    fit(run("pass", "G", started="2026-11-19T12:00:00"))
    assert "was measured 24.0 h ago" in unfit(run("pass", "G", started="2026-11-19T11:59:00"))


def test_only_judged_runs_of_the_golden_unit_on_this_bench_are_checks():
    for other in (run("pass", "ETB-1"), run("pass", "G", bench="c"), run("pass", "G", outcome="fault"), run(None, "G")):
        assert "has not checked itself" in unfit(other)
        fit(run("pass", "G"), other)


@pytest.mark.parametrize(("stiction", "good"), [(0.625, True), (0.375, True), (0.626, False), (0.374, False)])
def test_the_last_check_has_to_be_as_expected(stiction, good):
    check = run("fail", "G", stiction=stiction)
    (said,) = compared(GOLDEN, check)
    assert said == (f"T_st {stiction:.3f} N·m, expected 0.500 within 0.125 N·m", good)
    if good:
        fit(run("pass", "G", hours=5.0, stiction=9.0), check)
    else:
        assert f"came out wrong in run-1.0: {said[0]}; find out why" in unfit(run("pass", "G", hours=2.0), check)


def test_a_number_that_was_not_measured_is_not_as_expected():
    two = GOLDEN.model_copy(update={"expect": {**GOLDEN.expect, "T_c": Expected(value="0.2 N·m", within="0.1 N·m")}})
    assert compared(two, run("pass", "G")) == [
        ("T_st 0.500 N·m, expected 0.500 within 0.125 N·m", True),
        ("T_c unknown, expected 0.200 within 0.100 N·m", False),
    ]


def test_every_overdue_calibration_is_named_and_stops_the_golden_unit_too():
    dates = {"torque": date(2026, 11, 19), "current": date(2026, 11, 20), "angle": date(2026, 11, 18)}
    entries = tuple(Calibration(of=of, certificate=f"K-{of}", due=due.isoformat()) for of, due in dates.items())
    station = STATION.model_copy(update={"calibration": entries})
    said = unfit(run("pass", "G"), station=station, serial="G")
    assert said == (
        "calibration is overdue since: torque (certificate K-torque): 2026-11-19; angle (certificate K-angle): "
        "2026-11-18; have it calibrated, and note the new date"
    )
    fit(run("pass", "G", hours=48.0), station=station, now=datetime(2026, 11, 18, 23, 59, tzinfo=UTC))
