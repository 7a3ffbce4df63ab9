"""Frames as a bench records them, with right counters and checksums, for the benchmarks of logs."""

import numpy as np
from pydantic import TypeAdapter

from etb_hil.base.stock import find
from etb_hil.base.yamlfile import parse
from etb_hil.canio.dbc.dialect import Dialect
from etb_hil.canio.dbc.role_map import RoleMap
from etb_hil.canio.dbc.writer import MessageWriter
from etb_hil.canio.frames import FrameBlock, concatenate_frames
from etb_hil.plant.parameters import load_model

TICK_NS = 50_000
START_NS = 1_763_600_000_000_000_000
PER_TICK = 20  # ticks from sample to sample at 1 kHz


def dialect_of(bench="virtual_classic", dbc="etb_controller"):
    content, _ = parse(find("bench", bench))
    return Dialect.load(find("dbc", dbc), TypeAdapter(RoleMap).validate_python(content["roles"]))


class Traffic:
    """Current and angle at 1 kHz each, status at 100 Hz, 30 % of unrelated frames; or FD bursts of ten samples."""

    def __init__(self, *, fd=False):
        self.dialect = dialect_of("virtual_fd", "etb_controller_fd") if fd else dialect_of()
        names = ("EtbBurst",) if fd else ("EtbCurrent", "EtbEncoder", "EtbStatus")
        self._writers = {name: MessageWriter(self.dialect, name) for name in names}
        self._fd = fd
        self._model = load_model(find("model", "default")).values
        self._first = 0

    def block(self, milliseconds):
        """The frames of the next milliseconds, in the order of their stamps."""
        sample = self._first + np.arange(milliseconds)
        self._first += milliseconds
        ticks = sample * PER_TICK
        stamps = START_NS + ticks * TICK_NS
        angle, current, voltage = self._motion(sample)
        if self._fd:
            return self._bursts(ticks)
        status = sample % 10 == 0
        count = milliseconds * 9 // 10
        rng = np.random.default_rng(self._first)
        other_stamps = np.sort(rng.integers(stamps[0], stamps[-1] + 1_000_000, count))
        blocks = [
            self._writers["EtbCurrent"].write(
                {"motor_current": current, "motor_voltage": voltage, "sample_counter": ticks}, stamps + 200
            ),
            self._writers["EtbEncoder"].write(
                {
                    "motor_angle": self._model.gear_ratio * angle,
                    "throttle_angle": angle,
                    "throttle_angle_2": angle,
                    "sample_counter": ticks,
                },
                stamps + 400,
            ),
            self._writers["EtbStatus"].write(
                {"mode": 1, "enable": 1, "temperature": 25.0}, stamps[status] + 600
            ),
            FrameBlock(
                other_stamps, rng.integers(0x300, 0x308, count).astype(np.uint32), np.zeros(count, np.uint8),
                np.full(count, 8, np.uint8), np.zeros((count, 8), np.uint8), np.zeros(count, np.uint8),
            ),
        ]  # fmt: skip
        joined = concatenate_frames(blocks)
        return joined.select(np.argsort(joined.stamp_ns, kind="stable"))

    def _motion(self, sample):
        """A slow sine with, now and then, a fast one, and the current and voltage that they take."""
        p = self._model
        rate = np.where(sample // 5000 % 4 == 3, 30e-3, 2e-3)  # rad a sample
        phase = np.cumsum(rate)
        angle = 0.75 + 0.5 * np.sin(phase)
        velocity = 0.5 * np.cos(phase) * rate * 1e3
        inertia = -p.inertia * 0.5 * np.sin(phase) * (rate * 1e3) ** 2
        sliding = p.coulomb + (p.stiction - p.coulomb) * np.exp(-((velocity / p.stribeck_velocity) ** 2))
        friction = np.sign(velocity) * sliding + p.viscous * velocity
        spring = p.preload_open + p.slope_open * (angle - p.limp_home)
        current = (inertia + friction + spring) / p.torque_per_ampere
        return angle, current, p.resistance * current + p.back_emf * velocity

    def _bursts(self, ticks):
        starts = np.arange(ticks[0], ticks[-1] + PER_TICK, 10)
        values = {
            "motor_current": np.cos((starts[:, None] + np.arange(10)) * 1e-4),
            "motor_angle": 14.0 + 12.0 * np.sin((starts[:, None] + np.arange(10)) * 1e-4),
            "motor_voltage": 2.0,
            "throttle_angle": 0.7,
            "throttle_angle_2": 0.7,
            "sample_counter": starts,
        }
        return self._writers["EtbBurst"].write(values, START_NS + starts * TICK_NS)

    def frames(self, count):
        """About so many frames in one block."""
        per_ms = 2 if self._fd else 3
        blocks, found = [], 0
        while found < count:
            blocks.append(self.block(min(10_000, -(-count // per_ms) + 10)))
            found += len(blocks[-1])
        return concatenate_frames(blocks).select(slice(count))
