"""What is found in frames does not depend on how they were cut into calls, also where a clock was set back."""

from dataclasses import replace

import numpy as np
import pytest
from whole_run import files

from etb_hil.bench.job import execute, prepare
from etb_hil.canio.frames import concatenate_frames
from etb_hil.canio.logs.blf import read_blf
from etb_hil.session.analysis import Analysis

SCENARIO = """schema: etb_hil/scenario/1
name: Slow passes
phases:
  - {id: zero, kind: current_zero, duration: 0.3 s}
  - {id: ramps, kind: ramp, between: [10 deg, 50 deg], speed: 0.5 rad/s}
  - {id: steps, kind: step, positions: [20 deg, 30 deg, 20 deg], hold: 0.2 s}
"""
MS = 1_000_000


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cuts")
    (folder / "scenario.yaml").write_text(SCENARIO)
    job = prepare(files(scenario=folder / "scenario.yaml"))
    return job, execute(job, folder / "sessions", "", 1)


def judged(run, frames, cuts):
    """Return the measurements of a run's frames, handed over in pieces that end at these places."""
    job, finished = run
    analysis = Analysis(job.setup.dialect, job.model, job.limits, "cuts", bus=job.setup.bench.bus)
    for phase in finished.record.phases:
        analysis.begin_phase(phase.start_ns, phase.id, phase.kind)
    for first, last in zip([0, *cuts], [*cuts, len(frames)], strict=True):
        analysis.push(frames.select(slice(first, last)))
    return analysis.finish().measurements


@pytest.mark.parametrize("back_ms", [0, 1, 5, 20])
def test_the_cuts_change_nothing(run, back_ms):
    frames = concatenate_frames(list(read_blf(run[1].session.raw_log)))
    stamp_ns = frames.stamp_ns - back_ms * MS * (frames.stamp_ns // (100 * MS) % 2)  # set back and on, every 100 ms
    frames = replace(frames, stamp_ns=stamp_ns)
    whole = judged(run, frames, [])
    is_steady = back_ms < 10  # set back by more than the time between two commands, no pass is on a line
    assert ("spring_torque_open" in whole) == is_steady
    assert "step_delay_large_opening" in whole
    for seed in range(5):
        rng = np.random.default_rng(seed)
        places = np.unique(rng.integers(1, len(frames), size=10 ** int(rng.integers(1, 4))))
        assert judged(run, frames, places.tolist()) == whole
