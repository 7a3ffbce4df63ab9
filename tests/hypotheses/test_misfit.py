"""What is lacking is told by channels: what explains one is no alternative to what explains another."""

import pytest

from etb_hil.hypotheses.constants import EQUIVALENT_PARAMETER, EQUIVALENT_SHAPE, MATERIAL, NEEDED, NOTHING
from etb_hil.hypotheses.misfit import ANY, Misfit

NONE = Misfit(*[0.0] * len(ANY))
BEFORE = NONE._replace(torque=100.0, plate=6.0)
LEAST = NONE._replace(torque=EQUIVALENT_SHAPE * 100.0, voltage=MATERIAL, plate=MATERIAL)


def test_a_cause_of_one_channel_matters_beside_a_larger_misfit_of_another():
    assert BEFORE._replace(plate=0.0).lessens(BEFORE)
    assert BEFORE._replace(plate=0.0, torque=108.0).lessens(BEFORE)


@pytest.mark.parametrize("left", [NEEDED * 6.0 + 0.1, 6.0, 9.0])
def test_what_leaves_most_of_each_channel_is_no_cause(left):
    assert not BEFORE._replace(plate=left).lessens(BEFORE)


def test_an_immaterial_part_cannot_be_lessened():
    assert not NONE.lessens(NONE._replace(torque=0.9 * NOTHING))


@pytest.mark.parametrize("left", [{"voltage": 100.0}, {"voltage": 80.0}, {"voltage": 55.0, "plate": 55.0}])
def test_what_moves_a_misfit_to_other_channels_is_no_cause(left):
    assert not NONE._replace(**left).lessens(NONE._replace(torque=90.0))
    assert not BEFORE._replace(plate=0.0, torque=130.0).lessens(BEFORE)


def test_a_little_noise_beside_much_else_is_no_cause():
    assert not BEFORE._replace(plate=0.0).lessens(BEFORE._replace(plate=0.9 * MATERIAL))
    assert NONE.lessens(NONE._replace(plate=0.9 * MATERIAL))


def test_what_is_left_is_told_of_the_channel_that_the_cause_explains():
    cause = BEFORE._replace(plate=1.5)
    assert cause.share_of(BEFORE, cause) == pytest.approx(0.25)
    assert BEFORE._replace(plate=3.0).share_of(BEFORE, cause) == pytest.approx(0.5)


def test_nothing_is_left_where_each_part_is_immaterial():
    small = NONE._replace(torque=0.9 * NOTHING, voltage=0.9 * NOTHING)
    assert small.is_nothing
    assert small.is_little(small)


def test_what_a_shape_may_have_left_has_to_be_explained_nearly_whole():
    """In the channel of that shape alone; nothing is left of a part that is immaterial."""
    doubted = tuple(
        EQUIVALENT_PARAMETER if name == "torque" else share for name, share in zip(Misfit._fields, ANY, strict=True)
    )
    left = NONE._replace(torque=20.0, plate=6.0)
    assert not left._replace(torque=4.0).lessens(left, doubted)
    assert left._replace(torque=1.9).lessens(left, doubted)
    assert left._replace(plate=3.0).lessens(left, doubted)
    assert NONE._replace(torque=0.9 * NOTHING).lessens(NONE._replace(torque=5.0), doubted)


def test_an_alternative_explains_the_same_channel():
    cause = BEFORE._replace(torque=3.0)
    assert BEFORE._replace(torque=8.0).is_alternative_to(cause, BEFORE, LEAST)
    assert not BEFORE._replace(torque=95.0, plate=0.0).is_alternative_to(cause, BEFORE, LEAST)
    assert not BEFORE._replace(plate=0.0).is_alternative_to(cause, BEFORE, LEAST)


def test_a_cause_excludes_what_leaves_much_in_one_channel():
    cause = NONE._replace(torque=3.0)
    assert cause.excludes(NONE._replace(torque=40.0), LEAST)
    assert cause.excludes(NONE._replace(torque=3.0, plate=6.0), LEAST)
    assert not cause.excludes(NONE._replace(torque=20.0, plate=MATERIAL), LEAST)


def test_little_is_left_where_each_channel_has_little():
    assert NONE._replace(torque=30.0).is_little(BEFORE)
    assert not NONE._replace(torque=3.0, plate=6.0).is_little(BEFORE)
    assert NONE._replace(torque=0.9).is_little(NONE._replace(torque=1.1))
