"""A virtual controller with UDS on a bus, and other people's implementations at its other end."""

from collections import deque

import isotp
import numpy as np
from faults_nodes import Rewriting
from udsoncan.connections import BaseConnection
from udsoncan.exceptions import TimeoutException

from etb_hil.base.stock import find
from etb_hil.bench import job as job_room
from etb_hil.bench.bench_file import load_bench
from etb_hil.bench.job import execute, prepare
from etb_hil.canio.bus.link import VirtualLink
from etb_hil.canio.bus.virtual_network import VirtualNetwork
from etb_hil.canio.frames import classic_frames
from etb_hil.controller.virtual_controller import VirtualController
from etb_hil.plant.parameters import load_model
from etb_hil.uds.client import UdsClient

MS = 1_000_000
SETUP = load_bench(find("bench", "virtual_uds"))
UDS = SETUP.bench.uds
LEARN = UDS.routines["learn_stops"]


def frames_of(ident, payloads):
    """Return classic frames that go out now."""
    return classic_frames(0, ident, payloads)


def faulty_run(monkeypatch, chosen, folder, faults=(), *, node=None, change=None, **options):
    """Run a job whose virtual controller has faults of its diagnostics, with another node on the bus.

    `change` (see `Rewriting`): what the controller's cyclic frames say instead.
    """

    def connect(job, seed):
        bench = job.setup.bench
        network = VirtualNetwork(int(bench.bus.bitrate))
        controller = VirtualController(
            job.unit, job.setup.dialect, seed, nominal=job.model, uds=bench.uds, uds_faults=faults, **options
        )
        said = controller
        if change is not None:
            said = Rewriting(controller, job.setup.dialect, 0, 1 << 62, change)
        network.attach(said, controller.sends)
        if node is not None:
            network.attach(node, answers=False)
        return VirtualLink(network), network.clock

    monkeypatch.setattr(job_room, "connect", connect)
    return execute(prepare(chosen), folder / "sessions", "ETB-0042", 3)


class OtherEnd:
    """can-isotp's own protocol logic on a link of ours, stepped by whoever owns the time."""

    def __init__(self, link, sends, hears):
        self._link, self._sends, self._hears = link, sends, hears
        self._waiting = deque()
        address = isotp.Address(isotp.AddressingMode.Normal_11bits, txid=sends, rxid=hears)
        self.errors = []
        self.logic = isotp.TransportLayerLogic(
            lambda: self._waiting.popleft() if self._waiting else None,
            lambda message: link.send(frames_of(sends, [message.data])),
            address,
            error_handler=self.errors.append,
            params={"blocksize": 4, "stmin": 0, "tx_padding": 0xAA},
        )

    def step(self):
        frames = self._link.receive()
        for row in np.flatnonzero(frames.ident == self._hears):
            data = frames.data[row, : frames.length[row]].tobytes()
            self._waiting.append(isotp.CanMessage(arbitration_id=self._hears, data=data))
        self.logic.process()


class Connection(BaseConnection):
    """What `udsoncan.Client` talks through: can-isotp over the virtual bus, in virtual time."""

    def __init__(self, network):
        super().__init__()
        self._network = network
        self._end = OtherEnd(VirtualLink(network), UDS.request, UDS.response)
        self._is_open = False

    def open(self):
        self._is_open = True
        return self

    def close(self):
        self._is_open = False

    def is_open(self):
        return self._is_open

    def empty_rxqueue(self):
        while self._end.logic.available():
            self._end.logic.recv()

    def specific_send(self, payload, timeout=None):  # noqa: ARG002 (the base class has it)
        self._end.logic.send(payload)
        self._end.step()

    def specific_wait_frame(self, timeout=2.0):
        deadline = self._network.now_ns() + round(timeout * 1e9)
        while self._network.now_ns() < deadline:
            self._end.step()
            if self._end.logic.available():
                return bytes(self._end.logic.recv())
            self._network.sleep_until_ns(self._network.now_ns() + MS)
        raise TimeoutException("no frame in virtual time")


class Bench:
    """A network with the virtual controller on it; `ask` holds our client's conversations."""

    def __init__(self, unit="default", *, controller=True, settings=UDS, **options):
        self.network = VirtualNetwork(1_000_000)
        self.settings = settings
        if controller:
            model = load_model(find("model", unit))
            nominal = load_model(find("model", "default"))
            self.controller = VirtualController(model, SETUP.dialect, 1, nominal=nominal, uds=settings, **options)
            self.network.attach(self.controller, self.controller.sends)
        self.link = VirtualLink(self.network)
        self.client = UdsClient(settings)
        self.others = []

    def wait(self, seconds):
        self.network.sleep_until_ns(self.network.now_ns() + round(seconds * 1e9))

    def ask(self, request):
        """Ask as a bench does, every 10 ms."""
        self.client.ask(request, self.network.now_ns())
        while True:
            out, response = self.client.step(self.network.now_ns(), self.link.receive())
            if out is not None:
                self.link.send(out)
            if response is not None:
                return response
            for _ in range(10):
                self.wait(1e-3)
                for step in self.others:
                    step()
