"""The virtual controller takes an extended model as its unit."""

from dataclasses import replace

import numpy as np
import pytest

from etb_hil.base.errors import InputError
from etb_hil.base.stock import find
from etb_hil.controller.machine import Machine
from etb_hil.plant.model_file import EffectEntry
from etb_hil.plant.parameters import load_model

MODEL = load_model(find("model", "default"))


def _angle_after(effects, seconds=0.4):
    unit = replace(MODEL, effects=effects)
    machine = Machine(unit, MODEL, seed=1, start_angle=1.0)
    machine.run(round(seconds * 1e9))
    return machine.plate_angle


def test_a_weaker_spring_returns_the_plate_later():
    shift = EffectEntry(id="spring_preload_shift", strengths={"preload": "-0.12 N·m"})
    plain = [_angle_after((), t) for t in (0.05, 0.1)]
    slower = [_angle_after((shift,), t) for t in (0.05, 0.1)]
    assert np.all(np.array(slower) > np.array(plain))


def test_an_effect_of_no_strength_changes_next_to_nothing():
    nothing = EffectEntry(id="cogging_torque", strengths={"sine": "1e-9 N·m"})
    assert _angle_after((nothing,)) == pytest.approx(_angle_after(()), abs=2e-4)


def test_an_effect_of_a_sensor_is_refused_by_name():
    gain = EffectEntry(id="current_sensor_gain", strengths={"gain_error": 0.1})
    with pytest.raises(InputError, match="current_sensor_gain"):
        _angle_after((gain,))
