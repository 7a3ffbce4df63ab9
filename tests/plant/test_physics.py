"""What the equations and their integration must do whatever the numbers: the paper's properties, energy, symmetry."""

import dataclasses
import itertools

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from etb_hil.base.stock import find
from etb_hil.plant import physics
from etb_hil.plant.bristle import slide, strain
from etb_hil.plant.integrator import BRISTLE, CURRENT, OMEGA, STATES, THETA, TICK, advance, advance_record, new_state
from etb_hil.plant.parameters import load_model

DEFAULT = load_model(find("model", "default")).values
FAULTY = load_model(find("model", "faulty")).values
BOTH = pytest.mark.parametrize("values", [DEFAULT, FAULTY], ids=["healthy", "faulty"])

stiffnesses = st.floats(60.0, 1e4)
voltages = st.lists(st.floats(-12.0, 12.0) | st.just(float("nan")), min_size=1, max_size=40)


def simulate(values, state, voltages, ticks):
    record = np.empty((len(voltages) * ticks, STATES))
    advance_record(state, values.vector(), np.array(voltages), ticks, record)
    return record


def slide_along(values, velocities, bristle=0.0):
    """Bristles (n) and friction torque (n) under a prescribed velocity, linear between samples of a tick."""
    p = values.vector()
    rows = []
    for start, end in itertools.pairwise(velocities):
        g, g_end = physics.stribeck(start, p), physics.stribeck(end, p)
        bristle = strain(bristle, start, end, end, g, g_end, TICK, 1.0 / values.bristle_stiffness, 0.0, p)[0]
        rows.append((bristle, physics.friction_torque(end, bristle, p)))
    return np.array(rows).T


def test_indices_are_those_of_the_vector():
    names = [field.name for field in dataclasses.fields(DEFAULT)]
    assert len(names) == physics.PARAMETERS
    assert [getattr(physics, name.upper()) for name in names] == list(range(physics.PARAMETERS))
    assert physics.registers(DEFAULT.vector()) == tuple(DEFAULT.vector())


@BOTH
@given(velocities=st.lists(st.floats(-30.0, 30.0), min_size=2, max_size=60), stiffness=stiffnesses)
def test_property_1_bristles_never_carry_more_than_stiction(values, velocities, stiffness):
    values = dataclasses.replace(values, bristle_stiffness=stiffness)
    bristles, _ = slide_along(values, velocities)
    assert np.abs(stiffness * bristles).max() <= values.stiction * (1.0 + 1e-6)


@BOTH
@pytest.mark.parametrize("omega", [-20.0, -5.0, -0.1, 0.3, 4.0, 25.0])
def test_property_1_steady_sliding_gives_the_stribeck_curve(values, omega):
    values = dataclasses.replace(values, bristle_stiffness=1e3)
    _, torque = slide_along(values, np.full(20_000, omega))
    gaussian = np.exp(-((omega / values.stribeck_velocity) ** 2))
    curve = values.coulomb + (values.stiction - values.coulomb) * gaussian
    assert torque[-1] == pytest.approx(np.sign(omega) * curve + values.viscous * omega, rel=1e-9)


@BOTH
@pytest.mark.parametrize("bristle_share", [0.0, 0.3, 1.0])
def test_properties_2_and_3_a_monotone_dash_passes_stiction_and_settles_at_coulomb(values, bristle_share):
    """Velocity from negative, smooth and monotone to far above omega_s, slowly enough."""
    time = np.arange(0.0, 4.0, TICK)
    far = 4.0 * values.stribeck_velocity
    velocity = -0.3 + (far + 0.3) * 0.5 * (1.0 - np.cos(np.pi * time / 4.0))
    bristles, torque = slide_along(values, velocity, bristle_share * values.stiction / values.bristle_stiffness)
    after_turn = velocity[1:] > 0.0
    assert np.any(bristles[:-1] * bristles[1:] <= 0.0)  # z passes zero
    assert (values.bristle_stiffness * bristles[after_turn]).max() == pytest.approx(values.stiction, rel=0.01)
    assert values.bristle_stiffness * bristles[-1] == pytest.approx(values.coulomb, rel=1e-3)
    assert torque[-1] - values.viscous * velocity[-1] == pytest.approx(values.coulomb, rel=1e-3)


def test_a_dash_too_fast_for_property_3_misses_stiction():
    velocity = np.linspace(-0.05, 4.0 * FAULTY.stribeck_velocity, 40)
    bristles, _ = slide_along(FAULTY, velocity)
    assert (FAULTY.bristle_stiffness * bristles).max() < 0.8 * FAULTY.stiction


@given(
    bristle=st.floats(-1.0, 1.0),
    travel=st.floats(0.0, 0.1),
    share=st.floats(0.1, 0.9),
    g=st.floats(0.1, 0.6),
    stiffness=stiffnesses,
)
@example(bristle=-1.0, travel=0.0005, share=0.75, g=0.5, stiffness=626.0)  # the series, and beyond where it is used
def test_a_travel_in_two_parts_is_the_whole_travel(bristle, travel, share, g, stiffness):
    start = bristle * g / stiffness
    whole = slide(start, travel, g, g, stiffness, 1.0 / stiffness)[0]
    half = slide(start, share * travel, g, g, stiffness, 1.0 / stiffness)[0]
    parts = slide(half, (1.0 - share) * travel, g, g, stiffness, 1.0 / stiffness)[0]
    assert parts == pytest.approx(whole, abs=1e-11 * g / stiffness)


def stored_energy(rows, values):
    """Kinetic energy and that of springs, bristles and stops, in J, over a record, against rest at limp-home."""
    x = np.linspace(-0.3, 1.8, 210_001)
    p = values.vector()
    torque = np.array([physics.spring_torque(angle, p) for angle in x])
    potential = np.concatenate([[0.0], np.cumsum(0.5 * (torque[1:] + torque[:-1]) * np.diff(x))])
    beyond = np.maximum(rows[:, THETA] - values.stop_high, 0.0) + np.minimum(rows[:, THETA] - values.stop_low, 0.0)
    return (
        0.5 * values.inertia * rows[:, OMEGA] ** 2
        + np.interp(rows[:, THETA], x, potential - potential.min())
        + 0.5 * values.bristle_stiffness * rows[:, BRISTLE] ** 2
        + 0.5 * values.stop_stiffness * beyond**2
    )


@BOTH
@pytest.mark.parametrize("stiffness", [60.0, 1e4])
@pytest.mark.parametrize("start", [0.0, 0.5, 1.4])
def test_energy_is_never_created(values, stiffness, start):
    """Bridge open, no current: what is stored falls from tick to tick, but for the rounding of the potential."""
    values = dataclasses.replace(values, bristle_stiffness=stiffness)
    state = new_state(start)
    state[OMEGA] = 12.0 if start < 1.0 else -12.0
    rows = simulate(values, state, [float("nan")] * 500, 20)
    energy = stored_energy(rows, values)
    assert np.diff(energy).max() < 1e-11
    assert energy[-1] < 0.9 * energy[0]


@settings(max_examples=60, deadline=None)
@given(voltages=voltages, start=st.floats(0.05, 1.4), stiffness=stiffnesses)
def test_friction_is_passive(voltages, start, stiffness):
    """Over any run, friction gives back no more than its bristles held."""
    values = dataclasses.replace(FAULTY, bristle_stiffness=stiffness)
    rows = simulate(values, new_state(start), voltages, 20)
    p = values.vector()
    torque = np.array([physics.friction_torque(omega, z, p) for _, omega, z, _ in rows])
    power = torque * rows[:, OMEGA]
    taken = np.sum(0.5 * (power[1:] + power[:-1])) * TICK
    held = 0.5 * stiffness * np.diff(rows[[0, -1], BRISTLE] ** 2)[0]
    assert taken - held >= -1e-6


@settings(max_examples=100, deadline=None)
@given(voltages=voltages, offset=st.floats(-0.6, 0.6), omega=st.floats(-20.0, 20.0), stiffness=stiffnesses)
def test_a_mirrored_throttle_does_the_mirrored_thing(voltages, offset, omega, stiffness):
    values = dataclasses.replace(
        DEFAULT,
        limp_home=0.0,
        stop_low=-0.7,
        stop_high=0.7,
        bristle_stiffness=stiffness,
        slope_close=DEFAULT.slope_open,
    )
    state, mirror = new_state(offset), new_state(-offset)
    state[OMEGA], mirror[OMEGA] = omega, -omega
    assert np.array_equal(simulate(values, state, voltages, 20), -simulate(values, mirror, [-u for u in voltages], 20))


@settings(max_examples=60, deadline=None)
@given(voltages=voltages, start=st.floats(-0.01, 1.5), cut=st.integers(1, 19))
def test_a_run_does_not_feel_how_it_is_cut(voltages, start, cut):
    p = DEFAULT.vector()
    whole, parts = new_state(start), new_state(start)
    for voltage in voltages:
        advance(whole, p, voltage, 20)
        advance(parts, p, voltage, cut)
        advance(parts, p, voltage, 20 - cut)
    assert np.array_equal(whole, parts)


@settings(max_examples=60, deadline=None)
@given(
    voltages=voltages,
    start=st.floats(-0.05, 1.55),
    omega=st.floats(-40.0, 40.0),
    current=st.floats(-8.0, 8.0),
    stiffness=st.floats(20.0, 1e5),
    inductance=st.floats(1e-5, 3e-3),
)
def test_nothing_blows_up(voltages, start, omega, current, stiffness, inductance):
    values = dataclasses.replace(FAULTY, bristle_stiffness=stiffness, inductance=inductance)
    state = np.array([start, omega, 0.0, current])
    rows = simulate(values, state, voltages, 20)
    assert np.all(np.isfinite(rows))
    assert np.abs(rows[:, BRISTLE] * stiffness).max() <= (1.0 + 1e-6) * values.stiction
    assert np.abs(rows[:, CURRENT]).max() <= max(abs(current), (12.0 + 0.36 * 60.0) / values.resistance)
    assert np.abs(rows[:, OMEGA]).max() < 60.0


def test_at_rest_it_stays_at_rest():
    for voltage in (0.0, float("nan")):
        state = new_state(DEFAULT.limp_home)
        advance(state, DEFAULT.vector(), voltage, 100_000)
        assert np.array_equal(state, new_state(DEFAULT.limp_home))


@BOTH
def test_the_healthy_plate_comes_back_and_the_faulty_one_stays(values):
    state = new_state(1.0)
    simulate(values, state, [float("nan")] * 2000, 20)
    came_back = abs(state[THETA] - values.limp_home) < values.dead_zone + 1e-3
    assert came_back == (values.return_margin > 0.0)
    assert abs(state[OMEGA]) < 1e-3


def test_open_bridge_ends_the_current_and_keeps_it_at_zero():
    state = new_state(0.5)
    advance(state, DEFAULT.vector(), 12.0, 40)
    assert state[CURRENT] > 1.0
    rows = simulate(DEFAULT, state, [float("nan")], 200)
    gone = int(np.argmax(rows[:, CURRENT] == 0.0))
    assert 0 < gone < 40
    assert np.all(np.diff(rows[:gone, CURRENT]) < 0.0)
    assert np.all(rows[gone:, CURRENT] == 0.0)


def test_voltage_is_limited():
    limited, more = new_state(0.5), new_state(0.5)
    advance(limited, DEFAULT.vector(), 12.0, 100)
    advance(more, DEFAULT.vector(), 100.0, 100)
    assert np.array_equal(limited, more)


def test_the_springs_pull_towards_limp_home():
    p = DEFAULT.vector()
    assert physics.spring_torque(DEFAULT.limp_home, p) == 0.0
    assert physics.spring_torque(DEFAULT.limp_home + 0.1, p) == pytest.approx(0.35 + 0.1 * 0.05)
    assert physics.spring_torque(DEFAULT.limp_home - 0.1, p) == pytest.approx(-0.35 - 0.1 * 0.05)
    assert physics.spring_torque(DEFAULT.limp_home + DEFAULT.dead_zone, p) == pytest.approx(0.3501)
    assert abs(physics.spring_torque(DEFAULT.limp_home + 1e-4, p)) < 0.01


@given(theta=st.floats(-0.1, 1.6), omega=st.floats(-40.0, 40.0))
def test_the_stops_only_push(theta, omega):
    torque = physics.stop_torque(theta, omega, DEFAULT.vector())
    if theta > DEFAULT.stop_high:
        assert torque >= 0.0
    elif theta < DEFAULT.stop_low:
        assert torque <= 0.0
    else:
        assert torque == 0.0
