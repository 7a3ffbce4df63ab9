"""Kernels compiled before a change of the source they may hold are not used again."""

import os
import tomllib
from pathlib import Path

from etb_hil.base.compiled_cache import FLOORS, drop_stale


def test_what_is_older_than_a_source_on_its_floor_or_below_goes(tmp_path):
    ages = {
        "plant/a.py": 100,
        "plant/effects/b.py": 200,
        "observer/c.py": 120,
        "bench/d.py": 900,
        "plant/__pycache__/a.nbi": 199,
        "plant/__pycache__/b.1.nbc": 201,
        "observer/__pycache__/c.nbi": 150,
        "plant/__pycache__/a.cpython-311.pyc": 50,
    }
    for name, age in ages.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
        os.utime(tmp_path / name, (age, age))
    assert drop_stale(tmp_path) == 2
    assert {path.name for path in tmp_path.rglob("__pycache__/*")} == {"a.cpython-311.pyc", "b.1.nbc"}
    assert drop_stale(tmp_path) == 0


def test_the_floors_are_those_that_the_import_rules_hold():
    rules = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["tool"]["importlinter"]
    layers = [layer.removeprefix("etb_hil.") for layer in reversed(rules["contracts"][0]["layers"])]
    assert layers[: len(FLOORS)] == list(FLOORS)
