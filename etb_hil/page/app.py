"""The routes of the operator page.

Whoever sees it may look and press STOP; whoever holds the bench operates it.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.responses import FileResponse, JSONResponse, RedirectResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocketDisconnect

from etb_hil.base.errors import InputError
from etb_hil.base.files import write_bytes
from etb_hil.diagnosis.measurement_registry import measurement_kinds
from etb_hil.page.guard import Guard
from etb_hil.page.session_files import BenchInUse
from etb_hil.page.visitors import Rate, Visitor, Visitors
from etb_hil.replays.progress import read_progress
from etb_hil.report.panel_feed import PERIOD_S
from etb_hil.scenario.kinds.prompt import LONGEST_TEXT
from etb_hil.session.photos import LARGEST as LARGEST_PHOTO
from etb_hil.session.photos import is_photo

if TYPE_CHECKING:
    from starlette.requests import HTTPConnection, Request
    from starlette.websockets import WebSocket

    from etb_hil.page.live import Live
    from etb_hil.page.password import Password
    from etb_hil.page.session_files import SessionFiles

HERE = Path(__file__).parent
LARGEST_ORDER = 10_000  # bytes
MOST_PAGES = 200
_REPORT_POLICY = (
    "sandbox allow-scripts allow-downloads; default-src 'none'; style-src 'unsafe-inline'; img-src data:; "
    "script-src 'unsafe-inline'"
)
Handler = Callable[["Request", Visitor, dict[str, Any]], Awaitable[Response]]


class Page:
    """The page of one bench.

    `password` is None on this machine alone, `replays` the results of many logs.
    """

    def __init__(self, live: Live, files: SessionFiles, replays: Path, password: Password | None, cookie: str) -> None:
        self.live = live
        self._files = files
        self._replays = replays
        self._password = password
        self._cookie = cookie
        self._visitors = Visitors()
        self._tries = Rate(5, 60.0)
        self._orders = Rate(20, 10.0)
        self._pages = 0

    def app(self, hosts: frozenset[str], *, is_open: bool) -> Starlette:
        """Return the application, known by `hosts`, and by addresses where `is_open`."""
        return Starlette(
            routes=[
                Route("/", self._document("page.html")),
                Route("/engineer", self._document("engineer.html")),
                Route("/login", self._login_page),
                Route("/api/login", self._login, methods=["POST"]),
                Route("/api/logout", self._order(self._logout), methods=["POST"]),
                Route("/api/hold", self._order(self._hold), methods=["POST"]),
                Route("/api/release", self._order(self._release), methods=["POST"]),
                Route("/api/start", self._order(self._start), methods=["POST"]),
                Route("/api/stop", self._order(self._stop, is_stop=True), methods=["POST"]),
                Route("/api/end", self._order(self._end, is_stop=True), methods=["POST"]),
                Route("/api/answer", self._order(self._answer), methods=["POST"]),
                Route("/api/photo/{number:int}", self._photo, methods=["POST"]),
                Route("/api/history", self._history),
                Route("/api/replays", self._many_logs),
                Route("/api/explain", self._order(self._explain), methods=["POST"]),
                Route("/api/explain/stop", self._order(self._explain_stop), methods=["POST"]),
                Route("/results/{run_id}", self._file(self._files.results)),
                Route("/report/{run_id}", self._file(self._files.report, _REPORT_POLICY)),
                Route("/explanation/{run_id}", self._file(self._files.explanation, _REPORT_POLICY)),
                Route("/download/{run_id}.{kind}", self._download),
                Mount("/static", StaticFiles(directory=HERE / "static")),
                Route("/words/{language}.json", _words),
                WebSocketRoute("/live", self._socket),
            ],
            middleware=[Middleware(Guard, hosts=hosts, is_open=is_open)],
            exception_handlers={InputError: _failed, OSError: _failed, Exception: _failed},
            lifespan=self._lifespan,
        )

    @contextlib.asynccontextmanager
    async def _lifespan(self, _: Starlette) -> AsyncIterator[None]:
        task = asyncio.create_task(self.live.watch())
        yield
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task

    def _visitor(self, connection: HTTPConnection) -> Visitor | None:
        return self._visitors.find(connection.cookies.get(self._cookie))

    def _document(self, name: str) -> Callable[[Request], Awaitable[Response]]:
        """Return a route to a page, which begins a session where no password is needed."""

        async def handler(request: Request) -> Response:
            response = FileResponse(HERE / "static" / name)
            if self._visitor(request) is None:
                if self._password is not None:
                    return RedirectResponse("/login", 303)
                self._remember(response, request)
            return response

        return handler

    async def _login_page(self, _: Request) -> Response:
        return FileResponse(HERE / "static" / "login.html")

    async def _login(self, request: Request) -> Response:
        client = request.client.host if request.client else ""
        if not self._tries.allows(client):
            return _refused(429, "too_many_tries")
        order = await _body(request)
        given = str(order.get("password", ""))[:1000]
        if self._password is None or not await asyncio.to_thread(self._password.fits, given):
            return _refused(401, "wrong_password")
        response = JSONResponse({})
        self._remember(response, request)
        return response

    def _remember(self, response: Response, request: Request) -> None:
        response.set_cookie(
            self._cookie,
            self._visitors.let_in(self.live.holder.visitor).token,
            httponly=True,
            samesite="strict",
            secure=request.url.scheme == "https",
        )

    def _order(self, handle: Handler, *, is_stop: bool = False) -> Callable[[Request], Awaitable[Response]]:
        """Return a route for whoever has a session; a STOP is never one too many."""

        async def handler(request: Request) -> Response:
            visitor = self._visitor(request)
            if visitor is None:
                return _refused(401, "not_logged_in")
            if not is_stop and not self._orders.allows(visitor.token):
                return _refused(429, "too_many")
            return await handle(request, visitor, {} if is_stop else await _body(request))

        return handler

    async def _logout(self, _: Request, visitor: Visitor, __: dict[str, Any]) -> Response:
        self.live.holder.leave(visitor)
        self._visitors.send_away(visitor)
        self.live.changed()
        return JSONResponse({})

    async def _hold(self, _: Request, visitor: Visitor, order: dict[str, Any]) -> Response:
        name = str(order.get("operator", "")).strip()
        if not name or len(name) > 60 or not name.isprintable():
            return _refused(400, "no_name")
        if not self.live.holder.take(visitor, name):
            return _refused(409, "held")
        self.live.changed()
        return JSONResponse({})

    async def _release(self, _: Request, visitor: Visitor, __: dict[str, Any]) -> Response:
        self.live.holder.leave(visitor)
        self.live.changed()
        return JSONResponse({})

    async def _start(self, _: Request, visitor: Visitor, order: dict[str, Any]) -> Response:
        if self.live.holder.visitor is not visitor:
            return _refused(403, "not_holder")
        bench = self.live.bench
        given = {name: order.get(name) for name in ("serial", "scenario", "unit")}
        wanted = {name: text.strip() if isinstance(text, str) else "" for name, text in given.items()}
        if not 0 < len(wanted["serial"]) <= 80 or not wanted["serial"].isprintable():
            return _refused(400, "no_serial")
        if wanted["unit"] and wanted["unit"] not in bench["units"]:
            return _refused(400, "no_unit")
        if wanted["scenario"] and wanted["scenario"] not in {one["name"] for one in bench["scenarios"]}:
            return _refused(400, "no_scenario")
        for _attempt in range(100):  # a run whose verdict is here may take a moment to leave
            if self.live.start(wanted, self.live.holder.name):
                return JSONResponse({})
            if self.live.status != "done":
                break
            await asyncio.sleep(0.1)
        return _refused(409, "busy")

    async def _stop(self, _: Request, __: Visitor, ___: dict[str, Any]) -> Response:
        return JSONResponse({}) if self.live.stop(in_order=False) else _refused(409, "nothing_runs")

    async def _end(self, _: Request, __: Visitor, ___: dict[str, Any]) -> Response:
        return JSONResponse({}) if self.live.stop(in_order=True) else _refused(409, "nothing_runs")

    async def _answer(self, _: Request, visitor: Visitor, order: dict[str, Any]) -> Response:
        if self.live.holder.visitor is not visitor:
            return _refused(403, "not_holder")
        number, answer, entry = order.get("number"), order.get("answer"), order.get("entry", "")
        if not (isinstance(number, int) and isinstance(answer, str) and isinstance(entry, str)):
            return _refused(409, "not_asked")
        is_taken = len(entry) <= LONGEST_TEXT and self.live.answer(number, answer, entry)
        return JSONResponse({}) if is_taken else _refused(409, "not_asked")

    async def _photo(self, request: Request) -> Response:
        """Answer the prompt that asks for a photo with the photo in the request's body."""
        visitor = self._visitor(request)
        if visitor is None or self.live.holder.visitor is not visitor:
            return _refused(401 if visitor is None else 403, "not_logged_in" if visitor is None else "not_holder")
        if not self._orders.allows(visitor.token):
            return _refused(429, "too_many")
        number, prompt = request.path_params["number"], self.live.prompt
        if prompt is None or prompt["number"] != number or prompt["entry"] != "photo":
            return _refused(409, "not_asked")
        content = await _content(request, LARGEST_PHOTO)
        if not is_photo(content):
            return _refused(400, "no_photo")
        photo = self.live.channel.photo
        await asyncio.to_thread(write_bytes, photo, content, "make room, then take the photo again")
        if not self.live.answer(number, prompt["answers"][0], str(photo)):
            return _refused(409, "not_asked")
        return JSONResponse({})

    async def _history(self, request: Request) -> Response:
        if self._visitor(request) is None:
            return _refused(401, "not_logged_in")
        wanted = request.query_params.get("measurement", "")
        past = self.live.past
        measured = await asyncio.to_thread(past.measured)
        values = await asyncio.to_thread(past.history, wanted[:100]) if wanted else []
        return JSONResponse({"measured": measured, "values": values})

    async def _many_logs(self, request: Request) -> Response:
        """Tell how far the judging of many logs has come; null where none began."""
        if self._visitor(request) is None:
            return _refused(401, "not_logged_in")
        try:
            progress = await asyncio.to_thread(read_progress, self._replays)
        except InputError as error:
            return JSONResponse({"wrong": str(error)})
        if progress is None:
            return JSONResponse(None)
        return JSONResponse({**asdict(progress), "ended": progress.ended, "age_s": progress.age_s})

    async def _explain(self, _: Request, visitor: Visitor, order: dict[str, Any]) -> Response:
        if self.live.holder.visitor is not visitor:
            return _refused(403, "not_holder")
        folder = self._files.folder(str(order.get("run_id", "")))
        if folder is None:
            return _refused(404, "no_session")
        if self.live.is_testing:
            return _refused(409, "running_now")
        return JSONResponse({}) if self.live.explaining.start(folder) else _refused(409, "explains_now")

    async def _explain_stop(self, _: Request, visitor: Visitor, __: dict[str, Any]) -> Response:
        if self.live.holder.visitor is not visitor:
            return _refused(403, "not_holder")
        return JSONResponse({}) if self.live.explaining.stop() else _refused(409, "nothing_runs")

    async def _download(self, request: Request) -> Response:
        """Send frames or signals of a run.

        What must be computed for it waits until no test is under way.
        """
        if self._visitor(request) is None:
            return RedirectResponse("/login", 303)
        run_id, kind = request.path_params["run_id"], request.path_params["kind"]
        if kind == "blf":
            path = self._files.raw(run_id)
        else:
            try:
                path = await self._files.exported(run_id, kind, lambda: self.live.is_testing)
            except BenchInUse:
                return _refused(409, "running_now")
        return _refused(404, "no_data") if path is None else FileResponse(path, filename=f"{run_id}.{kind}")

    def _file(self, find: Callable[[str], Path | None], policy: str = "") -> Callable[[Request], Awaitable[Response]]:
        """Return a route to a file of a session, which may do what its `policy` allows."""

        async def handler(request: Request) -> Response:
            if self._visitor(request) is None:
                return RedirectResponse("/login", 303)
            path = find(request.path_params["run_id"])
            if path is None:
                return _refused(404, "no_report")
            return FileResponse(path, headers={"Content-Security-Policy": policy} if policy else None)

        return handler

    async def _socket(self, socket: WebSocket) -> None:
        visitor = self._visitor(socket)
        if visitor is None or self._pages >= MOST_PAGES:
            await socket.close(4401 if visitor is None else 4429)
            return
        await socket.accept()
        event = asyncio.Event()
        self.live.joins(event)
        self._pages += 1
        visitor.pages += 1
        listening = asyncio.create_task(_until_closed(socket))
        try:
            await self._tell(socket, visitor, event, listening)
        except WebSocketDisconnect:
            pass
        finally:
            listening.cancel()
            visitor.pages -= 1
            self._pages -= 1
            self.live.leaves(event)

    async def _tell(
        self, socket: WebSocket, visitor: Visitor, event: asyncio.Event, closed: asyncio.Task[None]
    ) -> None:
        version, number, seen = -1, -1, 0
        while not closed.done():
            if self._visitors.is_over(visitor):
                await socket.close(4401)
                return
            live = self.live
            event.clear()
            message: dict[str, Any] = {}
            if version != live.version:
                version = live.version
                message["about"] = live.about()
                message["you"] = {
                    "holds": live.holder.visitor is visitor,
                    "may_leave": self._password is not None,
                }
            if number != live.number:
                number, seen = live.number, 0
            message["news"], seen = live.news(seen)
            await socket.send_text(json.dumps(message))
            await asyncio.sleep(PERIOD_S)
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(event.wait(), 5.0)


async def _until_closed(socket: WebSocket) -> None:
    """Read what an open page sends, which is nothing, until it is closed."""
    with contextlib.suppress(WebSocketDisconnect, RuntimeError):
        while True:
            await socket.receive_text()


async def _words(request: Request) -> Response:
    """Return the words of a language.

    A measurement without words of its own there has the name of its declaration.
    """
    path = HERE / "words" / f"{request.path_params['language']}.json"
    if path not in (HERE / "words").iterdir():
        return Response(status_code=404)
    declared = {f"measurement {kind.id}": kind.name for kind in measurement_kinds().values()}
    return JSONResponse(declared | json.loads(path.read_text("utf-8")))


async def _body(request: Request) -> dict[str, Any]:
    """Return the order that a request carries; empty where it carries none."""
    try:
        order = json.loads(await _content(request, LARGEST_ORDER) or b"{}")
    except ValueError:
        return {}
    return order if isinstance(order, dict) else {}


async def _content(request: Request, most: int) -> bytes:
    """Return the body of a request; empty where it is longer than so many bytes."""
    content = bytearray()
    async for part in request.stream():
        content += part
        if len(content) > most:
            return b""
    return bytes(content)


async def _failed(_: Request, error: Exception) -> Response:
    """Say on the page what failed there.

    The server's log has the traceback of what nobody foresaw.
    """
    is_stated = isinstance(error, InputError | OSError)
    said = str(error) if is_stated else f"{type(error).__name__}: {error}"
    return JSONResponse({"why": "page_failed", "said": said}, 503 if is_stated else 500)


def _refused(code: int, why: str) -> Response:
    """Return a refusal; the page has the words for `why`."""
    return JSONResponse({"why": why}, code)
