"""What data keep silent of: samples that are left out, or filled in and judged."""

import re
from dataclasses import replace

import numpy as np
import pytest
from answers import plain
from synthetic import MODEL

from etb_hil.discrepancy.answer.quality import data_quality
from etb_hil.discrepancy.explain import explain
from etb_hil.discrepancy.fitting.balances import Balances
from etb_hil.discrepancy.measured.segments import measurements_of
from etb_hil.recording.recording import ClockGrade, Recording
from etb_hil.recording.tables import read_table

RATE = 2000


def changed(recording, keep=None, **columns):
    block = recording.block(recording.sources[0])
    found = Recording("changed", ClockGrade.TABLE)
    whole = replace(block, columns={**block.columns, **columns})
    found.append([whole if keep is None else whole.select(keep)])
    return found


def flags_of(recording):
    return [
        flag
        for m in measurements_of(recording, MODEL)
        for flag in plain(data_quality([Balances(m, MODEL)], MODEL))[0]["flags"]
    ]


def test_whole_samples_call_for_no_word(cogging_recording):
    assert not any("of the samples" in flag or "left out" in flag for flag in flags_of(cogging_recording))


@pytest.mark.parametrize(("times", "is_said"), [(1.0, False), (1.002, False), (1.01, True), (0.99, True)])
def test_a_scale_that_is_not_as_stated_is_said(cogging_recording, times, is_said):
    plate = cogging_recording.series("throttle_angle").values * times
    said = [flag for flag in flags_of(changed(cogging_recording, throttle_angle=plate)) if "as far as" in flag]
    assert len(said) == is_said
    assert all(f"moves {times:.4f} times as far" in flag for flag in said)


def test_play_is_no_scale(cogging_recording):
    """Springs press the teeth to one side above limp-home and to the other below it."""
    plate = cogging_recording.series("throttle_angle").values
    lags = plate - 0.004 * np.sign(plate - MODEL.values.limp_home)
    assert not any("as far as" in flag for flag in flags_of(changed(cogging_recording, throttle_angle=lags)))


def test_values_that_are_missing_one_at_a_time_are_said_to_be_filled_in_and_judged(cogging_recording):
    current = cogging_recording.series("motor_current").values.copy()
    current[5::10] = np.nan
    flags = flags_of(changed(cogging_recording, motor_current=current))
    (said,) = (flag for flag in flags if "no motor_current" in flag)
    assert said.startswith("10 % of the samples have no motor_current; 10 %, single ones")
    assert not any("excludes them" in flag for flag in flags)


def test_of_values_that_are_missing_alone_and_together_both_shares_are_said(cogging_recording):
    current = cogging_recording.series("motor_current").values.copy()
    current[5::20] = np.nan
    current[10::20] = current[11::20] = current[12::20] = np.nan
    flags = flags_of(changed(cogging_recording, motor_current=current))
    assert any(flag.startswith("20 % of the samples have no motor_current; 5 %, single ones") for flag in flags)
    (bad,) = (flag for flag in flags if "excludes them" in flag)
    assert float(bad.split()[0]) == pytest.approx(20.0, abs=1.0)  # 15 % and the samples that they end at
    assert bad.endswith("0.1 s around them, 100 % in all")


def test_a_bad_moment_costs_what_lies_beside_it_too_and_that_is_said(cogging_recording):
    current = cogging_recording.series("motor_current").values.copy()
    current[4000:4400] = np.nan
    (bad,) = (f for f in flags_of(changed(cogging_recording, motor_current=current)) if "excludes them" in f)
    assert float(bad.split()[0]) == pytest.approx(100.0 * 400 / 24000, abs=0.1)
    assert float(re.search(r"around them, ([0-9.]+) %", bad)[1]) == pytest.approx(100.0 * 800 / 24000, abs=0.3)


def test_where_no_sample_can_be_judged_the_answer_says_why(cogging_recording):
    current = cogging_recording.series("motor_current").values.copy()
    current[::20] = current[1::20] = current[2::20] = np.nan
    found = plain(explain([changed(cogging_recording, motor_current=current)], MODEL))
    assert found["verdict"] == "insufficient_data"
    assert "has no sample that could be judged: a value is missing" in found["data_quality"][0]


def test_samples_that_are_missing_in_every_column_are_said_once(cogging_recording):
    keep = np.arange(12 * RATE) % 10 != 5
    (said,) = (flag for flag in flags_of(changed(cogging_recording, keep)) if "of the samples have no" in flag)
    assert said.startswith("10 % of the samples have no motor_voltage, motor_current, motor_angle, throttle_angle;")


def test_a_column_that_begins_late_is_said_to_be_filled_in(cogging_recording):
    current = cogging_recording.series("motor_current").values.copy()
    current[: 3 * RATE] = np.nan
    flags = flags_of(changed(cogging_recording, motor_current=current))
    assert any(flag.startswith("25 % of the samples have no motor_current; 25 %,") for flag in flags)


def test_segments_that_are_too_short_are_said_to_be_left_out(cogging_recording):
    seconds = np.arange(12 * RATE) / RATE
    keep = ~((seconds > 0.9) & (seconds < 1.0)) & ~((seconds > 2.2) & (seconds < 2.3))
    flags = flags_of(changed(cogging_recording, keep))
    assert "2 segments of less than 2 s between gaps left out: 2.1 s, 18 % of the samples" in flags


def test_samples_with_the_time_of_the_sample_before_are_said_to_be_left_out(cogging_recording, tmp_path):
    block = cogging_recording.block("table")
    lines = ["time_s,motor_voltage_V,motor_angle_rad"]
    for k in range(0, len(block), 2):
        sample = f"{block.time_ns[k] * 1e-9:.6f},{block.columns['motor_voltage'][k]},{block.columns['motor_angle'][k]}"
        lines += [sample, sample] if k in (100, 900) else [sample]
    path = tmp_path / "twice.csv"
    path.write_text("\n".join([*lines, ""]), "utf-8")
    assert "2 rows had the time of the row before and were left out" in flags_of(read_table(path))
