# SPDX-License-Identifier: Apache-2.0
"""A client of the live page, as a browser would be: sends commands, and keeps what comes."""

from __future__ import annotations

import asyncio
import json
import queue
import threading
from typing import Any

from graph_probe import DEADLINE, Probe
from tornado.httpclient import HTTPRequest
from tornado.websocket import websocket_connect


class Page:
    """An open connection."""

    def __init__(self, address: str) -> None:
        self.messages: queue.Queue[dict[str, Any]] = queue.Queue()
        self._address = address
        self._commands: queue.Queue[str | None] = queue.Queue()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._talk()))
        self._thread.start()

    def send(self, **command: Any) -> None:
        self._commands.put(json.dumps(command))

    def close(self) -> None:
        self._commands.put(None)
        self._thread.join(DEADLINE)

    def next_of(self, kind: str, probe: Probe) -> Any:
        """Return the next message of a kind; all others before it are forgotten."""

        def find() -> list[Any]:
            while not self.messages.empty():
                message = self.messages.get()
                if kind in message:
                    return [message[kind]]
            return []

        return probe.wait_for(find, kind)[0]

    async def _talk(self) -> None:
        origin, _, rest = self._address.partition("/?")
        request = HTTPRequest(f"{origin.replace('http', 'ws')}/live?{rest}", headers={"Origin": origin})
        connection = await websocket_connect(request, on_message_callback=self._keep)
        while (command := await asyncio.to_thread(self._commands.get)) is not None:
            await connection.write_message(command)
        connection.close()

    def _keep(self, text: str | bytes | None) -> None:
        if text is not None:
            self.messages.put(json.loads(text))
