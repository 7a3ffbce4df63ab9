"""A part of the project's own is one file: nothing else is edited, and every command has it.

Phases and effects have tests like these beside theirs.
"""

import os
import subprocess
import sys

LAW = '''
"""Half of what a stiff spring would do."""

import numpy as np

from etb_hil.controller.laws.interface import ControlLaw


def gains(nominal):
    return np.array([nominal.inertia * 1e4])


def torque(gain, memory, error, rate):
    return 0.5 * gain[0] * error


LAW = ControlLaw("half a spring", gains, torque)
'''
OBSERVER = '''
"""The angle's observer under another name."""

from etb_hil.observer.kinds.angle import OBSERVER as ANGLE
from etb_hil.observer.registry import ObserverKind

OBSERVER = ObserverKind("the angle's, again", ANGLE.make)
'''
READER = '''
"""One frame a byte."""

import numpy as np

from etb_hil.canio.frames import FrameBlock
from etb_hil.canio.logs.log_reader import Reader


class Log:
    notes: list = []
    begin_ns = 0

    def __init__(self, path):
        self.path = path

    def __iter__(self):
        count = len(self.path.read_bytes())
        none = np.zeros(count, np.uint8)
        yield FrameBlock(
            np.arange(count, dtype=np.int64), np.full(count, 7, np.uint32), none, none,
            np.zeros((count, 8), np.uint8), none,
        )


READER = Reader("one frame a byte", (".bytes",), Log)
'''
PROGRAM = """
from pathlib import Path

from etb_hil.canio.logs import formats
from etb_hil.controller.laws import kinds as laws
from etb_hil.observer import kinds as observers

formats.__path__.append("readers")
laws.__path__.append("laws")
observers.__path__.append("observers")

import numpy as np

from etb_hil.base.stock import find
from etb_hil.bench.bench_file import load_bench
from etb_hil.canio.logs.reading import read_log
from etb_hil.controller.laws.choice import law_gains, law_number, law_torque
from etb_hil.observer.registry import observer_kind
from etb_hil.plant.parameters import load_model

stock = find("bench", "virtual_classic").read_text("utf-8")
Path("bench.yaml").write_text(f"{stock}law: half-spring\\nobserver: other-angle\\n", "utf-8")
bench = load_bench(Path("bench.yaml")).bench
nominal = load_model(find("model", "default")).values
memory = np.zeros(2)
for law in (bench.law, "pd"):
    gain = law_gains(law, nominal)
    print(law_torque(law_number(law), gain, memory, 0.5, 0.0) / gain[0])
print(observer_kind(bench.observer).summary)
print(sum(len(block) for block in read_log(Path("a.bytes"))))
"""


def test_a_law_an_observer_and_a_reader_that_files_add_are_chosen_and_used(tmp_path):
    for name, text in (("laws/half_spring", LAW), ("observers/other_angle", OBSERVER), ("readers/one_a_byte", READER)):
        path = tmp_path / f"{name}.py"
        path.parent.mkdir()
        path.write_text(text, "utf-8")
    (tmp_path / "a.bytes").write_bytes(b"12345")
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], cwd=tmp_path, capture_output=True, text=True, check=False,
        env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")},
    )  # fmt: skip
    assert done.stdout.splitlines() == ["0.25", "0.5", "the angle's, again", "5"], done.stderr
