"""Drives without springs, drawn by the independent generator: healthy, and with something off."""

import pytest
from answers import plain
from explain_drives import CASES, outcome, searched
from generator.axis import draw_axis

from etb_hil.discrepancy.answer.quality import data_quality
from etb_hil.discrepancy.plan.next_test import next_test


@pytest.mark.parametrize("motion", ["linear", "rotary"])
def test_a_healthy_drive_is_adequate_though_nobody_knows_its_bristles(motion):
    findings = searched(draw_axis(222100, motion))
    assert findings.verdict == "adequate"
    unit = {"linear": "m", "rotary": "rad"}[motion]
    assert plain(data_quality(findings.balances, findings.model))[0]["travel_unit"] == unit


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
