"""How often the fault of a unit is named from the record of a friction check, and how often wrongly.

    python benchmarks/unit_faults.py [--first 0] [--each 4] [--kinds KIND ...] [--rate 1000]

For each kind of fault the independent throttle runs a friction check; the bench's idea of the unit is drawn inside its
tolerances. Printed are verdict and causes with their ambiguity groups, with the component that all of them sit in.
Units of the kinds from `none` on are healthy, with presliding, a Stribeck curve or a drift that the model has not.
"""

import argparse
import time
from collections import Counter
from dataclasses import replace

import numpy as np
from independent_throttle import SAMPLE_S, Unit, friction_check, off_by_tolerances, sense
from throttle_as_model import bench_model

from etb_hil.discrepancy.answer.explanation import causes
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.measured.segments import measurements_of
from etb_hil.discrepancy.search.stepwise import search
from etb_hil.plant.component import Component
from etb_hil.recording.recording import ClockGrade, Recording
from etb_hil.recording.samples import SampleBlock

RIGHT = {
    "everywhere": ("parameter:coulomb", "parameter:stiction"),
    "break-away": ("parameter:stiction",),
    "place": ("friction_position_local",),
    "direction": ("friction_asymmetry",),
    "spring": ("parameter:preload_open", "parameter:preload_close", "spring_preload_shift"),
    "motor": ("parameter:torque_constant",),
    "winding": ("parameter:resistance",),
    "sensor": ("current_sensor_gain",),
    "worn-gear": ("gear_backlash",),
    "none": (),
    "elasto-plastic": (),
    "maxwell-slip": (),
    "gms": (),
    "exponent": ("stribeck_shape",),
    "drift": (),
}
LAWS = ("elasto-plastic", "maxwell-slip", "gms")  # of presliding, as `Unit.law` numbers them
COMPONENT = {
    **dict.fromkeys(("everywhere", "break-away", "place", "direction", "exponent"), Component.FRICTION),
    "spring": Component.SPRINGS,
    **dict.fromkeys(("motor", "winding"), Component.MOTOR),
    "sensor": Component.CURRENT_SENSOR,
    "worn-gear": Component.GEAR,
}


def faulty(kind, rng):
    """Return a unit with a fault of a kind, and the gain of its current sensor."""
    unit = Unit()
    share = rng.uniform(0.85, 1.15)
    unit = replace(unit, coulomb=share * unit.coulomb, stiction=share * unit.stiction)
    by, gain = {}, 1.0
    if kind == "everywhere":
        more = rng.uniform(1.6, 2.2)
        by = {"coulomb": more * unit.coulomb, "stiction": more * unit.stiction}
    elif kind == "break-away":
        by = {"stiction": rng.uniform(1.8, 3.5) * unit.stiction}
    elif kind == "place":
        by = {"bump": rng.uniform(0.6, 1.8), "bump_angle": rng.uniform(0.3, 1.2), "bump_width": rng.uniform(0.04, 0.12)}
    elif kind == "direction":
        by = {"by_direction": rng.choice([-1.0, 1.0]) * rng.uniform(0.3, 0.6)}
    elif kind == "spring":
        which = rng.choice(["preload_open", "preload_close"])
        by = {which: rng.uniform(0.6, 0.85) * getattr(unit, which)}
    elif kind == "motor":
        less = rng.uniform(0.75, 0.9)
        by = {"torque_per_ampere": less * unit.torque_per_ampere, "back_emf": less * unit.back_emf}
    elif kind == "winding":
        by = {"resistance": rng.uniform(1.3, 2.0) * unit.resistance}
    elif kind == "sensor":
        gain = 1.0 + rng.choice([-1.0, 1.0]) * rng.uniform(0.08, 0.2)
    elif kind == "worn-gear":
        by = {"play": np.radians(rng.uniform(0.3, 1.0))}
    else:
        by = of_another_shape(kind, rng)
    return replace(unit, **by), gain


def of_another_shape(kind, rng):
    """Return what makes the friction of a healthy unit another one than the model's."""
    if kind in LAWS:
        return {"law": float(1 + LAWS.index(kind))}
    if kind == "exponent":
        return {"exponent": rng.uniform(0.5, 2.5)}
    if kind == "drift":
        return {"drift": rng.choice([-1.0, 1.0]) * rng.uniform(0.0, 0.02), "drift_ends": rng.uniform(3.0, 10.0)}
    return {}


def recorded(unit, gain, rate, rng):
    """Return what the bench records of a friction check, and its model."""
    truth, phases = friction_check(unit)
    seen = sense(unit, truth, rate, rng, current_offset=0.0)
    part = slice(0, phases[-1][1] * rate // round(1.0 / SAMPLE_S))  # until the bridge opens
    columns = {
        "motor_current": gain * seen.current[part],
        "motor_angle": seen.motor_angle[part],
        "motor_voltage": seen.voltage[part],
        "throttle_angle": seen.throttle_angle[part],
    }
    time_ns = seen.time_ns[part]
    recording = Recording("friction check", ClockGrade.TABLE)
    recording.append([SampleBlock("table", time_ns, time_ns, columns, np.zeros(len(time_ns), np.int64))])
    return recording


def answered(findings):
    """Return the verdict, each cause with its ambiguity group, and the component that all of them sit in."""
    found = [(one.winner.id, list(one.ambiguity_group)) for one in findings.accepted]
    components = {one.component for one in causes(findings)}
    return findings.verdict, found, components.pop() if len(components) == 1 else ""


def standing(kind, verdict, found, component):
    """Return how an answer stands to the truth."""
    right = set(RIGHT[kind])
    groups = [{effect, *group} for effect, group in found]
    if not groups:
        return "adequate" if verdict == "adequate" else "nothing named"
    if all(group <= right for group in groups):
        return "named"
    if verdict == "explained":
        return "wrong"
    if component:
        return "component named" if component == COMPONENT.get(kind) else "wrong component"
    return "ambiguous with the truth" if any(group & right for group in groups) else "ambiguous without the truth"


def one_case(kind, seed, rate):
    """Return how an answer stands to the truth, and print it."""
    rng = np.random.default_rng([seed, *kind.encode()])
    unit, gain = faulty(kind, rng)
    model = bench_model(off_by_tolerances(Unit(), rng))
    measured = measurements_of(recorded(unit, gain, rate, rng), model)
    begin = time.process_time()
    answer = answered(search(model, [Balances(one, model) for one in measured]))
    print(f"{kind} {seed}: {answer} {time.process_time() - begin:.1f} s", flush=True)
    return standing(kind, *answer)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--each", type=int, default=4)
    parser.add_argument("--rate", type=int, default=1000)
    parser.add_argument("--kinds", nargs="*", default=list(RIGHT))
    options = parser.parse_args()
    for kind in options.kinds:
        seeds = range(options.first, options.first + options.each)
        print(f"== {kind}: {dict(Counter(one_case(kind, seed, options.rate) for seed in seeds))}", flush=True)


if __name__ == "__main__":
    main()
