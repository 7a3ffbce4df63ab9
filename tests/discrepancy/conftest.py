"""The independent generator stands beside these tests; the engine never sees it."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parent.parent / "hidden"))
sys.path.insert(0, str(Path(__file__).parent.parent / "report"))

import numpy as np
import pytest
from synthetic import MODEL, RATE, measurement

from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.search.stepwise import search
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.recording.recording import ClockGrade, Recording
from etb_hil.recording.samples import SampleBlock


@pytest.fixture(scope="session")
def cogging_recording():
    """Twelve seconds of a unit that warms as its model file states, with cogging that it leaves out."""
    p = MODEL.with_laws_as_terms(25.0).vector()
    p[CATALOGUE["cogging_torque"].indices[0]] = 0.03
    p[CATALOGUE["cogging_torque"].indices[2]] = 7.0
    m = measurement(p, seed=5)
    time_ns = np.round(np.arange(len(m)) / RATE * 1e9).astype(np.int64)
    columns = {
        "motor_voltage": m.voltage,
        "motor_current": m.current,
        "motor_angle": m.angle * MODEL.values.gear_ratio,
        "throttle_angle": m.plate,
        "temperature": m.temperature,
    }
    found = Recording("synthetic", ClockGrade.TABLE)
    found.append([SampleBlock("table", time_ns, time_ns, columns, np.zeros(len(time_ns), np.int64))])
    return found


@pytest.fixture(scope="session")
def cogging_findings():
    """What a search finds in a record of a unit with cogging."""
    p = MODEL.vector()
    p[CATALOGUE["cogging_torque"].indices[0]] = 0.03
    p[CATALOGUE["cogging_torque"].indices[2]] = 7.0
    return search(MODEL, [Balances(measurement(p, seed=5), MODEL)])
