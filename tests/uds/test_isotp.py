"""ISO-TP: messages of every length, between two ends of ours and against can-isotp; what is broken is named."""

from collections import deque
from contextlib import suppress

import isotp
import pytest
from hypothesis import given
from hypothesis import strategies as st

from etb_hil.canio.isotp import LONGEST, IsoTpEnd, TransportError, TransportTiming, separation_ns

MS = 1_000_000
S = 1_000_000_000


def exchanged(payload, sender, receiver, *, lose=None):
    """Carry frames to and fro in steps of 1 ms until the message has arrived; `lose` drops one frame by number."""
    sender.send(payload)
    now, count = 0, 0
    while not receiver.received and now < 20 * S:
        for one, other in ((sender, receiver), (receiver, sender)):
            for data in one.step(now):
                count += 1
                if count != lose:
                    other.take(now, data)
        now += MS
    return receiver.received.popleft(), now


@given(
    length=st.integers(1, LONGEST),
    block=st.integers(0, 255),
    separation=st.sampled_from([0, 1, 5, 0xF1, 0xF9]),
    fill=st.integers(0, 255),
)
def test_a_message_arrives_whole(length, block, separation, fill):
    payload = bytes((k * 7 + fill) % 256 for k in range(length))
    receiver = IsoTpEnd(TransportTiming(block_size=block, separation_ms=separation))
    assert exchanged(payload, IsoTpEnd(), receiver)[0] == payload


class TheirEnd:
    """can-isotp's logic behind the interface of ours."""

    def __init__(self, **params):
        self._out, self._in = [], deque()
        address = isotp.Address(isotp.AddressingMode.Normal_11bits, txid=1, rxid=2)
        self._logic = isotp.TransportLayerLogic(
            lambda: self._in.popleft() if self._in else None,
            lambda message: self._out.append(bytes(message.data)),
            address,
            params=params,
        )
        self.received = deque()

    def send(self, payload):
        self._logic.send(payload)

    def take(self, _now, data):
        self._in.append(isotp.CanMessage(arbitration_id=2, data=data))

    def step(self, _now):
        self._logic.process()
        while self._logic.available():
            self.received.append(bytes(self._logic.recv()))
        out, self._out = self._out, []
        return out


@pytest.mark.parametrize("length", [1, 7, 8, 13, 14, 62, 63, 300, LONGEST])
@pytest.mark.parametrize("block", [0, 1, 8])
def test_it_understands_another_implementation(length, block):
    payload = bytes(k % 251 for k in range(length))
    ours = IsoTpEnd(TransportTiming(block_size=block))
    assert exchanged(payload, TheirEnd(), ours)[0] == payload
    assert exchanged(payload, IsoTpEnd(), TheirEnd(blocksize=block, stmin=0))[0] == payload


@pytest.mark.parametrize(("lost", "kind"), [(1, "N_TIMEOUT_Bs"), (2, "N_TIMEOUT_Bs"), (3, "N_WRONG_SN")])
def test_a_lost_frame_is_named_in_bounded_time(lost, kind):
    with pytest.raises(TransportError) as caught:
        exchanged(bytes(50), IsoTpEnd(), IsoTpEnd(), lose=lost)
    assert caught.value.kind == kind


def test_a_message_that_breaks_off_is_given_up():
    end = IsoTpEnd()
    end.take(0, bytes.fromhex("1014 010203040506"))
    assert end.step(0) == [bytes.fromhex("300000cccccccccc")]
    assert end.step(S) == []
    with pytest.raises(TransportError, match="broke off"):
        end.step(S + 1)
    assert not end.is_receiving


@pytest.mark.parametrize("data", ["00", "0f010203", "1004010203040506", "1007aabbccddeeff"])
def test_frames_of_lengths_that_cannot_be_are_ignored(data):
    """ISO 15765-2: neither an error nor a flow control, and the message that comes in goes on."""
    end = IsoTpEnd()
    end.take(0, bytes.fromhex(data))
    assert (end.is_receiving, list(end.received), end.step(0)) == (False, [], [])
    end.take(0, bytes.fromhex("1008010203040506"))
    assert len(end.step(0)) == 1
    end.take(1, bytes.fromhex(data))
    end.take(2, bytes.fromhex("210708"))
    assert list(end.received) == [bytes(range(1, 9))]
    assert end.step(3) == []


def test_it_waits_as_long_as_it_is_told_to_and_no_longer():
    end = IsoTpEnd()
    end.send(bytes(20))
    end.step(0)
    for k in range(10):
        end.take(k, bytes.fromhex("310000"))
    with pytest.raises(TransportError) as caught:
        end.take(11, bytes.fromhex("310000"))
    assert caught.value.kind == "N_WFT_OVRN"
    assert not end.is_sending


def test_what_was_received_before_a_reset_is_gone():
    end = IsoTpEnd()
    end.take(0, bytes.fromhex("023e00"))
    end.reset()
    assert not end.received


@pytest.mark.parametrize(("code", "expected"), [(0, 0), (0x7F, 127 * MS), (0xF1, MS // 10), (0x80, 127 * MS)])
def test_separation_times(code, expected):
    assert separation_ns(code) == expected


@given(st.lists(st.binary(max_size=8), max_size=30))
def test_no_frames_break_it(frames):
    end = IsoTpEnd()
    for now, data in enumerate(frames):
        with suppress(TransportError):
            end.take(now * MS, data)
            end.step(now * MS)
    end.reset()
    end.received.clear()
    assert exchanged(b"still alive", IsoTpEnd(), end)[0] == b"still alive"
