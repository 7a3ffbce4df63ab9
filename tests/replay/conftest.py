"""A faulty unit's run, and its frames: what a module replays in its own ways."""

import pytest
from whole_run import run_briskly_on

from etb_hil.canio.frames import concatenate_frames
from etb_hil.canio.logs.blf import read_blf


@pytest.fixture(scope="module")
def live(tmp_path_factory):
    return run_briskly_on(tmp_path_factory.mktemp("sessions"), unit="faulty")


@pytest.fixture(scope="module")
def frames(live):
    return concatenate_frames(read_blf(live.session.raw_log))
