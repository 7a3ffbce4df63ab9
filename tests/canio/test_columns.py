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
