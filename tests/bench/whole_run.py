"""Runs a stock scenario on a stock virtual bench, as several tests need it."""

from etb_hil.base.stock import find
from etb_hil.bench.job import JobFiles, execute, prepare


def files(**names):
    chosen = {"scenario": "friction_check", "bench": "virtual_classic", "model": "default", "limits": "default"}
    chosen |= {"unit": "default"} | names
    kinds = {"unit": "model"}
    return JobFiles(**{key: find(kinds.get(key, key), str(name)) for key, name in chosen.items()})


def run_on(folder, seed=3, serial="", **names):
    return execute(prepare(files(**names)), folder, serial, seed)
