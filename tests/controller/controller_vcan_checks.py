"""Beside a vcan0: `etb-hil controller` as a process of its own, commanded over SocketCAN; prints JSON."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from etb_hil.base.clock import WallClock
from etb_hil.base.stock import find
from etb_hil.bench.bench_file import load_bench
from etb_hil.canio.bus.link import open_link
from etb_hil.canio.dbc.writer import MessageWriter
from etb_hil.canio.frames import FrameFlag, concatenate_frames

MS = 1_000_000
DRIVEN_MS, AFTER_MS, PERIOD_MS = 1000, 200, 10


def serve_and_drive(kind: str) -> dict[str, object]:
    setup = load_bench(find("bench", f"vcan_{kind}"))
    clock = WallClock()
    log = Path(tempfile.mkdtemp()) / "controller.jsonl"
    command = [sys.executable, "-m", "etb_hil", "controller", "--interface", "socketcan", "--channel", "vcan0"]
    command += ["--log", str(log), *(["--fd"] if kind == "fd" else [])]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        banner = process.stdout.readline()
        link = open_link(setup.bench.bus, clock)
        request = MessageWriter(setup.dialect, "EtbMeasurementRequest")
        asked = {"request_signals": 3.0, "request_rate": 1000.0, "request_burst": float(kind == "fd")}
        link.send(request.write(asked, [0]))
        writer = MessageWriter(setup.dialect, "EtbCommand")
        set_point = {"command_mode": 1.0, "command_enable": 1.0, "command_position": 0.5}
        received = []
        MessageWriter(setup.dialect, "EtbCommand").write(set_point, [0])  # compiles here, not while time runs
        deadline = clock.now_ns()
        for tick in range((DRIVEN_MS + AFTER_MS) // PERIOD_MS):
            if tick < DRIVEN_MS // PERIOD_MS:
                link.send(writer.write(set_point, [0]))
            deadline += PERIOD_MS * MS
            clock.sleep_until_ns(deadline)
            received.append(link.receive())
        health = link.health()
        link.close()
        process.send_signal(signal.SIGTERM)
        farewell = process.stdout.read()
        code = process.wait(60)
    frames = concatenate_frames(received)
    name = "EtbBurst" if kind == "fd" else "EtbCurrent"
    counter = "BurstSampleCounter" if kind == "fd" else "CurrentSampleCounter"
    message = setup.dialect.message(name)
    rows = np.flatnonzero((frames.ident == message.ident) & (frames.flags & FrameFlag.SENT == 0))
    codec = message.message
    counts = [codec.decode(frames.data[row, : frames.length[row]].tobytes())[counter] for row in rows]
    return {
        "banner": banner,
        "farewell": farewell,
        "code": code,
        "samples": len(counts),
        "steps": sorted({int(step) for step in np.diff(counts) % 65536}),
        "dropped": health.dropped,
        "error_frames": health.error_frames,
        "log": [json.loads(line) for line in log.read_text().splitlines()],
    }


if __name__ == "__main__":
    print(json.dumps(serve_and_drive(sys.argv[1])))
