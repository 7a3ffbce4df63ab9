"""What the windows of a run say to the fit of friction.

They hold the measured torque, the load by the bench's model, and what an error of that model adds to the load.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etb_hil.diagnosis.ticks import Ticks
from etb_hil.diagnosis.windows import (
    Windows,
    bend,
    sliding,
    window_means,
)
from etb_hil.plant.exactmath import sines_and_cosines
from etb_hil.plant.parameters import ThrottleParameters
from etb_hil.recording.samples import Float64, Int64


@dataclass(frozen=True, slots=True)
class Evidence:
    """The windows of a run as the fit takes them.

    `ticks` (n) are those by whose angle bristles bend; `windows` (m) lie over them.

    `motor` (m) N·m, torque of the measured current, and `motor_rate` (m) N·m/s; `load` (m) N·m, springs and inertia by
    the bench's model; `velocity` rad/s, `position` rad (m); `errors` (m, 7), what inertia, preloads, slopes and the
    encoder's disc add to the load for a unit of their error; `per_ampere` N·m/A; `cluster` (m) numbers segments that
    share their noise. `over_time` (n) is the factor on friction at the time of each tick; `counts` (m), which windows
    are fitted; `slides` (m), which of them are beyond any bending of bristles.
    """

    ticks: Ticks
    windows: Windows
    motor: Float64
    motor_rate: Float64
    load: Float64
    velocity: Float64
    position: Float64
    errors: Float64
    per_ampere: float
    cluster: Int64
    over_time: Float64
    counts: NDArray[np.bool_]
    slides: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.windows)

    @property
    def overlap(self) -> float:
        """By how much a mean of many windows varies more than one of independent ones."""
        return self.windows.shape.overlap


def gather_evidence(
    ticks: Ticks, windows: Windows, velocity: Float64, throttle: ThrottleParameters, cluster: Int64
) -> Evidence:
    """Return what the windows (m) hold; `velocity` (m) rad/s is theirs."""
    p = throttle
    above = ticks.angle > p.limp_home
    distance = np.abs(ticks.angle - p.limp_home)
    side = np.where(above, 1.0, -1.0)
    opened, closed = np.where(above, 1.0, 0.0), np.where(above, 0.0, -1.0)
    basis = (opened, closed, opened * distance, closed * distance)
    spring = side * np.where(
        above, p.preload_open + p.slope_open * distance, p.preload_close + p.slope_close * distance
    )
    # The bridge's voltage steps at ticks, and the current's slope with it. Under the triangle that a second difference
    # answers to, that is 1/6, 4/6, 1/6 of single samples at the kinks, and 1/12, 10/12, 1/12 of means between them.
    current = ticks.current.copy()
    bend(current, 1.0 / 12.0, 1.0 / 12.0, ticks.samples)
    motor = window_means(p.torque_per_ampere * current, windows.shape.mean, windows)
    motor_rate = window_means(p.torque_per_ampere * ticks.current, windows.shape.rate, windows)
    inertia = window_means(p.inertia * ticks.angle, windows.shape.acceleration, windows)
    springs = (window_means(column, windows.shape.torque, windows) for column in basis)
    errors = np.stack([inertia, *springs, *_by_disc(ticks, windows, p)], axis=1)
    load = window_means(spring, windows.shape.torque, windows) + inertia
    level, all_of_them = np.ones(len(ticks)), np.ones(len(windows), np.bool_)
    place = ticks.angle[windows.centre]
    return Evidence(
        ticks, windows, motor, motor_rate, load, velocity, place, errors, p.torque_per_ampere, cluster, level,
        all_of_them, sliding(ticks, windows),
    )  # fmt: skip


def _by_disc(ticks: Ticks, windows: Windows, p: ThrottleParameters) -> tuple[Float64, Float64]:
    """Return the load (m) that a disc off centre takes away.

    The two results are for 1 rad of sine and of cosine of the motor's angle, by which the angle is read too large. Both
    loads have the same sign in opening and in closing, where friction changes its sign.
    """
    slope = np.where(ticks.angle > p.limp_home, p.slope_open, p.slope_close)

    def load(wave: Float64) -> Float64:
        inertia = window_means(p.inertia * wave, windows.shape.acceleration, windows)
        return -(inertia + window_means(slope * wave, windows.shape.torque, windows)) / p.gear_ratio

    sine, cosine = sines_and_cosines(p.gear_ratio * ticks.angle)
    return load(sine), load(cosine)
