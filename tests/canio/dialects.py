"""Dialects that several tests use: the project's own two."""

from pydantic import TypeAdapter

from etb_hil.base.stock import find
from etb_hil.canio.dbc.dialect import Dialect
from etb_hil.canio.dbc.role_map import ProtectionSettings, RoleMap

COMMANDS = {
    "command_mode": "EtbCommand.CommandMode",
    "command_enable": "EtbCommand.CommandEnable",
    "command_position": "EtbCommand.CommandPosition",
    "command_velocity": "EtbCommand.CommandVelocity",
    "command_voltage": "EtbCommand.CommandVoltage",
    "request_signals": "EtbMeasurementRequest.RequestSignals",
    "request_rate": "EtbMeasurementRequest.RequestRate",
    "request_burst": "EtbMeasurementRequest.RequestBurst",
    "request_duration": "EtbMeasurementRequest.RequestDuration",
}
STATUS = {
    "mode": "EtbStatus.Mode",
    "enable": "EtbStatus.BridgeOn",
    "faults": "EtbStatus.Faults",
    "temperature": "EtbStatus.Temperature",
    "supply_voltage": "EtbStatus.SupplyVoltage",
    "controller_time": "EtbStatus.ControllerTime",
}
CLASSIC = {
    **COMMANDS,
    **STATUS,
    "motor_current": "EtbCurrent.MotorCurrent",
    "motor_voltage": "EtbCurrent.MotorVoltage",
    "motor_angle": "EtbEncoder.MotorAngle",
    "throttle_angle": "EtbEncoder.ThrottleAngle",
    "throttle_angle_2": "EtbEncoder.ThrottleAngle2",
    "sample_counter": ["EtbCurrent.CurrentSampleCounter", "EtbEncoder.EncoderSampleCounter"],
}
FD = {
    **COMMANDS,
    **STATUS,
    "motor_current": "EtbBurst.MotorCurrent0..9",
    "motor_voltage": "EtbBurst.MotorVoltage",
    "motor_angle": {"signal": "EtbBurst.MotorAngle0..9", "turns": "EtbBurst.MotorTurn"},
    "throttle_angle": "EtbBurst.ThrottleAngle",
    "throttle_angle_2": "EtbBurst.ThrottleAngle2",
    "sample_counter": "EtbBurst.BurstSampleCounter",
}


def load(path, roles, protection=None, **options):
    return Dialect.load(
        path,
        TypeAdapter(RoleMap).validate_python(roles),
        TypeAdapter(ProtectionSettings).validate_python(protection or {}),
        **options,
    )


def classic(**options):
    return load(find("dbc", "etb_controller"), CLASSIC, **options)


def fd(**options):
    return load(find("dbc", "etb_controller_fd"), FD, **options)
