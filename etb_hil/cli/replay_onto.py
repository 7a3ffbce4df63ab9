"""A log sent onto the bus of a bench."""

from __future__ import annotations

from contextlib import closing
from typing import TYPE_CHECKING

from etb_hil.base.clock import WallClock
from etb_hil.base.steady import steady
from etb_hil.base.stock import find
from etb_hil.bench.bench_file import load_bench
from etb_hil.canio.bus.link import open_link
from etb_hil.cli.replay_options import is_session, window_of
from etb_hil.replays.log_frames import Frames
from etb_hil.replays.onto_bus import send_log
from etb_hil.session.session import RAW_LOG

if TYPE_CHECKING:
    import argparse


def replay_onto(options: argparse.Namespace) -> int:
    """Send the frames, say how late they were, and return the exit code."""
    bus = load_bench(find("bench", options.onto)).bench.bus
    paths = [source / RAW_LOG if is_session(source) else source for source in options.sources]
    frames = Frames(paths, options.channel[0] if options.channel else None, window_of(options))
    clock = WallClock()
    with steady(), closing(open_link(bus, clock)) as link:
        print(send_log(frames, link, clock, fd=bus.fd))
    for note in frames.notes:
        print(f"  Note     {note}")
    if len(frames.channels) > 1:
        there = ", ".join(map(str, sorted(frames.channels)))
        print(f"  Note     frames of channels {there} went onto one bus; --channel N sends those of one")
    return 0
