"""A page that is served as its users serve it, a station with three parts, and a real browser before it."""

import http.client
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

from selenium import webdriver

from etb_hil.base.stock import find

CHROMIUM, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")
_FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
    "--lang=en",
)
ZERO = "- {id: zero, kind: current_zero, duration: 0.3 s}\n"
WARM = "{role: throttle_angle, rises_above: 80 deg, for: 5 ms, otherwise: stop}"
ASKS = '- {id: plug, kind: prompt, text: "Is the plug in?", answers: [done, stop]}\n' + ZERO
TELLS = (
    '- {id: lot, kind: prompt, text: "Which lot?", entry: text, timeout: 60 s}\n'
    '- {id: look, kind: prompt, text: "Photo of the plug", entry: photo, timeout: 60 s}\n' + ZERO
)
NEVER = ZERO + f"- {{id: wait, kind: wait, timeout: 0.3 s, until: {WARM}}}\n"


class Served:
    """An `etb-hil page` of its own, in a folder of its own; `options` as on the command line."""

    def __init__(self, folder, *options):
        self.folder = folder
        self.options = options
        self.start()

    def start(self):
        environment = {**os.environ, "TMPDIR": str(short_folder(self.folder)), "OMP_NUM_THREADS": "1"}
        command = [sys.executable, "-m", "etb_hil", "page", "--port", "0", "--out", "sessions", *self.options]
        self.errors = (self.folder / "errors").open("w")
        self.process = subprocess.Popen(
            command, cwd=self.folder, env=environment, stdout=subprocess.PIPE, stderr=self.errors, text=True
        )
        self.address = self.process.stdout.readline().strip()
        assert self.address.startswith("http"), (self.folder / "errors").read_text()
        self.port = int(self.address.rstrip("/").rpartition(":")[2])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.end()

    def end(self, how=signal.SIGTERM):
        self.process.send_signal(how)
        self.process.wait(120)
        self.process.stdout.close()
        self.errors.close()

    def ask(self, method, path, order=None, cookie=None, **headers):
        """Return (status, headers, body) of a request as a browser on the page's own address sends it."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=120)
        own = {"Host": f"127.0.0.1:{self.port}"}
        if method == "POST":
            own["Origin"] = f"http://127.0.0.1:{self.port}"
        if cookie:
            own["Cookie"] = cookie
        own |= {name.replace("_", "-"): value for name, value in headers.items()}
        connection.request(
            method, path, None if order is None else json.dumps(order), {k: v for k, v in own.items() if v}
        )
        answer = connection.getresponse()
        body = answer.read().decode()
        connection.close()
        return answer.status, answer.headers, body

    def send(self, path, content, cookie):
        """Return (status, answer) of bytes that are posted, as a browser posts a photo."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=120)
        own = {"Host": f"127.0.0.1:{self.port}", "Origin": f"http://127.0.0.1:{self.port}", "Cookie": cookie}
        connection.request("POST", path, content, own)
        answer = connection.getresponse()
        body = json.loads(answer.read())
        connection.close()
        return answer.status, body

    def visit(self):
        """Return the cookie of a new visitor."""
        return self.ask("GET", "/")[1]["Set-Cookie"].split(";")[0]


def short_folder(folder):
    """Return a folder whose name is short enough for sockets."""
    place = Path("/tmp") / f"etb{os.getpid()}_{abs(hash(str(folder))) % 10**8}"
    place.mkdir(exist_ok=True)
    return place


def station(folder):
    """Write a station whose parts pass or fail (OK-), let the bench fail (BF-) and ask (AS-); return its file."""
    limits = find("limits", "default").read_text("utf-8")
    parts = []
    scenarios = (("default-throttle", "OK", None), ("never", "BF", NEVER), ("asks", "AS", ASKS), ("tells", "TE", TELLS))
    for number, prefix, phases in scenarios:
        (folder / f"{number}.limits.yaml").write_text(limits.replace("default-throttle", number))
        if phases is not None:
            text = f"schema: etb_hil/scenario/1\nname: {number}\nphases:\n{phases}"
            (folder / f"{number}.scenario.yaml").write_text(text)
        scenario = "friction_check" if phases is None else f"{number}.scenario.yaml"
        parts.append(
            f"  - {{number: {number}, revision: '1', approver: A, serial: '{prefix}-[0-9]+', limits: "
            f"{number}.limits.yaml, model: default, scenario: {scenario}}}\n"
        )
    path = folder / "line.station.yaml"
    path.write_text(
        "schema: etb_hil/station/1\nname: Throttle line 2\nbench: virtual_classic\nparts:\n" + "".join(parts)
    )
    return path


STRANGE = "<img src=x onerror=document.title=1>"  # a name that becomes a script where a page takes it for HTML


def strange_station(folder):
    """Write a station like `station`, whose unit answers UDS, and whose names would be scripts; return its file."""
    path = station(folder)
    bench = find("bench", "virtual_uds").read_text("utf-8").replace("Virtual bench with UDS", STRANGE)
    (folder / "strange.bench.yaml").write_text(bench)
    asks = folder / "asks.scenario.yaml"
    asks.write_text(asks.read_text().replace("name: asks", f"name: {STRANGE!r}").replace("Is the plug in?", STRANGE))
    text = path.read_text().replace("virtual_classic", "strange.bench.yaml").replace("Throttle line 2", STRANGE)
    path.write_text(text.replace("'OK-[0-9]+'", "'OK.*'").replace("'AS-[0-9]+'", "'AS.*'"))
    return path


def open_browser(profile, size=(1920, 1080), *flags):
    """Return a headless Chromium of this size."""
    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM
    for flag in (*_FLAGS, f"--user-data-dir={profile}", *flags):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options, webdriver.ChromeService(DRIVER))
    driver.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride",
        {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": size[0] < 500},
    )
    return driver


SIZES = ((1920, 1080), (1280, 800), (390, 844))


def resize(driver, size):
    """Give the page of a browser this size."""
    driver.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride",
        {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": False},
    )


def clipped(driver):
    """Return the sections whose contents are wider than they are."""
    return driver.execute_script(
        "return [...document.querySelectorAll('section')].filter((one) => one.scrollWidth > one.clientWidth)"
        ".map((one) => `${one.id || one.innerText.slice(0, 40)}: ${one.scrollWidth} > ${one.clientWidth}`)"
    )


def keep_pictures(driver, name, element=None):
    """Keep what a browser shows at each size, from an element on, where ETB_HIL_SCREENSHOTS names a folder."""
    if folder := os.environ.get("ETB_HIL_SCREENSHOTS"):
        for size in SIZES:
            resize(driver, size)
            if element is not None:
                driver.execute_script("arguments[0].scrollIntoView()", element)
            driver.execute_script("return new Promise((done) => setTimeout(done, 150))")
            driver.save_screenshot(str(Path(folder) / f"{name}_{size[0]}.png"))
        resize(driver, SIZES[0])


PATIENCE_S = 600.0  # nothing here takes as long: what waits longer hangs, however busy the machine is


def until(condition):
    """Wait until a condition holds, and return what it gave."""
    end = time.monotonic() + PATIENCE_S
    while not (found := condition()):
        assert time.monotonic() < end, "it never came to this"
        time.sleep(0.05)
    return found
