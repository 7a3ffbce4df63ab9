"""How a run begins: the controller is asked, with the drive off, until it answers or a second has passed."""

import numpy as np
import pytest
from faults_cases import Injected
from faults_nodes import MS, Deaf, Rewriting
from faults_study import run_with
from whole_run import files

from etb_hil.bench.job import prepare
from etb_hil.session.events import read_events

PHASES = """schema: etb_hil/scenario/1
name: test
phases:
  - {id: zero, kind: current_zero, duration: 0.1 s}
  - {id: hold, kind: hold, position: 30 deg, duration: 0.1 s}
"""

pytestmark = pytest.mark.spoilt


@pytest.fixture
def run(tmp_path):
    """Run a short scenario with a controller that `spoil` puts something before."""

    def run_scenario(spoil):
        path = tmp_path / "scenario.yaml"
        path.write_text(PHASES)
        job = prepare(files(scenario=path))
        return run_with(job, tmp_path / "out", 1, [Injected(spoil=[lambda node: spoil(node, job.setup.dialect)])])

    return run_scenario


@pytest.mark.parametrize("deaf_ms", [0, 300, 900])
def test_a_controller_that_wakes_within_a_second_is_waited_for(run, deaf_ms):
    finished = run(lambda node, _: Deaf(node, 0, deaf_ms * MS))
    assert (finished.results.bench.outcome, finished.results.bench.safe_state) == ("ok", True)
    begun = next(event for event in read_events(finished.session.events) if event.event == "phase")
    assert begun.stamp_ns - finished.record.start_ns < (deaf_ms + 120) * MS  # asked every 50 ms, then three statuses


def test_a_controller_that_says_nothing_for_a_second_is_a_bench_fault(run):
    finished = run(lambda node, _: Deaf(node, 0, 1_100 * MS))
    bench = finished.results.bench
    assert (bench.outcome, bench.reason_id, finished.results.exit_code) == ("fault", "no_answer", 3)
    assert finished.results.phases == ()
    assert finished.record.end_ns - finished.record.start_ns < 1_700 * MS  # and half a second to see the drive off


@pytest.mark.parametrize(("until_ms", "outcome"), [(500, "ok"), (1_500, "fault")])
def test_a_fault_that_an_earlier_run_left_has_a_second_to_go(run, until_ms, outcome):
    def change(role, values, stamp_ns):
        return np.where(stamp_ns[:, None] < until_ms * MS, 4.0, values) if role == "faults" else None

    finished = run(lambda node, dialect: Rewriting(node, dialect, 0, 1 << 62, change))
    assert finished.results.bench.outcome == outcome
    assert finished.results.bench.reason_id == ("" if outcome == "ok" else "controller_fault")
