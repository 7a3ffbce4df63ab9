"""A guard of the cell on the bus of a bench, which opens or falls silent."""

import numpy as np

from etb_hil.base.stock import find
from etb_hil.canio.frames import FrameBlock

MS = 1_000_000
MESSAGE = '\nBO_ 320 CellGuard: 1 EtbController\n SG_ Closed : 0|1@1+ (1,0) [0|1] "" Bench\n'


def guarded_bench(folder):
    """Write a bench file whose DBC has a guard of the cell; return its path."""
    dbc = folder / "guarded.dbc"
    text = find("dbc", "etb_controller").read_text("utf-8")
    first = text.index("\nBO_ ")
    dbc.write_text(text[:first] + MESSAGE + text[first:], "utf-8")
    bench = folder / "guarded.yaml"
    text = find("bench", "virtual_classic").read_text("utf-8").replace("dbc: etb_controller", "dbc: guarded.dbc")
    bench.write_text(text.replace("  faults: Etb", "  interlock: CellGuard.Closed\n  faults: Etb"), "utf-8")
    return bench


class Guard:
    """A node that reports the guard every 10 ms: open from `opens` s on, and nothing from `ends` s on."""

    def __init__(self, opens, ends=1e9):
        self.opens, self.ends, self.due_ns = opens, ends, 0

    def run(self, until_ns, inbox):  # noqa: ARG002 (a node hears the bus, this one does not listen)
        stamps = np.arange(self.due_ns, until_ns + 1, 10 * MS)
        self.due_ns += 10 * MS * len(stamps)
        stamps = stamps[stamps < self.ends * 1e9]
        count = len(stamps)
        data = (stamps < self.opens * 1e9).astype(np.uint8)[:, None]
        return FrameBlock(
            stamps, np.full(count, 320, np.uint32), np.zeros(count, np.uint8), np.ones(count, np.uint8), data,
            np.zeros(count, np.uint8),
        )  # fmt: skip
