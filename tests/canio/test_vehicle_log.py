"""A vehicle's log through the vehicle's own DBC file becomes a Recording of its pedal and throttle."""

from __future__ import annotations

import os
from pathlib import Path

import can
import cantools
import numpy as np
import pytest

from etb_hil.base.errors import InputError
from etb_hil.bench.bench_file import load_bench
from etb_hil.canio.logs.recording import record_log
from etb_hil.recording.recording import ClockGrade
from etb_hil.report.recording_plot import plot_recording

CHECKOUT = Path(__file__).resolve().parents[2]
DATA = Path(os.environ.get("ETB_HIL_REAL_DATA", CHECKOUT.parent / "shared" / "data")) / "can_passat"
TRACE, DBC = DATA / "passat-idling.trc", DATA / "vw_pq.dbc"

BENCH = CHECKOUT / "docs" / "examples" / "passat.bench.yaml"
SIGNALS = {  # role: message, signal, factor from the signal's unit to SI
    "pedal_position": ("Motor_3", "MO3_Pedalwert", 0.01),
    "throttle_opening": ("Motor_3", "MO3_DKW", 0.01),
    "engine_speed": ("Motor_1", "Motordrehzahl", 2 * np.pi / 60),
}
HEAT = "temperature: Master_3.Motortemperatur_linearisiert"  # a message that this log has not

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason="no measured data beside the checkout (ETB_HIL_REAL_DATA)")


def dialect(tmp_path, roles=None):
    """The example bench file's dialect, with other roles where given."""
    text = BENCH.read_text()
    if roles is not None:
        text = text[: text.index("roles:")] + f"roles: {roles}\n" + text[text.index("limits:") :]
    path = tmp_path / "bench.yaml"
    path.write_text(text)
    return load_bench(path, DBC).dialect


def test_throttle_pedal_and_speed_are_those_that_cantools_decodes(tmp_path):
    recording = record_log(TRACE, dialect(tmp_path))
    assert recording.clock is ClockGrade.RECEIVE_STAMPS
    assert recording.notes == []
    database = cantools.database.load_file(DBC, strict=False)
    with can.LogReader(TRACE) as reader:
        messages = list(reader)
    for role, (name, signal, factor) in SIGNALS.items():
        message = database.get_message_by_name(name)
        mine = [m for m in messages if m.arbitration_id == message.frame_id]
        expected = [message.decode(bytes(m.data), decode_choices=False, allow_truncated=True)[signal] for m in mine]
        series = recording.series(role)
        np.testing.assert_allclose(series.values, np.array(expected) * factor, rtol=1e-15)
        assert np.max(np.abs(series.time_ns - np.array([m.timestamp for m in mine]) * 1e9)) < 500
        assert np.all(np.diff(series.time_ns) > 0)


def test_the_engine_idles_with_the_throttle_nearly_shut(tmp_path):
    recording = record_log(TRACE, dialect(tmp_path))
    assert set(recording.series("pedal_position").values) == {0.0}
    assert set(recording.series("throttle_opening").values) == {0.04}
    speed = recording.series("engine_speed")
    assert np.all(np.abs(speed.values * 60 / (2 * np.pi) - 752) < 12)
    assert 5.7 < (speed.time_ns[-1] - speed.time_ns[0]) * 1e-9 < 5.8


def test_the_recording_is_drawn(tmp_path):
    recording = record_log(TRACE, dialect(tmp_path))
    plot_recording(recording, recording.roles, tmp_path / "passat.png")
    assert (tmp_path / "passat.png").read_bytes().startswith(b"\x89PNG")


def test_a_message_that_the_log_lacks_is_noted(tmp_path):
    roles = f"{{{HEAT}, pedal_position: {{signal: Motor_3.MO3_Pedalwert, scale: 0.01}}}}"
    recording = record_log(TRACE, dialect(tmp_path, roles))
    assert recording.notes == ["Master_3: no frame in the log"]


def test_a_log_without_any_frame_of_the_dialect_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"holds no frame that has a role; allowed: Master_3 \(0x106\)"):
        record_log(TRACE, dialect(tmp_path, f"{{{HEAT}}}"))
