"""Limits that follow temperature and rest, and which limit applies to a measurement."""

import pytest
from pydantic import ValidationError

from etb_hil.diagnosis.limit_laws import DwellLaw, TemperatureLaw
from etb_hil.diagnosis.limits import Limit, Limits
from etb_hil.diagnosis.measurement_registry import measurement_kinds
from etb_hil.plant.table_one import Shaft


def dwell(per_decade="10 %", reference="1 s", between=("0.1 s", "100 s")):
    return DwellLaw.model_validate({"per_decade": per_decade, "reference": reference, "between": list(between)})


def heat(between=("0 degC", "80 degC"), coefficient="-0.3 %/K"):
    law = {"coefficient": coefficient, "reference": "20 degC", "between": list(between)}
    return TemperatureLaw.model_validate(law)


@pytest.mark.parametrize(
    ("rest", "factor"), [(1.0, 1.0), (10.0, 1.1), (100.0, 1.2), (1e4, 1.2), (0.1, 0.9), (0.0, 0.9)]
)
def test_a_ten_times_longer_rest_adds_its_share(rest, factor):
    assert dwell().factor(rest) == pytest.approx(factor)


@pytest.mark.parametrize(("rest", "factor"), [(10.0, 1.0), (100.0, 1.1), (1.0, 0.9), (0.1, 0.8)])
def test_a_limit_is_that_stated_after_the_rest_it_is_stated_for(rest, factor):
    assert dwell(reference="10 s").factor(rest) == pytest.approx(factor)


@pytest.mark.parametrize(
    ("law", "says"),
    [
        ({"between": ("0 s", "1 s")}, "two times above zero"),
        ({"between": ("1 s", "1 s")}, "the shorter one first"),
        ({"between": ("2 s", "1 s")}, "the shorter one first"),
        ({"per_decade": "110 %"}, "takes the limit to zero"),
        ({"per_decade": "-60 %"}, "takes the limit to zero"),
        ({"reference": "0 s"}, "reference"),
    ],
)
def test_impossible_laws_of_rest_are_refused(law, says):
    with pytest.raises(ValidationError, match=says):
        dwell(**law)


@pytest.mark.parametrize("law", [{"between": ("20 degC", "20 degC")}, {"coefficient": "5 %/K"}])
def test_impossible_laws_of_temperature_are_refused(law):
    with pytest.raises(ValidationError):
        heat(**law)


def test_both_limits_are_taken_to_the_throttle_shaft_and_the_temperature():
    limit = Limit(0.01, 0.02, Shaft.MOTOR, heat())
    assert limit.at_throttle(10.0, 70.0) == pytest.approx((0.085, 0.17))
    assert limit.at_throttle(10.0) == pytest.approx((0.1, 0.2))
    assert Limit(0.1, None).at_throttle(10.0) == (0.1, None)
    assert Limit(None, 0.2).at_throttle(10.0) == (None, 0.2)


def limits(**by_id):
    return Limits("A-1", "1", 0.03, by_id)


def test_the_limits_of_a_measurement_are_given_at_the_throttle_shaft():
    some = limits(T_st=Limit(0.1, 0.2), T_c=Limit(high=0.02, shaft=Shaft.MOTOR))
    assert (some.least("T_st", 10.0), some.most("T_st", 10.0)) == (0.1, 0.2)
    assert (some.least("T_c", 10.0), some.most("T_c", 10.0)) == (None, 0.2)
    assert (some.least("other", 10.0), some.most("other", 10.0)) == (None, None)


def test_the_limit_of_a_single_value_comes_before_that_of_all():
    kind = measurement_kinds()["step_delay"]
    one, all_of_them = Limit(high=1.0), Limit(high=2.0)
    assert limits(step_delay_large_opening=one, step_delay=all_of_them).of(kind, "_large_opening") is one
    assert limits(step_delay_large_opening=one, step_delay=all_of_them).of(kind, "_small_opening") is all_of_them
    assert limits(step_delay_large_opening=one).of(kind, "_small_opening") is None


def test_break_away_from_rest_is_judged_by_a_limit_with_a_law_of_rest_alone():
    kind = next(kind for kind in measurement_kinds().values() if kind.judged_at_rest_by)
    plain, of_rest, own = Limit(high=0.2), Limit(high=0.2, dwell=dwell()), Limit(high=0.3)
    assert limits().of(kind) is None
    assert limits(**{kind.judged_at_rest_by: plain}).of(kind) is None
    assert limits(**{kind.judged_at_rest_by: of_rest}).of(kind) is of_rest
    assert limits(**{kind.judged_at_rest_by: of_rest, kind.id: own}).of(kind) is own
    assert limits(**{kind.judged_at_rest_by: of_rest}).dwell == dwell()
    assert limits(**{kind.judged_at_rest_by: plain}).dwell is None
    assert limits(step_delay=plain, **{kind.judged_at_rest_by: of_rest}).dwell == dwell()
