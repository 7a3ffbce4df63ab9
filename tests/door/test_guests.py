"""Tests that need a guest are spread, so that no two workers wait for the one that may run."""

from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import pytest
from guests import spread


def files(folder, count, tests=2, **module):
    made = [Path(folder, f"test_{k}.py") for k in range(count)]
    return [SimpleNamespace(path=path, module=SimpleNamespace(**module)) for path in made for _ in range(tests)]


@pytest.mark.parametrize("others", [9, 20, 300])
def test_files_that_need_a_guest_stand_apart_and_all_others_as_they_were(others):
    guests, rest = files("tests/vcan", 4, vcan_machine=None), files("tests/bench", others)
    items = [*rest, *guests]
    spread(items)
    assert [item for item in items if item in rest] == rest
    assert [item for item in items if item in guests] == guests
    places = [k // 2 for k, item in enumerate(items) if item in guests]
    assert places[::2] == places[1::2]  # the tests of a file follow each other
    begins = [0, *(place + 1 for place in places[::2]), others + 4 + 1]
    between = [last - first - 1 for first, last in pairwise(begins)]
    assert max(between) - min(between) <= 1
    assert min(between) > 0


def test_without_such_files_the_order_is_kept():
    rest = files("tests/bench", 5)
    items = [*rest]
    spread(items)
    assert items == rest
