"""Elasto-plastic bristles: elastic below break-away, on the Stribeck curve when sliding, and never more than that."""

import dataclasses
import math

import independent_plant
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import odeint

from etb_hil.base.errors import InputError
from etb_hil.base.stock import find
from etb_hil.plant.bristle import ELASTIC_SHARE, bend
from etb_hil.plant.integrator import BRISTLE, OMEGA, STATES, THETA, TICK, advance_bristles, new_state
from etb_hil.plant.model_file import FrictionModel
from etb_hil.plant.model_text import model_text
from etb_hil.plant.parameters import load_model
from etb_hil.plant.voltage_run import run_voltage

MODEL = load_model(find("model", "default"))
DEFAULT = MODEL.values
FAULTY = load_model(find("model", "faulty")).values


def simulate(values, state, voltages, elastic=ELASTIC_SHARE, ticks=1):
    p, rows = values.vector(), np.empty((len(voltages), STATES))
    for k, voltage in enumerate(voltages):
        advance_bristles(state, p, elastic, voltage, ticks, TICK)
        rows[k] = state
    return rows


def shaken(elastic):
    """Return the angle after 4 s of holding near 46 deg under a vibration of 50 Hz, up to three quarters of T_st."""
    start, stiction = 0.8, DEFAULT.stiction
    spring = DEFAULT.preload_open + DEFAULT.slope_open * (start - DEFAULT.limp_home)
    turn = 2.0 * math.pi * 50.0
    impedance = abs(complex(DEFAULT.resistance, turn * DEFAULT.inductance))
    per_torque = 1.0 / DEFAULT.torque_per_ampere
    time = np.arange(4000) * 20 * TICK
    held = DEFAULT.resistance * per_torque * (spring - 0.25 * stiction)
    state = new_state(start)
    state[3] = spring * per_torque
    swing = 0.5 * stiction * per_torque * impedance * np.minimum(time, 1.0)
    return simulate(DEFAULT, state, held + swing * np.sin(turn * time), elastic, 20)[:, THETA]


def test_a_plate_below_break_away_stays_where_lugre_creeps():
    still, creeping = shaken(ELASTIC_SHARE), shaken(0.0)
    last = slice(-1000, None)
    assert abs(np.mean(still[last]) - 0.8) < DEFAULT.stiction / DEFAULT.bristle_stiffness
    assert abs(np.mean(still[-100:]) - np.mean(still[-1100:-1000])) < 1e-6
    assert np.mean(creeping[last]) < 0.7


@pytest.mark.parametrize(
    ("values", "stiffness"),
    [
        pytest.param(DEFAULT, 60.0, id="healthy-60.0"),
        pytest.param(FAULTY, 1e4, id="faulty-10000.0"),
        pytest.param(DEFAULT, 1e4, id="healthy-10000.0", marks=pytest.mark.study),
        pytest.param(FAULTY, 60.0, id="faulty-60.0", marks=pytest.mark.study),
    ],
)
def test_its_equations_are_those_of_an_independent_solver(values, stiffness):
    """Voltage swings that slide, reverse and stick, clear of limp-home and stops."""
    values = dataclasses.replace(values, bristle_stiffness=stiffness)
    spring = values.preload_open + values.slope_open * 0.6
    time = np.arange(6000) * TICK
    held = values.resistance * spring / values.torque_per_ampere
    volts = held + (3.0 * np.sin(2.0 * math.pi * 7.0 * time) + 1.5 * np.sin(2.0 * math.pi * 40.0 * time)) * np.exp(
        -8 * time
    )
    rows = simulate(values, new_state(0.75), volts)
    y, expected = new_state(0.75), []
    for voltage in volts:
        y = odeint(rates, y, [0.0, TICK], args=(values, voltage), rtol=1e-9, atol=[1e-12, 1e-10, 1e-14, 1e-10])[-1]
        expected.append(y)
    expected = np.array(expected)
    assert np.ptp(expected[:, THETA]) > 0.01
    assert np.sqrt(np.mean((rows[:, THETA] - expected[:, THETA]) ** 2)) < 5e-6
    bent = values.bristle_stiffness * (rows[:, BRISTLE] - expected[:, BRISTLE])
    assert np.sqrt(np.mean(bent**2)) < 2e-3 * values.stiction


def rates(y, _, values, voltage):
    theta, omega, z, current = y
    torque, z_dot = independent_plant.friction(omega, z, values, ELASTIC_SHARE)
    pull = independent_plant.springs(theta, values) + independent_plant.stops(theta, omega, values)
    acceleration = (values.torque_per_ampere * current - torque - pull) / values.inertia
    return (
        omega,
        acceleration,
        z_dot,
        (voltage - values.resistance * current - values.back_emf * omega) / values.inductance,
    )


@settings(max_examples=40, deadline=None)
@given(
    voltages=st.lists(st.floats(-12.0, 12.0) | st.just(float("nan")), min_size=1, max_size=40),
    start=st.floats(-0.05, 1.55),
    omega=st.floats(-40.0, 40.0),
    stiffness=st.floats(20.0, 1e5),
)
def test_bristles_never_carry_more_than_stiction(voltages, start, omega, stiffness):
    values = dataclasses.replace(FAULTY, bristle_stiffness=stiffness)
    state = new_state(start)
    state[OMEGA] = omega
    rows = simulate(values, state, voltages, ticks=20)
    assert np.all(np.isfinite(rows))
    assert np.abs(rows[:, BRISTLE] * stiffness).max() <= (1.0 + 1e-6) * values.stiction


def test_steady_sliding_is_on_the_stribeck_curve():
    bent = 0.0
    for _ in range(20_000):
        bent = bend(bent, 1e-5, 0.15, 0.15, 60.0, 1.0 / 60.0, ELASTIC_SHARE)[0]
    assert bent * 60.0 == pytest.approx(0.15, rel=1e-9)


def test_a_small_motion_is_elastic_and_comes_back():
    there = bend(0.0, 1e-3, 0.15, 0.15, 60.0, 1.0 / 60.0, ELASTIC_SHARE)
    assert there[:2] == (1e-3, 0.5e-3)
    assert bend(1e-3, -1e-3, 0.15, 0.15, 60.0, 1.0 / 60.0, ELASTIC_SHARE)[0] == 0.0


def test_a_model_file_chooses_the_law(tmp_path):
    text = find("model", "default").read_text("utf-8")
    path = tmp_path / "model.yaml"
    path.write_text(text + "\nfriction_model: elasto-plastic\n", "utf-8")
    model = load_model(path)
    assert model.friction_model is FrictionModel.ELASTO_PLASTIC
    again = tmp_path / "again.yaml"
    again.write_text(model_text(model, "once more"), "utf-8")
    assert load_model(again).friction_model is FrictionModel.ELASTO_PLASTIC
    time_ns = np.arange(400) * 1_000_000
    voltage = 2.0 + 2.0 * np.sin(np.arange(400) * 0.05)
    runs = [run_voltage(one, time_ns, voltage, 0.5, 20.0).angle for one in (MODEL, model)]
    assert 1e-5 < np.abs(runs[0] - runs[1]).max() < 0.2
    path.write_text(text + "\nfriction_model: coulomb\n", "utf-8")
    with pytest.raises(InputError, match="friction_model"):
        load_model(path)
