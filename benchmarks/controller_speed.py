"""What the virtual controller costs in processor time per simulated second: plant, sensors and frames.

python benchmarks/controller_speed.py
"""

from __future__ import annotations

import statistics
import time

import numpy as np

from etb_hil.base.modes import Mode
from etb_hil.base.stock import find
from etb_hil.bench.bench_file import load_bench
from etb_hil.canio.dbc.writer import MessageWriter
from etb_hil.canio.frames import concatenate_frames
from etb_hil.controller.machine import Machine
from etb_hil.controller.state import COMMAND, REQUEST
from etb_hil.controller.virtual_controller import VirtualController
from etb_hil.plant.parameters import load_model

SECONDS = 20
RUNS = 7
PERIOD_NS = 10_000_000


def _events(burst):
    stamps = np.arange(0, SECONDS * 1_000_000_000, PERIOD_NS) + 250_000
    t = stamps * 1e-9
    events = np.zeros((len(stamps) + 1, 6))
    events[0] = [REQUEST, 3, 1000.0, float(burst), 0.0, 0.0]
    events[1:, 0] = COMMAND
    events[1:, 1], events[1:, 2] = int(Mode.POSITION), 1.0
    events[1:, 3], events[1:, 4] = 0.7 + 0.4 * np.sin(8.0 * t), 3.2 * np.cos(8.0 * t)
    return np.concatenate([[0], stamps]), events


def _machine_ms(burst):
    model = load_model(find("model", "default"))
    stamps, events = _events(burst)
    costs = []
    for _ in range(RUNS + 1):
        machine = Machine(model, model, seed=1)
        start = time.process_time()
        machine.run(SECONDS * 1_000_000_000, stamps, events)
        costs.append((time.process_time() - start) / SECONDS * 1e3)
    return statistics.median(costs[1:])


def _node_ms(kind, calls_a_second):
    """Return the whole node's cost: frames read, plant and control run, frames written, in so many calls a second."""
    dialect = load_bench(find("bench", f"virtual_{kind}")).dialect
    model = load_model(find("model", "default"))
    asked = {"request_signals": 3.0, "request_rate": 1000.0, "request_burst": float(kind == "fd")}
    stamps, events = _events(kind == "fd")
    values = {"command_mode": 1.0, "command_enable": 1.0, "command_position": events[1:, 3]}
    values["command_velocity"] = events[1:, 4]
    inbox = concatenate_frames(
        [
            MessageWriter(dialect, "EtbMeasurementRequest").write(asked, [0]),
            MessageWriter(dialect, "EtbCommand").write(values, stamps[1:]),
        ]
    )
    cuts = np.linspace(0, SECONDS * 1_000_000_000, SECONDS * calls_a_second + 1).astype(np.int64)[1:].tolist()
    ends = np.searchsorted(inbox.stamp_ns, cuts).tolist()
    parts = [inbox.select(slice(a, b)) for a, b in zip([0, *ends[:-1]], ends, strict=True)]
    costs = []
    for _ in range(RUNS + 1):
        node = VirtualController(model, dialect, seed=1)
        start = time.process_time()
        frames = sum(len(node.run(cut, part)) for cut, part in zip(cuts, parts, strict=True))
        costs.append((time.process_time() - start) / SECONDS * 1e3)
    return statistics.median(costs[1:]), frames // SECONDS


def main():
    print(f"plant, sensors, control, samples at 1 kHz:  {_machine_ms(False):.2f} ms per simulated second")
    print(f"plant, sensors, control, samples at 20 kHz: {_machine_ms(True):.2f} ms per simulated second")
    for kind in ("classic", "fd"):
        for calls in (10, 200, 1000):
            cost, frames = _node_ms(kind, calls)
            print(f"node on {kind}, {frames} frames/s out, {calls:4d} calls/s: {cost:.2f} ms per simulated second")


if __name__ == "__main__":
    main()
