"""Runs a stock scenario on a stock virtual bench, as several tests need it."""

import tempfile
from pathlib import Path

from etb_hil.base.stock import find
from etb_hil.bench.job import JobFiles, execute, prepare

# What a verdict needs and no more: at wall clock every second is one.
BRISK = """schema: etb_hil/scenario/1
name: Brisk friction check
phases:
  - {id: zero, kind: current_zero, duration: 0.5 s}
  - {id: home, kind: home, speed: 2 rad/s, press: 1 deg, release: 0.5 s}
  - {id: ramps, kind: ramp, between: [2 deg, 80 deg], speed: 0.6 rad/s}
  - id: dashes
    kind: dash
    between: [12 deg, 74 deg]
    against: 1.5 rad/s
    peak: 17.5 rad/s
    rise: 75 ms
    fall: 45 ms
    settle: 150 ms
    approach: 3 rad/s
    repeat: 2
"""


def files(**names):
    chosen = {"scenario": "friction_check", "bench": "virtual_classic", "model": "default", "limits": "default"}
    chosen |= {"unit": "default"} | names
    kinds = {"unit": "model"}
    return JobFiles(**{key: find(kinds.get(key, key), str(name)) for key, name in chosen.items()})


def run_on(folder, seed=3, serial="", **names):
    return execute(prepare(files(**names)), folder, serial, seed)


def run_briskly_on(folder, **names):
    """Run the brisk scenario: all that a verdict needs, in a quarter of the stock scenario's processor time."""
    with tempfile.TemporaryDirectory() as place:
        scenario = Path(place) / "brisk.yaml"
        scenario.write_text(BRISK, "utf-8")
        return run_on(folder, scenario=scenario, **names)
