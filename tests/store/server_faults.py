"""Two benches that store 100 runs each, and what may happen to their server meanwhile."""

import json
import socket
import subprocess
import sys
import threading
from contextlib import suppress

RUNS = 100  # of a bench
_BENCH = f"""
import json, sys, time
from pathlib import Path
from made_up_runs import result, session
from etb_hil.store.address import store_address
from etb_hil.store.queue import Queue
queue, took, waited = Queue(Path(sys.argv[1])), [], 0
for number in range({RUNS}):
    queue.add(result(number, sys.argv[2]), session(queue.sessions))
    began = time.perf_counter()
    waited += queue.deliver(store_address(sys.argv[3])).waiting > 0
    took.append(time.perf_counter() - began)
    time.sleep(0.02)
print(json.dumps({{"slowest_s": max(took), "waited": waited}}))
"""


def two_benches(folders, address):
    """Start a bench for each of two folders of sessions."""
    return [
        subprocess.Popen(
            [sys.executable, "-c", _BENCH, str(folder), folder.name, str(address)],
            env={"PYTHONPATH": ":".join(sys.path)}, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )
        for folder in folders
    ]  # fmt: skip


def ended(benches):
    """Return what each bench says at its end: the slowest delivery, and after how many runs some waited."""
    said = [bench.communicate(timeout=300) for bench in benches]
    assert [error for _, error in said] == ["", ""]
    return [json.loads(text) for text, _ in said]


class Proxy:
    """Passes the bytes of clients on to a server; cuts each client off after so many as `limits` has for it."""

    def __init__(self, port, limits):
        self._server = ("127.0.0.1", port)
        self._door = socket.create_server(("127.0.0.1", 0))
        self.port = self._door.getsockname()[1]
        threading.Thread(target=self._accept, args=(iter(limits),), daemon=True).start()

    def _accept(self, limits):
        for most in limits:
            client, _ = self._door.accept()
            threading.Thread(target=self._work, args=(client, most), daemon=True).start()
        self._door.close()

    def _work(self, client, left):
        with suppress(OSError), client, socket.create_connection(self._server) as server:
            threading.Thread(target=self._back, args=(server, client), daemon=True).start()
            while left > 0 and (some := client.recv(min(left, 4096))):
                server.sendall(some)
                left -= len(some)
            for end in (client, server):
                end.shutdown(socket.SHUT_RDWR)

    @staticmethod
    def _back(server, client):
        with suppress(OSError):
            while some := server.recv(4096):
                client.sendall(some)


def fill(path):
    """Fill a file system."""
    with suppress(OSError), path.open("wb", buffering=0) as file:
        while file.write(b"x" * 65536):
            pass
