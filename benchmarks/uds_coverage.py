"""How often intervals hold the truth where the current is asked for by UDS, by how often it is read.

    python benchmarks/uds_coverage.py [--units 20] [--seed 37] [--every "10 ms" "20 ms"] [--bench virtual_uds_data]

One friction check a unit, drawn inside the tolerances of the stock model; T_st of two units in three is risen by 30 or
100 %. `cyclic` is the same unit on `virtual_classic`, with a cyclic current at 1 kHz. A false FAIL has T_st and T_c
within the stock limits, a false PASS one beyond. The truth is that of 20 degC, as the limits are.
"""

import argparse
import tempfile
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import yaml

from etb_hil.base.stock import find
from etb_hil.bench.job import JobFiles, execute, prepare

RISES = (1.0, 1.3, 2.0)


def read_every(bench, every, folder):
    """Return a bench's file whose current is read that often."""
    plain = yaml.safe_load(find("bench", bench).read_text("utf-8"))
    plain["uds"]["data"]["motor_current"]["every"] = every
    path = Path(folder) / f"{every.replace(' ', '_')}.yaml"
    path.write_text(yaml.safe_dump(plain, sort_keys=False), "utf-8")
    return path


def job_of(bench):
    stock = {"scenario": "friction_check", "model": "default", "limits": "default", "unit": "default"}
    return prepare(JobFiles(bench=bench, **{kind: find("model" if kind == "unit" else kind, name)
                                            for kind, name in stock.items()}))  # fmt: skip


def draw(model, rng, number):
    """Return a unit with its rise of T_st."""
    unit = model.drawn(rng)
    stiction = unit.parameters["stiction"]
    risen = replace(stiction, value=stiction.value * RISES[number % len(RISES)])
    return replace(unit, parameters={**unit.parameters, "stiction": risen})


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--units", type=int, default=20)
    parser.add_argument("--seed", type=int, default=37)
    parser.add_argument("--every", nargs="+", default=["10 ms", "20 ms"])
    parser.add_argument("--bench", default="virtual_uds_data")
    options = parser.parse_args()
    print(f"{'current':>8} {'of':4} {'holds':>7} {'half width':>10}   verdicts", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        benches = {"cyclic": find("bench", "virtual_classic")}
        benches |= {every: read_every(options.bench, every, folder) for every in options.every}
        for every, bench in benches.items():
            show(every, job_of(bench), options)


def show(every, job, options):
    """Print how the intervals of one bench fared."""
    held, widths, verdicts = Counter(), {"T_st": [], "T_c": []}, Counter()
    begun = time.process_time()
    for number in range(options.units):
        rng = np.random.default_rng([options.seed, number])
        unit = draw(job.model, rng, number)
        with tempfile.TemporaryDirectory() as sessions:
            found = execute(replace(job, unit=unit), Path(sessions), "", int(rng.integers(2**31))).found
        truths = {"T_st": unit.values.stiction, "T_c": unit.values.coulomb}
        measured = {name: found.measurements[name] for name in truths if found.measurements[name].interval is not None}
        for name, one in measured.items():
            low, high = one.interval
            held[name] += low <= truths[name] <= high
            widths[name].append(0.5 * (high - low) / truths[name])
        verdicts[str(found.verdict) + wrong(str(found.verdict), measured, truths)] += 1
    for name, those in widths.items():
        share = held[name] / len(those) if those else float("nan")
        said = ", ".join(f"{kind} {count}" for kind, count in verdicts.most_common()) if name == "T_st" else ""
        print(
            f"{every:>8} {name:4} {share:7.1%} {np.median(those) if those else float('nan'):10.1%}   {said}", flush=True
        )
    print(f"{'':8} {time.process_time() - begun:.0f} s of processor time", flush=True)


def wrong(verdict, measured, truths):
    """Return ' (FALSE)' behind a verdict that the truth contradicts."""
    beyond = any(truths[name] > one.limit_high for name, one in measured.items() if one.limit_high is not None)
    return " (FALSE)" if verdict == ("pass" if beyond else "fail") else ""


if __name__ == "__main__":
    main()
