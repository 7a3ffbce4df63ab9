"""Drives without springs, drawn by the independent generator: healthy, and with something off."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from answers import plain
from explain_drives import CASES, balances_of, model_of, outcome, searched
from generator.axis import draw_axis

from etb_hil.discrepancy.answer.quality import data_quality
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.plan.next_test import next_test
from etb_hil.plant.effects.catalogue import CATALOGUE


@pytest.mark.parametrize("motion", ["linear", pytest.param("rotary", marks=pytest.mark.study)])
def test_a_healthy_drive_is_adequate_though_nobody_knows_its_bristles(motion):
    findings = searched(draw_axis(222100, motion))
    assert findings.verdict == "adequate"
    unit = {"linear": "m", "rotary": "rad"}[motion]
    assert plain(data_quality(findings.balances, findings.model))[0]["travel_unit"] == unit


@pytest.mark.parametrize(("driven", "has_bridge"), [("current", False), ("voltage", True)])
def test_of_a_drive_without_a_winding_no_bridge_is_said_to_be_open(driven, has_bridge):
    axis = draw_axis(222106, "rotary", driven=driven)
    (b,) = balances_of(axis, model := model_of(axis))
    some_missing = replace(b.measured, is_good=np.arange(len(b.measured)) % 5000 > 50)
    (quality,) = data_quality([Balances(some_missing, model)], model)
    (said,) = (flag for flag in quality.flags if "of the samples are missing or bad" in flag)
    assert ("or the bridge was open" in said) is has_bridge


MACHINES = {
    "brushless motor": {"driven": "current"},
    "motor in volts": {"driven": "voltage"},
    "pendulum": {"gravity": 4.0},
    "motor in volts with a pendulum": {"driven": "voltage", "gravity": 3.0},
    "axis on a spring": {"spring": 5.0},
}


@pytest.mark.parametrize("machine", MACHINES)
def test_a_healthy_machine_is_adequate_whatever_its_parts(machine):
    assert searched(draw_axis(222106, "rotary", **MACHINES[machine])).verdict == "adequate"


@pytest.mark.study
def test_a_linear_motor_in_volts_with_its_current_read_is_adequate():
    assert searched(draw_axis(222107, "linear", driven="voltage and current")).verdict == "adequate"


def test_gravity_that_the_file_lacks_is_found_with_its_size():
    """On the motor's own shaft it is the torque of cogging with one wave a turn: turning the machine tells them."""
    findings = searched(draw_axis(222108, "rotary", gravity=4.0, is_stated=False))
    assert findings.verdict == "ambiguous"
    (found,) = findings.accepted
    assert (found.winner.id, found.ambiguity_group) == ("gravity_load", ["cogging_torque"])
    truth = draw_axis(222108, "rotary", gravity=4.0)
    stated = float(re.search(r"gravity: {torque: ([\d.e-]+) N·m", truth.file)[1])
    sizes = [float(findings.final.fit.whole[k]) for k in CATALOGUE["gravity_load"].indices]
    assert math.hypot(*sizes) == pytest.approx(stated, rel=0.12)  # the file is up to 10 % off


@pytest.mark.parametrize("axis", [pytest.param(k, marks=[pytest.mark.study] if k < 5 else []) for k in range(6)])
def test_beside_friction_that_differs_by_direction_no_force_is_late(axis):
    """Each model of such a drive has a delay: what it is worth is told by the same descent with it and without it."""
    findings = searched(draw_axis(91302 + axis, "rotary", asymmetry=0.2))
    assert {found.winner.id for found in findings.accepted} <= {"friction_asymmetry"}


@pytest.mark.parametrize(
    ("motion", "driven"), [("rotary", "voltage"), pytest.param("linear", "force", marks=pytest.mark.study)]
)
def test_a_fan_that_the_file_lacks_is_found_with_its_size(motion, driven):
    """Viscosity and the friction's peak cannot bend as a square of the speed does."""
    axis = draw_axis(222111, motion, driven=driven, fan=1.0)
    findings = searched(axis)
    assert findings.verdict == "explained"
    (found,) = findings.accepted
    assert found.winner.id == "fan_drag"
    fastest = {"rotary": 12.0, "linear": 0.35}[motion]
    at_ten = findings.model.values.coulomb * (10.0 / fastest) ** 2  # the file is up to 10 % off
    assert float(findings.final.fit.whole[CATALOGUE["fan_drag"].indices[0]]) == pytest.approx(at_ten, rel=0.15)


@pytest.mark.study
@pytest.mark.parametrize("motion", ["linear", "rotary"])
def test_a_force_that_reads_too_large_is_no_wrong_number_alone(motion):
    """Every number is off by the same factor then, and nothing but their tolerances tells."""
    found = [searched(draw_axis(222101 + k, motion, force_scale=1.25)) for k in range(3)]
    outcomes = [outcome(findings, ("current_sensor_gain",)) for findings in found]
    assert set(outcomes) <= {"in its class", "unexplained", "adequate"}
    asked = [next_test(f) for f, said in zip(found, outcomes, strict=True) if said == "in its class"]
    assert asked
    assert all(test is not None and "apply a known force" in test.text for test in asked)


@pytest.mark.parametrize(
    ("motion", "case"),
    [
        ("linear", "mass 50 % larger"),
        *(
            pytest.param(motion, case, marks=pytest.mark.study)
            for motion, case in (
                ("rotary", "friction 20 % apart by direction"),
                ("linear", "friction 20 % apart by direction"),
                ("linear", "a wave of 20 % of the friction once a turn"),
                ("rotary", "mass 50 % larger"),
                ("rotary", "a wave of 20 % of the friction once a turn"),
            )
        ),
    ],
)
def test_what_is_off_is_named_or_in_its_class(motion, case):
    options, truths = CASES[case]
    assert outcome(searched(draw_axis(222102, motion, **options)), truths) in ("named", "in its class")


@pytest.mark.study
@pytest.mark.parametrize("motion", ["linear", "rotary"])
def test_friction_that_is_raised_everywhere_is_told_from_other_shapes_by_the_likelihood(motion):
    options, _ = CASES["friction 50 % larger"]
    findings = searched(draw_axis(222103, motion, **options))
    assert {one.winner.id for one in findings.accepted} == {"parameter:coulomb", "parameter:stiction"}
    others = {id_ for one in findings.accepted for id_ in one.ambiguity_group}
    assert not others & {"presliding_hysteresis", "friction_position_local", "friction_asymmetry"}
