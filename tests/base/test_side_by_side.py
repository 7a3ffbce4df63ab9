"""Work on several items at a time gives what work on one after another gives."""

import threading
import time

import pytest

from etb_hil.base import side_by_side as module
from etb_hil.base.side_by_side import side_by_side


@pytest.fixture(params=[1, 2, 5])
def on_cores(request, monkeypatch):
    monkeypatch.setattr(module, "cores", lambda: request.param)
    return request.param


@pytest.mark.usefixtures("on_cores")
def test_results_come_in_the_order_of_their_items():
    def slower_first(number):
        time.sleep(0.002 * (10 - number))
        return number * number

    assert list(side_by_side(slower_first, range(10))) == [number * number for number in range(10)]


@pytest.mark.usefixtures("on_cores")
def test_nothing_makes_nothing():
    assert list(side_by_side(lambda one: one, [])) == []


def test_as_many_items_as_there_are_cores_are_worked_on_at_a_time(on_cores):
    together = threading.Barrier(on_cores, timeout=120.0)  # raises where they do not meet
    places = list(side_by_side(lambda _: together.wait(), range(2 * on_cores)))
    assert sorted(places) == sorted([*range(on_cores)] * 2)


@pytest.mark.usefixtures("on_cores")
def test_work_inside_work_starts_no_more_threads():
    def outer(number):
        inner = [*side_by_side(lambda one: (one, threading.get_ident()), range(3))]
        assert {ident for _, ident in inner} == {threading.get_ident()}
        return number + sum(one for one, _ in inner)

    assert list(side_by_side(outer, range(6))) == [number + 3 for number in range(6)]


@pytest.mark.usefixtures("on_cores")
@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_what_an_item_raises_ends_the_work(error):
    begun = []

    def work(number):
        begun.append(number)
        if number == 2:
            raise error(f"item {number}")
        time.sleep(0.01)
        return number

    found = side_by_side(work, range(1000))
    assert [next(found), next(found)] == [0, 1]
    with pytest.raises(error, match="item 2"):
        next(found)
    assert len(begun) < 1000
    assert not [one for one in threading.enumerate() if one.name.startswith("side_by_side")]


@pytest.mark.usefixtures("on_cores")
def test_who_stops_asking_ends_the_work():
    begun = []

    def work(number):
        begun.append(number)
        time.sleep(0.01)
        return number

    found = side_by_side(work, range(1000))
    assert next(found) == 0
    found.close()
    count = len(begun)
    assert count < 1000
    time.sleep(0.05)
    assert len(begun) == count
