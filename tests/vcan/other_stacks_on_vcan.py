"""Beside a vcan0: other people's UDS stacks at either end of ours; prints what was read as a line of JSON.

`python other_stacks_on_vcan.py BENCH FOLDER`. can-isotp in user space is client and server; the kernel's ISO-TP is a
client where this kernel has it.
"""

from __future__ import annotations

import json
import socket
import subprocess
import sys
import threading
from pathlib import Path

import can
import isotp
from udsoncan import AsciiCodec, Request, Response
from udsoncan.client import Client
from udsoncan.connections import IsoTPSocketConnection, PythonIsoTpConnection

from etb_hil.base.clock import WallClock
from etb_hil.bench.bench_file import load_bench
from etb_hil.canio.bus.link import open_link
from etb_hil.uds import conversation
from etb_hil.uds.client import UdsClient
from etb_hil.uds.keys import key_of

TEXTS = {0xF18C: "ETB-0042-AB-12345", 0xF187: "a part number that is too long for one frame", 0xF195: "1.4.2"}


def config(uds):
    return {
        "request_timeout": 8.0,
        "p2_timeout": 4.0,  # the guest is slow
        "p2_star_timeout": 6.0,
        "use_server_timing": False,
        "data_identifiers": {0xF18C: AsciiCodec(len(TEXTS[0xF18C]))},
        "security_algo": lambda level, seed, **_: key_of(uds.security.key, seed, level),
        "standard_version": 2013,
    }


def asked(connection, uds):
    """Ask our controller by udsoncan's client."""
    with Client(connection, config=config(uds)) as client:
        serial = client.read_data_by_identifier(0xF18C).service_data.values[0xF18C]
        client.change_session(3)
        client.unlock_security_access(uds.security.level)
        client.tester_present()
        client.clear_dtc(0xFFFFFF)
        codes = client.get_dtc_by_status_mask(0x09).service_data.dtcs
        return {"serial": serial, "codes": [hex(code.id) for code in codes]}


def address(uds, *, is_server=False):
    ends = (uds.response, uds.request) if is_server else (uds.request, uds.response)
    return isotp.Address(isotp.AddressingMode.Normal_11bits, txid=ends[0], rxid=ends[1])


class Server(threading.Thread):
    """Answers data identifiers and trouble codes with can-isotp's stack and udsoncan's messages."""

    def __init__(self, bus, uds):
        super().__init__(daemon=True)
        self._stack = isotp.CanStack(bus, address=address(uds, is_server=True), params={"blocksize": 4, "stmin": 1})
        self.ends = threading.Event()

    def run(self):
        self._stack.start()
        while not self.ends.is_set():
            payload = self._stack.recv(block=True, timeout=0.2)
            if payload is None:
                continue
            request = Request.from_payload(bytes(payload))
            if request.service.request_id() == 0x22:
                data = request.data + TEXTS[int.from_bytes(request.data, "big")].encode()
            else:
                data = bytes([request.subfunction, 0xFF]) + bytes.fromhex("2119002f")
            self._stack.send(Response(request.service, Response.Code.PositiveResponse, data).get_payload())
        self._stack.stop()


def ask_another_server(setup):
    """Read identity and codes of their server by our client."""
    clock, uds = WallClock(), setup.bench.uds
    timing = uds.timing.model_copy(update={"transport": 4.0})
    client = UdsClient(uds.model_copy(update={"timing": timing}))
    link = open_link(setup.bench.bus, clock)

    def ask(request):
        client.ask(request, clock.now_ns())
        while True:
            out, response = client.step(clock.now_ns(), link.receive())
            if out is not None:
                link.send(out)
            if response is not None:
                return response
            clock.sleep_until_ns(clock.now_ns() + 1_000_000)

    try:
        identity = conversation.hold(conversation.read_identity(uds, {}), ask)
        codes = conversation.hold(conversation.read_codes(uds), ask)
    finally:
        link.close()
    return {"identity": [one.value for one in identity], "codes": [code.code for code in codes]}


def kernel_reason():
    """Return why the kernel's ISO-TP cannot be used, or an empty text."""
    try:
        with socket.socket(socket.AF_CAN, socket.SOCK_DGRAM, socket.CAN_ISOTP) as there:
            there.bind(("vcan0", 0x7E8, 0x7E0))
    except (AttributeError, OSError) as error:
        return f"this kernel has no ISO-TP: {error}"
    return ""


def main(bench, folder):
    setup = load_bench(Path(bench))
    uds, channel = setup.bench.uds, setup.bench.bus.channel
    found = {"kernel_reason": kernel_reason()}
    words = [sys.executable, "-m", "etb_hil", "controller", "--bench", bench, "--serial", TEXTS[0xF18C]]
    with subprocess.Popen([*words, "--log", f"{folder}/controller.jsonl"], stdout=subprocess.PIPE, text=True) as ours:
        ours.stdout.readline()
        with can.Bus(interface="socketcan", channel=channel) as bus:
            found["client"] = asked(PythonIsoTpConnection(isotp.CanStack(bus, address=address(uds))), uds)
        if not found["kernel_reason"]:
            found["kernel"] = asked(IsoTPSocketConnection(channel, address(uds)), uds)
        ours.terminate()
    with can.Bus(interface="socketcan", channel=channel) as bus:
        server = Server(bus, uds)
        server.start()
        found["server"] = ask_another_server(setup)
        server.ends.set()
        server.join(5)
    print(json.dumps(found))


if __name__ == "__main__":
    main(*sys.argv[1:])
