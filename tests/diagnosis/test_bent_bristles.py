"""Intervals hold what windows that slide say alone, whatever bristles do while they bend."""

from dataclasses import replace

import numpy as np
import pytest
from independent_throttle import ELASTO_PLASTIC, LUGRE, MAXWELL_SLIP, Unit, friction_check, sense
from throttle_as_model import bench_model, rows_of

from etb_hil.diagnosis.assessment import JUDGED, assess
from etb_hil.diagnosis.bent_bristles import unsure_by_bristles, unsure_by_lag
from etb_hil.diagnosis.current_zero import Zero
from etb_hil.diagnosis.friction_model import COULOMB, DROP, LOG_SPEED, VISCOUS
from etb_hil.diagnosis.stribeck_fit import refit
from etb_hil.diagnosis.ticks import TickMaker
from etb_hil.diagnosis.window_weights import weights_of

ZERO = Zero(0.0, 1e-5, 1e-3, 0.0, 20.0)


def assessed(unit, rate):
    """Return the throttle's model, and what is known of its motion's ramps and dashes."""
    run, phases = friction_check(unit, creeps=())
    maker, model = TickMaker(), bench_model(unit)
    moving = [phase for phase in phases if phase[0] in {"ramp", "dash"}]
    for rows, _ in rows_of(sense(unit, run, rate, np.random.default_rng(5)), moving, rate):
        found, unknown = rows.columns, np.full(len(rows.time_ns), np.nan)
        angle = found["motor_angle"] / unit.gear_ratio
        maker.push(
            rows.time_ns, angle, found["motor_current"], found["motor_voltage"], unknown, unknown, unknown, JUDGED
        )
    return assess(maker.ticks(), model, model.values, ZERO)


@pytest.mark.parametrize("law", [LUGRE, ELASTO_PLASTIC, MAXWELL_SLIP], ids=["LuGre", "elasto-plastic", "Maxwell slip"])
def test_a_fit_to_windows_that_slide_is_about_a_standard_error_away_at_most(law):
    for stiffness in (60.0, 120.0, 200.0):
        found = assessed(Unit(law=law, bristle_stiffness=stiffness), 20000)
        one = found.laws[0]
        weight = weights_of(found.evidence, one.fit.parameters, one.fit.residual).of_sliding
        sliding = replace(found.evidence, counts=weight > 0.0)
        alone = refit(sliding, one.prior, one.fit.parameters)
        for number in (COULOMB, VISCOUS, LOG_SPEED):
            apart = abs(float(alone.parameters[number] - one.fit.parameters[number]))
            assert apart < 1.1 * one.fit.error({number: 1.0})


def test_without_windows_that_slide_nothing_is_added():
    found = assessed(Unit(), 1000)
    one, none_slides = found.laws[0], replace(found.evidence, slides=np.zeros(len(found.evidence), np.bool_))
    again = unsure_by_bristles(none_slides, one.prior, one.fit)
    for number in (COULOMB, DROP, VISCOUS, LOG_SPEED):
        assert again.error({number: 1.0}) == pytest.approx(one.fit.error({number: 1.0}), rel=0.01)


def test_another_lag_of_sliding_makes_omega_s_unsure_and_no_other_number():
    """Where the speed changes, friction of another law follows sooner: that looks like another Stribeck velocity."""
    found = assessed(Unit(), 20000)
    one = found.laws[0]
    again = unsure_by_lag(found.evidence, one.prior, one.fit)
    assert again.error({LOG_SPEED: 1.0}) > 1.05 * one.fit.error({LOG_SPEED: 1.0})
    for weights in ({COULOMB: 1.0, DROP: 1.0}, {COULOMB: 1.0}):
        assert again.error(weights) == pytest.approx(one.fit.error(weights), rel=0.03)
