"""Commands on the wire: set-points, requests, counters and CRCs, and values that are refused."""

import cantools
import cantools.autosar.end_to_end as e2e
import dialects
import numpy as np
import pytest

from etb_hil.base.errors import InputError
from etb_hil.base.stock import find
from etb_hil.canio.dbc.commands import CommandEncoder
from etb_hil.canio.dbc.writer import MessageWriter
from etb_hil.canio.frames import FrameFlag

SET_POINT = {
    "command_mode": 1.0,
    "command_enable": 1.0,
    "command_position": 0.75,
    "command_velocity": -2.5,
    "command_voltage": 0.0,
}
REQUEST = {"request_signals": 3.0, "request_rate": 1000.0, "request_burst": 0.0, "request_duration": 12.5}


@pytest.fixture(params=["classic", "fd"])
def dialect(request):
    return getattr(dialects, request.param)()


def test_what_cantools_reads_is_what_was_commanded(dialect):
    database = cantools.database.load_file(dialect.path)
    encoder = CommandEncoder(dialect)
    for k in range(300):
        frame = encoder.encode(SET_POINT, 5_000_000 * k)
        message = database.get_message_by_name("EtbCommand")
        payload = frame.data[0, : message.length].tobytes()
        ids = dialect.message("EtbCommand").protection.data_ids
        if message.is_fd:
            assert e2e.check_profile5_crc(payload, ids[0])
            assert int(frame.flags[0]) == FrameFlag.FD | FrameFlag.BITRATE_SWITCH
        else:
            assert e2e.check_profile2_crc(payload, ids[k % 16])
            assert int(frame.flags[0]) == 0
        decoded = message.decode(payload, decode_choices=False)
        assert decoded["AliveCounter"] == k % (256 if message.is_fd else 16)
        assert decoded["CommandPosition"] == pytest.approx(0.75)
        assert decoded["CommandVelocity"] == pytest.approx(-2.5)
        assert (decoded["CommandMode"], decoded["CommandEnable"], decoded["CommandVoltage"]) == (1, 1, 0)
        assert frame.stamp_ns.tolist() == [5_000_000 * k]
        assert frame.length.tolist() == [message.length]


def test_each_message_counts_for_itself(dialect):
    encoder = CommandEncoder(dialect)
    both = encoder.encode({**SET_POINT, **REQUEST}, 1)
    assert both.ident.tolist() == [0x110, 0x111]
    assert encoder.encode(REQUEST, 2).ident.tolist() == [0x111]
    column = 2 if dialect.message("EtbCommand").fd else 1
    assert int(encoder.encode(SET_POINT, 3).data[0, column]) & 0xF == 1
    assert int(encoder.encode(REQUEST, 4).data[0, column]) & 0xF == 2


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"command_position": 2.0}, r"EtbCommand.CommandPosition .*2.0.* allowed: -1.6384 to 1.63835 rad"),
        ({"command_position": float("nan")}, r"CommandPosition .*nan"),
        ({"command_mode": 20.0}, r"CommandMode"),
        ({"motor_current": 1.0}, r"no message to the controller carries the role 'motor_current'.*command_mode"),
    ],
)
def test_what_cannot_be_sent_is_refused(dialect, changed, said):
    with pytest.raises(InputError, match=said):
        CommandEncoder(dialect).encode({**SET_POINT, **changed}, 0)


def test_a_refused_command_does_not_move_the_counter():
    encoder = CommandEncoder(dialects.classic())
    encoder.encode(SET_POINT, 0)
    with pytest.raises(InputError):
        encoder.encode({**SET_POINT, "command_position": 9.0}, 1)
    assert int(encoder.encode(SET_POINT, 2).data[0, 1]) & 0xF == 1


def test_a_message_is_the_same_in_one_block_or_in_many(dialect):
    name = "EtbBurst" if dialect.message("EtbStatus").fd else "EtbCurrent"
    shape = (40, 10) if name == "EtbBurst" else 40
    rng = np.random.default_rng(5)
    ticks = np.arange(40) * 20
    values = {"motor_current": rng.uniform(-9, 9, shape), "motor_voltage": rng.uniform(-12, 12, 40)}
    whole = MessageWriter(dialect, name).write({**values, "sample_counter": ticks}, ticks * 50_000)
    writer = MessageWriter(dialect, name)
    for k in range(40):
        part = {role: column[k : k + 1] for role, column in values.items()}
        one = writer.write({**part, "sample_counter": ticks[k : k + 1]}, ticks[k : k + 1] * 50_000)
        np.testing.assert_array_equal(one.data[0], whole.data[k])


def test_measured_values_saturate():
    writer = MessageWriter(dialects.classic(), "EtbCurrent")
    frame = writer.write({"motor_current": 99.0, "MotorVoltage": -99.0}, 0)
    message = cantools.database.load_file(find("dbc", "etb_controller")).get_message_by_name("EtbCurrent")
    decoded = message.decode(frame.data[0].tobytes())
    assert decoded["MotorCurrent"] == pytest.approx(32.767)
    assert decoded["MotorVoltage"] == pytest.approx(-32.768)


def test_a_message_whose_signals_overlap_is_not_sent(tmp_path):
    path = tmp_path / "overlap.dbc"
    text = find("dbc", "etb_controller").read_text(encoding="utf-8")
    path.write_text(text.replace("CommandVelocity : 32|16", "CommandVelocity : 30|16"), encoding="utf-8")
    dialect = dialects.load(path, dialects.CLASSIC)
    with pytest.raises(InputError, match=r"EtbCommand: cannot be sent: .*overlapping"):
        CommandEncoder(dialect)
