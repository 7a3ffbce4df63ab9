"""Friction over speed that goes by no law of friction: losses in the motor's iron, from the hidden generator."""

from dataclasses import replace

import explain_cases  # noqa: F401 (lets Python find the generator of hidden cases)
import numpy as np
import pytest
from generator.rig import no_effects
from independent_throttle import ELASTO_PLASTIC, Unit, friction_check, sense
from test_bent_bristles import assessed
from test_diagnosis_verdicts import judge
from throttle_as_model import bench_model
from verdicts_under_effects import judged, on_the_rig, sized

from etb_hil.diagnosis.fitted_numbers import fitted_numbers
from etb_hil.diagnosis.speed_misfit import SpeedMisfit

SHARES = (0.15, 0.3)  # of T_c, that the losses take


@pytest.fixture(scope="module", params=SHARES)
def lossy(request):
    return with_losses(Unit(coulomb=0.15, stiction=0.18), request.param)


def with_losses(unit, share):
    rig, phases = on_the_rig(unit, unit, 3, 1000, 20.0)
    effects, _ = sized(rig, "iron_loss", share, np.random.default_rng(5), no_effects())
    return judged(rig, phases, unit, effects, 1000, 1.0)


def test_where_friction_is_off_the_law_is_said(lossy):
    (said,) = [reason for reason in lossy.reasons if reason.id == "friction_by_no_law"]
    assert "mN·m off the likeliest law" in said.text


def test_what_only_the_law_parts_is_bounded_above_or_not_given(lossy):
    for name, true in (("T_c", 0.15), ("viscous", 1e-3)):
        found = lossy.measurements.get(name)
        assert (found.value, found.low) == (None, 0.0)
        assert true < found.high
    omega_s = lossy.measurements["omega_s"]
    assert (omega_s.value, omega_s.high, omega_s.note) == (None, None, "friction over speed goes by no known law")


def test_no_faster_plate_is_asked_for_where_there_is_no_law():
    result = with_losses(Unit(coulomb=0.17, stiction=0.21, stribeck_velocity=10.0), 0.3)
    ids = [reason.id for reason in result.reasons]
    assert ids[0] == "T_c_undecided"
    assert "friction_by_no_law" in ids
    assert "T_c_not_reached" not in ids


def test_stiction_is_known_without_the_law(lossy):
    found = lossy.measurements.get("T_st")
    assert found.low < 0.18 < found.high
    assert found.high - found.low < 0.1 * found.value


@pytest.mark.parametrize(
    "unit",
    [
        Unit(),
        Unit(stribeck_velocity=10.0),
        Unit(exponent=0.7),
        Unit(exponent=2.5),
        Unit(dwell=0.08),
        Unit(law=ELASTO_PLASTIC),
        Unit(drift=-0.006),
    ],
    ids=["the paper's", "a slow fall", "steep", "blunt", "ageing", "elasto-plastic", "drifting"],
)
def test_friction_by_a_law_is_not_doubted(unit):
    unit = replace(unit, coulomb=0.13)
    motion, phases = friction_check(unit)
    result = judge(unit, sense(unit, motion, 1000, np.random.default_rng(8)), phases, 1000)
    assert all(reason.id != "friction_by_no_law" for reason in result.reasons)
    assert result.measurements.get("T_c").low > 0.0


def test_friction_above_the_law_raises_the_bounds_of_its_own_speeds():
    """T_c is below friction at every speed, and viscosity takes no more than all of it at the fastest."""
    found, more = assessed(Unit(), 1000), 0.005

    def highest(name, misfit):
        return fitted_numbers(found, bench_model(Unit()).values, misfit)[name].high

    below, slow, fast = (SpeedMisfit(*at) for at in ((found.fastest, -more), (0.05, more), (found.fastest, more)))
    assert highest("viscous", fast) == pytest.approx(highest("viscous", below) + more / found.fastest)
    for name in ("T_c", "viscous"):
        assert highest(name, slow) == highest(name, below)
    assert highest("T_c", below) <= highest("T_c", fast) < highest("T_c", below) + more
