"""Transfer of a cause to another recording of the same axis, whose encoder starts to count anywhere."""

import math
from dataclasses import replace

import numpy as np
import pytest
from explain_drives import balances_of, model_of
from generator.axis import COULOMB, STICTION, draw_axis

from etb_hil.discrepancy.answer.angle_zero import is_absolute, shifts_for
from etb_hil.discrepancy.answer.transfer import transfer
from etb_hil.discrepancy.candidates.candidate import Candidate, Refined
from etb_hil.discrepancy.fitting.calibration import calibrate
from etb_hil.discrepancy.fitting.noise_floor import noise_floor_of, weigh
from etb_hil.discrepancy.fitting.unknowns import effect_unknowns
from etb_hil.discrepancy.search.findings import CurrentModel, Findings, SelectionStep
from etb_hil.plant.effects.catalogue import CATALOGUE

ID, TOOTH, ZERO = "cogging_torque", 0.1, 0.37


def drawn(motion, **options):
    return draw_axis(48, motion, seconds=8.0, **options)


@pytest.fixture(scope="module", params=["linear", "rotary"])
def motion(request):
    return request.param


@pytest.fixture(scope="module")
def found(motion):
    """The findings of a search that named the wave of one recording."""
    axis = drawn(motion, tooth=TOOTH)
    model = model_of(axis)
    segments = balances_of(axis, model)
    before = calibrate(model, segments)
    noise_floor = noise_floor_of(model, segments, before.fit.whole, before.unknowns)
    weigh(segments, noise_floor.level)
    effect, begin = CATALOGUE[ID], before.fit.whole.copy()
    begin[effect.place("sine")], begin[effect.place("order")] = TOOTH * model.values.coulomb, 1.0
    values = [begin[place] for place in effect.indices]
    own = effect_unknowns(effect, values, segments[0].load, segments[0].largest)
    fitted = calibrate(model, segments, begin, [*before.unknowns, *own])
    step = SelectionStep(before, Refined(Candidate(ID, effect), fitted.fit, fitted.unknowns), (), accepted=True)
    nothing = np.ones(9)
    return Findings(
        model, segments, before, [step], CurrentModel(fitted, noise_floor, nothing), nothing, np.ones(9, np.int64)
    )


def tried(found, motion, **options):
    other = drawn(motion, way_of=49, **options)
    (one,) = transfer(found, balances_of(other, found.model, "another recording"))
    return one


def test_a_wave_is_carried_over_to_a_recording_with_another_zero(found, motion):
    one = tried(found, motion, tooth=TOOTH, zero=ZERO)
    assert one.carried_over
    assert one.explained_share > 0.8
    turn = 2.0 * math.pi / found.balances[0].gear
    off = (one.angle_shift / turn + ZERO + 0.5) % 1.0 - 0.5
    assert abs(off) < 0.03
    unit = f"{1e3 * one.angle_shift:.1f} mm" if motion == "linear" else f"{math.degrees(one.angle_shift):.1f} deg"
    assert one.text.startswith(f"with {unit} added to the angle there, it explains ")


def test_of_a_recording_with_the_same_zero_no_shift_is_said(found, motion):
    one = tried(found, motion, tooth=TOOTH)
    assert one.carried_over
    assert one.angle_shift is None
    assert one.text.startswith("it explains ")


def test_the_free_run_has_the_shifted_angle(found, motion):
    errors, there = (tried(found, motion, tooth=TOOTH, zero=zero).free_run for zero in (ZERO, 0.0))
    assert abs(errors.with_cause - there.with_cause) < 0.1 * there.without_cause


@pytest.mark.parametrize("off", [{}, {"asymmetry": 0.2}, {"wrong": {COULOMB: 1.5, STICTION: 1.5}}])
def test_a_recording_without_the_wave_shows_it_at_no_zero(found, motion, off):
    """Not even where something else is off, of which a wave somewhere explains a little."""
    one = tried(found, motion, zero=ZERO, **off)
    assert not one.carried_over
    assert one.angle_shift is None
    assert one.text.startswith(
        "it explains less than 2 % of the residual there, or at no zero of the angle has 0.7 to 1.4"
    )


def test_the_segments_of_one_recording_have_one_zero(found, motion):
    other = drawn(motion, way_of=49, tooth=TOOTH, zero=ZERO)
    twice = [one for _ in range(2) for one in balances_of(other, found.model, "another recording")]
    first, second = transfer(found, twice)
    assert first.angle_shift == second.angle_shift


@pytest.mark.parametrize("part", ["has_stops", "has_spring"])
def test_of_an_axis_whose_zero_is_absolute_no_shift_is_tried(found, motion, part):
    device = replace(found.model.device, **{part: True})
    absolute = replace(found, model=replace(found.model, device=device))
    one = tried(absolute, motion, tooth=TOOTH, zero=ZERO)
    assert not one.carried_over
    assert one.angle_shift is None
    assert one.text == "it explains less than 2 % of the residual there and is not carried over"


def test_a_pendulum_of_the_model_file_has_an_absolute_zero():
    assert is_absolute(model_of(draw_axis(48, "rotary", gravity=4.0, seconds=1.0)))
    assert not is_absolute(model_of(draw_axis(48, "rotary", seconds=1.0)))


def test_a_wave_of_another_size_is_not_said_to_explain_nothing(found, motion):
    one = tried(found, motion, tooth=0.5 * TOOTH, zero=ZERO)
    assert not one.carried_over
    assert "or at no zero of the angle has 0.7 to 1.4 times its size there" in one.text


@pytest.mark.parametrize("off", [0.0, 1000.0])
def test_shifts_of_a_place_are_those_by_which_both_travels_overlap(found, off):
    effect, whole = CATALOGUE["friction_position_local"], found.final.fit.whole.copy()
    (width,) = (k for one, k in zip(effect.stated, effect.stated_indices, strict=True) if one.is_width)
    travel = np.ptp(found.balances[0].measured.angle)
    whole[width] = 0.1 * travel
    shifts = shifts_for([effect], whole, found.balances[0].measured.angle, found.balances[0].shifted(off))
    assert shifts[0] == pytest.approx(-off - travel, abs=0.11 * travel)
    assert shifts[-1] == pytest.approx(-off + travel, abs=0.11 * travel)
    assert len(shifts) < 50


def test_shifts_of_gravity_are_those_within_a_turn_of_the_shaft(found):
    angle = 100.0 * found.balances[0].measured.angle
    shifts = shifts_for([CATALOGUE["gravity_load"]], found.final.fit.whole, angle, found.balances[0])
    assert shifts[[1, -2]] == pytest.approx([-math.pi, math.pi])
    assert len(shifts) == 19


def test_effects_say_whether_they_depend_on_the_angle():
    ids = {id_ for id_, effect in CATALOGUE.items() if effect.depends_on_angle}
    assert {ID, "torque_ripple", "friction_position_periodic", "friction_position_local", "gravity_load"} <= ids
    assert not ids & {"friction_asymmetry", "angle_delay", "motor_angle_delay", "stribeck_shape", "iron_loss"}
