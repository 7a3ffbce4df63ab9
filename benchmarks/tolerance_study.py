"""T_st, T_c and verdicts when the bench's model is not the unit: draws inside the model's stated tolerances.

    python benchmarks/tolerance_study.py [--draws 10]

Every draw takes another bench model (each parameter inside its tolerance of the stock model) and another seed of the
sensors' noise, for the healthy and the faulty unit, on classic CAN at 1 kHz and on CAN FD at 20 kHz.
"""

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from etb_hil.base.stock import find
from etb_hil.bench.job import JobFiles, execute, prepare
from etb_hil.plant.parameters import load_model

EXPECTED = {"default": "pass", "faulty": "fail"}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=10)
    parser.add_argument("--seed", type=int, default=20261120)
    options = parser.parse_args()
    known = load_model(find("model", "default"))
    print(
        "bench            unit     right  inconclusive  wrong   T_st error % (mean, worst)   T_c error % (mean, worst)"
    )
    for bench in ("virtual_classic", "virtual_fd"):
        for unit, expected in EXPECTED.items():
            rng = np.random.default_rng(options.seed)
            truth = load_model(find("model", unit)).values
            names = ("friction_check", bench, "default", "default", unit)
            kinds = ("scenario", "bench", "model", "limits", "model")
            job = prepare(JobFiles(*(find(kind, name) for kind, name in zip(kinds, names, strict=True))))
            verdicts, errors = [], []
            for seed in range(options.draws):
                with tempfile.TemporaryDirectory() as folder:
                    finished = execute(replace(job, model=known.drawn(rng)), Path(folder), "", seed)
                verdicts.append(finished.results.unit.verdict)
                found = {n.id: n.value for n in finished.results.measurements.values()}
                errors.append((found["T_st"] / truth.stiction - 1.0, found["T_c"] / truth.coulomb - 1.0))
            right, unsure = verdicts.count(expected), verdicts.count("inconclusive")
            off = 100.0 * np.array(errors, float)
            mean, worst = off.mean(axis=0), np.abs(off).max(axis=0)
            print(
                f"{bench:16} {unit:8} {right:5d} {unsure:13d} {len(verdicts) - right - unsure:6d}"
                f"   {mean[0]:+13.2f} {worst[0]:12.2f} {mean[1]:+14.2f} {worst[1]:12.2f}"
            )


if __name__ == "__main__":
    main()
