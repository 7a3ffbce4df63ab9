"""Our client against a server that is not ours: can-isotp's logic with answers made by udsoncan."""

import pytest
from uds_bench import LEARN, MS, UDS, Bench, OtherEnd
from udsoncan import AsciiCodec, Dtc, Request, Response
from udsoncan.services import ReadDataByIdentifier

from etb_hil.bench.unit_talk import UnitTalk
from etb_hil.canio.bus.link import VirtualLink
from etb_hil.canio.frames import FrameBlock, classic_frames, concatenate_frames
from etb_hil.uds import conversation
from etb_hil.uds.client import UdsClient, UdsError
from etb_hil.uds.settings import UdsSettings

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


POLLED = UdsSettings(
    request=0x7E0,
    response=0x7E8,
    trouble_codes=False,
    data={"temperature": {"id": 0x1234, "unit": "degC", "every": "50 ms"}},
)
P2_STAR_MS = 5100  # with what is added for the way


def read(number):
    return ReadDataByIdentifier.make_request([number], {number: AsciiCodec(1)})


def said(ms, *payloads):
    """Return single frames of the unit at a time in ms."""
    data = [bytes([len(payload) // 2]) + bytes.fromhex(payload) for payload in payloads]
    return concatenate_frames([classic_frames(ms * MS, POLLED.response, [one.ljust(8, b"\xcc")]) for one in data])


def given_up(number):
    """Return a client that gave a request of an identifier up, and when, in ms."""
    client = UdsClient(POLLED)
    client.ask(read(number), 0)
    for ms in range(1000):
        try:
            client.step(ms * MS, FrameBlock.empty())
        except UdsError as error:
            assert error.reason_id == "uds_no_answer"  # noqa: PT017 (the time at which it comes is wanted)
            client.give_up()
            return client, ms
    raise AssertionError


@pytest.mark.parametrize("answer", ["62f19041", "7f2231"])
@pytest.mark.parametrize("after", [20, P2_STAR_MS])
def test_a_late_answer_to_a_request_that_was_given_up_is_passed_over_once(answer, after):
    client, gone = given_up(0xF190)
    assert client.step((gone + after) * MS, said(gone + after, answer)) == (None, None)
    with pytest.raises(UdsError, match="did not ask") as caught:
        client.step((gone + after) * MS, said(gone + after, answer))
    assert caught.value.reason_id == "uds_second_tester"


@pytest.mark.parametrize(
    ("answer", "after"),
    [("62f19041", P2_STAR_MS + 1), ("62f19141", 20), ("7f1911", 20), ("5902", 20)],
)
def test_what_no_request_explains_is_a_second_testers(answer, after):
    client, gone = given_up(0xF190)
    with pytest.raises(UdsError) as caught:
        client.step((gone + after) * MS, said(gone + after, answer))
    assert caught.value.reason_id == "uds_second_tester"


def test_response_pending_of_a_request_that_was_given_up_makes_it_later():
    client, gone = given_up(0xF190)
    for later in (5000, 10_000, 15_000):
        assert client.step((gone + later) * MS, said(gone + later, "7f2278")) == (None, None)
    assert client.step((gone + 20_000) * MS, said(gone + 20_000, "62f19041")) == (None, None)


def test_a_late_answer_is_not_taken_for_that_to_the_next_request():
    client, gone = given_up(0xF190)
    client.ask(read(0xF18C), gone * MS)
    client.step(gone * MS, FrameBlock.empty())
    assert client.step((gone + 10) * MS, said(gone + 10, "62f19041"))[1] is None
    assert client.step((gone + 20) * MS, said(gone + 20, "62f18c42"))[1].data == bytes.fromhex("f18c42")
    client.ask(read(0xF18C), (gone + 30) * MS)
    client.step((gone + 30) * MS, FrameBlock.empty())
    with pytest.raises(UdsError, match="cut short"):  # the late one has come: no request explains another
        conversation.hold(
            conversation.read_identity(POLLED.model_copy(update={"identification": {"serial": 0xF18C}}), {}),
            lambda _: client.step((gone + 40) * MS, said(gone + 40, "62f19041"))[1],
        )


@pytest.mark.parametrize(
    ("request_made", "answer"),
    [
        (conversation.keep_session, "7e00"),
        (conversation.clear_codes, "54"),
        (conversation.close_session, "5001003201f4"),
        (lambda: conversation.start_routine(LEARN), "7101" + f"{LEARN.id:04x}" + "00"),
        (lambda: conversation.read_codes(UDS), "5902ff"),
    ],
)
def test_late_answers_of_other_services_are_known_by_what_they_repeat(request_made, answer):
    client = UdsClient(POLLED)
    client.ask(next(request_made()), 0)
    client.step(0, FrameBlock.empty())
    client.give_up()
    assert client.step(300 * MS, said(300, answer)) == (None, None)
    with pytest.raises(UdsError):
        client.step(300 * MS, said(300, answer))


class HandClock:
    """A clock that a test sets."""

    ns = 0

    def now_ns(self):
        return self.ns


@pytest.mark.parametrize("spread_ms", [0, 5, 30])
def test_a_unit_that_wakes_up_slowly_and_answers_all_requests_is_no_second_tester(spread_ms):
    """It sleeps for 400 ms: three requests wait by then, and it answers one after another."""
    clock = HandClock()
    talk = UnitTalk(POLLED, clock)
    due, asked = [], 0
    for ms in range(0, 3000, 5):
        clock.ns = ms * MS
        arrived = [one for at, one in due if at <= ms]
        due = [(at, one) for at, one in due if at > ms]
        out = talk.hear(concatenate_frames(arrived) if arrived else FrameBlock.empty())
        if out is not None and len(out):
            asked += 1
            at = max([ms + 4, 404, *(before + spread_ms for before, _ in due)])
            due.append((at, said(at, "6212340014")))
        talk.check()
    assert asked > 40  # once in 50 ms, from when it is awake


def answered_by(answers, every_ms=5):
    """Return the response to a request, when it came in ms, and how often it was sent; a unit answers in 2 ms."""
    client, due, sent = UdsClient(POLLED), [], []
    client.ask(read(0xF190), 0)
    for ms in range(0, 20_000, every_ms):
        arrived = [one for at, one in due if at <= ms]
        due = [(at, one) for at, one in due if at > ms]
        out, response = client.step(ms * MS, concatenate_frames(arrived) if arrived else FrameBlock.empty())
        if response is not None:
            return response, ms, sent
        if out is not None:
            sent.append(bytes(out.data[0]))
            due.append((ms + 2, said(ms + 2, answers[min(len(sent), len(answers)) - 1])))
    raise AssertionError


@pytest.mark.parametrize("busy", [1, 3, 10])
def test_a_busy_unit_is_asked_again(busy):
    response, ms, sent = answered_by(["7f2221"] * busy + ["62f19041"])
    assert response.positive
    assert sent == [bytes.fromhex("0322f190cccccccc")] * (busy + 1)
    assert 100 * busy <= ms <= 115 * busy + 10


def test_a_unit_that_stays_busy_has_refused_in_bounded_time():
    response, ms, sent = answered_by(["7f2221"])
    assert response.code_name == "BusyRepeatRequest"
    assert (len(sent), ms < 1300) == (11, True)


def test_another_refusal_is_not_repeated():
    response, _, sent = answered_by(["7f2222", "62f19041"])
    assert (response.code_name, len(sent)) == ("ConditionsNotCorrect", 1)
