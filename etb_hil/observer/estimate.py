"""Input and output of every observer."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from etb_hil.recording.samples import Float64, Int64

if TYPE_CHECKING:
    from etb_hil.plant.parameters import Model


@dataclass(frozen=True, slots=True)
class SensorNoise:
    """One standard deviation of the sensors' white noise, with quantisation.

    `angle` rad at the throttle shaft, of which `angle_step` rad is what it is rounded to; `current` A.
    """

    angle: float
    current: float
    angle_step: float = 0.0

    @staticmethod
    def of_steps(
        angle_step: float, current_step: float, angle_noise: float = 0.0, current_noise: float = 0.0
    ) -> SensorNoise:
        """Return the noise of sensors that round to whole steps.

        The noise is a uniform error of one step, and their own noise.
        """
        return SensorNoise(
            math.sqrt(angle_step * angle_step / 12.0 + angle_noise * angle_noise),
            math.sqrt(current_step * current_step / 12.0 + current_noise * current_noise),
            angle_step,
        )

    @staticmethod
    def of_bench(model: Model) -> SensorNoise:
        """Return the noise of a model's sensors: motor encoder and current sensor."""
        sensors = model.sensors
        turn = 2.0 * math.pi / sensors.motor_counts_per_turn
        return SensorNoise.of_steps(
            turn / model.values.gear_ratio, float(sensors.current_step), current_noise=float(sensors.current_noise)
        )


@dataclass(frozen=True, slots=True, eq=False)
class FrictionEstimate:
    """Velocity and friction torque at the instants of the samples that were pushed.

    `time_ns` (n); `velocity` rad/s and `friction` N·m (n), at the throttle shaft, NaN while the observer settles and
    where a sample is bad; `delay_ns` (n), how far the friction lags behind a slow change. `deviation` N·m (n), the
    friction's standard deviation, from observers that state one.
    """

    time_ns: Int64
    velocity: Float64
    friction: Float64
    delay_ns: Int64
    deviation: Float64 | None = None


class Observer(Protocol):
    """An estimator of the friction torque that runs on a stream.

    Its bits are the same however the stream is cut.
    """

    def push(self, time_ns: Int64, current: Float64, angle: Float64) -> FrictionEstimate:
        """Take samples (n), of which NaN is a bad one.

        Instants are in ns, the motor current in A, the throttle-shaft angle in rad.
        """
        ...
