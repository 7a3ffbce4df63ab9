"""Commands over time for the controller's machine, and what came out of it as plain arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from etb_hil.base.modes import Mode
from etb_hil.base.stock import find
from etb_hil.controller.machine import Machine
from etb_hil.controller.state import COMMAND, EVENT_WIDTH, REQUEST
from etb_hil.plant.parameters import load_model

MS = 1_000_000
TICK = 50e-6
BOTH = 3  # current and encoder


def model(name):
    return load_model(find("model", name))


def command(mode, position=0.0, velocity=0.0, voltage=0.0, *, enable=True):
    return [COMMAND, int(mode), float(enable), position, velocity, voltage]


def request(signals=BOTH, rate=1000.0, *, burst=False, duration=0.0):
    return [REQUEST, signals, rate, float(burst), duration, 0.0]


OFF = command(Mode.OFF, enable=False)


def table(rows):
    """Return stamps and events of rows (stamp_ns, event)."""
    stamps = np.array([stamp for stamp, _ in rows], np.int64)
    return stamps, np.array([event for _, event in rows], float).reshape(len(rows), EVENT_WIDTH)


def stream(at, end_s, *, start_s=0.0, period_ms=10):
    """Return rows of commands: `at(t)` every period, as a bench sends them, a quarter of a millisecond on the bus."""
    count = round((end_s - start_s) * 1e3 / period_ms)
    times = [start_s + index * period_ms * 1e-3 for index in range(count)]
    return [(round(t * 1e9) + MS // 4, at(t)) for t in times]


@dataclass
class Trace:
    """What a machine gave out, in order."""

    samples: np.ndarray
    statuses: np.ndarray
    switches: np.ndarray

    @property
    def time(self):
        return self.samples["tick"] * TICK

    def angle(self, machine_start, gear=18.0):
        """Return the plate's angle in rad by the encoder, from a known start."""
        return machine_start + self.samples["motor_angle"] / gear

    def between(self, start_s, end_s):
        return (self.time >= start_s) & (self.time < end_s)


def drive(machine: Machine, rows, end_s, cuts=()):
    """Run a machine through rows of events in one call, or cut at the given times (s)."""
    stamps, events = table(rows)
    parts, at = [], 0
    for cut in [*sorted(cuts), end_s]:
        until = round(cut * 1e9)
        arrived = int(np.searchsorted(stamps, until, side="left"))
        used, outputs = machine.run(until, stamps[at:arrived], events[at:arrived])
        at += used
        parts += [(o.samples.copy(), o.statuses.copy(), o.switches.copy()) for o in outputs]
    samples, statuses, switches = (np.concatenate(column) for column in zip(*parts, strict=True))
    return Trace(_instants(samples), statuses, switches)


_INSTANT = np.dtype(
    [(name, int) for name in ("tick", "signals")]
    + [(name, float) for name in ("current", "motor_angle", "voltage", "track", "track_2")]
)


def _instants(rows):
    """Return one row a sampled instant; voltage and tracks are NaN but for the first one of a burst."""
    count = np.where(rows["burst"] > 0, 10, 1)
    out = np.zeros(count.sum(), _INSTANT)
    first = np.repeat(np.cumsum(count) - count, count)
    index = np.arange(len(out)) - first
    source = np.repeat(np.arange(len(rows)), count)
    out["tick"] = rows["tick"][source] + index
    out["signals"] = rows["signals"][source]
    for name in ("current", "motor_angle"):
        out[name] = rows[name][source, index]
    for name in ("voltage", "track", "track_2"):
        out[name] = np.where(index == 0, rows[name][source], np.nan)
    return out
