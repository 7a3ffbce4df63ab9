"""Whether 95 % intervals hold the truth: effects' numbers where the generator means the same by one, and the base.

    python benchmarks/explain_sizes.py FIRST COUNT [--out rows.jsonl]

Hides one effect after the other, in a form of its curve that ours has too, strong or medium. A number counts where the
truth is named, no other cause with it, and no base parameter in its class: what a parameter imitates has no size of its
own. Nor does one that lies beyond what the catalogue takes for possible. NOT_COMPARED says which effects have no number
in common with the generator's, and why.
"""

import argparse
import json
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from explain_cases import hidden_case
from generator.size import OutOfReachError
from scoring import rate

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.fitting.intervals import estimates
from etb_hil.discrepancy.measured.segments import measurements_of
from etb_hil.discrepancy.search.stepwise import search
from etb_hil.plant.effects.catalogue import CATALOGUE

A, B, C = range(3)  # the generator's shape parameters
BASE = (
    "resistance", "preload_open", "preload_close", "slope_open", "slope_close", "limp_home", "coulomb", "stiction",
    "viscous",
)  # fmt: skip
NOT_COMPARED = {
    "stiction_dwell": "there the growth fades with the Stribeck curve, ours with the way",
    "stribeck_shape": "there two curves are mixed, ours is one of another exponent",
    "spring_nonlinear": "there both springs are bent, ours is the opening one",
    "spring_preload_shift": "the preloads' tolerances imitate it",
    "gear_backlash": "there the teeth also give way under a load, by 2e-5 rad each way; ours counts that as play",
    "current_sensor_gain": "the tolerances of all torques and of the resistance imitate it together",
}


@dataclass(frozen=True)
class Number:
    """One of our parameters, or two that are an amplitude, in the generator's terms.

    `forms`: those of the generator's curve for which it is `factor` times its strength or its shape parameter `place`
    (both where `is_product`). `beside`: a finer shape of ours without which those forms are not ours.
    """

    names: tuple
    forms: tuple
    factor: float = 1.0
    place: int | None = None
    is_product: bool = False
    beside: str = ""

    def truth(self, entry):
        """The true value; None where this curve has no such number."""
        if entry["form"] not in self.forms:
            return None
        shape = 1.0 if self.place is None else entry["shape"][self.place]
        if shape < 0.0:
            return None  # a layer that is not there
        return self.factor * shape * (entry["strength"] if self.place is None or self.is_product else 1.0)


def _waves(first):
    """Amplitudes of a wave and of its second harmonic; `first`: the form that has none."""
    both = ("sine", "cosine"), ("second_sine", "second_cosine")
    return [Number(both[0], (first,)), Number(both[0], (2,), 0.85), Number(both[1], (2,), 0.35)]


COMPARED = {
    "friction_position_periodic": [Number(("order",), (0, 1, 2), place=A)],  # over the gear ratio
    "friction_position_local": [
        Number(("peak",), (0,)), Number(("width",), (0,), np.sqrt(np.log(2.0)), B),  # at half the height
        Number(("place",), (0, 1, 2, 3), place=A),
    ],
    "friction_temperature": [
        Number(("friction_per_30_kelvin",), (0,), -1.0),
        Number(("friction_per_30_kelvin",), (1, 2), -1.0, beside="curve"),
        Number(("viscosity_per_30_kelvin",), (0, 1, 2), -1.0, A, is_product=True),
    ],
    "friction_asymmetry": [Number(("friction",), (0, 1, 2), beside="evenness")],
    "friction_load": [
        Number(("coefficient",), (0,)),
        Number(("coefficient",), (2,), beside="threshold"), Number(("threshold",), (2,), place=B),
    ],
    "presliding_hysteresis": [
        Number(("torque",), (0,)), Number(("torque",), (2,), beside="exponent"),
        Number(("way",), (0,), place=A), Number(("way",), (2,), place=A, beside="exponent"),
    ],
    "shaft_compliance": [Number(("compliance",), (0,))],
    "cogging_torque": [*_waves(0), Number(("order",), (0, 1, 2), place=A)],
    "torque_ripple": [*_waves(0), Number(("order",), (0, 1, 2), place=A)],
    "limp_home_dead_zone": [
        Number(("above",), (0,)), Number(("below",), (0,)),
        Number(("above",), (1,), 2.0), Number(("below",), (2,), 2.0),
    ],
    "aerodynamic_torque": [Number(("torque",), (0,)), Number(("lean",), (0,), place=B)],
    "end_stop_compliance": [
        Number(("upper_layer",), (0,), place=A), Number(("lower_layer",), (0,), place=B),
    ],
    "iron_loss": [
        Number(("constant",), (0,)), Number(("onset",), (0,), place=A), Number(("constant",), (1, 2), beside="lag"),
        Number(("onset",), (2,), 1.25, A, beside="lag"),
    ],
    "resistance_temperature": [
        Number(("housing_share",), (0,)), Number(("self_heating",), (0,), 0.1, A, is_product=True),
    ],
    "magnet_temperature": [Number(("coefficient",), (0,)), Number(("time_constant",), (0,), place=A)],
    "brush_drop": [Number(("drop",), (0,)), Number(("knee",), (0,), place=A), Number(("drop",), (1,), beside="lag")],
    "hbridge_dead_time": [Number(("error",), (0, 1, 2))],
    "supply_sag": [
        Number(("source_resistance",), (0,)), Number(("source_resistance",), (1,), beside="one_way"),
        Number(("static_sag",), (0, 1), 1.0, A, is_product=True),
    ],
    "current_sensor_offset": [Number(("offset",), (0, 1)), Number(("drift",), (1,), 0.01)],
    "angle_sensor_eccentricity": _waves(0),
    "sensor_hysteresis": [Number(("half_width",), (0,), 0.5)],
    "measurement_delay": [Number(("delay",), (0,)), Number(("lag",), (1,))],
}  # fmt: skip


def covered(findings, truth):
    """{number: whether its interval holds the truth}; only for causes that are the truth, with nothing else named."""
    return {name: bool(low <= value <= high) for name, (value, low, high) in compared(findings, truth).items()}


def compared(findings, truth):
    """{number: (truth, low, high)} of what can be compared."""
    found = {e.name: e for e in estimates(findings.final, findings.balances, findings.final_noise_floor)}
    hidden = {entry["effect"]: entry for entry in truth["effects"]}
    is_collinear = any(id_.startswith("parameter:") for step in findings.accepted for id_ in step.ambiguity_group)
    if {step.winner.id for step in findings.accepted} != set(hidden) or is_collinear:
        return {}
    numbers = {
        f"base:{name}": (value, found[name].low, found[name].high)
        for name, value in base_numbers(truth).items()
        if name in found
    }
    for id_, entry in hidden.items():
        for number in COMPARED.get(id_, ()):
            value, parts = number.truth(entry), [found.get(f"{id_}.{name}") for name in number.names]
            if value is None or None in parts or (number.beside and f"{id_}.{number.beside}" not in found):
                continue
            if id_ == "friction_position_periodic":
                value /= truth["unit"]["gear_ratio"]
            if _is_possible(id_, number.names[0], value):
                numbers[f"{id_}.{number.names[0]}"] = _reach(parts, value)
    return numbers


def base_numbers(truth):
    """{base parameter: its true value at the throttle shaft} of a sealed truth."""
    unit = truth["unit"]
    return {name: unit[name] for name in BASE} | {
        "torque_per_ampere": unit["motor_constant"] * unit["gear_ratio"],
        "inertia": unit["plate_inertia"] + unit["gear_ratio"] ** 2 * unit["motor_inertia"],
    }


def _is_possible(id_, name, value):
    """Tell whether the catalogue takes a number for possible; one beyond ends on its bound, and says so."""
    stated = next(parameter for parameter in CATALOGUE[id_].stated if parameter.name == name)
    return abs(value) <= stated.high


def _reach(parts, truth):
    """Truth, low and high of a number, or of the length of two."""
    if len(parts) == 1:
        return truth, parts[0].low, parts[0].high
    size = math.hypot(*(part.value for part in parts))
    halves = ((0.5 * (part.high - part.low)) * part.value / size for part in parts)
    reach = math.hypot(*halves)
    return abs(truth), size - reach, size + reach


def one(seed):
    """Hide the seed's effect in a form that can be compared; return what was named and the numbers."""
    rng = np.random.default_rng([seed, 11])
    name = list(COMPARED)[seed % len(COMPARED)]
    form = int(rng.choice(sorted({form for number in COMPARED[name] for form in number.forms})))
    hidden = hidden_case(seed, (name,), str(rng.choice(["strong", "medium"])), form=form)
    findings = search(
        hidden.model, [Balances(m, hidden.model) for m in measurements_of(hidden.recording, hidden.model)]
    )
    numbers = compared(findings, hidden.case.truth)
    named = [(step.winner.id, step.ambiguity_group) for step in findings.accepted]
    return {"seed": seed, "effect": name, "form": form, "named": named, "numbers": numbers}


def show(rows):
    """Print coverage by number and together, with exact bounds, and how wide the intervals are."""
    by_name = {}
    for row in rows:
        for name, (value, low, high) in row["numbers"].items():
            by_name.setdefault(name, []).append((low <= value <= high, 0.5 * (high - low) / max(abs(value), 1e-12)))
    for name, found in sorted(by_name.items()):
        wide = float(np.median([width for _, width in found]))
        print(f"  {name:45} {sum(holds for holds, _ in found):3} of {len(found):3}, half as wide as {wide:.1%} of it")
    for what, is_base in (("effects' numbers", False), ("base parameters", True)):
        held = [holds for name, found in by_name.items() for holds, _ in found if name.startswith("base:") == is_base]
        if held:
            share = rate(sum(held), len(held))
            print(f"{what}: {sum(held)} of {len(held)} = {share.value:.1%} ({share.low:.1%} to {share.high:.1%})")
    files = sum(any(not name.startswith("base:") for name in row["numbers"]) for row in rows)
    print(f"{files} of {len(rows)} files have a number of their effect that could be compared; without one are")
    print("  " + "; ".join(f"{name}: {why}" for name, why in NOT_COMPARED.items()))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("first", type=int)
    parser.add_argument("count", type=int)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    rows = []
    for seed in range(options.first, options.first + options.count):
        try:
            rows.append(one(seed))
        except OutOfReachError:
            continue
        row = rows[-1]
        missed = [name for name, (value, low, high) in row["numbers"].items() if not low <= value <= high]
        print(seed, row["effect"], row["form"], row["named"], "missed:", missed or "nothing", flush=True)
        if options.out:
            with options.out.open("a", encoding="utf-8") as file:
                file.write(json.dumps(row, default=float) + "\n")
    show(rows)


if __name__ == "__main__":
    main()
