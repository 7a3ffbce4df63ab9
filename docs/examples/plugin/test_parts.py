"""Each part held to the contract of its kind."""

import json
from pathlib import Path

import pytest
from throttle_extras.differences import OBSERVER
from throttle_extras.frame_lines import READER
from throttle_extras.gravity_torque import EFFECT
from throttle_extras.nudge_current import MEASUREMENT
from throttle_extras.nudges import PHASE
from throttle_extras.soft_pd import LAW
from throttle_extras.turned_key import KEY

from etb_hil import testing

SETTINGS = {"between": ["20 deg", "40 deg"], "size": "5 deg", "hold": "0.2 s"}
SCENARIO = """\
schema: etb_hil/scenario/1
name: nudging
phases:
  - {kind: current_zero, id: zero, duration: 0.5 s}
  - {kind: nudges, id: nudging, between: [20 deg, 40 deg], size: 5 deg, hold: 0.2 s}
"""


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """Return a log of a hundred frames."""
    path = tmp_path / "drive.frames"
    frames = [{"t": 1e-3 * k, "id": 0x100 + k % 3, "data": f"{k:016x}"} for k in range(100)]
    path.write_text("".join(json.dumps(frame) + "\n" for frame in frames), "utf-8")
    return path


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    """Return a scenario with the package's phase."""
    path = tmp_path / "nudging.yaml"
    path.write_text(SCENARIO, "utf-8")
    return path


def test_effect() -> None:
    """Gravity."""
    testing.check_effect(EFFECT)


def test_key() -> None:
    """Turned bytes."""
    testing.check_key(KEY)


def test_law() -> None:
    """PD."""
    testing.check_law(LAW)


def test_measurement(scenario: Path) -> None:
    """Largest current."""
    testing.check_measurement(MEASUREMENT, scenario)


def test_observer() -> None:
    """Differences."""
    testing.check_observer(OBSERVER)


def test_phase() -> None:
    """Small steps."""
    testing.check_phase(PHASE, SETTINGS)


def test_reader(log: Path) -> None:
    """Lines of JSON."""
    testing.check_reader(READER, log)
