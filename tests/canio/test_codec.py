"""The codec gives what cantools gives, bit for bit, over every kind of signal in cantools' own collection."""

import math
import os
from pathlib import Path

import cantools
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from etb_hil.base.errors import InputError
from etb_hil.base.stock import find
from etb_hil.canio.dbc.codec import MessageCodec
from etb_hil.canio.dbc.signal_bits import Overflow

DATA = Path(os.environ.get("ETB_HIL_REAL_DATA", Path(__file__).parents[3] / "shared" / "data"))
COLLECTION = sorted((DATA / "peers" / "cantools_dbc").glob("*.[dD][bB][cC]"))


def usable_messages(path):
    try:
        database = cantools.database.load_file(path, strict=False)
    except Exception:  # noqa: BLE001 (some files of the collection are bad on purpose)
        return []
    return [m for m in database.messages if not m.is_container]


def assert_same(message, payloads):
    codec = MessageCodec(message)
    columns = codec.decode(payloads)
    for row, payload in enumerate(payloads):
        try:
            expected = message.decode(payload.tobytes()[: message.length], decode_choices=False)
        except cantools.database.DecodeError:
            continue  # cantools refuses a frame whose multiplexer has an id that no signal has; ours says NaN
        for name in codec.signals:
            value = columns[name][row]
            if name not in expected:
                assert math.isnan(value), name
            else:
                wanted = float(expected[name])
                # Python scales integers of any size exactly; in columns those beyond 64 bits are rounded once more.
                signal = message.get_signal_by_name(name)
                scaled_beyond_64_bits = not signal.is_float and abs(signal.scale) > 1 and signal.length > 60
                bound = 2**-51 * abs(wanted) if scaled_beyond_64_bits else 0.0
                same = abs(value - wanted) <= bound or value == wanted or (math.isnan(value) and math.isnan(wanted))
                assert same, (name, value, wanted)


@pytest.mark.skipif(not COLLECTION, reason="cantools' DBC collection is not beside the checkout")
@pytest.mark.parametrize("path", COLLECTION, ids=lambda p: p.name)
def test_decoding_equals_cantools_over_its_collection(path):
    rng = np.random.default_rng(20)
    for message in usable_messages(path):
        try:
            MessageCodec(message)
        except InputError:
            continue  # a signal outside its message, in the files that are bad on purpose
        payloads = rng.integers(0, 256, (40, max(message.length, 1)), dtype=np.uint8)
        payloads[0], payloads[1] = 0, 255
        assert_same(message, payloads)


@pytest.mark.skipif(not COLLECTION, reason="cantools' DBC collection is not beside the checkout")
@pytest.mark.parametrize("path", COLLECTION, ids=lambda p: p.name)
def test_encoding_equals_cantools_over_its_collection(path):
    rng = np.random.default_rng(21)
    for message in usable_messages(path):
        try:
            codec = MessageCodec(message)
        except InputError:
            continue
        for payload in rng.integers(0, 256, (20, max(message.length, 1)), dtype=np.uint8):
            try:
                values = message.decode(payload.tobytes()[: message.length], decode_choices=False)
                expected = message.encode(values, strict=False)
            except (cantools.database.DecodeError, cantools.database.EncodeError, ValueError, OverflowError):
                continue
            if any(abs(float(v)) >= 2**53 or not math.isfinite(float(v)) for v in values.values()):
                continue  # float64 columns do not hold such integers
            assert codec.encode(values)[0].tobytes() == expected, message.name


@st.composite
def dbc_signals(draw):
    """One signal of any kind, and the payload width that holds it."""
    width = draw(st.sampled_from([8, 64]))
    kind = draw(st.sampled_from(["unsigned", "signed", "float"]))
    length = draw(st.sampled_from([16, 32, 64]) if kind == "float" else st.integers(1, 64))
    motorola = draw(st.booleans())
    start = draw(st.integers(0, 8 * width - length))
    if motorola:
        start = 8 * (start // 8) + 7 - start % 8
    scale = draw(st.sampled_from(["1", "2", "-3", "0.5", "0.001", "5e-05", "0.0003834951969714103"]))
    offset = draw(st.sampled_from(["0", "-40", "7", "0.1", "-12.566370614359172"]))
    sign = "-" if kind == "signed" else "+"
    text = f'VERSION ""\nNS_ :\nBS_:\nBU_: A\nBO_ 1 M: {width} A\n'
    text += f' SG_ S : {start}|{length}@{0 if motorola else 1}{sign} ({scale},{offset}) [0|0] "" A\n'
    if kind == "float":
        text += f"SIG_VALTYPE_ 1 S : {2 if length == 64 else 1};\n"
    return text, width, kind == "float" and length == 16


@settings(max_examples=300)
@given(dbc_signals(), st.data())
def test_any_signal_equals_cantools(described, data):
    text, width, half = described
    if half:
        return  # a DBC file has no 16-bit floats; test_half_floats has them
    message = cantools.database.load_string(text, "dbc", strict=True).messages[0]
    payload = data.draw(st.binary(min_size=width, max_size=width))
    assert_same(message, np.frombuffer(payload, np.uint8).reshape(1, width))
    value = message.decode(payload, decode_choices=False)["S"]
    if math.isfinite(float(value)) and abs(float(value)) < 2**50:
        try:
            expected = message.encode({"S": float(value)}, strict=False)
        except (cantools.database.EncodeError, OverflowError, ValueError):
            return
        assert MessageCodec(message).encode({"S": float(value)})[0].tobytes() == expected


def test_half_floats():
    signal = cantools.database.can.Signal("S", 0, 16, conversion=cantools.database.conversion.IdentityConversion(True))
    message = cantools.database.can.Message(1, "M", 2, [signal])
    every = np.arange(65536, dtype=np.uint16)
    payloads = np.column_stack([every & 0xFF, every >> 8]).astype(np.uint8)
    values = MessageCodec(message).decode(payloads)["S"]
    np.testing.assert_array_equal(values, every.view(np.float16).astype(np.float64))
    numbers = np.isfinite(values) & (every != 0x8000)  # an offset of 0 takes the sign off minus zero
    np.testing.assert_array_equal(MessageCodec(message).encode({"S": values[numbers]}), payloads[numbers])


@pytest.fixture(scope="module")
def current():
    return MessageCodec(cantools.database.load_file(find("dbc", "etb_controller")).get_message_by_name("EtbCurrent"))


def test_values_that_do_not_fit_are_refused_with_the_range(current):
    with pytest.raises(InputError, match=r"EtbCurrent.MotorCurrent .*40.* allowed: -32.768 to 32.767 A"):
        current.encode({"MotorCurrent": [0.0, 40.0]})
    with pytest.raises(InputError, match="nan"):
        current.encode({"MotorCurrent": math.nan})


def test_values_that_do_not_fit_saturate_or_wrap_where_asked(current):
    values = {"MotorCurrent": [40.0, -40.0, 32.7675, -32.7685]}
    held = current.decode(current.encode(values, Overflow.SATURATE))["MotorCurrent"]
    np.testing.assert_allclose(held, [32.767, -32.768, 32.767, -32.768])
    wrapped = current.decode(current.encode({"CurrentSampleCounter": [65536.0, -1.0, 131077.0]}, Overflow.WRAP))
    assert wrapped["CurrentSampleCounter"].tolist() == [0.0, 65535.0, 5.0]


def test_an_unknown_signal_is_a_key_error(current):
    with pytest.raises(KeyError, match="NoSuch"):
        current.encode({"NoSuch": 1.0})


def test_wider_payloads_than_the_message_are_read(current):
    narrow = current.encode({"MotorCurrent": [1.5, -2.0], "MotorVoltage": 3.0})
    wide = np.zeros((2, 64), np.uint8)
    wide[:, :8] = narrow
    assert current.decode(wide)["MotorCurrent"].tolist() == [1.5, -2.0]
    with pytest.raises(ValueError, match="8 bytes"):
        current.decode(narrow[:, :4])


def _message_with(signal):
    """Return a message of 8 bytes with one signal `S`, whose place, scale and sign are as in a DBC file."""
    text = f'VERSION ""\nBU_: A\nBO_ 1 M: 8 A\n SG_ S : {signal} [0|0] "" A\n'
    return cantools.database.load_string(text, "dbc").messages[0]


def _wide(length, order, signed, data, scale=1, offset=0):
    """Return a message with a wide integer at a drawn place, and the least raw value of it."""
    start = 7 if order == 0 else data.draw(st.integers(0, 64 - length))
    message = _message_with(f"{start}|{length}@{order}{'-' if signed else '+'} ({scale},{offset})")
    return message, -(1 << length - 1) if signed else 0


@pytest.mark.parametrize("length", [54, 57, 63, 64])
@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize("signed", [False, True])
@given(data=st.data())
@settings(max_examples=20)
def test_integers_of_more_bits_than_a_float_keep_them_all(length, order, signed, data):
    message, low = _wide(length, order, signed, data)
    value = data.draw(st.integers(low, low + (1 << length) - 1))
    codec = MessageCodec(message)
    assert codec.encode({"S": value})[0].tobytes() == message.encode({"S": value}, strict=False)
    assert codec.encode({"S": low + (1 << length)}, Overflow.SATURATE)[0].tobytes() == message.encode(
        {"S": low + (1 << length) - 1}, strict=False
    )
    assert (
        codec.encode({"S": value + (1 << length)}, Overflow.WRAP)[0].tobytes()
        == codec.encode({"S": value})[0].tobytes()
    )
    with pytest.raises(InputError, match="cannot hold this value"):
        codec.encode({"S": low - 1})


@pytest.mark.parametrize("length", [54, 60, 63, 64])
@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize("signed", [False, True])
@given(data=st.data())
@settings(max_examples=30)
def test_wide_integers_with_whole_scales_keep_all_bits_in_any_company(length, order, signed, data):
    """A list of 64-bit integers on both sides of 2^63 is a list of floats to numpy."""
    scale, offset = data.draw(st.sampled_from([(1, 0), (2, 0), (-1, 0), (1, 7), (3, -5), (4, 1)]))
    message, low = _wide(length, order, signed, data, scale, offset)
    raws = data.draw(st.lists(st.integers(low, low + (1 << length) - 1) | st.just(low + (1 << length) - 1), min_size=1))
    expected = [message.encode({"S": raw}, scaling=False) for raw in raws]
    exact = [message.decode(payload, decode_choices=False)["S"] for payload in expected]
    assert exact == [raw * scale + offset for raw in raws]
    for values in (exact, tuple(exact), np.array(exact, object)):
        assert [row.tobytes() for row in MessageCodec(message).encode({"S": values})] == expected
    with pytest.raises(InputError, match="nan"):
        MessageCodec(message).encode({"S": [*exact, math.nan]})


def test_a_refused_wide_integer_is_told_with_its_range_to_the_last_digit():
    message = _message_with("0|64@1+ (1,0)")
    with pytest.raises(InputError, match=r"it is 18446744073709551616\); allowed: 0 to 18446744073709551615;"):
        MessageCodec(message).encode({"S": [1, 1 << 64]})


def test_fractions_beside_wide_integers_are_scaled_as_they_are():
    message = _message_with("0|64@1+ (0.5,0)")
    payloads = MessageCodec(message).encode({"S": [0.5, (1 << 63) - 1, 2.5]})
    assert payloads.view(np.uint64).ravel().tolist() == [1, (1 << 64) - 2, 5]
