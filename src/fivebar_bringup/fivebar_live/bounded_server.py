# SPDX-License-Identifier: Apache-2.0
"""An HTTP server that nobody without the token can keep busy: its connections, requests and waits are limited."""

from __future__ import annotations

from typing import Any

from tornado.httpserver import HTTPServer
from tornado.iostream import IOStream
from tornado.web import Application

MOST_CONNECTIONS = 64
"""Number of connections at a time. A new one takes the place of the oldest that has not shown the token."""

LONGEST_REQUEST = 10.0
"""Time (s) in which a request has to be complete; so long may a connection be idle."""

LARGEST_HEADER = 16_384
"""Largest header (bytes) of a request."""

LARGEST_BODY = 4096
"""Largest body (bytes) of a request: pages send none."""


class BoundedServer(HTTPServer):
    """Serves an application; `admit` marks a connection as one that has shown the token."""

    def __init__(self, application: Application) -> None:
        """Serve an application on sockets that are added."""
        # HTTPServer is made by `initialize`
        self._admitted: dict[IOStream, bool] = {}

    def initialize(self, *arguments: Any, **settings: Any) -> None:
        """Set the limits."""
        limits: dict[str, Any] = {
            "idle_connection_timeout": LONGEST_REQUEST,
            "body_timeout": LONGEST_REQUEST,
            "max_header_size": LARGEST_HEADER,
            "max_body_size": LARGEST_BODY,
        }
        super().initialize(*arguments, **limits | settings)

    def handle_stream(self, stream: IOStream, address: tuple[Any, ...]) -> None:
        """Take a new connection, where there is room or can be made."""
        self._admitted = {
            connection: admitted for connection, admitted in self._admitted.items() if not connection.closed()
        }
        if len(self._admitted) >= MOST_CONNECTIONS:
            oldest = next((connection for connection, admitted in self._admitted.items() if not admitted), None)
            if oldest is None:
                stream.close()
                return
            del self._admitted[oldest]
            oldest.close()
        self._admitted[stream] = False
        super().handle_stream(stream, address)

    def admit(self, stream: IOStream) -> None:
        """Note that a connection has shown the token, so that it is not closed for another one."""
        if stream in self._admitted:
            self._admitted[stream] = True

    @property
    def connections(self) -> int:
        """Number of open connections."""
        return sum(not connection.closed() for connection in self._admitted)
