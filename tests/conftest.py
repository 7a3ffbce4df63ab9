"""What holds for every test: no machine's load fails a test.

And each run of a bench ends with a look at its bus.
"""

import gc
import json
import os
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy is loaded: as the command does it
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # a command that a test starts reads what the one before it compiled

import pytest
from bus_truth import VIRTUAL, assert_bus_truth, assert_bus_was_healthy
from hypothesis import HealthCheck, settings
from order import order
from quick import QUICK

from etb_hil.results.json_file import result_from_dict

# The gate looks at the same examples every time; whoever hunts for new ones runs the tests by hand.
settings.register_profile(
    "etb_hil", deadline=None, suppress_health_check=[HealthCheck.too_slow], derandomize="CI" in os.environ
)
settings.load_profile("etb_hil")


TESTS = Path(__file__).parent
QUICK_FILES = {TESTS / f"{name}.py" for name in QUICK}


def pytest_ignore_collect(collection_path, config):
    """Import the quick files alone for `-m quick`: the others' imports would take as long as a tenth of the tests."""
    is_other = collection_path.suffix == ".py" and collection_path not in QUICK_FILES
    return True if is_other and config.option.markexpr == "quick" else None


def pytest_collection_modifyitems(items):
    """Mark the tests of the quick files, and put all files in the order in which they begin."""
    for item in items:
        if item.path in QUICK_FILES:
            item.add_marker("quick")
    order(items, TESTS)


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Keep what is collected out of the garbage collector: it stays, and costs a third of the time to look at again."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.collect()
        gc.freeze()
        gc.enable()


@pytest.fixture(autouse=True, scope="session")
def run_results():
    """Keep the results of every run in this process, whoever started it."""
    from etb_hil.bench import job  # noqa: PLC0415 (not before there is a test to run)

    kept = []
    with pytest.MonkeyPatch.context() as patch:
        results_of = job.results_of

        def keeping(*parts):
            results = results_of(*parts)
            kept.append(results)
            return results

        patch.setattr(job, "results_of", keeping)
        yield kept


@pytest.fixture(autouse=True, scope="session")
def looked_at():
    """Run ids of the runs whose bus was looked at."""
    return set()


@pytest.fixture(autouse=True)
def _bus_is_looked_at(request, run_results, looked_at):
    """End every test by asserting the bus truth of its runs; those marked `spoilt` had their faults on purpose."""
    yield
    is_spoilt = request.node.get_closest_marker("spoilt") is not None
    ours = [run_results.pop() for _ in run_results[:]]
    looked_at.update(results.run_id for results in ours)
    for results in (*ours, *_of_other_processes(request.node.funcargs.get("tmp_path"), looked_at)):
        assert_bus_truth(results)
        if not is_spoilt and results.bus.name.startswith(VIRTUAL):
            assert_bus_was_healthy(results)


def _of_other_processes(folder, looked_at):
    """Yield the results of runs in processes that a test started, from the sessions that they left in its folder."""
    for path in () if folder is None else folder.rglob("results.json"):
        results = result_from_dict(json.loads(path.read_text("utf-8")), str(path))
        if (path.parent / "events.jsonl").exists() and results.run_id not in looked_at:
            looked_at.add(results.run_id)
            yield results
