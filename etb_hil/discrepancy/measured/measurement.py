"""A measurement ready for the balances: one even clock, one shaft, SI."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from etb_hil.plant.device import THROTTLE, Device
from etb_hil.plant.effects.port import Port
from etb_hil.plant.model_file import Sensors
from etb_hil.recording.samples import Float64

SLOWEST = 200.0  # Hz of sampling; below it the balances see too little of friction
CHANGES = 1.0  # K: a temperature that stays within it tells nothing of heat


@dataclass(frozen=True, slots=True)
class Measurement:
    """A segment without gaps, evenly sampled, in SI; angles at the throttle shaft.

    Columns have n values each. `voltage` is the command or terminal voltage of each sample, held until the next.
    `is_good` (n) is False where samples were bad or bridged. `sensors`: the model file's data sheet, with the noise
    that these samples show where that is more.
    """

    origin: str
    rate: float
    start_s: float
    voltage: Float64
    angle: Float64
    angle_noise: float
    current: Float64 | None
    plate: Float64 | None
    temperature: Float64
    has_temperature: bool
    is_good: NDArray[np.bool_]
    sensors: Sensors
    flags: tuple[str, ...] = field(default=())
    device: Device = THROTTLE  # without a winding, `voltage` and `current` are the force, or the current imposed
    is_plates: bool = False  # the angle is the plate sensor's: no encoder is as fine
    encoder: Float64 | None = None  # of one that is not
    is_decimated: bool = False  # the samples that a balance is made of; what is simulated along them has no others
    added: Float64 | None = None  # force or torque that a test says it adds to a drive's

    def __len__(self) -> int:
        return len(self.angle)

    @property
    def motor_and_plate(self) -> tuple[Float64 | None, Float64 | None]:
        """The motor's angle (n) and the plate's, None where it was not read."""
        return (self.encoder, self.angle) if self.is_plates else (self.angle, self.plate)

    @property
    def lateness_of_angle(self) -> Port:
        """The port of the lateness of `angle`."""
        return Port.PLATE_LATENESS if self.is_plates else Port.MOTOR_LATENESS

    def role(self, name: str) -> str:
        """Return the role of a signal of the motor or the plate."""
        if name == "current":
            return "motor_current"
        return "throttle_angle" if name == "plate" or self.is_plates else "motor_angle"

    @property
    def dt(self) -> float:
        """Time between two samples in s."""
        return 1.0 / self.rate


def voltage_rms(sensors: Sensors) -> float:
    """Return the voltmeter's noise and rounding, rms, in V."""
    return float(np.hypot(sensors.voltage_noise, sensors.voltage_step / np.sqrt(12.0)))


def current_rms(sensors: Sensors) -> float:
    """Return the current sensor's noise and rounding, rms, in A."""
    return float(np.hypot(sensors.current_noise, sensors.current_step / np.sqrt(12.0)))


def plate_rms(sensors: Sensors) -> float:
    """Return the plate sensor's noise and rounding, rms, in rad."""
    return float(np.hypot(sensors.plate_noise, sensors.plate_range / 2**sensors.plate_bits / np.sqrt(12.0)))
