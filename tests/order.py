"""The order in which files of tests begin; pytest-xdist gives them to its workers in this order.

Two workers start with the first two files. They compile different functions, and load from the cache what the other one
has compiled. A guest compiles three times as slowly as its host: what it needs is compiled before.
"""

from itertools import groupby

FIRST = (
    "discrepancy/test_whole_answer",  # compiles what `explain` needs
    "api/test_connect",  # compiles what a run needs
    "trusted/test_fault_verdicts",
    "discrepancy/test_effects",  # needs the same as the first file
    "bench/test_python_can_buses",  # compiles what a controller at wall clock needs
    "uds/test_uds_in_a_run",
    "uds/test_controller_faults",
    "uds/test_readings",  # long, and by its name the last of all
    "trusted/test_signals_while_judged",
    "trusted/test_limits_are_physical",
    "discrepancy/test_interruption",
    "replay/test_many_logs",
    "plugins/test_used",
    "docs/test_commands_in_documents",
    "api/test_diagnose_simulate_explain",
    "page/test_operators_batch",
    "page/test_page_lets_nobody_in",
    "page/test_engineers_view",
    "base/test_compiled",
    "plugins/test_contracts",
    "plugins/test_example_package",
)


def order(items, folder):
    """Put the files of `FIRST` first, and spread those that need a guest between the others."""
    first = {folder / f"{name}.py": place for place, name in enumerate(FIRST)}
    items.sort(key=lambda item: first.get(item.path, len(first)))
    count = sum(item.path in first for item in items)
    items[count:] = spread(items[count:])


def spread(items):
    """Return the tests with the files that need a guest between the others, as far apart as there are files.

    One guest runs at a time, and no worker shall wait for it.
    """
    files = [list(each) for _, each in groupby(items, key=lambda item: item.path)]
    guests = [file for file in files if _needs_guest(file)]
    ordered = [file for file in files if not _needs_guest(file)]
    every = len(ordered) / (len(guests) + 1)
    for number, file in reversed([*enumerate(guests, 1)]):
        ordered.insert(round(number * every), file)
    return [item for file in ordered for item in file]


def _needs_guest(file):
    return hasattr(getattr(file[0], "module", None), "vcan_machine")
