"""`etb-hil isolability`: which effects a planned scenario could distinguish.

The command also says which scenario to add.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from etb_hil.discrepancy.measured.measurement import Measurement
    from etb_hil.plant.parameters import Model


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("model", help="model file, or the name of a stock one")
    parser.add_argument("scenarios", nargs="+", help="scenario files, or names of stock ones")
    parser.add_argument("--bench", default="virtual_fd", help="virtual bench file (default: %(default)s)")
    parser.add_argument("--suggest", action="store_true", help="try the other stock scenarios, too (takes minutes)")


def run(options: argparse.Namespace) -> int:
    """Run the scenarios on the virtual unit and print the pairs that are not isolable."""
    from etb_hil.base.errors import InputError, Problem
    from etb_hil.base.outcome import ExitCode
    from etb_hil.base.stock import stock_names
    from etb_hil.discrepancy.plan.isolability import isolability_of
    from etb_hil.plant.names import display_name

    made = [_along(options, name) for name in options.scenarios]
    model, records = made[0][0], [record for _, record in made]
    for name, record in zip(options.scenarios, records, strict=True):
        if not record:
            what = f"the record of {name} has no motion to judge"
            raise InputError(Problem(what, allowed="2 s of motion at least", remedy="plan a longer motion"))
    print("computing the sensitivities", file=sys.stderr)
    found = isolability_of(model, records)
    print(f"{len(found.not_isolable)} of {found.pairs} pairs are not isolable (cosine of 0.95 and more):")
    for first, second, cosine in found.not_isolable:
        print(f"  {display_name(first)} and {display_name(second)} ({cosine:.2f})")
    if found.hidden:
        print(f"not detectable jointly with the base parameters: {', '.join(map(display_name, found.hidden))}")
    if options.suggest and found.not_isolable:
        left = {}
        for name in stock_names("scenario"):
            if name not in options.scenarios and (record := _along(options, name)[1]):
                left[name] = isolability_of(model, [*records, record])
        best = min(left, key=lambda name: (len(left[name].hidden), len(left[name].not_isolable)))
        pairs, hidden = len(left[best].not_isolable), len(left[best].hidden)
        print(f"with the scenario {best}, {pairs} pairs are not isolable and {hidden} effects are not detectable")
    return int(ExitCode.DONE)


def _along(options: argparse.Namespace, scenario: str) -> tuple[Model, list[Measurement]]:
    from etb_hil.base.stock import find, stock_file
    from etb_hil.bench.job import JobFiles, execute, prepare
    from etb_hil.discrepancy.measured.segments import measurements_of

    model = find("model", options.model)
    files = JobFiles(
        scenario=find("scenario", scenario),
        bench=find("bench", options.bench),
        model=model,
        limits=stock_file("limits", "default"),
        unit=model,
    )
    print(f"simulating {scenario}", file=sys.stderr)
    job = prepare(files)
    with tempfile.TemporaryDirectory() as folder:
        finished = execute(job, Path(folder), "", 1)
        recording = finished.analysis.recording
    return job.model, measurements_of(recording, job.model)
