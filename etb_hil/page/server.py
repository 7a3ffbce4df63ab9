"""Serves the operator page of one bench."""

from __future__ import annotations

import fcntl
import json
import os
import socket
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import uvicorn

from etb_hil.base.errors import InputError, Problem
from etb_hil.base.own_process import command_of
from etb_hil.page.app import Page
from etb_hil.page.channel import Channel
from etb_hil.page.guard import known_names
from etb_hil.page.live import Live
from etb_hil.page.password import Password
from etb_hil.page.past import Past
from etb_hil.page.session_files import SessionFiles
from etb_hil.store.address import store_address


@dataclass(frozen=True, slots=True)
class Settings:
    """What a page serves.

    `base` are the options of every run, `host` is None for this machine alone.

    `sessions` is the folder of sessions, `replays` that of the results of many logs.
    """

    bench: str | None
    station: Path | None
    sessions: Path
    replays: Path
    base: list[str]
    host: str | None
    port: int
    password: Password | None


def serve(settings: Settings) -> None:
    """Serve the page until the process is interrupted.

    InputError where the files or the port will not do.
    """
    surveyed = _survey(settings)
    channel = Channel.between(settings.sessions, settings.bench or surveyed["bench"])
    descriptor = os.open(channel.folder / "page.lock", os.O_RDWR | os.O_CREAT, 0o600)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise InputError(
            Problem("a page of this bench and this folder is open already", remedy="use it, or end it first")
        ) from None
    listener = _listener(settings.host or "127.0.0.1", settings.port)
    port = listener.getsockname()[1]
    live = Live(
        channel,
        Past(settings.sessions, store_address(surveyed["store"]), surveyed["bench"], surveyed.get("golden", "")),
        surveyed,
        settings.base,
        lambda: _survey(settings),
    )
    live.open()
    files = SessionFiles(settings.sessions, channel.exports)
    page = Page(live, files, settings.replays, settings.password, f"etb_hil_{port}")
    name = settings.host or "127.0.0.1"
    print(f"http://{f'[{name}]' if ':' in name else name}:{port}/", flush=True)  # noqa: T201 (where the page is)
    config = uvicorn.Config(
        page.app(known_names(settings.host), is_open=settings.host is not None),
        log_level="warning",
        access_log=False,
        server_header=False,
        proxy_headers=False,  # any client can write X-Forwarded-For: limits count the address that it comes from
        ws="websockets-sansio",
        ws_max_size=1024,
        timeout_graceful_shutdown=1,
        timeout_keep_alive=15,
        limit_concurrency=500,
        h11_max_incomplete_event_size=16_384,
    )
    uvicorn.Server(config).run(sockets=[listener])
    live.close()
    if channel.is_busy():
        print("A test is under way; it goes on. The next 'etb-hil page' finds it again.", flush=True)  # noqa: T201


def _survey(settings: Settings) -> dict[str, Any]:
    command = command_of("etb_hil.page.survey", "--sessions", str(settings.sessions))
    command += ["--bench", settings.bench] if settings.bench else []
    command += ["--station", str(settings.station)] if settings.station else []
    done = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603 (our own program)
    said = done.stderr.strip()
    try:
        found: dict[str, Any] = json.loads(done.stdout)
    except ValueError:  # a plug-in ended the process
        why = said.rpartition("\n")[2] or f"exit code {done.returncode}"
        remedy = "correct the bench's files and plug-ins, then repeat"
        raise InputError(Problem(f"the bench cannot be surveyed: {why}", remedy=remedy)) from None
    if said:
        print(said, file=sys.stderr)  # noqa: T201 (what plug-ins print)
    if "wrong" in found:
        raise InputError(found["wrong"])
    return found


def _listener(host: str, port: int) -> socket.socket:
    try:
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
        listener = socket.socket(family, socket.SOCK_STREAM)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((host, port))
        listener.listen(128)  # before the address is told
    except OSError as error:
        raise InputError(
            Problem(f"cannot listen: {error.strerror or error}", value=f"{host}:{port}", remedy="give another --port")
        ) from None
    return listener
