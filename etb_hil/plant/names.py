"""Names of effects and base parameters in reports and messages."""

from __future__ import annotations

from etb_hil.plant.effects.catalogue import CATALOGUE

_PARAMETERS = {  # by their names in a model file
    "resistance": "winding resistance",
    "inductance": "winding inductance",
    "back_emf_constant": "back-EMF constant",
    "torque_constant": "torque constant",
    "gear_ratio": "gear ratio",
    "motor_inertia": "motor inertia",
    "throttle_inertia": "plate inertia",
    "preload_open": "opening-side spring preload",
    "preload_close": "closing-side spring preload",
    "slope_open": "opening-side spring slope",
    "slope_close": "closing-side spring slope",
    "limp_home": "limp-home angle",
    "dead_zone": "half the dead zone",
    "stop_low": "lower stop",
    "stop_high": "upper stop",
    "stop_stiffness": "stiffness of the stops",
    "stop_damping": "damping of the stops",
    "coulomb": "sliding friction",
    "stiction": "break-away friction",
    "stribeck_velocity": "Stribeck velocity",
    "bristle_stiffness": "bristle stiffness",
    "bristle_damping": "bristle damping",
    "viscous": "viscous friction",
    "supply_voltage": "supply voltage",
    "voltage_limit": "limit of the motor voltage",
}


def display_name(id_: str) -> str:
    """Return the name of an effect, or of a base parameter in a model file."""
    effect = CATALOGUE.get(id_)
    stated = _PARAMETERS.get(id_, "") if effect is None else effect.name
    return stated or id_.replace("_", " ")
