"""`etb-hil simulate`: a scenario or a recorded voltage on a model, without a bus, into a table."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING

from etb_hil.cli.quantity_option import quantity_option

if TYPE_CHECKING:
    from etb_hil.plant.parameters import Model
    from etb_hil.recording.recording import Recording
    from etb_hil.recording.samples import Float64, Int64

AMBIENT_C = 20.0  # where models state their values, and a table has no temperature
SLOWEST_HZ, FASTEST_HZ = 1.0, 20e3  # the controller's machine lives in ticks of 50 us


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("scenario", nargs="?", help="scenario file (default: friction_check)")
    parser.add_argument("--voltage", type=Path, metavar="TABLE", help="a table with a motor voltage, in its place")
    parser.add_argument("--map", type=Path, metavar="FILE", help="map file for the table's columns")
    parser.add_argument("--unit", default="default", metavar="MODEL", help="what is simulated (default: %(default)s)")
    parser.add_argument(
        "--model", default="default", help="what the controller takes the unit for (default: %(default)s)"
    )
    parser.add_argument("--law", default="pd", help="position law: pd, pid or sliding-mode (default: %(default)s)")
    parser.add_argument("--rate", default="1 kHz", help="of the samples of a scenario (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="of the sensors' noise (default: %(default)s)")
    parser.add_argument("--start-angle", metavar="ANGLE", help="at the start of a voltage (default: the table's)")
    parser.add_argument("--out", type=Path, default=Path("simulation.csv"), help=".csv or .parquet (%(default)s)")


def run(options: argparse.Namespace) -> int:
    """Simulate, write the table, and say what is in it."""
    from etb_hil.base.errors import InputError, Problem
    from etb_hil.base.stock import find
    from etb_hil.plant.parameters import load_model
    from etb_hil.recording.table_writer import check_writable, column_name, write_table

    if options.voltage is not None and options.scenario is not None:
        raise InputError(Problem("a scenario and a voltage were given", remedy="give one of them"))
    check_writable(options.out)
    unit = load_model(find("model", options.unit))
    time_ns, columns = _scenario(options, unit) if options.voltage is None else _voltage(options, unit)
    write_table(options.out, time_ns, columns)
    seconds = (time_ns[-1] - time_ns[0]) * 1e-9
    print(f"{options.out}: {len(time_ns)} rows over {seconds:.3f} s of '{unit.name}'")
    print(f"columns: time_s, {', '.join(map(column_name, columns))}")
    return 0


def _scenario(options: argparse.Namespace, unit: Model) -> tuple[Int64, dict[str, Float64]]:
    from etb_hil.base.errors import InputError, Problem
    from etb_hil.base.stock import find
    from etb_hil.bench.simulation import Simulation
    from etb_hil.plant.parameters import load_model
    from etb_hil.scenario.scenario_file import load_scenario

    scenario = load_scenario(find("scenario", options.scenario or "friction_check")).content
    rate = quantity_option("--rate", options.rate, "frequency")
    if not SLOWEST_HZ <= rate <= FASTEST_HZ:
        allowed = f"{SLOWEST_HZ:g} Hz to {FASTEST_HZ / 1e3:g} kHz"
        raise InputError(Problem("--rate: no rate of samples", value=options.rate, allowed=allowed))
    nominal = load_model(find("model", options.model))
    guard = scenario.supply_guard
    return Simulation(unit, nominal, law=options.law, seed=options.seed, rate=rate, supply=guard).run(scenario.steps)


def _voltage(options: argparse.Namespace, unit: Model) -> tuple[Int64, dict[str, Float64]]:
    from etb_hil.base.errors import InputError, Problem
    from etb_hil.plant.voltage_run import run_voltage
    from etb_hil.recording.tables import read_table

    recording = read_table(options.voltage, options.map)
    voltage = recording.series("motor_voltage")
    start = unit.values.limp_home
    if options.start_angle is not None:
        start = quantity_option("--start-angle", options.start_angle, "angle")
    elif "throttle_angle" in recording.roles:
        start = float(recording.series("throttle_angle").values[0])
        if math.isnan(start):
            raise InputError(
                Problem(f"{options.voltage}: the first throttle_angle is missing", remedy="give --start-angle")
            )
    temperature = _temperature(recording, voltage.time_ns)
    found = run_voltage(unit, voltage.time_ns, voltage.values, start, temperature)
    return voltage.time_ns, {
        "motor_voltage": voltage.values,
        "motor_current": found.current,
        "motor_angle": found.motor_angle,
        "throttle_angle": found.angle,
        "temperature": temperature,
    }


def _temperature(recording: Recording, time_ns: Int64) -> Float64:
    """Return the housing's temperature in degC at instants (n): the table's, with missing values filled in."""
    import numpy as np

    if "temperature" in recording.roles:
        told = recording.series("temperature")
        known = np.isfinite(told.values)
        if known.any():
            return np.interp(time_ns, told.time_ns[known], told.values[known])
    return np.full(len(time_ns), AMBIENT_C)
