"""Map files: a table with names of its own becomes roles, scale and offset included."""

from __future__ import annotations

import numpy as np
import pytest

from etb_hil.base.errors import InputError
from etb_hil.recording.tables import read_table

scipy_io = pytest.importorskip("scipy.io", reason="MAT files need SciPy")
scipy_sparse = pytest.importorskip("scipy.sparse", reason="MAT files need SciPy")

MAP = """schema: etb_hil/table_map/1
time: {column: zeit, unit: ms}
roles:
  throttle_angle: {column: winkel, unit: deg, scale: 2, offset: 90}
  motor_voltage: {column: u, unit: mV}
  drive_force: {column: u, unit: N, scale: 0.5}
"""


@pytest.fixture
def map_file(tmp_path):
    path = tmp_path / "map.yaml"
    path.write_text(MAP)
    return path


def check(recording):
    np.testing.assert_array_equal(recording.series("throttle_angle").time_ns, [0, 1_500_000])
    np.testing.assert_allclose(recording.series("throttle_angle").values, [np.pi / 2, np.pi], rtol=1e-15)
    np.testing.assert_allclose(recording.series("motor_voltage").values, [1.0, 2.0], rtol=1e-15)
    np.testing.assert_array_equal(recording.series("drive_force").values, [500.0, 1000.0])


def test_a_csv_file_through_a_map(tmp_path, map_file):
    path = tmp_path / "t.csv"
    path.write_text("zeit;winkel;u;bemerkung\n0;0;1000;gut\n1,5;45;2000;gut\n")
    check(read_table(path, map_file))


def test_a_mat_file_through_a_map(tmp_path, map_file):
    path = tmp_path / "t.mat"
    scipy_io.savemat(path, {"zeit": [0, 1.5], "winkel": [[0.0], [45.0]], "u": [1000, 2000], "k": 3.0, "text": "a"})
    check(read_table(path, map_file))


@pytest.mark.parametrize(
    ("vectors", "says"),
    [
        ({"winkel": [0, 1]}, "has no such column (it is 'u')"),
        ({"winkel": [0, 1], "u": [0, 1, 2]}, "u: has 3 values, the time zeit has 2"),
        ({"winkel": [0, np.inf], "u": [0, 1]}, "winkel: is infinite in row 2"),
        ({"winkel": [0, 1], "u": [0, 1], "zeit": [1, 0.5]}, "zeit: goes back after row 1"),
        ({"winkel": [0, 1], "u": [0, 1], "zeit": [1, np.nan]}, "zeit: every value must be a time"),
    ],
)
def test_a_broken_mat_file_names_the_vector(tmp_path, map_file, vectors, says):
    path = tmp_path / "t.mat"
    scipy_io.savemat(path, {"zeit": [0.0, 1.0]} | vectors)
    with pytest.raises(InputError) as caught:
        read_table(path, map_file)
    assert says in str(caught.value)


@pytest.mark.parametrize(
    ("wrong", "right", "says"),
    [
        ("column: winkel", "column: winkle", "map.yaml:4: roles.throttle_angle.column"),
        ("column: winkel", "column: winkle", "did you mean 'winkel'?"),
        ("unit: deg", "unit: V", "'V' does not fit; allowed: rad, mrad, deg"),
        ("unit: deg", "unit: furlong", "must be a unit that etb_hil knows"),
        ("motor_voltage:", "motor_volts:", "'motor_volts' must be a role"),
        ("unit: ms", "unit: fortnight", "'ns', 'us', 'ms'"),
        ("scale: 2", "scaling: 2", "did you mean 'scale'?"),
        ("scale: 2", "scale: .inf", "scale"),
    ],
)
def test_a_wrong_map_says_file_line_and_remedy(tmp_path, map_file, wrong, right, says):
    path = tmp_path / "t.csv"
    path.write_text("zeit,winkel,u\n0,0,0\n")
    map_file.write_text(MAP.replace(wrong, right, 1))
    with pytest.raises(InputError) as caught:
        read_table(path, map_file)
    assert says in str(caught.value)
    assert "map.yaml" in str(caught.value)


@pytest.mark.parametrize("size", [0, 4])
def test_a_mat_array_without_dimensions_is_refused(tmp_path, size):
    """SciPy reads dimensions that are not there, and the process would die of it."""
    path = tmp_path / "t.mat"
    scipy_io.savemat(path, {"zeit": [0.0, 1.0], "u": [1.0, 2.0]})
    content = bytearray(path.read_bytes())
    dimensions = 128 + 3 * 8  # behind the header, and the tags and flags of the first array
    assert content[dimensions : dimensions + 8] == bytes([5, 0, 0, 0, 8, 0, 0, 0])
    content[dimensions + 4] = size
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"t\.mat: must be a complete MAT file: an array in it lacks its dimensions"):
        read_table(path)


@pytest.mark.parametrize("kind", [0, 8, 10, 15, 64, 0xFFFF])
def test_a_mat_array_of_numbers_of_no_kind_is_refused(tmp_path, kind):
    """SciPy looks such a kind up behind the end of its table, and the process would die of it."""
    path = tmp_path / "t.mat"
    scipy_io.savemat(path, {"zeit": [0.0, 1.0], "u": [1.0, 2.0]})
    content = bytearray(path.read_bytes())
    values = content.index(bytes([9, 0, 0, 0, 16, 0, 0, 0]))  # two of double precision
    content[values : values + 2] = kind.to_bytes(2, "little")
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"t\.mat: must be a complete MAT file: the values of an array in it must be"):
        read_table(path)


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("dtype", ["f8", "f4", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "c16", "?"])
def test_a_mat_file_may_hold_arrays_of_all_kinds_of_numbers(tmp_path, map_file, dtype, packed):
    path = tmp_path / "t.mat"
    others = {
        "single": np.array(1, dtype),
        "cube": np.ones((2, 3, 2), dtype),
        "words": "abc",
        "empty": np.zeros((0, 3)),
    }
    columns = {"zeit": np.arange(3, dtype=np.int16), "winkel": np.zeros(3), "u": np.array([1, 0, 1], dtype).real}
    scipy_io.savemat(path, others | columns, do_compression=packed)
    assert read_table(path, map_file).series("motor_voltage").values.tolist() == [1e-3, 0.0, 1e-3]


@pytest.mark.parametrize("packed", [False, True])
def test_variables_of_a_mat_file_that_are_no_vectors_are_named_with_their_kind(tmp_path, packed):
    """A single value is a constant of the measurement, whatever its name is."""
    path = tmp_path / "t.mat"
    others = {
        "temperature_degC": 21.5,
        "begin": "09:30",
        "gains": np.ones((3, 2)),
        "cube": np.ones((2, 3, 2)),
        "roots": np.array([1j, 2j]),
        "nothing": np.zeros((0, 3)),
        "about": {"rig": "left"},
        "names": np.array(["a", 2.0], dtype=object),
        "sparse": scipy_sparse.csc_matrix(np.eye(3)),
    }
    vectors = {"time_s": [0.0, 1.0], "motor_voltage_V": [1.0, 2.0], "strom": [0.0, 1.0]}
    scipy_io.savemat(path, vectors | others, do_compression=packed)
    recording = read_table(path)
    assert [*recording.roles] == ["motor_voltage"]
    unread, left_out = recording.notes
    assert unread == "columns without a known role were left out: strom"
    names, kinds = left_out.split(": ", 1)
    assert names == "variables other than vectors of real numbers were left out"
    assert set(kinds.removesuffix(")").split("), ")) == {
        "temperature_degC (a single value", "begin (text", "gains (3 x 2", "cube (2 x 3 x 2", "roots (1 x 2, complex",
        "nothing (0 x 3", "about (a struct", "names (a cell array", "sparse (a sparse matrix",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("name", "value", "says"),
    [
        ("throttle_angle_deg", np.ones((50, 2)), "50 x 2"),
        ("motor_current_A", np.array([1j, 2j]), "1 x 2, complex"),
        ("motor_current", {"Time": [0.0, 1.0], "Data": [1.0, 2.0]}, "a struct"),
        ("motor_current_A", np.zeros((0, 0)), "0 x 0"),
        ("motor_current_A", "1 2 3", "text"),
        ("t_ms", np.ones((2, 2)), "2 x 2"),
    ],
)
def test_a_signal_of_a_mat_file_that_is_no_vector_is_refused(tmp_path, name, value, says):
    path = tmp_path / "t.mat"
    scipy_io.savemat(path, {"time_s": [0.0, 1.0], "motor_voltage_V": [1.0, 2.0], name: value})
    with pytest.raises(InputError) as caught:
        read_table(path)
    assert str(caught.value) == (
        f"{path}: {name}: must be a vector of real numbers (it is '{says}'); allowed: a value for each time, "
        "n x 1 or 1 x n; save each signal as a vector of its own, or leave this one out with a map file"
    )


@pytest.mark.parametrize(("value", "says"), [(3.0, "a single value"), (np.ones((2, 2)), "2 x 2"), ("a", "text")])
def test_a_map_file_names_no_variable_that_is_no_vector(tmp_path, map_file, value, says):
    path = tmp_path / "t.mat"
    scipy_io.savemat(path, {"zeit": [0.0, 1.0], "winkel": [0.0, 1.0], "u": value})
    with pytest.raises(InputError, match=rf"u: must be a vector of real numbers \(it is '{says}'\)"):
        read_table(path, map_file)
