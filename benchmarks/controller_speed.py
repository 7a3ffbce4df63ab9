"""What the virtual controller costs per simulated second, plant, sensors and frames included.

    python benchmarks/controller_speed.py
"""

from __future__ import annotations

import statistics
import time

import numpy as np

from etb_hil.base.modes import Mode
from etb_hil.base.stock import find
from etb_hil.controller.machine import Machine
from etb_hil.controller.state import COMMAND, REQUEST
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
        start = time.perf_counter()
        machine.run(SECONDS * 1_000_000_000, stamps, events)
        costs.append((time.perf_counter() - start) / SECONDS * 1e3)
    return statistics.median(costs[1:])


def main():
    print(f"plant, sensors, control, samples at 1 kHz:  {_machine_ms(False):.2f} ms per simulated second")
    print(f"plant, sensors, control, samples at 20 kHz: {_machine_ms(True):.2f} ms per simulated second")


if __name__ == "__main__":
    main()
