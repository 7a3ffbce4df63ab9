"""A scenario or a voltage on a model, without a bus."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from etb_hil.api.arguments import checked
from etb_hil.api.recordings import Recording, read
from etb_hil.base.errors import InputError, Problem
from etb_hil.base.reference_temperature import REFERENCE_TEMPERATURE

if TYPE_CHECKING:
    from etb_hil.plant.parameters import Model
    from etb_hil.recording import recording
    from etb_hil.recording.samples import Float64, Int64

SLOWEST_HZ, FASTEST_HZ = 1.0, 20e3  # the controller's machine lives in ticks of 50 us


@checked
def simulate(
    unit: Model | str | Path = "default",
    scenario: str | Path | None = None,
    *,
    voltage: recording.Recording | str | Path | None = None,
    columns: str | Path | None = None,
    model: Model | str | Path = "default",
    law: str = "pd",
    rate: float | str = "1 kHz",
    seed: int = 1,
    start_angle: float | str | None = None,
) -> Recording:
    """Simulate a throttle under a scenario or under a motor voltage.

    The scenario is friction_check by default.

    `unit` is what is simulated. Of a scenario: `model` is what the controller takes the unit for, `law` its position
    law, `rate` that of the samples ('1 kHz', or a number in Hz), `seed` that of the sensors' noise. Of a voltage: a
    recording or table (`columns` is its map file) with the role motor_voltage; `start_angle` ('12 deg', or rad) is
    where the plate begins, by default at the recording's first angle, else at limp-home. Raises InputError where they
    do not fit.
    """
    from etb_hil.api.models import as_throttle

    if voltage is not None and scenario is not None:
        raise InputError(Problem("a scenario and a voltage were given", remedy="give one of them"))
    of_scenario = {"model": (model, "default"), "law": (law, "pd"), "rate": (rate, "1 kHz"), "seed": (seed, 1)}
    if voltage is not None:
        _refuse_unused({name: one for name, (one, usual) in of_scenario.items() if one != usual}, "a scenario")
    if voltage is None:
        _refuse_unused({"start_angle": start_angle}, "a voltage")
    if not isinstance(voltage, str | Path):
        _refuse_unused({"columns": columns}, "a voltage from a table")
    what = as_throttle(unit)
    if voltage is None:
        time_ns, found = _scenario(what, as_throttle(model), str(scenario or "friction_check"), law, rate, seed)
    else:
        given = read(voltage, columns=columns) if isinstance(voltage, str | Path) else voltage
        time_ns, found = _voltage(what, given, start_angle)
    return _recording(f"simulation of '{what.name}'", time_ns, found)


def _refuse_unused(given: dict[str, object], goes_with: str) -> None:
    """Raise InputError where an argument was given that goes with something else."""
    problems = [
        Problem(f"{name}: it goes with {goes_with}", value=value, remedy="leave it out")
        for name, value in given.items()
        if value is not None
    ]
    if problems:
        raise InputError(*problems)


def _recording(origin: str, time_ns: Int64, columns: dict[str, Float64]) -> Recording:
    from etb_hil.recording.recording import ClockGrade
    from etb_hil.recording.samples import SampleBlock

    found = Recording(origin, ClockGrade.TABLE)
    found.append([SampleBlock("simulation", time_ns, time_ns, columns, np.zeros(len(time_ns), np.int64))])
    return found


def _scenario(
    unit: Model, nominal: Model, name: str, law: str, rate: float | str, seed: int
) -> tuple[Int64, dict[str, Float64]]:
    from etb_hil.base.stock import find
    from etb_hil.bench.simulation import Simulation
    from etb_hil.scenario.scenario_file import load_scenario

    scenario = load_scenario(find("scenario", name)).content
    hertz = _quantity("rate", rate, "frequency")
    if not SLOWEST_HZ <= hertz <= FASTEST_HZ:
        allowed = f"{SLOWEST_HZ:g} Hz to {FASTEST_HZ / 1e3:g} kHz"
        raise InputError(Problem("rate: no rate of samples", value=rate, allowed=allowed))
    guard = scenario.supply_guard
    return Simulation(unit, nominal, law=law, seed=seed, rate=hertz, supply=guard).run(scenario.steps)


def _voltage(
    unit: Model, given: recording.Recording, start_angle: float | str | None
) -> tuple[Int64, dict[str, Float64]]:
    from etb_hil.plant.voltage_run import run_voltage

    voltage = given.series("motor_voltage")
    start = unit.values.limp_home
    if start_angle is not None:
        start = _quantity("start_angle", start_angle, "angle")
    elif "throttle_angle" in given.roles:
        start = float(given.series("throttle_angle").values[0])
        if math.isnan(start):
            what = f"{given.origin}: the first throttle_angle is missing"
            raise InputError(Problem(what, remedy="give start_angle"))
    temperature = _temperature(given, voltage.time_ns)
    found = run_voltage(unit, voltage.time_ns, voltage.values, start, temperature)
    return voltage.time_ns, {
        "motor_voltage": voltage.values,
        "motor_current": found.current,
        "motor_angle": found.motor_angle,
        "throttle_angle": found.angle,
        "temperature": temperature,
    }


def _temperature(given: recording.Recording, time_ns: Int64) -> Float64:
    """Return the housing's temperature in degC at instants (n).

    The temperature is the recording's, with missing values filled in.
    """
    if "temperature" in given.roles:
        told = given.series("temperature")
        known = np.isfinite(told.values)
        if known.any():
            return np.interp(time_ns, told.time_ns[known], told.values[known])
    return np.full(len(time_ns), REFERENCE_TEMPERATURE)  # a table has none


def _quantity(name: str, given: float | str, dimension: str) -> float:
    """Return a value in SI.

    InputError names the argument, and the units allowed.
    """
    from etb_hil.base.quantity import parse_quantity

    if isinstance(given, int | float):
        return float(given)
    try:
        return parse_quantity(given, dimension)
    except ValueError as error:
        raise InputError(Problem(f"{name}: {error}", value=given)) from None
