"""The component that a cause sits in."""

import pytest

from etb_hil.plant.component import Component, component_at, component_of_parameter
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.port import Port
from etb_hil.plant.table_one import KINDS


def test_every_port_and_every_base_parameter_belongs_to_a_component():
    assert {component_at(port) for port in Port} | {component_of_parameter(name) for name in KINDS} == set(Component)


@pytest.mark.parametrize("effect", CATALOGUE.values(), ids=CATALOGUE)
def test_an_effect_sits_in_one_component(effect):
    assert len(effect.components) == 1


def test_a_loss_of_the_motor_is_no_friction_of_bearings():
    assert CATALOGUE["iron_loss"].components == {Component.MOTOR}
    assert CATALOGUE["presliding_hysteresis"].components == {Component.FRICTION}
