"""The generator's plant against physics that needs no simulation, and against itself at half the step."""

import ast
from pathlib import Path

import generator
import numpy as np
import pytest
from generator import layout as at
from generator.bench import control_gains, simulate
from generator.friction import stribeck_fraction
from generator.recipes import RECIPES
from generator.rig import no_effects, set_up
from generator.unit import draw_unit, vector
from scipy.optimize import brentq


def _open_loop(unit, volts, rate=2000, finer=1, effects=None):
    inputs = np.zeros((len(volts), at.INPUTS))
    inputs[:, at.IN_VOLTAGE] = volts
    inputs[:, at.IN_MODE] = at.OPEN_LOOP
    inputs[:, at.IN_TEMPERATURE] = 25.0
    effects = no_effects() if effects is None else effects
    return simulate(inputs, vector(unit), effects, control_gains(unit, 120.0), rate, finer=finer)


def _with(name, strength, seed=0):
    rng = np.random.default_rng(seed)
    effects = no_effects()
    row = RECIPES[name].draw(name, rng, draw_unit(rng))
    row[at.STRENGTH] = strength
    effects[at.ROW[name]] = row
    return effects


def test_the_generator_shares_no_code_with_the_package():
    for path in Path(generator.__file__).parent.glob("*.py"):
        tree = ast.parse(path.read_text("utf-8"))
        imported = [alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names]
        imported += [node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
        assert not [name for name in imported if name.split(".")[0] == "etb_hil"], path


@pytest.mark.parametrize("seed", range(3))
def test_energy_from_the_terminals_is_stored_or_lost_and_nothing_else(seed):
    rig = set_up(seed, "ramps_and_steps", 5.0, 20000)
    p = rig.parameters
    rows = simulate(rig.inputs, p, no_effects(), rig.gains, 20000)
    current, velocity, angle = rows[:, at.LOG_CURRENT], rows[:, at.LOG_VELOCITY], rows[:, at.LOG_ANGLE]
    inertia = p[at.N] ** 2 * p[at.J_MOTOR] + p[at.J_PLATE]
    dt = 1.0 / 20000
    # The voltage holds over a step; everything else is smooth.
    supplied = np.sum(rows[:-1, at.LOG_TERMINAL] * 0.5 * (current[1:] + current[:-1])) * dt
    heat = np.trapezoid(p[at.R] * current**2, dx=dt)
    friction = np.trapezoid(rows[:, at.LOG_FRICTION] * velocity, dx=dt)
    passed = p[at.K] * p[at.N] * current - rows[:, at.LOG_FRICTION] - inertia * rows[:, at.LOG_ACCELERATION]
    holding = np.trapezoid(passed * velocity, dx=dt)
    stored = 0.5 * p[at.L] * (current[-1] ** 2 - current[0] ** 2) + 0.5 * inertia * (
        velocity[-1] ** 2 - velocity[0] ** 2
    )
    assert supplied == pytest.approx(heat + friction + holding + stored, rel=2e-3)
    # Off the stops the springs give back what they took: their work is the area under the line between two angles.
    above = (angle[-1] - p[at.LIMP_HOME], angle[0] - p[at.LIMP_HOME])
    energy = [_spring_energy(away, p) for away in above]
    inside = (angle.min() > p[at.STOP_LOW]) and (angle.max() < p[at.STOP_HIGH])
    if inside:
        assert holding == pytest.approx(energy[0] - energy[1], abs=2e-3)


def _spring_energy(away, p):
    preload, slope = (p[at.PRELOAD_OPEN], p[at.SLOPE_OPEN]) if away > 0.0 else (p[at.PRELOAD_CLOSE], p[at.SLOPE_CLOSE])
    # The cubic rise over the dead zone holds back half of the preload there.
    return preload * (abs(away) - 0.5 * p[at.DEAD_ZONE]) + 0.5 * slope * away * away


@pytest.mark.parametrize("seed", range(4))
def test_stalled_on_the_upper_stop_the_current_is_voltage_over_resistance(seed):
    unit = draw_unit(np.random.default_rng(seed))
    last = _open_loop(unit, np.full(2500, 11.0))[-1]
    assert last[at.LOG_CURRENT] == pytest.approx(11.0 / unit["resistance"], rel=1e-6)
    pushed = unit["motor_constant"] * unit["gear_ratio"] * last[at.LOG_CURRENT]
    depth = last[at.LOG_ANGLE] - unit["stop_high"]
    spring = unit["preload_open"] + unit["slope_open"] * (last[at.LOG_ANGLE] - unit["limp_home"])
    held = pushed - spring - unit["stop_stiffness"] * depth
    assert depth > 0.0
    assert abs(held) <= unit["stiction"] + 1e-9  # friction holds the rest, and no more than it can


@pytest.mark.parametrize("seed", range(4))
def test_at_a_constant_voltage_the_speed_is_what_both_balances_say(seed):
    unit = {**draw_unit(np.random.default_rng(seed)), "slope_open": 0.0, "stop_high": 300.0}
    volts = 9.0
    row = _open_loop(unit, np.full(1500, volts))[-1]
    torque_per_ampere = unit["motor_constant"] * unit["gear_ratio"]

    def too_little(velocity):
        current = (volts - torque_per_ampere * velocity) / unit["resistance"]
        peak = (unit["stiction"] - unit["coulomb"]) * np.exp(-((velocity / unit["stribeck_velocity"]) ** 2))
        return torque_per_ampere * current - unit["preload_open"] - unit["coulomb"] - peak - unit["viscous"] * velocity

    assert row[at.LOG_VELOCITY] == pytest.approx(brentq(too_little, 0.0, 100.0), rel=1e-6)


def test_the_bridge_off_leaves_no_current_and_the_plate_at_limp_home():
    unit = draw_unit(np.random.default_rng(1))
    inputs = np.zeros((1500, at.INPUTS))
    inputs[:300, at.IN_VOLTAGE] = 10.0
    inputs[:, at.IN_MODE] = np.where(np.arange(1500) < 300, at.OPEN_LOOP, at.BRIDGE_OFF)
    rows = simulate(inputs, vector(unit), no_effects(), control_gains(unit, 120.0))
    assert rows[550, at.LOG_ANGLE] != pytest.approx(rows[650, at.LOG_ANGLE], abs=0.05)
    assert abs(rows[-1, at.LOG_CURRENT]) < 1e-9
    assert rows[-1, at.LOG_ANGLE] == pytest.approx(unit["limp_home"], abs=unit["dead_zone"])


def _volts(unit, seconds, into_stops):
    """A voltage that swings the plate about mid-travel, or from stop to stop."""
    t = np.arange(round(seconds * 1e3)) * 1e-3
    per_volt = unit["motor_constant"] * unit["gear_ratio"] / unit["resistance"]
    hold = (unit["preload_open"] + 0.5 * unit["slope_open"]) / per_volt
    slow, fast = (6.0, 1.5) if into_stops else (1.25, 0.3)
    swing = slow * np.sin(2.0 * np.pi * 1.3 * t) + fast * np.sin(2.0 * np.pi * 7.0 * t)
    return hold + unit["stiction"] / per_volt * swing


@pytest.mark.parametrize("effect", [None, "gear_backlash", "shaft_compliance", "end_stop_compliance"])
@pytest.mark.parametrize("into_stops", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_half_the_step_gives_the_same_motion(effect, into_stops, seed):
    effects = no_effects() if effect is None else _with(effect, RECIPES[effect].start)
    unit = draw_unit(np.random.default_rng(seed))
    volts = _volts(unit, 2.0, into_stops)
    coarse, fine = (_open_loop(unit, volts, finer=finer, effects=effects) for finer in (1, 2))
    apart = np.sqrt(np.mean((coarse - fine) ** 2, axis=0))
    # Teeth and stops that meet inside a step cost accuracy, far below a count of the encoder (2e-5 rad).
    knocks = into_stops or effect == "gear_backlash"
    assert apart[at.LOG_ANGLE] < (1e-5 if knocks else 1e-7)
    assert apart[at.LOG_FRICTION] < (1e-4 if knocks else 1e-6)


@pytest.mark.parametrize("strength", [0.45, 0.6])
def test_friction_that_one_side_nearly_loses_stays_a_friction_at_speed(strength):
    effects = _with("friction_asymmetry", strength)
    effects[at.FRICTION_ASYMMETRY, at.B] = -1.0
    unit = {**draw_unit(np.random.default_rng(0)), "bristle_stiffness": 120.0}
    volts = np.tile(np.repeat([11.0, -11.0], 150), 3)
    coarse, fine = (_open_loop(unit, volts, finer=finer, effects=effects) for finer in (1, 2))
    assert coarse[:, at.LOG_VELOCITY].min() < -20.0
    most = unit["bristle_stiffness"] * np.abs(coarse[:, at.LOG_BRISTLE]).max()
    assert most <= unit["stiction"] + 1e-9
    assert np.sqrt(np.mean((coarse - fine)[:, at.LOG_ANGLE] ** 2)) < 1e-5  # it goes from stop to stop


@pytest.mark.parametrize("name", at.EFFECTS)
def test_zero_strength_changes_nothing(name):
    rig = set_up(3, "ramps_and_steps", 2.0, 2000)
    plain = rig.record(no_effects())
    with_it = rig.record(_with(name, 0.0))
    for role, values in plain.items():
        assert np.array_equal(values, with_it[role]), role


def test_a_stiff_shaft_and_tight_teeth_come_close_to_the_rigid_plant():
    unit = draw_unit(np.random.default_rng(5))
    volts = _volts(unit, 1.5, into_stops=False)
    rigid = _open_loop(unit, volts)
    for effects in (_with("shaft_compliance", 5e-5), _with("gear_backlash", 1e-7)):
        loose = _open_loop(unit, volts, effects=effects)
        assert np.abs(loose[:, at.LOG_ANGLE] - rigid[:, at.LOG_ANGLE]).max() < 2e-4


def test_the_stribeck_share_falls_from_one_to_nothing():
    p = vector(draw_unit(np.random.default_rng(0)))
    shares = [stribeck_fraction(x * p[at.STRIBECK], p, no_effects()) for x in (0.0, 1.0, 2.15)]
    assert shares == pytest.approx([1.0, np.exp(-1.0), 0.0098], abs=1e-4)
