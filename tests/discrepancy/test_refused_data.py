"""Data that cannot be explained: the answer says which, why and what is allowed, and nothing is named."""

import numpy as np
import pytest
from answers import plain
from synthetic import MODEL

from etb_hil.base.errors import InputError
from etb_hil.discrepancy.explain import explain
from etb_hil.discrepancy.measured.angles import must_count_turns
from etb_hil.recording.recording import ClockGrade, Recording
from etb_hil.recording.samples import SampleBlock


def _changed(recording, **columns):
    block = recording.block(recording.sources[0])
    found = Recording("changed", ClockGrade.TABLE)
    whole = {**block.columns, **columns}
    found.append([SampleBlock("table", block.time_ns, block.stamp_ns, whole, block.lost_before)])
    return found


@pytest.mark.parametrize("every", [1, 40])
def test_a_duty_of_zeros_is_refused_at_once_however_slow_its_samples_are(cogging_recording, every):
    block = cogging_recording.block("table")
    samples = slice(None, None, every)
    columns = {role: values[samples] for role, values in block.columns.items() if role != "motor_voltage"}
    columns["motor_duty"] = np.zeros(len(columns["motor_angle"]))
    found = Recording("zeros", ClockGrade.TABLE)
    found.append(
        [SampleBlock("table", block.time_ns[samples], block.stamp_ns[samples], columns, block.lost_before[samples])]
    )
    answer = plain(explain([found], MODEL))
    assert answer["verdict"] == "insufficient_data"
    assert any("check the column of motor_voltage or motor_duty" in str(one) for one in answer["data_quality"])


@pytest.mark.parametrize("later_ns", [1, 1_000, 20_000])
def test_rows_that_are_repeated_a_moment_later_are_refused_at_once(cogging_recording, later_ns):
    """An even clock as fine as their distance would have a million points for each second."""
    block = cogging_recording.block("table")
    time_ns = np.repeat(block.time_ns, 2) + np.tile([0, later_ns], len(block))
    columns = {role: np.repeat(values, 2) for role, values in block.columns.items()}
    found = Recording("twice", ClockGrade.TABLE)
    found.append([SampleBlock("table", time_ns, time_ns, columns, np.zeros(len(time_ns), np.int64))])
    answer = plain(explain([found], MODEL))
    assert answer["verdict"] == "insufficient_data"
    assert any("remove rows that repeat the one before" in str(one) for one in answer["data_quality"])


def _values(recording, role):
    return recording.series(role).values


def _still(recording):
    nothing = np.zeros(len(_values(recording, "motor_voltage")))
    return {
        "motor_voltage": nothing,
        "motor_current": nothing,
        "motor_angle": nothing,
        "throttle_angle": nothing + 0.14,
    }


@pytest.mark.parametrize(
    ("columns", "says"),
    [
        (_still, "stands still"),
        (
            lambda r: {a: np.degrees(_values(r, a)) for a in ("motor_angle", "throttle_angle")},
            "the plate moves beyond the model's stops; suspected unit mismatch: values in deg whose unit says rad",
        ),
        (lambda r: {"motor_angle": np.mod(_values(r, "motor_angle"), 2.0 * np.pi)}, "begins anew after each turn"),
        (lambda r: {"motor_current": -_values(r, "motor_current")}, "motor_current runs against motor_voltage"),
        (lambda r: {"motor_current": 1000.0 * _values(r, "motor_current")}, "check its unit (A or mA)"),
        (lambda r: {"motor_current": np.clip(_values(r, "motor_current"), -1.5, 1.5)}, "motor_current stays at 1.5 A"),
        (lambda r: {"motor_current": np.maximum(_values(r, "motor_current"), 0.0)}, "motor_current stays at 0 A"),
        (lambda r: {"motor_voltage": np.full(len(_values(r, "motor_voltage")), np.nan)}, "no values of motor_voltage"),
        (lambda r: {"motor_voltage": np.zeros(len(_values(r, "motor_voltage")))}, "voltage is constant (0 V) while"),
        (lambda r: {"motor_voltage": np.full(len(_values(r, "motor_voltage")), 12.0)}, "check the column of"),
    ],
    ids=[
        "still",
        "degrees",
        "within a turn",
        "backwards",
        "mA as A",
        "cut off",
        "one way",
        "no voltage",
        "zeros",
        "the supply",
    ],
)
def test_nothing_is_named_and_the_reason_is_said(cogging_recording, columns, says):
    found = plain(explain([_changed(cogging_recording, **columns(cogging_recording))], MODEL))
    assert found["verdict"] == "insufficient_data"
    assert not found["causes"]
    assert says in found["data_quality"][0]


@pytest.mark.parametrize("lost", [slice(0, 0), slice(250, 650)], ids=["whole", "with a gap"])
def test_an_angle_within_a_turn_that_counts_on_is_taken(lost):
    """Neither a bad sample nor what moved in a gap is a turn that was not counted."""
    seconds = np.arange(1500) * 1e-3
    angle = 2.9 * np.sin(2.0 * np.pi * seconds)
    angle[700] -= 3.2
    seconds, angle = np.delete(seconds, lost), np.delete(angle, lost)
    must_count_turns("own", seconds, {"drive_angle": angle})
    with pytest.raises(InputError, match="drive_angle jumps by about a turn"):
        must_count_turns("own", seconds, {"drive_angle": np.mod(angle, 2.0 * np.pi)})
