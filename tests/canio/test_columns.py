"""Columns of numpy alone give what cantools gives, and what the compiled codec gives."""

import cantools
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_codec import COLLECTION, dbc_signals, usable_messages

from etb_hil.base.errors import InputError
from etb_hil.canio.dbc.codec import MessageCodec
from etb_hil.canio.dbc.columns import ColumnDecoder
from etb_hil.canio.frames import FrameBlock, FrameFlag


def frames_of(message, payloads):
    count = len(payloads)
    return FrameBlock(
        np.arange(count),
        np.full(count, message.frame_id, np.uint32),
        np.full(count, FrameFlag.EXTENDED if message.is_extended_frame else 0, np.uint8),
        np.full(count, message.length, np.uint8),
        payloads,
        np.zeros(count, np.uint8),
    )


def assert_as_the_codec(message, payloads):
    codec = MessageCodec(message)  # itself checked against cantools
    found = ColumnDecoder([message]).push(frames_of(message, payloads))
    assert len(found) == 1
    np.testing.assert_array_equal(found[0].stamp_ns, np.arange(len(payloads)))
    for name, expected in codec.decode(payloads).items():
        got = found[0].columns[name]
        same = (got == expected) | (np.isnan(got) & np.isnan(expected))
        assert same.all(), (name, got[~same][0], expected[~same][0])


@pytest.mark.skipif(not COLLECTION, reason="cantools' DBC collection is not beside the checkout")
@pytest.mark.parametrize("path", COLLECTION, ids=lambda p: p.name)
def test_columns_equal_the_codec_over_cantools_collection(path):
    rng = np.random.default_rng(22)
    for message in usable_messages(path):
        try:
            MessageCodec(message)
        except InputError:
            continue  # a signal outside its message, in the files that are bad on purpose
        payloads = rng.integers(0, 256, (50, 64 if message.length > 8 else 8), dtype=np.uint8)
        payloads[0], payloads[1] = 0, 255
        if message.signals:
            assert_as_the_codec(message, payloads)


@settings(max_examples=200, deadline=None)
@given(dbc_signals(), st.integers(0, 2**32))
def test_any_signal_equals_the_codec(described, seed):
    text, width, _ = described
    message = cantools.database.load_string(text, "dbc", strict=False).messages[0]
    message = cantools.database.load_string(text, "dbc", strict=False).messages[0]
    payloads = np.random.default_rng(seed).integers(0, 256, (20, width), dtype=np.uint8)
    assert_as_the_codec(message, payloads)


@pytest.mark.parametrize("scaled", ["(2,0)", "(1,1e308)", "(-4,-1e308)"])
def test_a_double_that_is_scaled_beyond_its_end_is_infinite(scaled):
    text = f'BU_: A\nBO_ 1 M: 8 A\n SG_ S : 0|64@1+ {scaled} [0|0] "" A\nSIG_VALTYPE_ 1 S : 2;\n'
    message = cantools.database.load_string(text, "dbc", strict=False).messages[0]
    values = np.array([1.7e308, -1.7e308, 1.0, 0.0])
    payloads = values.astype("<f8").view(np.uint8).reshape(-1, 8)
    assert_as_the_codec(message, payloads)
    found = ColumnDecoder([message]).push(frames_of(message, payloads))[0].columns["S"]
    assert np.isinf(found[:2]).any()
    assert np.isfinite(found[2:]).all()


SIGNAL = ' SG_ S : 0|16@1+ (1,0) [0|0] "" A\n'


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (f"BO_ 1 M: 2 A\n{SIGNAL}{SIGNAL.replace('0|16', '0|8')}", "one signal of this name .*'M.S'"),
        (f"BO_ 1 M: 2 A\n{SIGNAL}BO_ 2 M: 2 A\n{SIGNAL}", "one message has this name .*'M'"),
        (f"BO_ 1 M: 2 A\n{SIGNAL}BO_ 1 N: 2 A\n{SIGNAL}", "one message has this identifier .*'0x1: M and N'"),
    ],
)
def test_what_cannot_be_told_apart_is_refused(text, told):
    database = cantools.database.load_string(f'VERSION ""\nBU_: A\n{text}', "dbc", strict=False)
    with pytest.raises(InputError, match=told):
        ColumnDecoder(database.messages)


def test_the_codec_refuses_signals_of_one_name():
    text = f'VERSION ""\nBU_: A\nBO_ 1 M: 2 A\n{SIGNAL}{SIGNAL}'
    with pytest.raises(InputError, match="more than one signal"):
        MessageCodec(cantools.database.load_string(text, "dbc", strict=False).messages[0])


@pytest.mark.parametrize("others", [0, 200])
def test_messages_are_told_apart(others):
    text = 'VERSION ""\nBU_: A\n'
    for number in range(3 + others):
        text += f'BO_ {100 + number} M{number}: 2 A\n SG_ S : 0|16@1+ (1,0) [0|0] "" A\n'
    text += 'BO_ 2147483748 Extended: 2 A\n SG_ S : 0|8@1+ (1,0) [0|0] "" A\n'
    decoder = ColumnDecoder(cantools.database.load_string(text, "dbc").messages)
    count = 8
    frames = FrameBlock(
        np.arange(count),
        np.array([100, 102, 100, 100, 100, 99, 100, 102], np.uint32),
        np.array([0, 0, FrameFlag.EXTENDED, FrameFlag.REMOTE, FrameFlag.ERROR, 0, 0, FrameFlag.SENT], np.uint8),
        np.array([2, 8, 8, 2, 2, 8, 1, 2], np.uint8),
        np.arange(8 * count, dtype=np.uint8).reshape(count, 8),
        np.zeros(count, np.uint8),
    )
    found = {c.message: (c.stamp_ns.tolist(), c.columns["S"].tolist()) for c in decoder.push(frames)}
    assert found == {"M0": ([0], [256.0]), "M2": ([1, 7], [2312.0, 14648.0]), "Extended": ([2], [16.0])}
    assert decoder.too_short == 1


@pytest.mark.parametrize("length", [52, 53, 54, 60, 63, 64])
@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize("signed", [False, True])
@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_values_that_floats_round_are_counted_with_the_first(length, order, signed, data):
    start = 7 if order == 0 else data.draw(st.integers(0, 64 - length))
    scale, offset = data.draw(st.sampled_from([(1, 0), (2, 0), (-1, 0)] + [(3, -5), (1, 7)] * (length < 61)))
    signal = f' SG_ S : {start}|{length}@{order}{"-" if signed else "+"} ({scale},{offset}) [0|0] "" A\n'
    message = cantools.database.load_string(f'VERSION ""\nBU_: A\nBO_ 1 M: 8 A\n{signal}', "dbc").messages[0]
    low = -(1 << length - 1) if signed else 0
    raws = data.draw(st.lists(st.integers(low, low + (1 << length) - 1), min_size=1, max_size=8))
    payloads = np.frombuffer(b"".join(message.encode({"S": raw}, scaling=False) for raw in raws), np.uint8)
    decoder = ColumnDecoder([message])
    (found,) = decoder.push(frames_of(message, payloads.reshape(-1, 8).copy()))
    exact = [message.decode(payload.tobytes())["S"] for payload in payloads.reshape(-1, 8)]
    assert found.columns["S"].tolist() == [float(value) for value in exact]
    lost = [k for k, value in enumerate(exact) if int(float(value)) != value]
    said = [(name, one.values, one.first_ns) for name, one in decoder.rounded.items()]
    assert said == ([("M.S", len(lost), lost[0])] if lost else [])


def test_a_rounded_value_that_its_multiplexer_leaves_out_is_not_counted():
    signals = ' SG_ X M : 0|2@1+ (1,0) [0|0] "" A\n SG_ S m1 : 2|62@1+ (1,0) [0|0] "" A\n'
    message = cantools.database.load_string(f'VERSION ""\nBU_: A\nBO_ 1 M: 8 A\n{signals}', "dbc").messages[0]
    payloads = np.full((3, 8), 255, np.uint8)
    payloads[:, 0] = [0xFC, 0xFD, 0xFE]
    decoder = ColumnDecoder([message])
    decoder.push(frames_of(message, payloads))
    assert [(name, one.values, one.first_ns) for name, one in decoder.rounded.items()] == [("M.S", 1, 1)]
