"""Verdicts on units that have an effect of the catalogue, which the bench's model lacks.

Run: python benchmarks/verdicts_under_effects.py [--units 20] [--rate 1000] [--seed 471] [--effects NAME ...]
     [--size 0.2]
One friction check a unit, by the generator of hidden cases. Units and what the bench believes of them are drawn as in
interval_coverage.py. The size of an effect is the 99th percentile of what it adds to the torque balance and, as the
torque of its current, to the voltage balance, in shares of T_c; where physics does not allow as much, the effect is as
large as it allows. A verdict is compared with the highest friction of the whole travel and both directions, and with
the least that a spring has over the friction that it returns the plate against at its place. Both hold the effect,
contacts having no age: a false FAIL has all of them within the stock limits, a false PASS one beyond.
Intervals are compared with the unit's parameters where the effect does not change these.
Effects of temperature have a housing at 50 degC, at which copper and magnets are as the bench's model says.
"""

import argparse
import math
import time
from collections import Counter
from dataclasses import replace

import explain_cases  # noqa: F401 (lets Python find the generator of hidden cases)
import numpy as np
from diagnosis_power import COPPER, LIMITS, MAGNETS, RISES, UNIT_SPREAD, healthy_design
from generator import layout as at
from generator.balances import balances
from generator.bench import control_gains
from generator.friction import extra_drag, steady_friction
from generator.recipes import RECIPES
from generator.rig import Rig, no_effects
from generator.sensitivity import QUIET
from generator.springs import spring_torque
from independent_throttle import Sensed, check_motion, off_by_tolerances
from interval_coverage import agreement
from throttle_as_model import bench_model, rows_of

from etb_hil.diagnosis.diagnosis import Diagnosis

OF_FRICTION = {
    "friction_position_periodic", "friction_position_local", "friction_temperature", "friction_asymmetry",
    "friction_load", "stiction_dwell", "stribeck_shape", "presliding_hysteresis", "iron_loss",
}  # fmt: skip
OF_TEMPERATURE = {"friction_temperature", "magnet_temperature", "resistance_temperature"}
REFERENCE = 25.0  # degC of the generator
PLATE_INERTIA = 4e-5  # kg m^2
MODES = {0: at.BRIDGE_OFF, 1: at.CLOSED_LOOP}
NEARLY = 0.1  # of its size, within which an effect is as large as asked for


def in_the_generator(unit):
    """Return a unit of interval_coverage.py as the generator has it."""
    gear = unit.gear_ratio
    own = {
        "motor_constant": unit.torque_per_ampere / gear,
        "plate_inertia": PLATE_INERTIA,
        "motor_inertia": (unit.inertia - PLATE_INERTIA) / gear**2,
    }
    return {name: float(own[name] if name in own else getattr(unit, name)) for name in at.PARAMETERS}


def on_the_rig(unit, bench, seed, rate, temperature):
    """Return the rig of a friction check, and its phases."""
    reference, velocity, mode, phases = check_motion(unit.limp_home)
    inputs = np.zeros((len(reference), at.INPUTS))
    inputs[:, at.IN_ANGLE], inputs[:, at.IN_VELOCITY] = reference, velocity
    inputs[:, at.IN_MODE] = [MODES[one] for one in mode]
    inputs[:, at.IN_TEMPERATURE] = temperature
    nominal = in_the_generator(bench)
    rig = Rig(seed, in_the_generator(unit), nominal, "friction_check", rate, inputs, control_gains(nominal, 120.0))
    return rig, phases


def size(rig, effects):
    """Return what effects add to torque and voltage balance, in shares of T_c, copper and magnets being warm."""
    p, warmer = rig.parameters.copy(), rig.inputs[0, at.IN_TEMPERATURE] - REFERENCE
    if warmer > 0.0:
        p[at.R] *= 1.0 + COPPER * warmer
        p[at.K] *= 1.0 + MAGNETS * warmer
    found = balances(rig.record(effects, QUIET), p, rig.rate)
    volts = p[at.K] * p[at.N] / p[at.R] * found["voltage"]
    return float(np.percentile(np.hypot(found["torque"] + found["torque_at_stops"], volts), 99.0)) / p[at.COULOMB]


def sized(rig, name, wanted, rng, beside):
    """Return effects with one of the wanted size, or as large as physics allows, and the size."""
    recipe = RECIPES[name]
    row = recipe.draw(name, rng, rig.unit)
    strength = recipe.start
    for _ in range(12):
        effects = beside.copy()
        effects[at.ROW[name]] = row
        effects[at.ROW[name], at.STRENGTH] = beside[at.ROW[name], at.STRENGTH] + strength * row[at.STRENGTH]
        found = size(rig, effects)
        if abs(found / wanted - 1.0) < NEARLY or (found < wanted and strength >= recipe.most):
            break
        strength = min(strength * np.clip(wanted / max(found, 1e-6), 0.2, 5.0), recipe.most)
    return effects, found


def extremes(rig, effects):
    """Return lowest and highest T_st and T_c over travel and directions, and the return margin."""
    p, inputs = rig.parameters, rig.inputs[0]
    angles = np.linspace(rig.unit["stop_low"], rig.unit["stop_high"], 1500)[1:-1]
    # At the edges of the dead zone the springs hold the plate with the least that they ever do.
    edge = 4.0 * rig.unit["dead_zone"] + 3.0 * effects[at.LIMP_HOME_ZONE, at.STRENGTH]
    away = angles - rig.unit["limp_home"]
    angles = np.concatenate([angles[np.abs(away) > edge], rig.unit["limp_home"] + np.array([-edge, edge])])
    springs = np.array([spring_torque(a, inputs, p, effects) for a in angles])
    found = {}
    for name, speed in (("T_st", 1e-6), ("T_c", 2.0 * rig.unit["stribeck_velocity"])):
        for way in (-1.0, 1.0):
            slow = np.array([0.0, way, inputs[at.IN_TEMPERATURE], inputs[at.IN_TEMPERATURE]])
            more = abs(extra_drag(way * speed, slow, effects))
            found[name, way] = more + np.array(
                [
                    steady_friction(a, way * speed, spring, slow, inputs, p, effects)
                    for a, spring in zip(angles, springs, strict=True)
                ]
            )
    ends = {
        name: (
            round(float(min(found[name, -1.0].min(), found[name, 1.0].min())), 4),
            round(float(max(found[name, -1.0].max(), found[name, 1.0].max())), 4),
        )
        for name in ("T_st", "T_c")
    }
    against = np.where(angles > rig.unit["limp_home"], found["T_st", -1.0], found["T_st", 1.0])
    return ends, float((np.abs(springs) - against).min())


def judged(rig, phases, bench, effects, rate, gain):
    """Return what the diagnosis says of a friction check on the rig."""
    table = rig.record(effects)
    sensed = Sensed(
        np.round(table["time"] * 1e9).astype(np.int64), gain * table["motor_current"], table["motor_voltage"],
        table["motor_angle"], table["throttle_angle"],
    )  # fmt: skip
    diagnosis = Diagnosis(bench_model(bench), LIMITS)
    for rows, kind in rows_of(sensed, phases, rate, temperature=rig.inputs[0, at.IN_TEMPERATURE]):
        diagnosis.push(rows, kind)
    return diagnosis.finish()


def check(name, number, options):
    """Return how the verdict agrees with the truth, the effect's size, which intervals hold the truth, and a text."""
    rng = np.random.default_rng([options.seed, number, at.ROW[name]])
    nominal = healthy_design(rng)
    bench = off_by_tolerances(nominal, rng)
    share = np.exp(UNIT_SPREAD * rng.standard_normal())
    unit = replace(nominal, coulomb=nominal.coulomb * share, stiction=nominal.stiction * share * rng.choice(RISES))
    beside = no_effects()
    if name in OF_TEMPERATURE:
        for row in (at.COPPER_HEAT, at.MAGNET_HEAT):
            beside[row, at.STRENGTH] = 1.0
    rig, phases = on_the_rig(unit, bench, number, options.rate, 50.0 if name in OF_TEMPERATURE else 20.0)
    effects, found = sized(rig, name, options.size, rng, beside)
    ends, margin = extremes(rig, effects)
    result = judged(rig, phases, bench, effects, options.rate, 1.0 + 0.02 * rng.uniform(-1.0, 1.0))
    agrees = agreement(ends["T_st"][1], ends["T_c"][1], margin, result)
    held = {}
    if name not in OF_FRICTION:
        for id_, true in (("T_st", unit.stiction), ("T_c", unit.coulomb), ("viscous", unit.viscous)):
            one = result.measurements.get(id_)
            if one is not None and one.low is not None:
                held[id_] = one.low <= true <= one.high
    said = {
        id_: f"{math.nan if m.value is None else m.value:.4f} [{m.low:.4f}, {m.high:.4f}]"
        for id_ in ("T_st", "T_c", "return_margin")
        if (m := result.measurements.get(id_)) is not None and m.low is not None
    }
    line = f"{name} {number}: {agrees}, size {found:.3f}, true {ends} margin {margin:.4f}, said {said}"
    return agrees, found, held, f"{line}, {[reason.id for reason in result.reasons]}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--units", type=int, default=20)
    parser.add_argument("--rate", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=471)
    parser.add_argument("--size", type=float, default=0.2, help="of an effect, in shares of T_c")
    parser.add_argument("--effects", nargs="*", default=at.CATALOGUE, choices=at.CATALOGUE)
    options = parser.parse_args()
    all_, start = Counter(), time.process_time()
    for name in options.effects:
        agreements, sizes, holds = Counter(), [], {}
        for number in range(options.units):
            agrees, found, held, line = check(name, number, options)
            agreements[agrees] += 1
            sizes.append(found)
            for id_, one in held.items():
                holds.setdefault(id_, []).append(one)
            if agrees.startswith("false"):
                print(f"  {line}", flush=True)
        all_ += agreements
        held = ", ".join(f"{id_} {sum(ones)} of {len(ones)}" for id_, ones in holds.items())
        print(f"{name}: {dict(agreements)}, size {np.median(sizes):.2f}, held: {held or '-'}", flush=True)
    print(f"all: {dict(all_)}, {time.process_time() - start:.0f} s of processor time")


if __name__ == "__main__":
    main()
