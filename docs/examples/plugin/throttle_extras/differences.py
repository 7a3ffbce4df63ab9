"""An observer: friction from differences of the angle over 20 ms; simple, late and noisy."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from etb_hil.plugins.observers import (
    FrictionEstimate,
    Model,
    ObserverKind,
    SensorNoise,
    ThrottleParameters,
    spring_torque,
)

SPAN = 0.02  # s of each difference


@dataclass
class Differences:
    """Takes the torque balance with velocity and acceleration from three angles, `SPAN` apart."""

    throttle: ThrottleParameters
    times: list[int] = field(default_factory=list)
    angles: list[float] = field(default_factory=list)
    currents: list[float] = field(default_factory=list)

    def push(
        self, time_ns: NDArray[np.int64], current: NDArray[np.float64], angle: NDArray[np.float64]
    ) -> FrictionEstimate:
        """Return velocity and friction at the instants of the samples."""
        count = len(time_ns)
        velocity, friction = np.full(count, np.nan), np.full(count, np.nan)
        for k in range(count):
            if not np.isfinite(current[k] + angle[k]):
                continue
            self.times.append(int(time_ns[k]))
            self.angles.append(float(angle[k]))
            self.currents.append(float(current[k]))
            velocity[k], friction[k] = self._latest()
        return FrictionEstimate(time_ns, velocity, friction, np.full(count, round(SPAN * 1e9), np.int64))

    def _latest(self) -> tuple[float, float]:
        now = self.times[-1]
        while now - self.times[0] > 2.5e9 * SPAN:
            del self.times[0], self.angles[0], self.currents[0]
        middle, first = (int(np.searchsorted(self.times, now - n * SPAN * 1e9)) for n in (1, 2))
        last = len(self.times) - 1
        if now - self.times[0] < 2.0 * SPAN * 1e9 or not first < middle < last:
            return np.nan, np.nan
        late, early = self._rate(middle, last), self._rate(first, middle)
        span = 0.5e-9 * (now - self.times[first])
        omega, acceleration = 0.5 * (late + early), (late - early) / span
        drive = self.throttle.torque_per_ampere * float(np.mean(self.currents[first:]))
        return omega, drive - spring_torque(
            self.angles[middle], self.throttle.vector()
        ) - self.throttle.inertia * acceleration

    def _rate(self, begin: int, end: int) -> float:
        return (self.angles[end] - self.angles[begin]) / (1e-9 * (self.times[end] - self.times[begin]))


def _make(_model: Model, throttle: ThrottleParameters, _noise: SensorNoise) -> Differences:
    return Differences(throttle)


OBSERVER = ObserverKind("differences of the angle over 20 ms", _make)
