"""Recordings: read from what people have, and handed to other libraries with their units."""

import re
import sys

import numpy as np
import pytest

import etb_hil as etb
from etb_hil.base.roles import ROLES
from etb_hil.recording.recording import ClockGrade

COLUMNS = {"motor_current": "motor_current_A", "motor_angle": "motor_angle_rad", "temperature": "temperature_degC"}


@pytest.fixture(scope="module")
def recording(healthy):
    return etb.read(healthy.folder)


def test_a_session_its_raw_log_and_the_run_hold_the_same_signals(healthy, recording):
    log = etb.read(healthy.folder / "raw.blf", bench="virtual_classic")
    for other in (log, healthy.recording):
        assert set(other.roles) == set(recording.roles)
        for role in recording.roles:
            assert np.array_equal(other[role].time_ns, recording[role].time_ns)
            assert np.array_equal(other[role].values, recording[role].values, equal_nan=True)
    assert recording.session == healthy.folder
    assert log.session is None


def test_a_role_by_its_name(recording):
    current = recording["motor_current"]
    assert (current.role, current.unit) == ("motor_current", "A")
    assert "motor_current" in recording
    assert "nonsense" not in recording
    with pytest.raises(etb.InputError, match=r"no signal for the role 'nonsense'.*motor_current"):
        _ = recording["nonsense"]


def test_the_table_has_every_sample_at_its_instant_and_nothing_between(recording):
    time_ns, columns = recording.table(COLUMNS)
    assert np.all(np.diff(time_ns) > 0)
    assert list(columns) == list(COLUMNS)
    for role, column in columns.items():
        signal = recording[role]
        at = np.searchsorted(time_ns, signal.time_ns)
        assert np.array_equal(time_ns[at], signal.time_ns)
        assert np.array_equal(column[at], signal.values, equal_nan=True)
        assert np.isnan(np.delete(column, at)).all()


def test_an_empty_recording_has_an_empty_table():
    empty = etb.Recording("nothing", ClockGrade.TABLE)
    assert empty.duration == 0.0
    assert [len(part) for part in empty.table()] == [0, 0]


def test_numpy(recording):
    found = recording.to_numpy(COLUMNS)
    assert list(found) == ["time_s", *COLUMNS.values()]
    assert {len(column) for column in found.values()} == {len(found["time_s"])}
    assert found["time_s"][-1] - found["time_s"][0] == pytest.approx(recording.duration, abs=0.1)


def test_pandas_keeps_units(recording):
    frame = recording.to_pandas(COLUMNS)
    assert frame.index.name == "time_s"
    assert list(frame.columns) == list(COLUMNS.values())
    assert frame.attrs["units"]["motor_current_A"] == "A"
    assert frame["motor_current_A"].dropna().to_numpy() == pytest.approx(recording["motor_current"].values)


def test_polars_keeps_units(recording):
    frame = recording.to_polars(COLUMNS)
    assert frame.columns == ["time_s", *COLUMNS.values()]
    assert len(frame) == len(recording.table(COLUMNS)[0])


def test_xarray_keeps_units(recording):
    dataset = recording.to_xarray(COLUMNS)
    assert {name: dataset[name].attrs["units"] for name in COLUMNS} == {name: ROLES[name].unit for name in COLUMNS}
    assert dataset["time_s"].attrs["units"] == "s"


def test_arrow_keeps_units(recording):
    table = recording.to_arrow(COLUMNS)
    assert {field.name: field.metadata[b"unit"].decode() for field in table.schema} == {
        "time_s": "s", **{name: ROLES[role].unit for role, name in COLUMNS.items()},
    }  # fmt: skip


@pytest.mark.parametrize(
    ("library", "method"), [("pandas", "to_pandas"), ("polars", "to_polars"), ("xarray", "to_xarray")]
)
def test_a_library_that_is_not_there_takes_one_line(recording, library, method, monkeypatch):
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(etb.InputError) as caught:
        getattr(recording, method)()
    assert str(caught.value).startswith(f"{library} is not installed")
    assert f"pip install {library}" in str(caught.value)


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_what_is_written_is_read_back(recording, tmp_path, suffix):
    path = tmp_path / f"signals{suffix}"
    recording.write(path, ["motor_current", "motor_angle"])
    again = etb.read(path)
    assert set(again.roles) == {"motor_current", "motor_angle"}
    before, after = (one.table(["motor_current", "motor_angle"]) for one in (recording, again))
    assert after[0] - after[0][0] == pytest.approx(before[0] - before[0][0], abs=2)
    for role in before[1]:
        assert after[1][role] == pytest.approx(before[1][role], rel=1e-6, nan_ok=True)


def test_the_signals_of_a_session_as_csv_are_those_of_the_session(healthy, recording, tmp_path, capsys):
    """Each signal keeps its own samples: slow ones make no rows of the fast ones."""
    from etb_hil.cli.main import main  # noqa: PLC0415

    path = tmp_path / "signals.csv"
    assert main(["export", str(healthy.folder), str(path)]) == 0
    assert "motor_current" in capsys.readouterr().out
    again = etb.read(path)
    assert set(again.roles) == set(recording.roles)
    for role in recording.roles:
        good = np.isfinite(recording[role].values)
        assert again[role].values == pytest.approx(recording[role].values[good], rel=1e-6), role
    assert again["motor_current"].time_ns == pytest.approx(recording["motor_current"].time_ns, abs=1000)
    assert main(["plot", str(path), "--out", str(tmp_path / "signals.png")]) == 0
    assert main(["export", str(healthy.folder), str(path), "--dbc", "etb"]) == 2
    assert "--dbc does not go with .csv" in capsys.readouterr().err


def test_errors_are_those_of_the_command_line(tmp_path, capsys):
    from etb_hil.cli.main import main  # noqa: PLC0415

    path = tmp_path / "data.xyz"
    path.write_text("nothing")
    with pytest.raises(etb.InputError) as caught:
        etb.read(path)
    assert main(["plot", str(path)]) == 2
    assert str(caught.value) in capsys.readouterr().err


def test_printed_it_shows_length_roles_and_ranges_with_units_for_people(recording):
    first, *lines = str(recording).splitlines()
    assert first.startswith("Recording of raw.blf: ")
    assert "time by sample counter" in first
    said = {line.split()[0]: line for line in lines}
    assert said.keys() >= set(recording.roles)
    assert re.search(r"\d+ samples, -?[\d.]+ deg to [\d.]+ deg$", said["throttle_angle"])


def test_a_notebook_shows_roles_units_and_a_picture(recording):
    page = recording._repr_html_()
    for role in recording.roles:
        assert f"<td>{role}</td>" in page
    assert page.count("<svg") == 1
    assert "<script" not in page
