"""What is said of drives without springs: healthy ones, and those of which a number, the force or the friction is off.

    python benchmarks/explain_drives.py FIRST COUNT

Each of COUNT drawn axes, linear and rotary in turn, is measured as each of CASES: in order, with its force read too
large or too small, with a wrong mass or friction, with friction that differs by direction, with a wave once a turn,
with a fan. Printed is what the answers are worth.
"""

import sys
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests" / "hidden"))

from generator.axis import COULOMB, MASS, STICTION, draw_axis

from etb_hil.discrepancy.answer.explanation import causes
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.measured.segments import measurements_of
from etb_hil.discrepancy.search.stepwise import search
from etb_hil.plant.drive_file import load_plant
from etb_hil.recording.recording import ClockGrade, Recording
from etb_hil.recording.samples import SampleBlock

CASES = {
    "nothing": ({}, ()),
    "force read 25 % too large": ({"force_scale": 1.25}, ("current_sensor_gain",)),
    "force read 20 % too small": ({"force_scale": 0.8}, ("current_sensor_gain",)),
    "mass 50 % larger": ({"wrong": {MASS: 1.5}}, ("parameter:motor_inertia",)),
    "friction 50 % larger": ({"wrong": {COULOMB: 1.5, STICTION: 1.5}}, ("parameter:coulomb", "parameter:stiction")),
    "friction 20 % apart by direction": ({"asymmetry": 0.2}, ("friction_asymmetry",)),
    "a wave of 20 % of the friction once a turn": ({"tooth": 0.2}, ("cogging_torque",)),
    "a fan that drags as much as the friction": ({"fan": 1.0}, ("fan_drag",)),
}


def searched(axis):
    """What the tool finds of an axis."""
    model = model_of(axis)
    return search(model, balances_of(axis, model))


def model_of(axis):
    """What an axis' file states."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "drive.yaml"
        path.write_text(axis.file, "utf-8")
        return load_plant(path)


def balances_of(axis, model, name="drawn axis"):
    """The balances of what was measured on an axis."""
    time_ns = np.round(axis.table["time"] * 1e9).astype(np.int64)
    columns = {role: values for role, values in axis.table.items() if role != "time"}
    recording = Recording(name, ClockGrade.TABLE)
    recording.append([SampleBlock("table", time_ns, time_ns, columns, np.zeros(len(time_ns), np.int64))])
    return [Balances(m, model) for m in measurements_of(recording, model)]


def outcome(findings, truths):
    """What an answer is worth, in a word or two; `truths`: ids of what is off, any of which is a right name."""
    named = [{cause.id, *cause.not_isolable_from} for cause in causes(findings)]
    if findings.verdict not in ("explained", "ambiguous"):
        return findings.verdict
    if any(len(ids) == 1 and not ids & set(truths) for ids in named):
        return "a wrong name alone"
    if not any(ids & set(truths) for ids in named):
        return "a class without the truth"
    return "named" if findings.verdict == "explained" else "in its class"


def main(first, count):
    for case, (options, truths) in CASES.items():
        axes = (draw_axis(first + k, ("linear", "rotary")[k % 2], **options) for k in range(count))
        found = Counter(outcome(searched(axis), truths) for axis in axes)
        print(f"{case:44}", ", ".join(f"{what} {n}" for what, n in found.most_common()), flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
