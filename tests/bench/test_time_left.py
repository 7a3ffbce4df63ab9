"""How long a run still takes: an answer takes as long as it takes, and what ends early is not waited for."""

from etb_hil.base.stock import find
from etb_hil.bench.job import JobFiles, execute, prepare

SCENARIO = """schema: etb_hil/scenario/1
name: timed
phases:
  - {id: ready, kind: prompt, text: Ready, answers: [yes], unattended: yes, timeout: 100 s}
  - {id: wait, kind: wait, until: {role: supply_voltage, above: 5 V}, timeout: 100 s}
  - {id: zero, kind: current_zero, duration: 0.5 s}
  - {id: held, kind: hold, position: 30 deg, duration: 1.5 s}
"""


def test_prompts_and_phases_that_end_early_take_no_time_of_the_run(tmp_path):
    scenario = tmp_path / "timed.yaml"
    scenario.write_text(SCENARIO)
    files = {name: find(name, "default") for name in ("model", "limits")}
    seen = []
    job = prepare(JobFiles(scenario=scenario, bench=find("bench", "virtual_classic"), **files))
    execute(job, tmp_path, "", 1, seen.append)
    left = {phase: [s.total_s - s.time_s for s in seen if s.phase == phase] for phase in ("", "zero", "held")}
    assert 102.0 <= left[""][0] <= 102.6  # the wait's longest, no answer's, and the way to 30 deg
    assert all(1.5 < entry < 2.6 for entry in left["zero"])
    assert left["held"] == sorted(left["held"], reverse=True)
    assert left["held"][-1] < 0.2
