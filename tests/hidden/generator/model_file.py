"""The nominal model as a model file: what the bench believes of the unit, with its tolerances."""

# name in the file -> (name in the unit, unit of measure, shaft or None)
_ENTRIES = {
    "resistance": ("resistance", "ohm", None),
    "inductance": ("inductance", "H", None),
    "back_emf_constant": ("motor_constant", "V·s/rad", "motor"),
    "torque_constant": ("motor_constant", "N·m/A", "motor"),
    "gear_ratio": ("gear_ratio", None, None),
    "motor_inertia": ("motor_inertia", "kg·m²", "motor"),
    "throttle_inertia": ("plate_inertia", "kg·m²", "throttle"),
    "preload_open": ("preload_open", "N·m", "throttle"),
    "preload_close": ("preload_close", "N·m", "throttle"),
    "slope_open": ("slope_open", "N·m/rad", "throttle"),
    "slope_close": ("slope_close", "N·m/rad", "throttle"),
    "limp_home": ("limp_home", "rad", "throttle"),
    "dead_zone": ("dead_zone", "rad", "throttle"),
    "stop_low": ("stop_low", "rad", "throttle"),
    "stop_high": ("stop_high", "rad", "throttle"),
    "stop_stiffness": ("stop_stiffness", "N·m/rad", "throttle"),
    "stop_damping": ("stop_damping", "N·m·s/rad", "throttle"),
    "coulomb": ("coulomb", "N·m", "throttle"),
    "stiction": ("stiction", "N·m", "throttle"),
    "stribeck_velocity": ("stribeck_velocity", "rad/s", "throttle"),
    "bristle_stiffness": ("bristle_stiffness", "N·m/rad", "throttle"),
    "bristle_damping": ("bristle_damping", "N·m·s/rad", "throttle"),
    "viscous": ("viscous", "N·m·s/rad", "throttle"),
}
_TOLERANCES = {"gear_ratio": "0 %", "stop_low": "5 mrad", "stop_high": "5 mrad"}


def model_text(nominal, sensors, name):
    """YAML text of a model file with the nominal values (dict of the unit's parameters) and the sensors' data sheet."""
    lines = ["schema: etb_hil/model/1", f"name: {name}", "description: nominal values of a drawn unit", "parameters:"]
    for key, (source, unit, shaft) in _ENTRIES.items():
        lines += [f"  {key}:", f"    value: {nominal[source]:.9g}{' ' + unit if unit else ''}"]
        lines += [f"    shaft: {shaft}"] if shaft else []
        lines += [f"    tolerance: {_TOLERANCES.get(key, '10 %')}", "    source: drawn"]
    lines += ["  supply_voltage: {value: 13.5 V, tolerance: 0.5 V, source: drawn}"]
    lines += ["  voltage_limit: {value: 12 V, tolerance: 0 V, source: drawn}"]
    lines += [
        "sensors:",
        f"  motor_counts_per_turn: {sensors.motor_counts}",
        "  plate_bits: 12",
        "  plate_range: 90 deg",
        "  plate_noise: 0.01 deg",
        f"  current_step: {sensors.current_step * 1e3:g} mA",
        f"  current_noise: {sensors.current_noise * 1e3:g} mA",
        f"  voltage_step: {sensors.voltage_step * 1e3:g} mV",
        f"  voltage_noise: {sensors.voltage_noise * 1e3:g} mV",
        "effects: []",
    ]
    return "\n".join(lines) + "\n"
