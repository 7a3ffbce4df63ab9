"""Hidden cases as the tool gets them: a Recording and a Model; the truth stays apart."""

import sys
import tempfile
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests" / "hidden"))

from generator.case import make_case
from generator.model_file import model_text
from generator.separability import sealed

from etb_hil.plant.parameters import Model, load_model
from etb_hil.recording.recording import ClockGrade, Recording
from etb_hil.recording.samples import SampleBlock


@dataclass
class HiddenCase:
    recording: Recording
    model: Model
    case: object

    def truth(self):
        return sealed(self.case)


def hidden_case(seed, effects=(), level="strong", **options):
    """Draw a case and hand it over as the tool would read it from its files."""
    case = make_case(seed, effects, level, **options)
    return HiddenCase(recording_of(case), model_of(case), case)


def recording_of(case):
    time_ns = np.round(case.table["time"] * 1e9).astype(np.int64)
    columns = {role: values for role, values in case.table.items() if role != "time"}
    recording = Recording("hidden case", ClockGrade.TABLE)
    recording.append([SampleBlock("table", time_ns, time_ns, columns, np.zeros(len(time_ns), np.int64))])
    return recording


def model_of(case):
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        path = Path(folder) / "model.yaml"
        path.write_text(model_text(case.nominal, case.sensors, "drawn unit"), "utf-8")
        return load_model(path)
