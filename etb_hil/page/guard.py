"""Checks of every request: host, origin, rate and headers.

The right host and origin, not too often, and headers that keep scripts out.
"""

from __future__ import annotations

import ipaddress
import socket
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse

from etb_hil.page.visitors import Rate

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Message, Receive, Scope, Send

POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_HEADERS = {
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}
STOPS = ("/api/stop", "/api/end")


@dataclass(slots=True)
class Guard:
    """Middleware that refuses wrong hosts and origins.

    `hosts` are the names that a browser may have for this page, beside addresses where `is_open`.

    A page of somebody else's that has its name point here (DNS rebinding) comes with that name, and is refused.
    """

    app: ASGIApp
    hosts: frozenset[str]
    is_open: bool
    rate: Rate = field(default_factory=lambda: Rate(400, 10.0))  # a browser that opens 20 pages at once asks for 160

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let a request through, or refuse it."""
        if scope["type"] not in {"http", "websocket"}:
            await self.app(scope, receive, send)
            return
        if refused := self._refusal(scope):
            if scope["type"] == "websocket":
                await send({"type": "websocket.close", "code": 4403, "reason": refused[1]})
            else:
                await PlainTextResponse(refused[1], refused[0])(scope, receive, send)
            return

        async def with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in _HEADERS.items():
                    headers.setdefault(name, value)
            await send(message)

        await self.app(scope, receive, with_headers)

    def _refusal(self, scope: Scope) -> tuple[int, str] | None:
        headers = Headers(scope=scope)
        host = headers.get("host", "")
        name = host.rsplit(":", 1)[0] if not host.endswith("]") else host
        if name.lower() not in self.hosts and not (self.is_open and _is_address(name)):
            return 421, "this page is not known by that name"
        is_reading = scope["type"] == "http" and scope["method"] in {"GET", "HEAD"}
        origin = headers.get("origin")
        if not is_reading and (origin is None or origin.split("://", 1)[-1].lower() != host.lower()):
            return 403, "the request comes from another page"
        client = scope["client"][0] if scope.get("client") else ""
        if scope["path"] not in STOPS and not self.rate.allows(client):
            return 429, "too many requests; wait for ten seconds"
        return None


def known_names(host: str | None) -> frozenset[str]:
    """Return the names of a page on this host, None for this machine alone."""
    own = {"localhost", "127.0.0.1", "[::1]"}
    if host is not None:
        own |= {host.lower(), socket.gethostname().lower(), socket.getfqdn().lower()}
    return frozenset(own)


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name.strip("[]"))
    except ValueError:
        return False
    return True
