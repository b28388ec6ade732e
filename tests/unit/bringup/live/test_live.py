# SPDX-License-Identifier: Apache-2.0
"""The live page: who may look, what may be asked for, and what is shown."""

from __future__ import annotations

import asyncio
import html
import json
import re
import socket
from collections.abc import Coroutine, Iterator
from contextlib import ExitStack, suppress
from typing import Any

import pytest
from tornado.httpclient import AsyncHTTPClient, HTTPClientError, HTTPRequest
from tornado.websocket import WebSocketClientConnection, websocket_connect

from fivebar_bringup.reference.faults import ADVICE, UNKNOWN, advice
from fivebar_control.model.geometry import inverse_geometry
from fivebar_description.interface import sample_stamp_ns
from fivebar_description.robot_file import load_robot
from fivebar_live import bounded_server
from fivebar_live import server as server_module
from fivebar_live.bounded_server import MOST_CONNECTIONS
from fivebar_live.commands import Command, CommandRefused, read_command
from fivebar_live.page import live_page, live_scene
from fivebar_live.samples import COLUMNS, JointStateSample, Messages, row, thinned
from fivebar_live.server import LiveServer


class Received(list[Command]):
    """Commands that have arrived."""


@pytest.fixture
def received() -> Received:
    return Received()


@pytest.fixture
def server(received: Received) -> Iterator[LiveServer]:
    server = LiveServer("<p>the page</p>", 0, received.append)
    yield server
    server.stop()


def done(work: Coroutine[Any, Any, Any]) -> Any:
    async def limited() -> Any:
        return await asyncio.wait_for(work, 60.0)

    return asyncio.run(limited())


async def fetch(server: LiveServer, query: str, host: str = "") -> Any:
    headers = {"Host": host} if host else {}
    return await AsyncHTTPClient().fetch(f"http://127.0.0.1:{server.port}/{query}", headers=headers)


async def connect(server: LiveServer, token: str, origin: str | None) -> WebSocketClientConnection:
    headers = {} if origin is None else {"Origin": origin}
    return await websocket_connect(HTTPRequest(f"ws://127.0.0.1:{server.port}/live?token={token}", headers=headers))


def own(server: LiveServer) -> str:
    return f"http://127.0.0.1:{server.port}"


def test_the_page_is_for_those_with_its_address(server: LiveServer) -> None:
    assert server.address == f"{own(server)}/?token={server.token}"
    assert len(server.token) > 30
    answer = done(fetch(server, f"?token={server.token}"))
    assert answer.body == b"<p>the page</p>"
    assert answer.headers["Referrer-Policy"] == "no-referrer"
    for query, host in (("", ""), ("?token=wrong", ""), (f"?token={server.token}", "robot.example")):
        with pytest.raises(HTTPClientError, match="403"):
            done(fetch(server, query, host))


def test_the_server_listens_on_this_machine_only(server: LiveServer) -> None:
    assert {socket.getsockname()[0] for socket in server._sockets} == {"127.0.0.1"}


@pytest.mark.parametrize("origin", [None, "null", "http://robot.example", "https://127.0.0.1:1", "http://127.0.0.1"])
def test_a_page_of_another_site_is_refused(server: LiveServer, origin: str | None) -> None:
    with pytest.raises(HTTPClientError, match="403"):
        done(connect(server, server.token, origin))
    assert not server.watched


def test_a_connection_without_the_token_is_refused(server: LiveServer) -> None:
    with pytest.raises(HTTPClientError, match="403"):
        done(connect(server, "wrong", own(server)))


def test_a_page_that_is_too_busy_to_answer_keeps_its_connection(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server_module, "PING_INTERVAL", 0.02)
    busy = LiveServer("<p>the page</p>", 0, lambda command: None)
    request = (
        f"GET /live?token={busy.token} HTTP/1.1\r\nHost: 127.0.0.1:{busy.port}\r\nOrigin: {own(busy)}\r\n"
        "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAA\r\n\r\n"
    )
    try:
        with socket.create_connection(("127.0.0.1", busy.port), timeout=60.0) as page:
            page.sendall(request.encode())
            heard = b""
            # an unanswered ping of two bytes (RFC 6455, 5.5.2), then ten more; a closed connection ends with b""
            while heard.partition(b"\r\n\r\n")[2].count(b"\x89\x00") < 11:
                chunk = page.recv(4096)
                assert chunk, heard
                heard += chunk
            assert busy.watched
    finally:
        busy.stop()


def test_commands_arrive_and_others_are_refused(server: LiveServer, received: Received) -> None:
    async def talk() -> list[Any]:
        page = await connect(server, server.token, own(server))
        refused = ('{"command": "torque", "q11": 1}', "[]", '{"command": "reset", "effort": [1, 1]}', "{")
        answers = []
        for text in refused:
            await page.write_message(text)
            answers.append(await page.read_message())
        await page.write_message('{"command": "emergency_stop"}')
        await page.write_message('{"command": "plan", "x": 0.01, "y": 0.1, "assembly": -1}')
        # refused after both, so that these have arrived before its answer does
        await page.write_message("{")
        answers.append(await page.read_message())
        page.close()
        return answers

    answers = done(talk())
    assert len(answers) == 5
    assert all(json.loads(answer)["notice"]["text"].startswith("refused: ") for answer in answers)
    assert received == [Command("emergency_stop"), Command("plan", 0.01, 0.1, -1)]


def test_a_page_that_opens_late_gets_what_it_needs(server: LiveServer) -> None:
    server.send('{"plan": 1}')
    server.send('{"scene": 1}', "scene")
    server.send('{"scene": 2}', "scene")

    async def look() -> Any:
        page = await connect(server, server.token, own(server))
        first = await page.read_message()
        server.send('{"plan": 2}')
        return first, await page.read_message()

    assert done(look()) == ('{"scene": 2}', '{"plan": 2}')


def test_the_server_ends_with_its_pages(server: LiveServer) -> None:
    async def look() -> Any:
        page = await connect(server, server.token, own(server))
        await asyncio.to_thread(server.stop)
        return await page.read_message()

    assert done(look()) is None
    assert not server._thread.is_alive()


def test_connections_without_the_token_keep_nobody_out(server: LiveServer) -> None:
    """Far more half-open connections than the server holds: silent ones, begun requests, and bytes that are none."""
    begun = (b"", b"GET / HTTP/1.1\r\nHost: x\r\n", b"\x00\xff" * 100)

    async def look() -> tuple[Any, Any]:
        page = await connect(server, server.token, own(server))
        for number in range(4 * MOST_CONNECTIONS):
            half_open = stack.enter_context(socket.create_connection(("127.0.0.1", server.port), 10.0))
            half_open.sendall(begun[number % len(begun)])
        answer = await fetch(server, f"?token={server.token}")
        server.send('{"plan": 1}')
        return answer.body, await page.read_message()

    with ExitStack() as stack:
        assert done(look()) == (b"<p>the page</p>", '{"plan": 1}')
        assert server.http is not None
        assert server.http.connections <= MOST_CONNECTIONS


def test_a_request_that_is_not_completed_in_time_is_dropped(
    received: Received, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bounded_server, "LONGEST_REQUEST", 0.2)
    server = LiveServer("<p>the page</p>", 0, received.append)
    unfinished = f"GET /?token={server.token} HTTP/1.1\r\nHost: "
    try:
        for begun in (b"", unfinished.encode(), b"A" * 20_000):
            # the other end closes it, with or without saying why
            connection = socket.create_connection(("127.0.0.1", server.port), 30.0)
            with connection, suppress(ConnectionResetError, BrokenPipeError):
                connection.sendall(begun)
                while connection.recv(4096):
                    pass
    finally:
        server.stop()


@pytest.mark.parametrize(
    "text",
    [
        '{"command": "move", "x": NaN, "y": 0.1, "assembly": 0}',
        '{"command": "move", "x": "0", "y": 0.1, "assembly": 0}',
        '{"command": "move", "x": 0.0, "y": 0.1, "assembly": 2}',
        '{"command": "move", "x": 0.0, "y": 0.1}',
        '{"command": ["move"]}',
        '{"command": "plan", "x": 1' + "0" * 400 + ', "y": 0.1, "assembly": 0}',
        "[" * 4000,
    ],
)
def test_a_goal_has_finite_coordinates_and_no_other_field(text: str) -> None:
    with pytest.raises(CommandRefused):
        read_command(text)


def test_every_fault_of_the_graph_is_explained() -> None:
    assert {"over_speed", "estimate_lost", "node_died"} <= set(ADVICE)
    assert advice("over_speed: motor 1 at 60 rad/s").recovery.startswith("Wait until the robot is at rest")
    assert advice("drive_lost: node 1") == UNKNOWN


def test_a_row_is_where_the_robot_is() -> None:
    robot = load_robot("dextar")
    position = inverse_geometry(robot, (1, -1), 0.01, 0.12)
    values = row(robot, 500_000_000, JointStateSample(tuple(position), (0.1, -0.2)), (0.01, 0.119), None)
    assert tuple(values) == COLUMNS
    assert values["time"] == 0.5
    assert (values["x"], values["y"], values["error"]) == pytest.approx((10.0, 120.0, 1.0))
    assert (values["mode"], values["torque2"], values["sigma"]) == (1.0, -0.2, None)


def test_samples_are_thinned_and_the_newest_one_stays() -> None:
    stamps = [sample_stamp_ns(sample, 500) for sample in range(18)]
    assert thinned(stamps) == stamps[1::4]
    slow = [sample_stamp_ns(sample, 100) for sample in range(5)]
    assert thinned(slow) == slow
    assert thinned([]) == []


def test_old_messages_are_forgotten() -> None:
    messages = Messages()
    for stamp in range(3000):
        messages.put(stamp, b"")
    assert messages.get(0) is None
    assert messages.after(2997) == [2998, 2999]


def test_the_page_holds_no_token_and_allows_its_own_scripts_only() -> None:
    page = html.unescape(live_page())
    assert "connect-src 'self'; script-src 'sha256-" in page
    assert "token" not in re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL)


def test_the_way_through_type_1_is_not_drawn_as_a_line() -> None:
    robot = load_robot("dextar")
    straight = live_scene(robot, [1, -1], [0.0, 0.15, 0.0, 0.02])["scene"]
    assert straight["path"] == [[0.0, 150.0], [0.0, 20.0]]
    assert live_scene(robot, [1, -1, 1, 1], [0.0, 0.15, 0.0, 0.02])["scene"]["path"] == []
