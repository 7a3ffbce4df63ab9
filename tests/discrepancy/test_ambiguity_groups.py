"""A right name is a guess where the data allow another: what has to be in a class."""

import pytest
from explain_cases import hidden_case
from explain_study import searched


@pytest.mark.study
@pytest.mark.parametrize(
    ("seed", "effects", "options"),
    [
        pytest.param(
            90058,
            ("measurement_delay",),
            {"view": "plate_only"},
            id="base parameters where no signal has a time offset",
        ),
        pytest.param(
            90397,
            ("limp_home_dead_zone",),
            {},
            id="base parameters beside a zone that reaches to the stop",
        ),
        pytest.param(
            90386,
            ("current_sensor_offset", "hbridge_dead_time"),
            {},
            id="a rival whose best shape is the end of its range",
        ),
        pytest.param(
            100016,
            ("parameter:coulomb",),
            {},
            id="a rival that takes nearly all as it was fitted",
        ),
        pytest.param(
            100035,
            ("presliding_hysteresis",),
            {},
            id="base parameters beside another shape that fits as well",
        ),
        pytest.param(
            111018,
            ("presliding_hysteresis",),
            {"level": "medium"},
            id="base parameters beside another curve that fits better",
        ),
        pytest.param(
            100012,
            ("parameter:bristle_stiffness",),
            {},
            id="a rival whose shape that takes most is none that looks alike",
        ),
        pytest.param(
            214510,
            ("magnet_temperature",),
            {"view": "no_current"},
            id="a winding that warms up, where no current tells",
        ),
        pytest.param(
            1003012,
            ("presliding_hysteresis", "measurement_delay", "brush_drop"),
            {"rate": 1000},
            id="a competing hypothesis of a cause that matters only beside a later one",
            marks=pytest.mark.study,
        ),
    ],
)
def test_a_cause_is_in_its_class_whatever_resembles_it(seed, effects, options):
    findings = searched(hidden_case(seed, effects, **options))
    classes = [{found.winner.id, *found.ambiguity_group} for found in findings.accepted]
    assert all(any(effect in one for one in classes) for effect in effects)
    assert all(one & set(effects) for one in classes)


@pytest.mark.study
@pytest.mark.parametrize("view", ["coarse_encoder", "encoder_only"])
def test_a_current_that_reads_wrong_is_not_taken_for_another_fault_alone(view):
    """All torques off by one factor, most of them inside their tolerances: what is left is the inertia's part of it."""
    (found,) = searched(hidden_case(212013, ("current_sensor_gain",), view=view)).accepted
    assert {found.winner.id, *found.ambiguity_group} > {"parameter:motor_inertia", "current_sensor_gain"}


@pytest.mark.study
@pytest.mark.parametrize(
    ("seed", "effect", "unmodelled"),
    [
        pytest.param(
            175000,
            "parameter:bristle_stiffness",
            {"current_sensor_gain"},
            id="a gain that is the number that was found, and the base",
        ),
        pytest.param(
            175105,
            "parameter:viscous",
            {"parameter:coulomb", "parameter:stiction"},
            id="friction's levels, which do it at no speed",
        ),
    ],
)
def test_what_is_no_class_of_a_wrong_number_is_not_named(seed, effect, unmodelled):
    findings = searched(hidden_case(seed, (effect,), "medium"))
    assert [found.winner.id for found in findings.accepted] == [effect]
    assert not unmodelled & set(findings.accepted[0].ambiguity_group)
