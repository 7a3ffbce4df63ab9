"""Values with units, as people write them in files: `30 deg`, `0.35 N·m`, `1 kHz`.

A table of our own and not a units library: those take rad as 1 and Hz as 1/s, so that degrees per second, hertz and
bare numbers pass for one another, which is the very mistake to catch here.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Annotated

from pydantic import BeforeValidator, WithJsonSchema

_RPM = 2.0 * math.pi / 60.0
_DEG = math.pi / 180.0

# dimension -> (SI unit, {unit as written: (factor, offset)}), value_si = value * factor + offset
DIMENSIONS: dict[str, tuple[str, dict[str, tuple[float, float]]]] = {
    "angle": ("rad", {"rad": (1.0, 0.0), "mrad": (1e-3, 0.0), "deg": (_DEG, 0.0), "rev": (2.0 * math.pi, 0.0)}),
    "angular velocity": ("rad/s", {"rad/s": (1.0, 0.0), "deg/s": (_DEG, 0.0), "rpm": (_RPM, 0.0)}),
    "angular acceleration": ("rad/s²", {"rad/s²": (1.0, 0.0), "deg/s²": (_DEG, 0.0)}),
    "torque": ("N·m", {"N·m": (1.0, 0.0), "mN·m": (1e-3, 0.0)}),
    "voltage": ("V", {"V": (1.0, 0.0), "mV": (1e-3, 0.0)}),
    "current": ("A", {"A": (1.0, 0.0), "mA": (1e-3, 0.0)}),
    "time": (
        "s",
        {
            "s": (1.0, 0.0),
            "ms": (1e-3, 0.0),
            "us": (1e-6, 0.0),
            "min": (60.0, 0.0),
            "h": (3600.0, 0.0),
            "d": (86400.0, 0.0),
        },
    ),
    "frequency": ("Hz", {"Hz": (1.0, 0.0), "kHz": (1e3, 0.0)}),
    "resistance": ("ohm", {"ohm": (1.0, 0.0), "mohm": (1e-3, 0.0)}),
    "inductance": ("H", {"H": (1.0, 0.0), "mH": (1e-3, 0.0), "uH": (1e-6, 0.0)}),
    "back-EMF constant": ("V·s/rad", {"V·s/rad": (1.0, 0.0)}),
    "torque constant": ("N·m/A", {"N·m/A": (1.0, 0.0), "mN·m/A": (1e-3, 0.0)}),
    "inertia": ("kg·m²", {"kg·m²": (1.0, 0.0)}),
    "stiffness": ("N·m/rad", {"N·m/rad": (1.0, 0.0), "N·m/deg": (1.0 / _DEG, 0.0)}),
    "rotary damping": ("N·m·s/rad", {"N·m·s/rad": (1.0, 0.0)}),
    "temperature": ("degC", {"degC": (1.0, 0.0), "K": (1.0, -273.15)}),
    "temperature coefficient": ("1/K", {"1/K": (1.0, 0.0), "%/K": (1e-2, 0.0)}),
    "ratio": ("1", {"1": (1.0, 0.0), "%": (1e-2, 0.0)}),
    "bit rate": ("bit/s", {"bit/s": (1.0, 0.0), "kbit/s": (1e3, 0.0), "Mbit/s": (1e6, 0.0)}),
    "force": ("N", {"N": (1.0, 0.0)}),
    "length": ("m", {"m": (1.0, 0.0), "mm": (1e-3, 0.0)}),
    "speed": ("m/s", {"m/s": (1.0, 0.0), "mm/s": (1e-3, 0.0)}),
    "mass": ("kg", {"kg": (1.0, 0.0)}),
    "linear damping": ("N·s/m", {"N·s/m": (1.0, 0.0)}),
    "linear stiffness": ("N/m", {"N/m": (1.0, 0.0), "N/mm": (1e3, 0.0)}),
    "force constant": ("N/V", {"N/V": (1.0, 0.0), "N/A": (1.0, 0.0)}),
}

# What people write beside the spellings that files take, in small letters.
SPELLINGS = {
    "amp": "A", "amps": "A", "amper": "A", "ampere": "A", "amperes": "A", "volt": "V", "volts": "V", "ohms": "ohm",
    "grad": "deg", "°": "deg", "degree": "deg", "degrees": "deg", "radian": "rad", "radians": "rad", "percent": "%",
    "sec": "s", "second": "s", "seconds": "s", "msec": "ms", "hertz": "Hz", "newton": "N", "newton meter": "N·m",
    "c": "degC", "°c": "degC", "celsius": "degC", "deg c": "degC", "degk": "K", "kelvin": "K",
    "u/min": "rpm", "umin": "rpm", "upm": "rpm", "1/min": "rpm", "min-1": "rpm",
    "unit_percent": "%", "unit_degrecelsi": "degC", "unit_volt": "V", "unit_amper": "A", "unit_minutinver": "rpm",
    "unit_degreeofarc": "deg",
}  # fmt: skip
# Of which SI units are made.
_COHERENT = {
    "1", "m", "s", "kg", "A", "K", "degC", "rad", "N", "V", "W", "J", "C", "F", "H", "T", "Wb", "Pa", "Hz", "S", "ohm",
    "bit",
}  # fmt: skip

MOST_S = 9.2e9  # 291 years, which 64 bits of nanoseconds hold

_NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*\Z", re.DOTALL)


def tidy_unit(text: str) -> str:
    """Return a unit in the table's spelling.

    `Nm`, `N*m` and `N m` become `N·m`, `^2` becomes `²`.
    """
    unit = text.strip().replace("^2", "²").replace("Ω", "ohm").replace("µ", "u").replace("μ", "u").replace("°C", "degC")
    unit = unit.replace("°", "deg")
    unit = re.sub(r"\s*([*·/])\s*", r"\1", unit).replace("*", "·")
    unit = re.sub(r"\s+", "·", unit)
    return re.sub(r"\b(m?)Nm(s?)\b", lambda m: f"{m[1]}N·m" + ("·s" if m[2] else ""), unit)


def unit_meant(text: str) -> str:
    """Return the unit that a DBC file or an export of its signals states.

    It is in the table's spelling where the table knows it: `Volts` is `V`, `Grad` is `deg`.
    """
    # Tools that take UTF-8 for Windows' code page write `Â°C`; they have saved many a file so.
    written = re.sub("Â(?=[°·µ²³])", "", text).strip()
    return tidy_unit(SPELLINGS.get(written.lower(), written))


def unit_of(dimension: str) -> str:
    """Return the SI unit of a dimension of the table."""
    return DIMENSIONS[dimension][0]


def dimension_of_unit(unit: str) -> str | None:
    """Return the dimension that a unit belongs to, or None where no dimension has it."""
    tidied = tidy_unit(unit)
    return next((name for name, (_, units) in DIMENSIONS.items() if tidied in units), None)


def is_si(unit: str) -> bool:
    """Return whether a unit is one of SI, or made of some, as `N·m/s`."""
    return all(part.rstrip("²³") in _COHERENT for part in re.split(r"[·/]", unit))


def si_unit_meant(text: str) -> str | None:
    """Return the SI unit that a text probably means, or None.

    The unit is `A` for `Amp` and for `mA`.
    """
    written = SPELLINGS.get(text.strip().lower(), text)
    dimension = dimension_of_unit(written)
    return None if dimension is None else unit_of(dimension)


def unit_written(text: str) -> str:
    """Return the SI unit of the quantity that a text gives.

    The unit is `s` for `20 ms`, and empty where there is none.
    """
    match = _NUMBER.match(text)
    dimension = dimension_of_unit(match[2]) if match and match[2] else None
    return "" if dimension is None else unit_of(dimension)


def to_si(value: float, unit: str, dimension: str) -> float:
    """Convert a value in a unit of the dimension to SI.

    ValueError names the units allowed.
    """
    units = DIMENSIONS[dimension][1]
    tidied = tidy_unit(unit)
    if tidied not in units:
        wrong = f"must be a unit of {dimension} (got '{unit}')" if unit else "the unit is missing"
        raise ValueError(f"{wrong}; write the value with one of: {', '.join(units)}")
    factor, offset = units[tidied]
    return value * factor + offset


def parse_quantity(text: object, dimension: str) -> float:
    """Read `30 deg` and the like; the result is in the dimension's SI unit.

    ValueError says what is wrong.
    """
    if isinstance(text, bool) or not isinstance(text, str | int | float):
        raise ValueError(f"{_named(dimension)} is expected, for instance '{format_quantity(1.0, dimension)}'")  # noqa: TRY004 (pydantic wants it)
    if isinstance(text, int | float):
        number, unit = float(text), "1" if dimension == "ratio" else ""
    else:
        match = _NUMBER.match(text)
        if match is None:
            raise ValueError(f"{_named(dimension)} is expected, for instance '{format_quantity(1.0, dimension)}'")
        number, unit = float(match[1]), match[2] or ("1" if dimension == "ratio" else "")
        if unit.startswith(","):  # of decimals or of thousands: which of them, nobody can tell
            raise ValueError(
                f"a number has no comma but a decimal point, for instance '{format_quantity(1.5, dimension)}'"
            )
    if not math.isfinite(number):
        raise ValueError(f"a finite {dimension} is expected")
    value = to_si(number, unit, dimension)
    if dimension == "time" and abs(value) > MOST_S:
        raise ValueError(f"a time of at most {MOST_S:g} s is expected")
    return value


def _named(dimension: str) -> str:
    return f"{'an' if dimension[0] in 'aeiou' else 'a'} {dimension}"


def format_quantity(value: float, dimension: str, digits: int = 6) -> str:
    """Write an SI value with its unit, so that `parse_quantity` reads it back."""
    unit = unit_of(dimension)
    return f"{value:.{digits}g}" if unit == "1" else f"{value:.{digits}g} {unit}"


def exact_quantity(value: float, dimension: str) -> str:
    """Write an SI value with its unit so that the same value is read back.

    The text has as few digits as `parse_quantity` needs for that.
    """
    unit = unit_of(dimension)
    number = _fewest_digits(value, lambda text: float(text) == value)
    return number if unit == "1" else f"{number} {unit}"


def exact_share(share: float) -> str:
    """Write a share in percent so that the same share is read back.

    The text has as few digits as `parse_quantity` needs for that.
    """
    percent = 100.0 * share
    near = (percent, math.nextafter(percent, math.inf), math.nextafter(percent, -math.inf))
    written = [_fewest_digits(one, lambda text: parse_quantity(f"{text} %", "ratio") == share) for one in near]
    return f"{next((one for one in written if parse_quantity(f'{one} %', 'ratio') == share), written[0])} %"


def _fewest_digits(value: float, is_same: Callable[[str], bool]) -> str:
    return next((text for digits in range(6, 17) if is_same(text := f"{value:.{digits}g}")), f"{value:.17g}")


def _reader(dimension: str) -> BeforeValidator:
    return BeforeValidator(lambda text: parse_quantity(text, dimension))


def _schema(dimension: str) -> WithJsonSchema:
    units = ", ".join(DIMENSIONS[dimension][1])
    return WithJsonSchema(
        {
            "type": ["string", "number"] if dimension == "ratio" else "string",
            "description": f"{dimension} with its unit, one of: {units}",
            "examples": [f"1 {unit_of(dimension)}"],
        }
    )


# Fields of pydantic models: the file holds `30 deg`, the model holds radians.
Angle = Annotated[float, _reader("angle"), _schema("angle")]
AngularVelocity = Annotated[float, _reader("angular velocity"), _schema("angular velocity")]
Torque = Annotated[float, _reader("torque"), _schema("torque")]
Voltage = Annotated[float, _reader("voltage"), _schema("voltage")]
Current = Annotated[float, _reader("current"), _schema("current")]
Duration = Annotated[float, _reader("time"), _schema("time")]
Frequency = Annotated[float, _reader("frequency"), _schema("frequency")]
Temperature = Annotated[float, _reader("temperature"), _schema("temperature")]
TemperatureCoefficient = Annotated[float, _reader("temperature coefficient"), _schema("temperature coefficient")]
Ratio = Annotated[float, _reader("ratio"), _schema("ratio")]
BitRate = Annotated[float, _reader("bit rate"), _schema("bit rate")]
