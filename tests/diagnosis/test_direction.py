"""An angle that runs against the motor, however many samples are lost, and what is none."""

from dataclasses import replace

import numpy as np
import pytest
from independent_throttle import Unit, friction_check, sense
from throttle_as_model import bench_model, rows_of

from etb_hil.base.stock import find
from etb_hil.diagnosis.diagnosis import Diagnosis
from etb_hil.diagnosis.limits_file import load_limits

LIMITS = load_limits(find("limits", "default"))

# Next to no friction against strong springs: what friction takes in is a sixth of what the springs hold and give back.
SLIPPERY = Unit(
    gear_ratio=15.0,
    coulomb=0.04,
    stiction=0.045,
    torque_per_ampere=0.3,
    back_emf=0.3,
    preload_open=0.45,
    preload_close=0.3,
    stribeck_velocity=140.0 / 15.0,
)


def singly(samples):
    return np.arange(samples) % 400 != 0


def scattered(samples):
    return np.random.default_rng(2).random(samples) > 0.1


def in_stretches(samples):
    rng, kept = np.random.default_rng(2), np.ones(samples, bool)
    for start in rng.integers(0, samples - 100, 15):
        kept[start : start + rng.integers(10, 60)] = False
    return kept


LOSSES = pytest.mark.parametrize("lost", [None, singly, scattered, in_stretches])


def reasons(unit, sensed, lost=None):
    """Return the reasons, by id, of a friction check of a unit."""
    return {reason.id: reason for reason in judged(unit, sensed, lost).reasons}


def judged(unit, sensed, lost=None):
    """Return the result of a friction check of a unit, judged by what its bench knows."""
    run, phases = friction_check(unit)
    samples = sensed(sense(unit, run, 1000, np.random.default_rng(1)))
    diagnosis = Diagnosis(bench_model(unit), LIMITS)
    for rows, kind in rows_of(samples, phases, 1000, keep=None if lost is None else lost(len(samples.time_ns))):
        diagnosis.push(rows, kind)
    return diagnosis.finish()


def reversed_angle(samples):
    return replace(samples, motor_angle=-samples.motor_angle, throttle_angle=-samples.throttle_angle)


def swapped_leads(samples):
    return replace(samples, current=-samples.current, voltage=-samples.voltage)


def late_current(samples):
    """A current that is 4 ms behind the angle."""
    return replace(samples, current=np.concatenate([np.full(4, samples.current[0]), samples.current[:-4]]))


def late_angle(samples):
    """An angle that is 4 ms behind the current."""
    shown = np.concatenate([np.full(4, samples.motor_angle[0]), samples.motor_angle[:-4]])
    return replace(samples, motor_angle=shown)


@LOSSES
def test_a_reversed_angle_is_named_whatever_samples_are_lost(lost):
    found = reasons(Unit(), reversed_angle, lost)
    assert "angle_reversed" in found
    assert not found.keys() & {"back_emf_contradicts", "spring_elsewhere"}


@pytest.mark.parametrize("lost", [None, singly, scattered])
def test_a_reversed_angle_is_named_where_friction_is_next_to_none(lost):
    assert "angle_reversed" in reasons(SLIPPERY, reversed_angle, lost)


def test_leads_that_are_swapped_are_not_told_from_a_reversed_angle():
    reason = reasons(Unit(), swapped_leads)["angle_reversed"]
    assert "or that of both current and voltage (the motor's leads)" in reason.text


@LOSSES
@pytest.mark.parametrize("sensed", [lambda s: s, late_current, late_angle], ids=["right", "late current", "late angle"])
@pytest.mark.parametrize("unit", [Unit(), SLIPPERY], ids=["healthy", "slippery"])
def test_an_angle_that_runs_the_right_way_is_never_reversed(unit, sensed, lost):
    assert "angle_reversed" not in reasons(unit, sensed, lost)


def test_no_number_of_a_bench_that_is_wired_wrongly_passes_or_fails():
    found = judged(Unit(), reversed_angle)
    assert "angle_reversed" in {reason.id for reason in found.reasons}
    assert [one.id for one in found.measurements.values() if one.is_judged] == []
