"""The one table of roles: what a signal is, wherever it comes from.

A signal may come from any bus, file or model.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Role:
    """A meaning that a signal can have, with its SI unit."""

    name: str
    unit: str
    meaning: str


_MEASURED = (
    Role("motor_voltage", "V", "voltage over the motor's terminals"),
    Role("motor_duty", "1", "duty cycle of the bridge, signed"),
    Role("motor_current", "A", "armature current"),
    Role("motor_angle", "rad", "motor shaft angle from its encoder, unwrapped"),
    Role("throttle_angle", "rad", "plate angle, first track"),
    Role("throttle_angle_2", "rad", "plate angle, second track"),
    Role("throttle_position", "V", "plate sensor, first track, not calibrated"),
    Role("throttle_position_2", "V", "plate sensor, second track, not calibrated"),
    Role("pedal_position", "1", "accelerator pedal, 0 to 1"),
    Role("throttle_opening", "1", "throttle opening, 0 to 1"),
    Role("temperature", "degC", "housing temperature"),
    Role("supply_voltage", "V", "supply at the controller"),
    Role("pwm_frequency", "Hz", "switching frequency of the bridge"),
    Role("drive_force", "N", "force of a linear drive"),
    Role("linear_position", "m", "position of a linear drive"),
    Role("drive_torque", "N·m", "torque of a rotary drive"),
    Role("drive_angle", "rad", "angle of a rotary drive, unwrapped"),
    Role("engine_speed", "rad/s", "crankshaft speed"),
    Role("sample_counter", "1", "the controller's sample counter, raw and wrapping"),
    Role("controller_time", "s", "the controller's own time"),
    Role("mode", "1", "the mode that the controller reports"),
    Role("enable", "1", "1 while the bridge is on"),
    Role("faults", "1", "fault bits that the controller reports"),
    Role("interlock", "1", "1 while the guard is closed; the bridge is on only then"),
)

_COMMANDED = (
    Role("command_mode", "1", "0 off, 1 position, 2 velocity, 3 voltage, 4 limp-home"),
    Role("command_enable", "1", "1 asks for the bridge to be on"),
    Role("command_position", "rad", "position set-point at the throttle shaft"),
    Role("command_velocity", "rad/s", "velocity set-point or feed-forward at the throttle shaft"),
    Role("command_voltage", "V", "voltage set-point"),
    Role("command_force", "N", "force that a test adds to a linear drive's own"),
    Role("command_torque", "N·m", "torque that a test adds to a rotary drive's own"),
    Role("command_duty", "1", "duty cycle asked of the bridge, signed"),
    Role("request_signals", "1", "bit mask of the signals asked for: 1 current, 2 encoder"),
    Role("request_rate", "Hz", "rate of the samples asked for"),
    Role("request_burst", "1", "1 asks for FD bursts at the sampling rate"),
    Role("request_duration", "s", "how long to measure; 0 means until told otherwise"),
)

ROLES: dict[str, Role] = {role.name: role for role in _MEASURED + _COMMANDED}
COMMANDED: frozenset[str] = frozenset(role.name for role in _COMMANDED)
