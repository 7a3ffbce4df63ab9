"""The place of tests that need a guest among the others: one guest runs at a time, and no worker shall wait for it."""

from itertools import groupby


def spread(items):
    """Put the files of tests that need a guest between the others, as far apart as there are files."""
    files = [list(each) for _, each in groupby(items, key=lambda item: item.path)]
    guests = [file for file in files if _needs_guest(file)]
    order = [file for file in files if not _needs_guest(file)]
    every = len(order) / (len(guests) + 1)
    for number, file in reversed([*enumerate(guests, 1)]):
        order.insert(round(number * every), file)
    items[:] = [item for file in order for item in file]


def _needs_guest(file):
    return hasattr(getattr(file[0], "module", None), "vcan_machine")
