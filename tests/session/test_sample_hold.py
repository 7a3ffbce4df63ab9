"""Rows of samples with the commands beside them: what is held, and since when."""

import numpy as np
import pytest

from etb_hil.diagnosis.segments import COMMAND_AGE, COMMAND_FRAME_AGE
from etb_hil.recording.samples import Joiner, SampleBlock
from etb_hil.session.sample_hold import SampleHold

MS = 1_000_000


def block(source, stamps_ms, **columns):
    stamp_ns = np.array([round(one * MS) for one in stamps_ms], np.int64)
    values = {role: np.array(one, float) for role, one in columns.items()}
    return SampleBlock(source, stamp_ns, stamp_ns, values, np.zeros(len(stamp_ns), np.int64))


@pytest.mark.parametrize("cut", [0, 1, 3, 4])
def test_a_row_has_the_age_of_the_command_and_of_its_last_frame_however_the_stream_is_cut(cut):
    samples = block("current", [1.0, 2.0, 3.0, 4.0, 5.0], motor_current=[0.0] * 5)
    commands = block("command", [1.5, 2.5, 3.6, 4.4], command_mode=[1, 1, 1, 0], command_position=[0.1, 0.1, 0.4, 0.4])
    slow = {"command_mode": "command", "command_position": "command"}
    rows = SampleHold(Joiner(["current"]), slow, tuple(slow))
    found = [rows.push([one.select(part) for one in (commands, samples)]) for part in (slice(cut), slice(cut, None))]
    parts = [part.columns for part in found if part is not None]
    age, seen = (np.concatenate([part[name] for part in parts]) for name in (COMMAND_AGE, COMMAND_FRAME_AGE))
    assert age == pytest.approx([np.nan, 0.5e-3, 1.5e-3, 0.4e-3, 0.6e-3], nan_ok=True)
    assert seen == pytest.approx([np.nan, 0.5e-3, 0.5e-3, 0.4e-3, 0.6e-3], nan_ok=True)


def test_commands_without_stamps_of_their_own_have_no_age():
    samples = block("table", [1.0, 2.0], motor_current=[0.0, 0.0], command_mode=[0, 1])
    rows = SampleHold(Joiner(["table"]), {"command_mode": "table"}).push([samples])
    assert COMMAND_AGE not in rows.columns
