"""A run that only pretends: feeds the panel, then prints the verdict; the panel's tests start it."""

import os
import signal
import sys
import time

import sample_run

from etb_hil.report.panel_feed import PanelFeed, PanelSnapshot

FULL = PanelSnapshot(
    title="friction check, serial ETB-0042",
    phase="ramp opening",
    time_s=12.4,
    progress=0.52,
    time_left_s=11.0,
    angle=0.7385,
    velocity=0.25,
    current=1.234,
    temperature=23.4,
    friction=0.302,
    friction_limit=0.25,
    stiction=0.171,
    stiction_limit=0.25,
    coulomb=0.165,
    coulomb_limit=0.18,
    exceedances=1,
    load=0.614,
    lost=0,
    messages=("homing done", "\x1b[31mred\x07 herring", "[bold]no markup[/bold]"),
)


def main():
    mode = sys.argv[1]
    with PanelFeed() as feed:
        feed.update(PanelSnapshot(title=FULL.title, phase="home", progress=0.1, angle=float("nan")))
        time.sleep(0.6)
        feed.update(FULL)
        if mode == "wait":
            print("ready", file=sys.stderr, flush=True)
            sys.stdin.readline()
        if mode == "killed":
            os.kill(feed._process.pid, signal.SIGKILL)
            feed._process.wait()
            feed.update(FULL)
            feed.update(FULL)
            print("alive:", feed.alive, "due:", feed.due("new"), feed.close())
    from etb_hil.report.verdict import verdict_text  # noqa: PLC0415 (a run loads it when acquisition is over)

    print(verdict_text(sample_run.results(0.567)))


if __name__ == "__main__":
    main()
