"""Kernels compiled before the newest change of the source are not used again."""

import os

from etb_hil.base.compiled_cache import drop_stale


def test_only_what_is_older_than_the_newest_source_goes(tmp_path):
    cache = tmp_path / "room" / "__pycache__"
    cache.mkdir(parents=True)
    ages = {"room/a.py": 100, "b.py": 200, "room/__pycache__/a.nbi": 150, "room/__pycache__/a.1.nbc": 199,
            "room/__pycache__/b.nbi": 201, "room/__pycache__/a.cpython-311.pyc": 50}  # fmt: skip
    for name, age in ages.items():
        (tmp_path / name).touch()
        os.utime(tmp_path / name, (age, age))
    assert drop_stale(tmp_path) == 2
    assert sorted(path.name for path in cache.iterdir()) == ["a.cpython-311.pyc", "b.nbi"]
    assert drop_stale(tmp_path) == 0
