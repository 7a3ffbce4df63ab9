"""What fails behind the page is told on it, no task of the page ends by it, and STOP works meanwhile."""

import asyncio
import os
import shutil
import signal
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import pytest
from served import short_folder, until
from test_page_lets_nobody_in import take, told

from etb_hil.page.channel import Channel, new_sender
from etb_hil.page.explaining import Explaining
from etb_hil.page.live import Live
from etb_hil.page.past import Past
from etb_hil.report.panel_feed import PanelFeed
from etb_hil.store.address import StoreAddress

ORDER = {"serial": "OK-1", "unit": "", "scenario": ""}


@pytest.fixture
def channel(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(short_folder(tmp_path)))
    return Channel.between(tmp_path, "bench")


@pytest.fixture
def live_with(channel, tmp_path):
    """Return what opens a bench of a page."""
    with ExitStack() as opened:

        def live_with(survey=dict):
            live = Live(channel, Past(tmp_path, StoreAddress(tmp_path / "x.sqlite"), "bench"), {}, [], survey)
            live.open()
            opened.callback(live.close)
            return live

        yield live_with


async def came_to(condition):
    for _ in range(2400):
        if condition():
            return
        await asyncio.sleep(0.05)
    raise AssertionError("it never came to this")


async def watched(live, condition):
    """Watch until a condition holds; return whether the watching goes on."""
    task = asyncio.create_task(live.watch())
    await came_to(lambda: condition() or task.done())
    goes_on = not task.done()
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)
    return goes_on


def test_a_state_that_cannot_be_written_and_a_survey_that_fails_end_no_watching(channel, live_with):
    def survey():
        raise RuntimeError("no such thing")

    live = live_with(survey)
    (channel.folder / "run.json").mkdir()
    live.status = "running"  # of a process that died just now
    assert asyncio.run(watched(live, lambda: "survey" in live.about()["troubles"]))
    assert (live.status, live.outcome["headline"]) == ("done", "BENCH FAULT")
    troubles = live.about()["troubles"]
    assert "run.json" in troubles["keep"]
    assert troubles["survey"] == "RuntimeError: no such thing"


def test_what_is_no_message_of_a_run_is_dropped(channel, live_with):
    live = live_with()
    live.status = "running"
    sender = new_sender()
    for junk in (5, [1], {"snapshot": None}, None):
        assert channel.send(channel.page_socket, junk, sender)
    sender.close()
    assert asyncio.run(watched(live, lambda: live.status == "done"))
    assert live.about()["troubles"] == {}


def test_a_run_that_cannot_be_started_is_told(channel, live_with):
    live = live_with()
    (channel.folder / "run.log").mkdir()
    assert live.start(ORDER, "A")
    assert (live.status, live.outcome["headline"]) == ("done", "REFUSED")
    assert "run.log: Is a directory" in live.outcome["reason"]
    assert not channel.is_busy()


FULL = """
import resource, sys
from pathlib import Path
from etb_hil.page.channel import Channel
channel = Channel(Path(sys.argv[1]))
resource.setrlimit(resource.RLIMIT_FSIZE, (0, resource.RLIM_INFINITY))
try:
    channel.start([])
except OSError as error:
    raise SystemExit(f"refused: {error.strerror}, {channel.is_busy()}")
"""


def test_no_run_starts_whose_process_stop_would_not_find(channel):
    done = subprocess.run(
        [sys.executable, "-c", FULL, str(channel.folder)], capture_output=True, text=True, check=False, timeout=60
    )
    assert done.stderr.strip() == "refused: File too large, False"


def test_stop_reaches_a_run_whose_folder_is_gone(channel, live_with):
    live = live_with()
    with subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"]) as run:
        live.status, live.run = "running", {"process": run.pid}
        shutil.rmtree(channel.folder)
        assert live.stop(in_order=True)
        assert run.wait(60) == -signal.SIGUSR1


@pytest.mark.parametrize(
    ("script", "status", "said"),
    [
        ("print('x' * 200_000)\nprint('\"at work\"')", "done", "at work"),
        ("raise SystemExit(2)", "failed", "it ended without an answer"),
    ],
)
def test_an_explanation_ends_whatever_it_prints(tmp_path, monkeypatch, script, status, said):
    nice = tmp_path / "bin" / "nice"
    nice.parent.mkdir()
    nice.write_text(f"#!{sys.executable}\n{script}\n")
    nice.chmod(0o755)
    monkeypatch.setenv("PATH", f"{nice.parent}:{os.environ['PATH']}")
    explaining = Explaining(lambda: None)

    async def explained():
        assert explaining.start(tmp_path)
        await came_to(lambda: explaining.status != "running")

    asyncio.run(explained())
    assert (explaining.status, explaining.said) == (status, said)


def test_an_explanation_that_is_ended_before_its_process_is_there_ends(tmp_path, monkeypatch):
    nice = tmp_path / "bin" / "nice"
    nice.parent.mkdir()
    nice.write_text("#!/bin/sh\nexec sleep 600\n")
    nice.chmod(0o755)
    monkeypatch.setenv("PATH", f"{nice.parent}:{os.environ['PATH']}")
    explaining = Explaining(lambda: None)

    async def explained():
        assert explaining.start(tmp_path)
        assert explaining.stop()
        await came_to(lambda: explaining.status != "running")

    asyncio.run(explained())
    assert explaining.status == "failed"


def test_a_photo_that_cannot_be_saved_is_told(page):
    cookie = take(page)
    assert page.ask("POST", "/api/start", {"serial": "TE-1"}, cookie)[0] == 200
    until(lambda: told(page, cookie, "news")["prompt"])
    asked = told(page, cookie, "news")["prompt"]
    page.ask("POST", "/api/answer", {"number": asked["number"], "answer": asked["answers"][0], "entry": "1"}, cookie)
    until(lambda: (told(page, cookie, "news")["prompt"] or {}).get("entry") == "photo")
    number = told(page, cookie, "news")["prompt"]["number"]
    (photo,) = [one.parent / "photo.jpg" for one in short_folder(page.folder).rglob("run.lock")]
    photo.mkdir()
    status, body = page.send(f"/api/photo/{number}", b"\xff\xd8\xff\xe0" + b"0" * 100 + b"\xff\xd9", cookie)
    photo.rmdir()
    assert status == 503
    assert body["why"] == "page_failed"
    assert "photo.jpg" in body["said"]
    assert page.ask("POST", "/api/stop", {}, cookie)[0] == 200
    until(lambda: told(page, cookie)["status"] == "done")
    page.ask("POST", "/api/release", {}, cookie)


def test_a_panel_that_cannot_start_leaves_no_file_open(monkeypatch):
    monkeypatch.setattr(sys, "executable", "/no/such/python")
    files = Path("/proc/self/fd")
    before = len(list(files.iterdir()))
    with PanelFeed() as feed:
        assert len(list(files.iterdir())) == before
    assert feed.close() == ""
