"""The virtual controller's services, asked by udsoncan's own client over can-isotp."""

import pytest
from uds_bench import LEARN, UDS, Bench, Connection, frames_of
from udsoncan import AsciiCodec
from udsoncan.client import Client
from udsoncan.exceptions import NegativeResponseException

from etb_hil.plant.integrator import THETA
from etb_hil.uds.keys import key_of
from etb_hil.uds.settings import DataValue

CONFIG = {
    "request_timeout": None,  # time is virtual: the connection counts it
    "p2_timeout": 0.2,
    "p2_star_timeout": 5.5,
    "data_identifiers": {identifier: AsciiCodec(17) for identifier in UDS.identification.values()},
    "security_algo": lambda level, seed, **_: key_of("example", seed, level),
    "use_server_timing": False,
    "standard_version": 2013,
}
SERIAL = "ETB-0042-AB-12345"  # more than a single frame holds


@pytest.fixture
def bench():
    return Bench(identity={"serial": SERIAL})


@pytest.fixture
def client(bench):
    with Client(Connection(bench.network), config=CONFIG) as client:
        yield client


def refusal(call, *parts, **named):
    with pytest.raises(NegativeResponseException) as caught:
        call(*parts, **named)
    return caught.value.response.code_name


def test_a_serial_number_comes_in_several_frames(client):
    found = client.read_data_by_identifier_first(UDS.identification["serial"])
    assert found == SERIAL


def test_what_is_not_known_is_refused(client):
    client.set_config("data_identifiers", {0x1234: AsciiCodec(3)})
    assert refusal(client.read_data_by_identifier, 0x1234) == "RequestOutOfRange"
    assert refusal(client.ecu_reset, 1) == "ServiceNotSupported"
    assert refusal(client.change_session, 2) == "SubFunctionNotSupported"
    assert refusal(client.clear_dtc, 0x123456) == "RequestOutOfRange"


def test_a_routine_wants_session_and_key(client, bench):
    assert refusal(client.start_routine, LEARN.id) == "ServiceNotSupportedInActiveSession"
    client.change_session(3)
    assert refusal(client.start_routine, LEARN.id) == "SecurityAccessDenied"
    client.unlock_security_access(1)
    assert client.start_routine(LEARN.id).positive
    assert refusal(client.start_routine, LEARN.id) == "ConditionsNotCorrect"
    for _ in range(100):
        status = client.get_routine_result(LEARN.id).service_data.routine_status_record[0]
        if status != 1:
            break
        client.tester_present()
        bench.wait(0.1)
    assert status == 0
    assert not bench.controller.driving
    assert bench.controller.plant_state[THETA] == pytest.approx(0.14, abs=0.02)  # let go at limp-home


def test_a_wrong_key_locks_it(client):
    client.change_session(3)
    client.set_config("security_algo", lambda **_: bytes(4))
    names = [refusal(client.unlock_security_access, 1) for _ in range(3)]
    assert names == ["InvalidKey", "InvalidKey", "ExceedNumberOfAttempts"]
    assert refusal(client.unlock_security_access, 1) == "RequiredTimeDelayNotExpired"


def test_a_session_without_a_tester_ends(client, bench):
    client.change_session(3)
    bench.wait(4.9)
    with client.suppress_positive_response:
        client.tester_present()
    bench.wait(4.9)
    assert client.request_seed(1).positive
    bench.wait(5.1)
    assert refusal(client.request_seed, 1) == "ServiceNotSupportedInActiveSession"


def test_clearing_takes_longer_than_p2_and_says_so(client, bench):
    begun = bench.network.now_ns()
    assert client.clear_dtc(0xFFFFFF).positive
    assert bench.network.now_ns() - begun > UDS.timing.p2 * 1e9


def test_codes_are_counted_and_listed(client):
    assert client.get_number_of_dtc_by_status_mask(0x01).service_data.dtc_count == 0
    assert len(client.get_supported_dtc().service_data.dtcs) == 7
    assert client.get_dtc_by_status_mask(0x09).service_data.dtcs == []


def test_how_time_is_cut_changes_nothing():
    heard = []
    for step in (10_000_000, 370_000):
        bench = Bench(identity={"serial": SERIAL})
        sent, frames = [bytes.fromhex("0322f18c"), bytes.fromhex("300002")], []
        for now in range(0, 100_000_000, step):
            if sent and now >= (0 if len(sent) == 2 else 40_000_000):
                bench.link.send(frames_of(UDS.request, [sent.pop(0)]))
            bench.network.sleep_until_ns(now + step)
            frames.append(bench.link.receive())
        heard.append([bytes(f.data[k]) for f in frames for k in range(len(f)) if f.ident[k] == UDS.response])
    assert heard[0] == heard[1]
    assert len(heard[0]) == 3


def asked(bench, *payloads):
    """Return what the unit answers to single frames, one after another."""
    answers = []
    for payload in payloads:
        request = bytes.fromhex(payload)
        bench.link.send(frames_of(UDS.request, [bytes([len(request)]) + request]))
        bench.wait(0.03)
        frames = bench.link.receive()
        heard = [bytes(frames.data[k]) for k in range(len(frames)) if frames.ident[k] == UDS.response]
        answers.append([one[1 : 1 + one[0]].hex() for one in heard])
    return answers


def test_codes_are_listed_for_requests_of_the_right_length_alone(bench):
    """ISO 14229-1: NRC 0x13 for bytes too many or too few, and no positive response where its bit is set."""
    assert asked(bench, "190affff", "190a01", "1902", "19020101", "190101ff") == [["7f1913"]] * 5
    assert asked(bench, "198201", "198101", "190200") == [[], [], ["59027f"]]
    assert asked(bench, "1982", "19b0") == [["7f1913"], ["7f1912"]]


def test_security_access_and_routines_are_silent_where_they_are_asked_to_be(bench):
    assert asked(bench, "1083", "2781") == [[], []]
    routine = f"{LEARN.id:04x}"
    assert asked(bench, f"3181{routine}") == [["7f3133"]]
    ((seed,),) = asked(bench, "2701")
    key = key_of("example", bytes.fromhex(seed[4:]), 1).hex()
    assert asked(bench, f"2782{key}", f"3183{routine}", f"3181{routine}") == [[], ["7f3124"], []]
    ((running,),) = asked(bench, f"3103{routine}")
    assert running == f"7103{routine}01"


@pytest.mark.parametrize("stop", ["2a04", "2a0404"])
def test_periodic_values_stop_with_and_without_identifiers(stop):
    settings = UDS.model_copy(
        update={
            "periodic": 0x7E9,
            "data": {"temperature": DataValue(id=0xF204, unit="degC", read="fast", every="10 ms")},
        }
    )
    bench = Bench(settings=settings)

    def values():
        bench.wait(0.1)
        return int((bench.link.receive().ident == 0x7E9).sum())

    assert asked(bench, "1003", "2a0304")[1] == ["6a"]
    assert values() > 5
    assert asked(bench, stop) == [["6a"]]
    values()
    assert values() == 0
    assert asked(bench, "2a03", "2a", "2a0405") == [["7f2a13"], ["7f2a13"], ["7f2a31"]]
