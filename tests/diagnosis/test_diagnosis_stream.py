"""The diagnosis on a stream: any chunks, any machine, the same bits; and what it hands over."""

import hashlib
import os
import pickle
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from independent_throttle import FAULTY, Unit, friction_check, sense
from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__
from throttle_as_model import bench_model, phase_of, rows_of

from etb_hil.base.stock import find
from etb_hil.diagnosis.diagnosis import Diagnosis
from etb_hil.diagnosis.limits_file import load_limits

LIMITS = load_limits(find("limits", "default"))
BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


def fingerprint(result):
    """Return a digest of every bit of a result."""
    digest = hashlib.sha256(repr((result.verdict, result.reasons, result.measurements, result.exceedances)).encode())
    for name in sorted(result.series):
        digest.update(name.encode() + np.ascontiguousarray(result.series[name]).tobytes())
    return digest.hexdigest()


@pytest.fixture(scope="module")
def runs():
    run, phases = friction_check(FAULTY, speeds=(1.2,), dashes=1)
    rng = np.random.default_rng(0)
    return {rate: list(rows_of(sense(FAULTY, run, rate, rng), phases, rate)) for rate in (1000, 20000)}


def judge(pieces):
    diagnosis = Diagnosis(bench_model(Unit()), LIMITS)
    for rows, kind in pieces:
        diagnosis.push(rows, kind)
    return diagnosis.finish()


def cut(pieces, sizes):
    for rows, kind in pieces:
        start, turn = 0, 0
        while start < len(rows):
            size = sizes[turn % len(sizes)]
            yield rows.select(slice(start, start + size)), kind
            start, turn = start + size, turn + 1


@settings(max_examples=8)
@given(sizes=st.lists(st.integers(1, 700), min_size=1, max_size=6), rate=st.sampled_from([1000, 20000]))
def test_same_bits_however_the_stream_is_cut(runs, sizes, rate):
    assert fingerprint(judge(cut(runs[rate], sizes))) == fingerprint(judge(runs[rate]))


_ELSEWHERE = """
import pickle, sys, warnings
sys.path[:0] = sys.argv[2:]
from test_diagnosis_stream import fingerprint, judge
with open(sys.argv[1], "rb") as file:
    print(fingerprint(judge(pickle.load(file))))
"""


@pytest.mark.study
def test_same_bits_on_a_lesser_processor(runs, tmp_path):
    """As tests/replay/test_replay_on_other_machines.py shows of results, and of all series, too.

    Neither the vector units of this machine nor its C library's choice of routines leave a trace."""
    rows = tmp_path / "rows.pickle"
    rows.write_bytes(pickle.dumps(runs[1000]))
    lesser = os.environ | {
        "NUMBA_CPU_NAME": "x86-64",
        "NUMBA_CPU_FEATURES": "",
        "NUMBA_CACHE_DIR": str(tmp_path / "cache"),
        "NPY_DISABLE_CPU_FEATURES": _numpy_extras(),
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX512F,-AVX2,-FMA,-AVX",
    }
    command = [sys.executable, "-c", _ELSEWHERE, str(rows), str(Path(__file__).parent), str(BENCHMARKS)]
    answer = subprocess.run(command, env=lesser, capture_output=True, text=True, check=False)
    assert answer.returncode == 0, answer.stderr
    assert answer.stdout.strip() == fingerprint(judge(runs[1000]))


def _numpy_extras():
    return " ".join(feature for feature in __cpu_dispatch__ if __cpu_features__[feature])


def test_result_has_all_measurements_and_columns(runs):
    result = judge(runs[1000])
    assert result.verdict == "fail"
    assert set(result.measurements) >= {"T_st", "T_c", "return_margin", "omega_s", "viscous", "T_c_literal"}
    for group in (
        ("time", "angle", "friction"),
        ("curve_velocity", "curve_low", "curve_high"),
        ("point_velocity", "point_friction"),
    ):
        assert len({len(result.series[name]) for name in group}) == 1
    inside = (result.series["curve_low"] <= result.series["curve_friction"]) & (
        result.series["curve_friction"] <= result.series["curve_high"]
    )
    assert np.all(inside)


def test_the_drawn_band_is_as_wide_as_the_numbers_intervals(runs):
    result = judge(runs[1000])
    stiction, series = result.measurements.get("T_st"), result.series
    slowest = np.flatnonzero(series["curve_velocity"] > 0.0)[0]
    assert series["curve_low"][slowest] == pytest.approx(stiction.low, rel=0.01)
    assert series["curve_high"][slowest] == pytest.approx(stiction.high, rel=0.01)


def test_snapshot_grows_with_the_stream(runs):
    diagnosis = Diagnosis(bench_model(Unit()), LIMITS)
    assert diagnosis.snapshot().reading is None
    readings = []
    for rows, kind in cut(runs[1000], [100]):
        diagnosis.push(rows, kind)
        readings.append(diagnosis.snapshot())
    counts = [r.exceedances for r in readings]
    assert counts == sorted(counts)
    assert counts[-1] == len(diagnosis.finish().exceedances)
    last = readings[-1].reading
    assert last.stiction == pytest.approx(FAULTY.stiction, rel=0.05)
    assert last.coulomb == pytest.approx(FAULTY.coulomb, rel=0.3)
    assert last.fastest > 2.15 * 140.0 / 18.0


def test_rows_without_a_needed_role_are_refused(runs):
    rows, _ = runs[1000][0]
    bare = type(rows)(
        rows.source, rows.time_ns, rows.stamp_ns, {"motor_current": rows.columns["motor_current"]}, rows.lost_before
    )
    with pytest.raises(KeyError):
        Diagnosis(bench_model(Unit()), LIMITS).push(bare, phase_of("ramp"))


@pytest.mark.parametrize("name", ["motor_current", "motor_angle", "motor_voltage", "throttle_angle"])
def test_an_infinite_value_is_a_missing_one(runs, name):
    found = []
    for bad in (np.nan, np.inf, -np.inf):
        pieces = [(rows, kind) for rows, kind in runs[1000]]
        for place in (0, 1):  # in the current's zero, and in motion
            rows, kind = pieces[place]
            columns = {**rows.columns, name: rows.columns[name].copy()}
            columns[name][100] = bad
            pieces[place] = (replace(rows, columns=columns), kind)
        found.append(judge(pieces))
    assert str(found[0].verdict) == "fail"
    assert found[0].measurements == found[1].measurements == found[2].measurements


def test_voltage_temperature_and_plate_sensor_are_optional(runs):
    needed = ("motor_current", "motor_angle")
    pieces = [
        (type(r)(r.source, r.time_ns, r.stamp_ns, {n: r.columns[n] for n in needed}, r.lost_before), kind)
        for r, kind in runs[1000]
    ]
    result = judge(pieces)
    assert str(result.verdict) == "fail"
    assert result.measurements.get("back_emf") is None
    assert result.measurements.get("T_st").value == pytest.approx(FAULTY.stiction, rel=0.02)
