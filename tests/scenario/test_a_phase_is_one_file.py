"""A kind of phase is one file in `kinds/`: scenarios, schema, rehearsal and diagnosis know it without another edit."""

import subprocess
import sys

FILE = '''
"""The phase `dip`: down from an angle and up again."""

from typing import ClassVar, Literal

from etb_hil.diagnosis.phase_use import Use
from etb_hil.scenario.phase import Between, PhaseModel
from etb_hil.scenario.trajectory import Chain, move


class DipPhase(PhaseModel):
    """Goes down and up between two angles."""

    angles: ClassVar = ("between",)
    use: ClassVar = Use.FITTED

    kind: Literal["dip"]
    between: Between

    def trajectory(self, start, throttle):
        """Return the phase's set-points."""
        low, high = self.between
        return Chain(move(start, high, 1.0), move(high, low, 1.0), move(low, high, 1.0))


PHASE = DipPhase
'''
SCENARIO = """\
schema: etb_hil/scenario/1
name: dipping
phases:
  - {kind: current_zero, id: zero, duration: 0.5 s}
  - {kind: dip, id: dipping, between: [20 deg, 40 deg]}
"""


PROGRAM = """
from etb_hil.scenario import kinds

kinds.__path__.append("kinds")

import etb_hil as etb

run = etb.run("dipping.yaml")
print(run.result.phases[-1].id, run.result.bench.outcome, run.measurements["fastest"].value > 0.9)
"""


def test_a_phase_that_one_file_adds_is_run_and_judged(tmp_path):
    (tmp_path / "kinds").mkdir()
    (tmp_path / "kinds" / "dip.py").write_text(FILE, "utf-8")
    (tmp_path / "dipping.yaml").write_text(SCENARIO, "utf-8")
    done = subprocess.run([sys.executable, "-c", PROGRAM], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.stdout.split() == ["dipping", "ok", "True"], done.stderr
