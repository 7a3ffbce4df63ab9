"""Values with units."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from etb_hil.base.quantity import DIMENSIONS, dimension_of_unit, format_quantity, parse_quantity, tidy_unit


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [
        ("30 deg", "angle", math.pi / 6),
        ("-60 rpm", "angular velocity", -2 * math.pi),
        ("350 mNm", "torque", 0.35),
        ("0.05 N*m/rad", "stiffness", 0.05),
        ("0.1 Nms/rad", "rotary damping", 0.1),
        ("4e-6 kg*m^2", "inertia", 4e-6),
        ("1.5 Ω", "resistance", 1.5),
        ("3 %", "ratio", 0.03),
        (0.03, "ratio", 0.03),
        ("20 °C", "temperature", 20.0),
        ("293.15 K", "temperature", 20.0),
        ("500 kbit/s", "bit rate", 5e5),
    ],
)
def test_units_are_read_to_si(text, dimension, value):
    assert parse_quantity(text, dimension) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "dimension"),
    [("3", "angle"), (3, "angle"), ("3 Hz", "angular velocity"), ("1/s", "frequency"), ("inf V", "voltage"),
     ("V", "voltage"), (True, "ratio"), (None, "time"), ("1 2 s", "time"), ([1], "time")],
)  # fmt: skip
def test_what_is_no_quantity_of_the_dimension_is_refused(text, dimension):
    with pytest.raises(ValueError, match=r"unit|expected"):
        parse_quantity(text, dimension)


@pytest.mark.parametrize(("text", "dimension", "said"), [("1,5 ohm", "resistance", "1.5 ohm"), ("0,3", "ratio", "1.5")])
def test_a_comma_is_not_taken_for_a_point_nor_for_a_unit(text, dimension, said):
    with pytest.raises(ValueError, match=f"a number has no comma but a decimal point, for instance '{said}'"):
        parse_quantity(text, dimension)


@given(st.sampled_from(sorted(DIMENSIONS)), st.floats(-1e6, 1e6))
def test_what_is_written_is_read_back(dimension, value):
    assert parse_quantity(format_quantity(value, dimension, 17), dimension) == value


def test_every_unit_of_the_table_is_in_the_spelling_that_is_looked_up():
    for name, (si, units) in DIMENSIONS.items():
        assert si in units, name
        for unit in units:
            assert tidy_unit(unit) == unit
            assert dimension_of_unit(unit) is not None


@pytest.mark.parametrize("text", ["1e300 s", "-9.3e9 s", "1e9 d", "1e308 h"])
def test_a_time_that_nanoseconds_cannot_hold_is_refused(text):
    with pytest.raises(ValueError, match=r"at most 9\.2e\+09 s"):
        parse_quantity(text, "time")
    assert parse_quantity("100000 d", "time") == 8.64e9
    assert parse_quantity("1e300 Hz", "frequency") == 1e300
