"""Our client against a server that is not ours: can-isotp's logic with answers made by udsoncan."""

import pytest
from uds_bench import UDS, Bench, OtherEnd
from udsoncan import Dtc, Request, Response

from etb_hil.canio.bus.link import VirtualLink
from etb_hil.canio.frames import FrameBlock
from etb_hil.uds import conversation
from etb_hil.uds.client import UdsError

TEXTS = {0xF18C: "ETB-0042", 0xF187: "a part number that is too long for one frame", 0xF195: "1.4.2"}


class OtherServer:
    """Answers as other people's server would, from its own table."""

    def __init__(self, network, *, codes=(), refuses=()):
        self._end = OtherEnd(VirtualLink(network), UDS.response, UDS.request)
        self._codes, self._refuses = codes, refuses

    def __call__(self):
        self._end.step()
        if self._end.logic.available():
            request = Request.from_payload(bytes(self._end.logic.recv()))
            self._end.logic.send(self._answer(request).get_payload())
            self._end.step()

    def _answer(self, request):
        service = request.service
        if service.request_id() in self._refuses:
            return Response(service, Response.Code.ConditionsNotCorrect)
        data = b""
        if service.request_id() == 0x22:
            data = request.data + TEXTS[int.from_bytes(request.data, "big")].encode()
        elif service.request_id() == 0x19:
            data = bytes([request.subfunction, 0xFF])
            for dtc in self._codes:
                data += dtc.id.to_bytes(3, "big") + bytes([dtc.status.get_byte_as_int()])
        return Response(service, Response.Code.PositiveResponse, data)


@pytest.fixture
def bench():
    return Bench(controller=False)


def held(bench, talk):
    return conversation.hold(talk, bench.ask)


def test_identity_is_read_from_another_server(bench):
    bench.others.append(OtherServer(bench.network))
    found = held(bench, conversation.read_identity(UDS, {"serial": "ETB-0043"}))
    assert [one.value for one in found] == list(TEXTS.values())
    assert found[0].expected == "ETB-0043"


def test_codes_are_read_from_another_server(bench):
    codes = []
    for number, status in ((0x211900, 0x09), (0xC10022, 0x28), (0x213500, 0x01)):
        dtc = Dtc(number)
        dtc.status.set_byte(status)
        codes.append(dtc)
    bench.others.append(OtherServer(bench.network, codes=codes))
    found = held(bench, conversation.read_codes(UDS))
    assert [(one.code, one.failure_type, one.status) for one in found] == [
        ("P2119", 0, 0x09),
        ("U0100", 0x22, 0x28),
        ("P2135", 0, 0x01),
    ]
    assert found[1].text == ""


def test_a_refusal_is_said(bench):
    bench.others.append(OtherServer(bench.network, refuses=(0x14,)))
    with pytest.raises(UdsError, match="refuses clearing its trouble codes: ConditionsNotCorrect"):
        held(bench, conversation.clear_codes())


def test_nobody_there_is_known_in_bounded_time(bench):
    with pytest.raises(UdsError) as caught:
        held(bench, conversation.read_codes(UDS))
    assert caught.value.reason_id == "uds_no_answer"
    assert bench.network.now_ns() < 0.2e9


def test_one_request_at_a_time(bench):
    bench.client.ask(conversation.ClearDiagnosticInformation.make_request(0xFFFFFF), 0)
    with pytest.raises(ValueError, match="still waits"):
        bench.client.ask(conversation.ClearDiagnosticInformation.make_request(0xFFFFFF), 0)
    bench.client.give_up()
    assert bench.client.step(0, FrameBlock.empty()) == (None, None)
