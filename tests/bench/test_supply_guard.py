"""The supply's window: what counts as outside, since when, and how it is said."""

import math

import numpy as np
import pytest

from etb_hil.bench.supply_guard import SupplyGuard
from etb_hil.recording.samples import SampleBlock
from etb_hil.scenario.condition import Condition

MS = 1_000_000


def guard(for_="50 ms", window=("10 V", "18 V")):
    return SupplyGuard(
        Condition.model_validate({"role": "supply_voltage", "outside": window, "for": for_})
    )  # fmt: skip


def block(*volts, start_ms=0, every_ms=25, late_ms=2, role="supply_voltage"):
    time_ns = (start_ms + every_ms * np.arange(len(volts))) * MS
    return SampleBlock("s", time_ns, time_ns + late_ms * MS, {role: np.array(volts, float)}, np.zeros(len(volts), int))


@pytest.mark.parametrize(
    ("volts", "is_outside"),
    [
        ([], False),
        ([13, 13, 13, 13], False),
        ([10, 10, 10, 10], False),  # the ends belong to the window
        ([18, 18, 18, 18], False),
        ([25, 25, 25, 13], False),
        ([25, 13, 25, 25], False),
        ([25, 25, 13, 25], False),
        ([13, 25, 25, 25], True),
        ([13, 18.01, 18.01, 18.01], True),
        ([13, 9.99, 9.99, 9.99], True),
        ([13, 9, 25, 9], True),
        ([13, math.nan, math.nan, math.nan], True),
        ([13, math.nan, 13, math.nan], False),
    ],
)
def test_it_is_outside_once_it_was_for_as_long_as_it_may(volts, is_outside):
    whole, parts = guard(), guard()
    whole.push([block(*volts)])
    for at, value in enumerate(volts):
        parts.push([block(value, start_ms=25 * at)])
    for one in (whole, parts):
        assert (one.outside is not None) == is_outside


@pytest.mark.parametrize(("every_ms", "is_outside"), [(50, True), (49, False)])
def test_the_time_that_it_may_last_counts_from_the_first_sample_outside(every_ms, is_outside):
    one = guard()
    one.push([block(13, 25, 25, every_ms=every_ms)])
    assert (one.outside is not None) == is_outside


@pytest.mark.parametrize(
    ("volts", "is_inside"),
    [
        ([], True),
        ([13, 13], True),
        ([10, 18], True),  # the ends belong to the window
        ([9.99, 13], False),
        ([13, 18.01, 13], False),
        ([13, math.nan, 13], False),
        ([20, 20], False),
    ],
)
def test_it_is_inside_only_where_all_new_samples_are(volts, is_inside):
    one = guard()
    new = [block(*volts), block(25, role="temperature"), block(13, start_ms=200)]
    one.push(new)
    assert one.outside is None
    assert one.is_inside(new) is is_inside
    assert one.is_inside([]) is True  # the newest sample is inside


def test_it_is_not_inside_while_the_newest_sample_is_outside():
    one = guard()
    one.push([block(13, 25)])
    assert one.outside is None
    assert not one.is_inside([])
    assert not one.is_inside([block(13)])


def test_without_a_time_one_sample_is_enough():
    one = guard(for_="0 s")
    one.push([block(13, 25)])
    assert (one.outside.stamp_ns, one.outside.value) == (27 * MS, 25.0)


def test_the_sample_that_fired_is_kept_until_the_supply_is_back():
    one = guard()
    one.push([block(13, 20, 21, 22, 23)])
    assert (one.outside.stamp_ns, one.outside.value) == (77 * MS, 22.0)
    one.push([block(24, start_ms=125)])
    assert one.outside.value == 22.0
    one.push([block(13, start_ms=150)])
    assert one.outside is None
    one.push([block(24, start_ms=175)])
    assert one.outside is None


def test_a_clock_that_goes_back_begins_anew():
    one = guard()
    one.push([block(25, start_ms=1_000), block(25, 25, start_ms=0)])
    assert one.outside is None
    one.push([block(25, start_ms=50)])
    assert one.outside is not None


def test_other_messages_say_nothing_of_the_supply():
    one = guard()
    one.push([block(25, 25, role="temperature"), block(25), block(13, start_ms=50, role="motor_voltage")])
    one.push([block(25, 25, start_ms=25)])
    assert one.outside is not None


def test_it_is_said_what_the_supply_is_and_what_it_should_be():
    one = guard()
    one.push([block(25, 25, 25.125)])
    assert str(one) == "supply at 25.12 V, outside 10 to 18 V"
    one = guard()
    assert str(one) == "no reading of the supply, outside 10 to 18 V"
    assert str(one.condition) == "supply_voltage outside 10 to 18 V for 0.05 s"
    one.push([block(math.nan, math.nan, math.nan)])
    assert str(one) == "no reading of the supply, outside 10 to 18 V"


def test_nothing_is_known_before_the_first_good_sample():
    one = guard()
    assert not one.is_inside([block(13)])
    one.push([block(math.nan), block(13, role="temperature")])
    assert not one.is_known
    one.push([block(13)])
    assert one.is_known
    assert one.is_inside([block(13)])


def test_a_reading_that_is_missing_does_not_make_a_known_supply_unknown():
    one = guard()
    assert not one.is_known
    one.push([block(math.nan)])
    assert not one.is_known
    one.push([block(13, start_ms=25), block(math.nan, start_ms=50)])
    assert one.is_known
