"""The channel between a page and its run touches no other process of the page."""

import subprocess
import sys

from etb_hil.page.channel import Channel


def test_asking_for_a_run_takes_no_other_child_s_exit_status(tmp_path):
    channel = Channel.between(tmp_path, "bench")
    for _ in range(5):
        with subprocess.Popen([sys.executable, "-c", "raise SystemExit(7)"]) as child:
            while child.poll() is None:
                assert not channel.is_busy()
        assert child.returncode == 7
