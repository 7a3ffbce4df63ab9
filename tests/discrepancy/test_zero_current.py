"""A current sensor's zero that a record shows at rest is no other one than that."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from synthetic import MODEL, measurement

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.search.zero_current import is_refuted
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.effects.layout import extended, row

OFFSET = "current_sensor_offset"


@pytest.fixture(scope="module")
def recorded():
    return measurement(MODEL.vector(), seed=1)


def _at_rest(measured, volts, reads):
    """The record with rests at both ends, under a voltage (V), where the current reads so much (A)."""
    rest = np.r_[0:900, len(measured) - 1000 : len(measured)]
    noise = np.random.default_rng(5).standard_normal((2, len(rest)))
    angle, voltage, current = measured.angle.copy(), measured.voltage.copy(), measured.current.copy()
    angle[:900], angle[-1000:] = angle[900], angle[-1000]
    voltage[rest] = volts + measured.sensors.voltage_noise * noise[0]
    current[rest] = reads + measured.sensors.current_noise * noise[1]
    return Balances(replace(measured, angle=angle, voltage=voltage, current=current), MODEL)


def _suspect(offset, id_=OFFSET):
    whole = extended(MODEL.vector())
    whole[row(OFFSET)] = offset
    return SimpleNamespace(candidate=SimpleNamespace(effect=CATALOGUE[id_]), fit=SimpleNamespace(whole=whole))


def test_a_zero_that_reads_nothing_is_not_off(recorded):
    b = _at_rest(recorded, 0.0, 0.0)
    assert is_refuted([b], _suspect(0.04))
    assert is_refuted([b], _suspect(-0.009))
    assert not is_refuted([b], _suspect(0.04, "friction_asymmetry"))


def test_one_that_reads_what_is_found_stands(recorded):
    assert not is_refuted([_at_rest(recorded, 0.0, 0.04)], _suspect(0.045))
    assert is_refuted([_at_rest(recorded, 0.0, 0.04)], _suspect(-0.04))


def test_a_voltage_that_holds_the_plate_says_nothing_of_the_zero(recorded):
    """A current that reads none may be the zero's opposite."""
    assert not is_refuted([_at_rest(recorded, 0.04 * MODEL.values.resistance, 0.0)], _suspect(-0.04))


def test_nor_does_what_never_rests(recorded):
    moves = replace(recorded, angle=recorded.angle + 1e-3 * np.sin(np.arange(len(recorded)) * 0.3))
    assert not is_refuted([Balances(moves, MODEL)], _suspect(0.04))


def test_it_is_looked_for_where_a_technician_is_told_to_look():
    assert CATALOGUE[OFFSET].looks_like == "a constant current is there with the bridge off"
