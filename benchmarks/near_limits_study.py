"""Verdicts on units near the limits, which are not the bench's model: drawn inside its tolerances, friction held.

    python benchmarks/near_limits_study.py [--draws 20] [--bench virtual_classic] [--case NAME]

Units inside their limits must never fail, units beyond limit and marginal band must never pass.
"""

import argparse
import tempfile
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np

from etb_hil.base.stock import find
from etb_hil.bench.job import JobFiles, execute, prepare
from etb_hil.plant.parameters import load_model

# T_st and T_c in N·m at the throttle shaft, and the verdict that would be wrong
CASES = {
    "healthy": (0.171, 0.144, "fail"),
    "T_st at 96 %": (0.2502, 0.144, "fail"),
    "T_st and T_c at the model's 30 %": (0.222, 0.187, "fail"),
    "T_st in the band": (0.2592, 0.144, "fail"),
    "T_st at 107 %": (0.279, 0.144, "pass"),
    "T_c at 105 %": (0.243, 0.2106, "pass"),
}


def drawn(model, stiction, coulomb, rng):
    """Return a unit of a model, each parameter drawn inside its tolerance, with the friction that is asked for."""
    gear, unit = model.values.gear_ratio, model.drawn(rng)
    at_motor = {"stiction": stiction / gear, "coulomb": coulomb / gear}
    held = {name: replace(unit.parameters[name], value=value) for name, value in at_motor.items()}
    return replace(unit, parameters={**unit.parameters, **held})


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=20)
    parser.add_argument("--bench", default="virtual_classic")
    parser.add_argument("--case", choices=list(CASES), action="append")
    options = parser.parse_args()
    names = ("friction_check", options.bench, "default", "default", "default")
    kinds = ("scenario", "bench", "model", "limits", "model")
    job = prepare(JobFiles(*(find(kind, name) for kind, name in zip(kinds, names, strict=True))))
    model = load_model(find("model", "default"))
    for case in options.case or CASES:
        stiction, coulomb, wrong = CASES[case]
        verdicts, errors, covered = Counter(), [], []
        for seed in range(options.draws):
            unit = drawn(model, stiction, coulomb, np.random.default_rng(9000 + seed))
            with tempfile.TemporaryDirectory() as folder:
                results = execute(replace(job, unit=unit), Path(folder), "", seed).results
            verdicts[results.unit.verdict] += 1
            numbers = results.measurements
            for name, truth in (("T_st", stiction), ("T_c", coulomb)):
                errors.append(abs(numbers[name].value / truth - 1.0))
                covered.append(numbers[name].low <= truth <= numbers[name].high)
        print(
            f"{case:34} {dict(verdicts)}  wrong: {verdicts[wrong]}  worst error {max(errors):.2%}  "
            f"intervals hold {np.mean(covered):.1%}",
            flush=True,
        )


if __name__ == "__main__":
    main()
