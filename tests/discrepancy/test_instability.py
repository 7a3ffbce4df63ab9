"""Where a voltage alone does not hold the plate."""

from dataclasses import replace

import pytest
from synthetic import MODEL

from etb_hil.discrepancy.answer.instability import unstable_range
from etb_hil.plant.device import THROTTLE
from etb_hil.plant.effects.layout import row
from etb_hil.plant.physics import LIMP_HOME, STOP_HIGH

SPRING = row("spring_nonlinear")


def test_straight_springs_hold_the_plate_everywhere():
    assert unstable_range(MODEL.vector(), THROTTLE) is None


def test_a_spring_that_gives_way_beyond_a_knee_does_not_hold_it_there():
    p = MODEL.vector()
    p[SPRING + 3], p[SPRING + 4] = -0.5, 0.1
    low, high = unstable_range(p, THROTTLE)
    assert low == pytest.approx(p[LIMP_HOME] + 0.6 * (p[STOP_HIGH] - p[LIMP_HOME]), abs=0.01)
    assert high == pytest.approx(p[STOP_HIGH], abs=0.01)


def test_a_fall_that_the_motor_damps_for_longer_than_a_run_is_none():
    p = MODEL.vector()
    p[SPRING + 3] = -0.06
    assert unstable_range(p, THROTTLE) is None


def test_a_drive_has_no_plate_that_may_be_unstable():
    """Without stops its angles reach 57295779513 deg."""
    p = MODEL.vector()
    p[SPRING + 3], p[SPRING + 4] = -0.5, 0.1
    assert unstable_range(p, replace(THROTTLE, is_throttle=False)) is None
