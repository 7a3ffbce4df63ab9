"""Tables from anywhere become Recordings in SI units, or say where they are broken."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from etb_hil.base.errors import InputError
from etb_hil.base.roles import ROLES
from etb_hil.recording import csvtable
from etb_hil.recording.recording import ClockGrade
from etb_hil.recording.tables import read_table

FINITE = st.floats(allow_nan=False, allow_infinity=False)
VALUES = st.one_of(FINITE, st.just(math.nan))
TIMES_US = st.lists(st.integers(-(10**12), 10**12), min_size=1, max_size=30, unique=True).map(sorted)


def table(folder, text, name="table.csv"):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def problems(path, map_file=None):
    with pytest.raises(InputError) as caught:
        read_table(path, map_file)
    return [str(problem) for problem in caught.value.problems]


@given(data=st.data(), times_us=TIMES_US, delimiter=st.sampled_from(",;\t"))
def test_every_value_that_was_written_is_read_back_exactly_at_its_time(tmp_path_factory, data, times_us, delimiter):
    roles = data.draw(st.lists(st.sampled_from(sorted(ROLES)), min_size=1, max_size=5, unique=True))
    columns = {role: data.draw(st.lists(VALUES, min_size=len(times_us), max_size=len(times_us))) for role in roles}
    comma = delimiter != "," and data.draw(st.booleans())
    unit = {"V·s/rad": "", "rad/s": "rad_per_s"}
    header = ["time_us", *(f"{role}_{unit.get(ROLES[role].unit, ROLES[role].unit)}" for role in roles)]
    rows = [[str(t), *(repr(columns[role][i]) for role in roles)] for i, t in enumerate(times_us)]
    text = "\n".join(delimiter.join(cell.replace(".", ",") if comma else cell for cell in row) for row in rows)
    path = table(tmp_path_factory.mktemp("t"), delimiter.join(header) + "\n" + text + "\n")

    recording = read_table(path)

    assert recording.clock is ClockGrade.TABLE
    assert sorted(recording.roles) == sorted(roles)
    for role in roles:
        series = recording.series(role)
        assert series.unit == ROLES[role].unit
        rows = np.searchsorted(np.array(times_us) * 1000, series.time_ns)
        np.testing.assert_array_equal(series.time_ns, np.array(times_us)[rows] * 1000)
        np.testing.assert_array_equal(series.values, np.array(columns[role])[rows])
        assert set(np.flatnonzero(~np.isnan(columns[role]))) <= set(rows)


def test_a_slow_column_in_rows_of_its_own_makes_no_rows_of_the_fast_ones(tmp_path):
    fast = [f"{k}.0,{k}," for k in range(100)]
    slow = [f"{k}.5,,{k}" for k in range(0, 100, 10)]
    lines = sorted((*fast, *slow), key=lambda line: float(line.split(",")[0]))
    recording = read_table(table(tmp_path, "time_ms,motor_current_A,temperature_degC\n" + "\n".join(lines) + "\n"))
    assert len(recording.series("motor_current").values) == 100
    assert recording.series("temperature").values.tolist() == list(range(0, 100, 10))
    assert not recording.block(recording.source_of("motor_current")).lost_before.any()


def test_a_slow_column_in_rows_of_the_fast_ones_stays_there(tmp_path):
    lines = [f"{k},{k},{20 if k % 10 == 0 else ''}" for k in range(100)]
    recording = read_table(table(tmp_path, "time_ms,motor_current_A,temperature_degC\n" + "\n".join(lines) + "\n"))
    assert list(recording.sources) == ["table"]
    assert np.isfinite(recording.series("temperature").values).sum() == 10


@given(text=st.text(max_size=300))
def test_any_text_is_read_or_refused_with_its_place(tmp_path_factory, text):
    path = table(tmp_path_factory.mktemp("t"), "time_s,motor_voltage_V\n0,1\n" + text)
    try:
        recording = read_table(path)
    except InputError as error:
        places = [str(problem) for problem in error.problems]
        assert places
        assert all(place.startswith(f"{path}:") for place in places)
    else:
        series = recording.series("motor_voltage")
        assert np.all(np.diff(series.time_ns) > 0)
        assert not np.any(np.isinf(series.values))


@given(content=st.binary(max_size=400), suffix=st.sampled_from([".csv", ".mat", ".txt"]))
def test_any_bytes_are_read_or_refused(tmp_path_factory, content, suffix):
    path = tmp_path_factory.mktemp("t") / f"table{suffix}"
    path.write_bytes(content)
    with pytest.raises(InputError, match="table"):
        read_table(path)


@given(
    rows=st.integers(1, 40),
    at=st.integers(0, 39),
    broken=st.sampled_from(["1e999", "inf", "0x10", "1_0", "twelve", "1 2", "--1"]),
)
def test_a_broken_cell_is_named_with_line_column_and_value(tmp_path_factory, rows, at, broken):
    lines = ["# a rig", "time_s,motor_current_A", *(f"{i},{i / 8}" for i in range(rows))]
    lines[2 + at % rows] = f"{at % rows},{broken}"
    path = table(tmp_path_factory.mktemp("t"), "\n".join(lines))
    (problem,) = problems(path)
    assert problem.startswith(f"{path}:{3 + at % rows}: motor_current_A: ")
    assert repr(broken) in problem
    assert "correct the cell" in problem


NUMBERS = ["1", "-2.5", " 3", "4 ", "+.5e-3", "6.", "1,5", '"7"', "7\t"]
CELLS = st.sampled_from([*NUMBERS, "", "nan", "1e999", "1\n5", "--1", "0x1", "\N{ARABIC-INDIC DIGIT ONE}"])


@given(cells=st.lists(st.tuples(CELLS, CELLS), min_size=1, max_size=8), delimiter=st.sampled_from(",;"))
def test_rows_taken_together_are_read_as_rows_one_by_one(tmp_path_factory, cells, delimiter):
    lines = [delimiter.join((f"{k}", *row)) for k, row in enumerate(cells)]
    header = delimiter.join(["time_s", "motor_current_A", "motor_voltage_V"])
    path = table(tmp_path_factory.mktemp("t"), "\n".join([header, *lines]))

    def read():
        try:
            found = read_table(path)
        except InputError as error:
            return [str(problem) for problem in error.problems]
        return [found.series(role).values.tolist() for role in found.roles]

    def never(*_):
        raise ValueError

    together = read()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(csvtable.CsvTable, "_take_together", never)
        assert repr(together) == repr(read())


def test_a_broken_cell_far_down_is_named_and_the_order_of_times_holds_across_blocks(tmp_path):
    rows = [f"{k},{k / 8}" for k in range(3 * csvtable.BLOCK)]
    whole = read_table(table(tmp_path, "time_s,motor_current_A\n" + "\n".join(rows)))
    assert whole.series("motor_current").values.tolist() == [k / 8 for k in range(len(rows))]
    rows[csvtable.BLOCK + 5] = f"{csvtable.BLOCK + 5},x"
    rows[2 * csvtable.BLOCK] = "0,1"
    first, second = problems(table(tmp_path, "time_s,motor_current_A\n" + "\n".join(rows)))
    assert f"table.csv:{csvtable.BLOCK + 7}: motor_current_A: must be a number" in first
    assert f"table.csv:{2 * csvtable.BLOCK + 2}: time_s: lies before the time of the row above" in second


def test_rows_without_a_broken_cell_are_taken_together(tmp_path, monkeypatch):
    def never(*_):
        pytest.fail("rows were taken one by one")

    monkeypatch.setattr(csvtable.CsvTable, "_take_row_by_row", never)
    rows = [f"{k},{k / 8}" for k in range(csvtable.BLOCK)]
    rows[7] = "7,"
    found = read_table(table(tmp_path, "time_s,motor_current_A\n" + "\n".join(rows))).series("motor_current").values
    assert np.isnan(found[7])
    assert found[[0, 6, 8, -1]].tolist() == [0.0, 0.75, 1.0, (csvtable.BLOCK - 1) / 8]


def test_what_is_broken_before_the_reading_ends_is_said_too(tmp_path):
    text = "time_s,motor_voltage_V\n0,1\n1,x\n2,3,4\n3,y\n" + '4,"5\n5,6\n'
    found = problems(table(tmp_path, text))
    says = ["must be a number", "a row of 3 cells", "must be a number", "a quote that does not close"]
    assert len(found) == 4
    for problem, line, why in zip(found, (3, 4, 5, 6), says, strict=True):
        assert f"table.csv:{line}: " in problem
        assert why in problem


def test_units_come_from_the_names(tmp_path):
    text = "t_ms,throttle_angle_deg,throttle_angle_2 [mrad],motor_duty_pct,engine_speed_rpm,temperature_K,note\n"
    recording = read_table(table(tmp_path, text + "0.5,90,1500,-50,60,273.15,1\n"))
    got = {role: recording.series(role).values[0] for role in recording.roles}
    assert got == pytest.approx(
        {
            "throttle_angle": math.pi / 2,
            "throttle_angle_2": 1.5,
            "motor_duty": -0.5,
            "engine_speed": 2 * math.pi,
            "temperature": 0.0,
        }
    )
    assert recording.series("motor_duty").time_ns[0] == 500_000


@pytest.mark.parametrize(
    ("header", "says"),
    [
        ("time_s,motor_volage_V", "did you mean 'motor_voltage'?"),
        ("time_s,motor_voltage", "needs a unit; allowed: V, mV"),
        ("time_s,motor_voltage_A", "must be a unit of the role motor_voltage (got 'A'); allowed: V, mV"),
        ("time,motor_voltage_V", "the time needs a unit; allowed: ns, us"),
        ("motor_voltage_V,motor_current_A", "no column is the time"),
        ("time_s,t_ms,motor_voltage_V", "more than one column is the time"),
        ("time_s,motor_voltage_V,motor_voltage_mV", "has the role motor_voltage already"),
        ("time_s,motor_voltage_V,motor_voltage_V", "columns have the same name"),
        ("time_s,colour,shape", "no column is a role"),
    ],
)
def test_a_header_that_cannot_be_read_says_why(tmp_path, header, says):
    found = problems(table(tmp_path, "\n" + header + "\n0,1,2\n"))
    assert any(says in problem and "table.csv:2" in problem for problem in found), found


@pytest.mark.parametrize(
    ("rows", "line", "says"),
    [
        (
            "0,1\n1,2,3",
            3,
            "a row of 3 cells under 2 names; complete the row or remove it; of decimal commas",
        ),
        ("0,1\n1", 3, "a row of 1 cells under 2 names"),
        ("0,1\n2,1\n1,1", 4, "lies before the time of the row above"),
        ("0,1\nnan,1", 3, "must be a number"),
        ("0,1\n1e30,1", 3, "is too large a time"),
        ('0,"1\n1,2\n2,3', 2, "a quote that does not close"),
    ],
)
def test_a_broken_row_is_named(tmp_path, rows, line, says):
    (problem,) = problems(table(tmp_path, "time_s,motor_voltage_V\n" + rows))
    assert f"table.csv:{line}: " in problem
    assert says in problem


@pytest.mark.parametrize("row", ["0,{:03d},1,5", '"0,{:03d}","1,5"', '0.{:03d},"1,5"'])
def test_decimal_commas_between_commas_are_one_problem(tmp_path, row):
    rows = "\n".join(row.format(k) for k in range(100))
    (problem,) = problems(table(tmp_path, f"time_s,motor_voltage_V\n{rows}\n"))
    assert "table.csv:2: " in problem
    assert "has decimal commas, and commas between the cells" in problem
    assert "write semicolons or tabs between the cells, or decimal points" in problem


def test_a_file_of_broken_rows_ends_in_a_short_list(tmp_path):
    assert len(problems(table(tmp_path, "time_s,motor_voltage_V\n" + "x,y\n" * 10_000))) <= 21


def test_rows_with_the_same_time_are_left_out_and_said(tmp_path):
    recording = read_table(table(tmp_path, "time_s,motor_voltage_V\n0,1\n1,2\n1,3\n2,4\n"))
    assert list(recording.series("motor_voltage").values) == [1, 2, 4]
    assert recording.notes == ["1 rows had the time of the row before and were left out"]


def test_a_long_step_is_a_gap_of_unknown_length(tmp_path):
    recording = read_table(table(tmp_path, "time_s,motor_voltage_V\n" + "".join(f"{t},0\n" for t in (0, 1, 2, 9, 10))))
    (gap,) = recording.gaps()
    assert (gap.start_ns, gap.end_ns, gap.lost) == (2_000_000_000, 9_000_000_000, None)


@pytest.mark.parametrize(
    ("path", "says"), [("no.csv", "cannot be read"), ("no.mat", "cannot be read"), ("no.xls", "no such file or folder")]
)
def test_a_path_that_is_no_table_is_refused(tmp_path, path, says):
    (problem,) = problems(tmp_path / path)
    assert says in problem


def test_a_file_of_another_kind_is_refused(tmp_path):
    (tmp_path / "some.xls").write_bytes(b"some bytes")
    (problem,) = problems(tmp_path / "some.xls")
    assert "allowed: .csv" in problem


def test_columns_without_a_known_role_are_named(tmp_path):
    recording = read_table(table(tmp_path, "time_s,motor_voltage_V,strom,zeit\n0,1,2,3\n1,2,3,4\n"))
    assert recording.notes == ["columns without a known role were left out: strom, zeit"]
    many = ",".join(f"x{k}" for k in range(12))
    (note,) = read_table(table(tmp_path, f"time_s,motor_voltage_V,{many}\n{'0,' * 13}0\n")).notes
    assert note.endswith("x9 and 2 more")
    (note,) = read_table(table(tmp_path, "time_s,motor_voltage_V,a\x1b[31mb\n0,1,2\n1,2,3\n")).notes
    assert "\x1b" not in note


@pytest.mark.parametrize("end", ["", "\n", "\r\n", "\n\n", "\n# a comment"])
def test_a_last_line_without_its_end_is_noted(tmp_path, end):
    """A number that is cut off is another number."""
    path = table(tmp_path, "time_s,motor_voltage_V\n0,1\n0.002,15." + end)
    recording = read_table(path)
    assert recording.series("motor_voltage").values.tolist() == [1.0, 15.0]
    if end:
        assert recording.notes == []
    else:
        (note,) = recording.notes
        assert note.startswith(f"{path}:3: the last line has no end of line: ")


def test_a_last_row_that_is_cut_off_before_its_last_cell_is_refused(tmp_path):
    (problem,) = problems(table(tmp_path, "time_s,motor_voltage_V,motor_current_A\n0,1,2\n0.002,15."))
    assert "table.csv:3: a row of 2 cells under 3 names; complete the row or remove it" in problem


@pytest.mark.parametrize("order", ["utf-16-le", "utf-16-be"])
def test_a_table_in_utf_16_is_named_as_such(tmp_path, order):
    path = tmp_path / "table.csv"
    path.write_bytes("\N{ZERO WIDTH NO-BREAK SPACE}time_s,motor_voltage_V\n0,1\n".encode(order))
    (problem,) = problems(path)
    assert problem.startswith(f"{path}: is UTF-16 text ")
    assert problem.endswith("allowed: UTF-8; save the file as UTF-8")


def test_rows_in_reverse_order_are_one_problem(tmp_path):
    rows = "".join(f"{5000 - k},1\n" for k in range(5000))
    (problem,) = problems(table(tmp_path, "time_ms,motor_voltage_V\n" + rows))
    assert "table.csv:3: time_ms: lies before the time of the row above" in problem
