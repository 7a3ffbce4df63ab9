"""Parquet tables become Recordings by the same rules as CSV, and what the project writes in Parquet is read."""

import sys

import numpy as np
import pytest

from etb_hil.base.errors import InputError
from etb_hil.recording.pairing import paired
from etb_hil.recording.recording import ClockGrade
from etb_hil.recording.samples import SampleBlock
from etb_hil.recording.table_writer import write_table
from etb_hil.recording.tables import read_table

pa = pytest.importorskip("pyarrow")
parquet = pytest.importorskip("pyarrow.parquet")
TIME_NS = np.arange(40, dtype=np.int64) * 500_000


def _table(tmp_path, columns):
    path = tmp_path / "t.parquet"
    parquet.write_table(pa.table(columns), path)
    return path


def _refused(path):
    with pytest.raises(InputError) as caught:
        read_table(path)
    return str(caught.value)


def test_a_table_that_we_wrote_is_read_as_its_csv(tmp_path):
    columns = {"motor_voltage": np.linspace(-3.0, 3.0, 40), "throttle_angle": np.linspace(0.1, 1.2, 40)}
    columns["motor_voltage"][7] = np.nan
    read = []
    for suffix in (".csv", ".parquet"):
        write_table(tmp_path / f"t{suffix}", TIME_NS, columns)
        read.append(read_table(tmp_path / f"t{suffix}"))
    for role in columns:
        csv, ours = (one.series(role) for one in read)
        np.testing.assert_array_equal(ours.time_ns, csv.time_ns)
        np.testing.assert_array_equal(ours.values, csv.values)
    assert read[1].clock == ClockGrade.TABLE


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_table_that_we_wrote_has_the_same_bits_when_read(tmp_path, suffix):
    """Counters and fault bits have more digits than measured values, and times have most of all."""
    columns = {
        "faults": np.array([2147483649.0, 0.0, -0.0, 2.0**53]),
        "sample_counter": np.array([4294967294.0, 4294967295.0, np.nan, 0.0]),
        "controller_time": np.array([123456.789012, 123456.789013, 1e-7, 0.1 + 0.2]),
        "motor_current": np.array([5e-324, -1.7976931348623157e308, np.pi, 1e22]),
    }
    path = tmp_path / f"t{suffix}"
    write_table(path, TIME_NS[:4], columns)
    recording = read_table(path)
    for role, values in columns.items():
        assert recording.series(role).values.tobytes() == values.tobytes(), role


def test_whole_numbers_are_written_without_a_fraction(tmp_path):
    write_table(tmp_path / "t.csv", TIME_NS[:3], {"faults": np.array([2147483649.0, np.nan, 0.0])})
    assert (tmp_path / "t.csv").read_text("utf-8").splitlines()[1:] == [
        "0.000000000,2147483649", "0.000500000,", "0.001000000,0",
    ]  # fmt: skip


def test_units_and_errors_are_those_of_every_table(tmp_path):
    path = _table(tmp_path, {"t_ms": [0, 1, 1, 2], "motor_current_mA": [1.0, None, 3.0, 4.0], "note": list("abcd")})
    recording = read_table(path)
    assert recording.series("motor_current").values == pytest.approx([0.001, np.nan, 0.004], nan_ok=True)
    assert recording.notes == [
        "columns without a known role were left out: note",
        "1 rows had the time of the row before and were left out",
    ]
    assert "needs a unit" in _refused(_table(tmp_path, {"time_s": [0.0, 1.0], "motor_current": [1.0, 2.0]}))
    assert "no column is the time" in _refused(_table(tmp_path, {"motor_current_A": [1.0, 2.0]}))
    assert "time_s: goes back after row 1" in _refused(
        _table(tmp_path, {"time_s": [1.0, 0.0], "motor_current_A": [1, 2]})
    )
    assert "holds no numbers but string" in _refused(_table(tmp_path, {"time_s": [0.0], "motor_current_A": ["a"]}))
    assert "is infinite in row 1" in _refused(_table(tmp_path, {"time_s": [0.0], "motor_current_A": [np.inf]}))
    assert "has no rows" in _refused(
        _table(tmp_path, {"time_s": pa.array([], "f8"), "motor_current_A": pa.array([], "f8")})
    )


def _log(tmp_path, fields, channel=(0, 0, 0, 0), message=("A", "B", "A", "B")):
    """A file as an export writes it: a row a frame, null where a frame does not carry the signal."""
    columns = {"stamp_ns": [1_000, 1_500, 2_000, 2_500], "channel": pa.array(channel, pa.uint8())}
    columns["message"] = pa.array(message).dictionary_encode()
    its = [pa.field(name, pa.float64(), metadata={"unit": unit}) for name, unit, _ in fields]
    whole = pa.table(columns)
    for field, (_, _, values) in zip(its, fields, strict=True):
        whole = whole.append_column(field, pa.array(values, pa.float64()))
    parquet.write_table(whole, tmp_path / "log.parquet")
    return tmp_path / "log.parquet"


CURRENT, ANGLE = ("A.MotorCurrent", "mA", [1.0, None, 2.0, None]), ("B.ThrottleAngle2", "deg", [None, 90, None, 180])


def test_signals_of_a_log_have_their_own_names_and_units(tmp_path):
    recording = read_table(_log(tmp_path, [CURRENT, ("A.Crc", "", [1, None, 2, None]), ANGLE]))
    assert recording.clock == ClockGrade.RECEIVE_STAMPS
    assert recording.roles == ["motor_current", "throttle_angle_2"]
    assert recording.series("motor_current").values == pytest.approx([0.001, 0.002])
    assert recording.series("throttle_angle_2").values == pytest.approx([0.5 * np.pi, np.pi])


def _block(source, time_ns, **columns):
    times = np.asarray(time_ns, np.int64)
    return SampleBlock(source, times, times, columns, np.zeros(len(times), np.int64))


def test_two_frames_of_one_sample_share_a_row_and_slower_ones_stay():
    rng = np.random.default_rng(3)
    times = np.arange(100) * 1_000_000
    angle, late = np.linspace(0.1, 1.2, 100), times + 150_000 + rng.integers(0, 90_000, 100)
    kept = np.arange(100) != 40
    whole, slow = paired(
        [
            _block("angle", late[kept], throttle_angle=angle[kept]),
            _block("voltage", times, motor_voltage=angle * 2.0),
            _block("status", times[::10] + 300, temperature=angle[::10]),
        ]
    )
    assert whole.time_ns.tolist() == times.tolist()
    np.testing.assert_array_equal(whole.columns["throttle_angle"], np.where(kept, angle, np.nan))
    assert slow.source == "status"
    assert len(slow) == 10


def test_a_map_names_signals_as_the_file_does(tmp_path):
    table_map = tmp_path / "m.yaml"
    roles = "roles: {drive_torque: {column: A.MotorCurrent, unit: N·m, scale: 2}}\n"
    table_map.write_text(f"schema: etb_hil/table_map/1\ntime: {{column: stamp_ns, unit: ns}}\n{roles}", "utf-8")
    recording = read_table(_log(tmp_path, [CURRENT, ANGLE]), table_map)
    assert recording.series("drive_torque").values == pytest.approx([2.0, 4.0])


def test_two_units_and_signals_of_one_role_are_refused(tmp_path):
    assert "on several channels (it is '0, 1')" in _refused(_log(tmp_path, [CURRENT, ANGLE], channel=(0, 1, 0, 1)))
    twice = ("B.MotorCurrent", "A", [None, 1.0, None, 2.0])
    assert "'A.MotorCurrent' has the role motor_current already" in _refused(_log(tmp_path, [CURRENT, twice]))


def test_what_cannot_be_read_says_why(tmp_path, monkeypatch):
    assert "cannot be read" in _refused(tmp_path / "no.parquet")
    (tmp_path / "broken.parquet").write_bytes(b"PAR1 or not")
    assert "must be a complete Parquet file" in _refused(tmp_path / "broken.parquet")
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    assert "Parquet files need pyarrow; pip install 'etb-hil[logs]'" in _refused(tmp_path / "no.parquet")
