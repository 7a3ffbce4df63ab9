"""Files that compile begin first; tests that need a guest are spread, so that no two workers wait for one guest."""

from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import pytest
from order import FIRST, order, spread

TESTS = Path(__file__).resolve().parents[1]


def files(folder, count, tests=2, **module):
    made = [Path(folder, f"test_{k}.py") for k in range(count)]
    return [SimpleNamespace(path=path, module=SimpleNamespace(**module)) for path in made for _ in range(tests)]


@pytest.mark.parametrize("others", [9, 20, 300])
def test_files_that_need_a_guest_stand_apart_and_all_others_as_they_were(others):
    guests, rest = files("tests/vcan", 4, vcan_machine=None), files("tests/bench", others)
    items = spread([*rest, *guests])
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
    assert spread(rest) == rest


def test_files_that_compile_begin_before_all_others_and_before_each_guest():
    begin = [SimpleNamespace(path=TESTS / f"{name}.py", test=k) for name in sorted(FIRST) for k in range(2)]
    rest, guests = files(TESTS / "bench", 5), files(TESTS / "vcan", 1, vcan_machine=None)
    items = [*guests, *rest[:4], *begin, *rest[4:]]
    order(items, TESTS)
    assert [(item.path, item.test) for item in items[: len(begin)]] == [
        (TESTS / f"{name}.py", k) for name in FIRST for k in range(2)
    ]
    assert [item for item in items[len(begin) :] if item in rest] == rest


@pytest.mark.parametrize("name", FIRST)
def test_each_file_that_begins_first_is_there(name):
    assert (TESTS / f"{name}.py").is_file()
