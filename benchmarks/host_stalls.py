"""How long this machine stands still, whatever runs on it: a process of high real-time priority that wakes every ms.

    python benchmarks/host_stalls.py --seconds 300

A bench at wall clock has 19 ms: the next command is due 10 ms after the last, and a watchdog of 30 ms opens the bridge
at the tick before its time. Where the machine stands still for longer, no bench on it can keep the drive on.
"""

import argparse
import gc
import os
import time

ALLOWED_MS = 19.0
PERIOD_NS = 1_000_000
NOTED_MS = 1.0


def stalls(seconds):
    """Return how late in ms each wake was that came more than a millisecond too late."""
    found, end_ns, due_ns = [], time.monotonic_ns() + round(seconds * 1e9), time.monotonic_ns()
    while due_ns < end_ns:
        due_ns += PERIOD_NS
        if (left_ns := due_ns - time.monotonic_ns()) > 0:
            time.sleep(left_ns * 1e-9)
        now_ns = time.monotonic_ns()
        if (late_ms := (now_ns - due_ns) * 1e-6) > NOTED_MS:
            found.append(late_ms)
            due_ns = now_ns
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=60.0)
    options = parser.parse_args()
    gc.disable()
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(50))
    found = stalls(options.seconds)
    fatal = sum(late > ALLOWED_MS for late in found)
    print(
        f"{options.seconds:.0f} s, load {os.getloadavg()[0]:.1f}: {len(found)} wakes late by more than "
        f"{NOTED_MS:.0f} ms, worst {max(found, default=0.0):.1f} ms; {fatal} beyond {ALLOWED_MS:.0f} ms"
    )


if __name__ == "__main__":
    main()
