"""Speed of codec, protection and decoder beside cantools: processor time, medians over interleaved rounds.

    python benchmarks/codec_speed.py [--rounds 7]

Encoding counts what a frame on the bus needs: signals, alive counter and CRC (cantools with its own end-to-end
functions). The live batch is 10 ms of a bench at 1 kHz: 10 current, 10 encoder and 1 status frames.
"""

import argparse
import statistics
import time

import cantools
import cantools.autosar.end_to_end as e2e
import numpy as np
from pydantic import TypeAdapter

from etb_hil.base.stock import find
from etb_hil.base.yamlfile import parse
from etb_hil.canio.dbc.codec import MessageCodec
from etb_hil.canio.dbc.commands import CommandEncoder
from etb_hil.canio.dbc.decoder import Decoder
from etb_hil.canio.dbc.dialect import Dialect
from etb_hil.canio.dbc.role_map import RoleMap
from etb_hil.canio.dbc.writer import MessageWriter
from etb_hil.canio.frames import concatenate_frames

TICK_NS = 50_000
MANY = 20_000  # frames of a block
BATCHES = 200  # of 10 ms


def dialect_of(bench, dbc):
    content, _ = parse(find("bench", bench))
    return Dialect.load(find("dbc", dbc), TypeAdapter(RoleMap).validate_python(content["roles"]))


CLASSIC = dialect_of("virtual_classic", "etb_controller")
FD = dialect_of("virtual_fd", "etb_controller_fd")
CURRENT = cantools.database.load_file(CLASSIC.path).get_message_by_name("EtbCurrent")
BURST = cantools.database.load_file(FD.path).get_message_by_name("EtbBurst")


def measured(ticks):
    """Current, encoder and status frames of the samples at `ticks`, in the order of a bus."""
    stamps = ticks * TICK_NS
    shared = {"sample_counter": ticks}
    blocks = [
        WRITERS["EtbCurrent"].write(
            {"motor_current": ticks % 999 * 1e-3, "motor_voltage": 6.0, **shared}, stamps + 200
        ),
        WRITERS["EtbEncoder"].write(
            {"motor_angle": ticks % 6000 * 1e-3, "throttle_angle": 0.3, "throttle_angle_2": 0.3, **shared}, stamps + 400
        ),
        WRITERS["EtbStatus"].write({"mode": 1, "enable": 1, "temperature": 25.0}, stamps[::10] + 600),
    ]
    joined = concatenate_frames(blocks)
    return joined.select(np.argsort(joined.stamp_ns, kind="stable"))


WRITERS = {name: MessageWriter(CLASSIC, name) for name in ("EtbCurrent", "EtbEncoder", "EtbStatus")}
TICKS = np.arange(MANY) * 20
BULK = measured(TICKS)
LIVE = [measured(TICKS[10 * k : 10 * k + 10]) for k in range(BATCHES)]
CURRENT_ROWS = BULK.data[BULK.ident == CURRENT.frame_id]
CURRENT_BYTES = [row.tobytes() for row in CURRENT_ROWS[:2000]]
BURST_WRITER = MessageWriter(FD, "EtbBurst")
BURST_TICKS = np.arange(2000) * 10
BURST_VALUES = {
    "motor_current": (BURST_TICKS[:, None] + np.arange(10)) % 999 * 1e-3,
    "motor_angle": (BURST_TICKS[:, None] + np.arange(10)) % 6000 * 1e-3,
    "motor_voltage": 6.0,
    "throttle_angle": 0.3,
    "throttle_angle_2": 0.3,
    "sample_counter": BURST_TICKS,
}
BURSTS = BURST_WRITER.write(BURST_VALUES, BURST_TICKS * TICK_NS)
BURST_BYTES = [row[:48].tobytes() for row in BURSTS.data[:500]]
SET_POINT = {
    "command_mode": 1.0,
    "command_enable": 1.0,
    "command_position": 0.5,
    "command_velocity": 0.0,
    "command_voltage": 0.0,
}


def seconds(function):
    start = time.process_time()
    function()
    return time.process_time() - start


def ours_encode():
    values = {"motor_current": TICKS % 999 * 1e-3, "motor_voltage": 6.0, "sample_counter": TICKS}
    return seconds(lambda: WRITERS["EtbCurrent"].write(values, TICKS * TICK_NS)) / MANY


def cantools_encode():
    ids = CLASSIC.message("EtbCurrent").protection.data_ids

    def run():
        for k in range(2000):
            values = {
                "Crc": 0,
                "AliveCounter": k % 16,
                "MotorCurrent": k % 999 * 1e-3,
                "MotorVoltage": 6.0,
                "CurrentSampleCounter": 20 * k % 65536,
            }
            e2e.apply_profile2_crc(CURRENT.encode(values), ids[k % 16])

    return seconds(run) / 2000


def ours_decode():
    codec = MessageCodec(CURRENT)
    return seconds(lambda: codec.decode(CURRENT_ROWS)) / len(CURRENT_ROWS)


def cantools_decode():
    return seconds(lambda: [CURRENT.decode(data) for data in CURRENT_BYTES]) / len(CURRENT_BYTES)


def ours_push():
    decoder = Decoder(CLASSIC)
    return seconds(lambda: decoder.push(BULK)) / len(BULK)


def ours_live():
    decoder = Decoder(CLASSIC)
    return seconds(lambda: [decoder.push(batch) for batch in LIVE]) / BATCHES


def cantools_live():
    database = cantools.database.load_file(CLASSIC.path)
    payloads = [(int(i), d.tobytes()) for batch in LIVE for i, d in zip(batch.ident, batch.data, strict=True)]
    return seconds(lambda: [database.decode_message(i, d) for i, d in payloads]) / BATCHES


def ours_burst():
    decoder = Decoder(FD)
    return seconds(lambda: decoder.push(BURSTS)) / len(BURSTS)


def cantools_burst():
    return seconds(lambda: [BURST.decode(data) for data in BURST_BYTES]) / len(BURST_BYTES)


def ours_burst_encode():
    return seconds(lambda: BURST_WRITER.write(BURST_VALUES, BURST_TICKS * TICK_NS)) / len(BURST_TICKS)


def ours_command():
    encoder = CommandEncoder(CLASSIC)
    encoder.encode(SET_POINT, 0)
    return seconds(lambda: [encoder.encode(SET_POINT, k) for k in range(2000)]) / 2000


CASES = [
    ("encode a frame, counter and CRC", "us", 1e6, ours_encode, cantools_encode),
    ("decode a frame's signals", "ns", 1e9, ours_decode, cantools_decode),
    ("10 ms live: 21 frames checked, clocked, as samples", "us", 1e6, ours_live, cantools_live),
    ("a frame of a long block, checked, clocked, as samples", "ns", 1e9, ours_push, None),
    ("an FD burst of 10 samples, checked, clocked, as rows", "us", 1e6, ours_burst, cantools_burst),
    ("encode an FD burst, counter and CRC", "us", 1e6, ours_burst_encode, None),
    ("one command, from set-points to frame", "us", 1e6, ours_command, None),
]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=7)
    rounds = parser.parse_args().rounds
    for _, _, _, ours, peer in CASES:  # compile and warm up
        ours()
        if peer:
            peer()
    times = [([], []) for _ in CASES]
    for _ in range(rounds):
        for (_, _, _, ours, peer), (own, other) in zip(CASES, times, strict=True):
            own.append(ours())
            if peer:
                other.append(peer())
    for (name, unit, factor, _, peer), (own, other) in zip(CASES, times, strict=True):
        mine = statistics.median(own) * factor
        line = f"{name:56}{mine:9.2f} {unit}"
        if peer:
            theirs = statistics.median(other) * factor
            line += f"   cantools {theirs:9.2f} {unit}   {theirs / mine:6.0f} times"
        print(line)


if __name__ == "__main__":
    main()
