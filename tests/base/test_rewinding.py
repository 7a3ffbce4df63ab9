"""What a mark keeps, and what rewinding brings back."""

import numpy as np

from etb_hil.base.rewinding import Rewindable, rewind


class Counter(Rewindable):
    LIVES = ("count",)

    def __init__(self):
        self.count = 0


class World(Rewindable):
    LIVES = ("time", "place", "names", "seen", "own", "others", "newest", "used")
    GROWS = ("rows",)

    def __init__(self):
        self.time, self.place, self.names, self.seen = 0.0, np.zeros(3), ["a"], {"a"}
        self.own, self.others, self.newest = Counter(), {"b": Counter()}, {"a": 1}
        self.used, self.rows = 2, np.arange(5)

    def state(self):
        plain = (self.time, self.place.tolist(), list(self.names), set(self.seen), dict(self.newest))
        return plain, self.own.count, self.others["b"].count, self.rows[: self.used].tolist()

    def live(self):
        self.time += 1.0
        self.place[1] += 2.0
        self.names.append("c")
        self.seen.add("c")
        self.newest["a"] = 7
        self.own.count = self.others["b"].count = 3
        self.rows[self.used :] = 9
        self.used = 5


def test_all_that_lives_is_brought_back_and_lives_again():
    world = World()
    before, mark = world.state(), world.mark()
    world.live()
    after = world.state()
    for _ in range(2):  # a mark holds more than once
        rewind([(world, mark)])
        assert world.state() == before
        world.live()
        assert world.state() != before
    assert after[0][:1] == world.state()[0][:1]


def test_who_looks_into_an_array_goes_on_seeing_it():
    world = World()
    view, mark = world.place[1:], world.mark()
    world.live()
    world.place = np.ones(7)  # replaced, as a queue that had to grow
    world.rewind(mark)
    assert view.tolist() == [0.0, 0.0]
    world.live()
    assert view[0] == 2.0
