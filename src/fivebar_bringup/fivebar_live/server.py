# SPDX-License-Identifier: Apache-2.0
"""Serves the live page on this machine only, to clients with the token in the address, and forwards their commands."""

from __future__ import annotations

import asyncio
import json
import secrets
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from tornado.http1connection import HTTP1Connection
from tornado.netutil import bind_sockets
from tornado.web import Application, HTTPError, RequestHandler
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from fivebar_live.bounded_server import BoundedServer
from fivebar_live.commands import Command, CommandRefused, read_command

ADDRESS = "127.0.0.1"

LARGEST = 4096
"""Largest message (bytes) that a page may send."""

PING_INTERVAL = 20.0
"""Time (s) between two messages that keep a silent connection open."""

SEND_TIMEOUT = 3.0
"""Longest time (s) at the end for the pages to take what has been sent."""

STOP_TIMEOUT = 5.0
"""Longest time (s) for the server's thread to end."""


class LiveServer:
    """A web server in a thread of its own."""

    def __init__(self, page: str, port: int, receive: Callable[[Command], None]) -> None:
        """Begin to serve a page; `receive` is called in the server's thread with every command.

        Args:
            page: the page as HTML.
            port: 0 for a free one.
            receive: what to do with a command; must return at once.

        Raises:
            OSError: the port is in use.
        """
        self.token = secrets.token_urlsafe(24)
        self._sockets = bind_sockets(port, ADDRESS)
        self.port = int(self._sockets[0].getsockname()[1])
        self.page = page
        self.receive = receive
        self.greetings: dict[str, str] = {}
        """Messages that every new page gets first, by kind."""
        self._clients: set[_Live] = set()
        self.http: BoundedServer | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._ended: asyncio.Event | None = None
        self._running = threading.Event()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._serve()), name="live page", daemon=True)
        self._thread.start()
        self._running.wait()

    @property
    def address(self) -> str:
        """The address of the page, with the token."""
        return f"http://{ADDRESS}:{self.port}/?token={self.token}"

    @property
    def hosts(self) -> tuple[str, str]:
        """Host names that requests may have; any other one would come from a foreign page."""
        return f"{ADDRESS}:{self.port}", f"localhost:{self.port}"

    @property
    def watched(self) -> bool:
        """Whether a page is open."""
        return bool(self._clients)

    def send(self, text: str, greeting: str = "") -> None:
        """Send a message to all pages, from any thread; with `greeting`, its kind, also to those that open later."""
        if greeting:
            self.greetings[greeting] = text
        self._pass_on(text, True)

    def send_frame(self, text: str) -> None:
        """Send a message that may be dropped: a page that has not received the last one yet does not get it."""
        self._pass_on(text, False)

    def _pass_on(self, text: str, needed: bool) -> None:
        if self._loop is not None and self._clients:
            self._loop.call_soon_threadsafe(self._broadcast, text, needed)

    def stop(self) -> None:
        """Close all pages' connections and end the thread."""
        if self._loop is not None and self._ended is not None and self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._ended.set)
        self._thread.join(STOP_TIMEOUT)

    def join(self, client: _Live) -> None:
        """Add a page; only in the server's thread."""
        self._clients.add(client)
        for text in list(self.greetings.values()):
            client.send(text, True)

    def leave(self, client: _Live) -> None:
        """Remove a page; only in the server's thread."""
        self._clients.discard(client)

    def _broadcast(self, text: str, needed: bool) -> None:
        for client in list(self._clients):
            client.send(text, needed)

    async def _serve(self) -> None:
        self._loop, self._ended = asyncio.get_running_loop(), asyncio.Event()
        # without an answer to a ping a page is slow: one that is gone has closed its connection, on this machine
        pings = {"websocket_ping_interval": PING_INTERVAL, "websocket_ping_timeout": 0}
        settings: dict[str, Any] = {"websocket_max_message_size": LARGEST, **pings}
        handlers = [("/", _Page, {"server": self}), ("/live", _Live, {"server": self})]
        server = self.http = BoundedServer(Application(handlers, log_function=lambda handler: None, **settings))
        server.add_sockets(self._sockets)
        self._running.set()
        await self._ended.wait()
        with suppress(TimeoutError):
            # what was sent last may say how the run ended
            await asyncio.wait_for(asyncio.gather(*(client.sent() for client in self._clients)), SEND_TIMEOUT)
        for client in list(self._clients):
            client.close(1001, "the run has ended")
        server.stop()
        await server.close_all_connections()


class _Guarded(RequestHandler):
    """Refuses requests that are not from a page of this server with its token."""

    def initialize(self, server: LiveServer) -> None:
        self.server = server

    def prepare(self) -> None:
        if self.request.host not in self.server.hosts:
            raise HTTPError(403, reason="unknown host")
        if not secrets.compare_digest(self.get_query_argument("token", "").encode(), self.server.token.encode()):
            raise HTTPError(403, reason="the token in the address is missing or wrong")
        if self.server.http is not None and isinstance(self.request.connection, HTTP1Connection):
            self.server.http.admit(self.request.connection.stream)

    def set_default_headers(self) -> None:
        self.set_header("Cache-Control", "no-store")
        self.set_header("Referrer-Policy", "no-referrer")
        self.set_header("X-Content-Type-Options", "nosniff")
        self.set_header("X-Frame-Options", "DENY")
        self.clear_header("Server")


class _Page(_Guarded):
    """The page."""

    def get(self) -> None:
        self.finish(self.server.page)


class _Live(_Guarded, WebSocketHandler):
    """The WebSocket of an open page: samples to it, commands from it."""

    _sending: asyncio.Future[None] | None = None

    def prepare(self) -> None:
        super().prepare()
        # a page of another site may know address and token, but cannot choose its Origin
        if self.request.headers.get("Origin") not in [f"http://{host}" for host in self.server.hosts]:
            raise HTTPError(403, reason="unknown origin")

    def check_origin(self, origin: str) -> bool:
        """Accept every origin: `prepare` has checked the request."""
        return True

    def open(self, *args: str, **kwargs: str) -> None:
        self.server.join(self)

    def on_close(self) -> None:
        self.server.leave(self)

    def on_message(self, message: str | bytes) -> None:
        try:
            self.server.receive(read_command(message))
        except CommandRefused as refusal:
            self.send(json.dumps({"notice": {"good": False, "text": f"refused: {refusal}"}}), True)

    def send(self, text: str, needed: bool) -> None:
        """Send a message; one that is not needed is left out while the page has not taken the last one."""
        if not needed and self._sending is not None and not self._sending.done():
            return
        try:
            self._sending = asyncio.ensure_future(self._write(text))
        except WebSocketClosedError:
            self.server.leave(self)

    async def sent(self) -> None:
        """Wait until the page has taken all messages."""
        if self._sending is not None:
            await self._sending

    async def _write(self, text: str) -> None:
        try:
            await self.write_message(text)
        except WebSocketClosedError:
            self.server.leave(self)
