"""What a hand can measure of a throttle without the bench: what with, which numbers of a model file, and how well.

Uncertainties are what these instruments reach with care, as shares; of angles and of effects' strengths in their units.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from etb_hil.discrepancy.search.extending import calibrated_parameters
from etb_hil.plant.effects.catalogue import CATALOGUE
from etb_hil.plant.measured import Measured, measured_parameter
from etb_hil.plant.parameters import Model
from etb_hil.plant.physics import Vector
from etb_hil.plant.table_one import KINDS, Shaft


@dataclass(frozen=True, slots=True, eq=False)
class Instrument:
    """One thing to do by hand, and the numbers that it gives, each with its uncertainty; rotary ones at a `shaft`."""

    how: str
    gives: dict[str, float]
    shaft: Shaft | None = None

    @property
    def ids(self) -> set[str]:
        """The ids of causes that its numbers judge."""
        return {name.partition(".")[0] if "." in name else f"parameter:{name}" for name in self.gives}


INSTRUMENTS = (
    Instrument(
        "measure the winding's resistance at the motor's terminals with a four-wire ohmmeter, in several positions",
        {"resistance": 0.01},
    ),
    Instrument(
        "compare the current's reading with a shunt or a clamp meter, at two currents and with the bridge off",
        {"current_sensor_gain.gain_error": 0.005, "current_sensor_offset.offset": 0.005},
    ),
    Instrument(
        "turn the motor at a known speed, its leads open, and read its voltage",
        {"torque_constant": 0.01},
        Shaft.MOTOR,
    ),
    Instrument(
        "turn the motor at a known speed, cold and 40 K warmer, its leads open, and compare its voltages",
        {"magnet_temperature.coefficient": 0.1},
    ),
    Instrument(
        "move the plate with a torque gauge from stop to stop, the gear taken out and no air flowing",
        {
            "preload_open": 0.02,
            "preload_close": 0.02,
            "slope_open": 0.03,
            "slope_close": 0.03,
            "spring_nonlinear.quadratic": 0.005,
            "spring_nonlinear.cubic": 0.005,
            "spring_nonlinear.quartic": 0.005,
        },
        Shaft.THROTTLE,
    ),
    Instrument(
        "read the plate's angle at both stops and, let go from either side, at limp-home",
        {"stop_low": 0.001, "stop_high": 0.001, "limp_home": 0.001},
        Shaft.THROTTLE,
    ),
    Instrument(
        "turn the plate slowly with a torque gauge both ways, the motor's leads open: half the difference, and "
        "what it takes to break away",
        {"coulomb": 0.03, "stiction": 0.03},
        Shaft.THROTTLE,
    ),
    Instrument(
        "hold the motor and load the plate's lever both ways under a dial gauge: what gives at once, and with the load",
        {"gear_backlash.play": 0.001, "shaft_compliance.compliance": 0.002},
    ),
    Instrument(
        "read the supply at the bridge with a voltmeter, at rest and under a known current",
        {"supply_sag.source_resistance": 0.02, "supply_sag.static_sag": 0.03},
    ),
    Instrument(
        "hold the motor at several currents of both signs and read the voltage at its terminals: its intercept",
        {"brush_drop.drop": 0.02},
    ),
    Instrument(
        "compare the mean voltage at the bridge's output with the duty that is commanded, at several currents",
        {"hbridge_dead_time.error": 0.02},
    ),
)


def as_measured(model: Model, p: Vector, instruments: Iterable[Instrument]) -> list[Measured]:
    """Return what instruments would read of a unit whose extended parameters are `p`."""
    found = []
    parameters = calibrated_parameters(model, p)
    for name, uncertainty in ((name, width) for one in instruments for name, width in one.gives.items()):
        if "." not in name:
            value = parameters[name].value
            width = uncertainty if KINDS[name].dimension == "angle" else uncertainty * abs(value)
            found.append(measured_parameter(model.parameters[name], value, width))
            continue
        effect = CATALOGUE[name.partition(".")[0]]
        parameter, place = next(
            (q, k) for q, k in zip(effect.stated, effect.stated_indices, strict=True) if name.endswith(f".{q.name}")
        )
        found.append(Measured(name, float(p[place]), uncertainty, parameter.unit, 0.0, 0.0))
    return found
