"""The panel's server: who may speak to it, who commands, and the page in a real browser."""

from __future__ import annotations

import asyncio
import json
import threading
from collections.abc import Awaitable, Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import aiohttp
import pytest

from camtool.panel.program import LoadedProgram
from camtool.panel.server import PanelServer
from camtool.panel.session import Session
from camtool.sending.line import Port, opened_line
from camtool.target.registry import load_target
from tests.panel.test_session import PROGRAM
from tests.pictures.viewer_browser import NEEDS_BROWSER, browser
from tests.sending.test_ends import hosted
from tests.waiting import HANG_S

__all__ = ["browser"]

SPEED = 1.0


@contextmanager
def served(
    name: str,
    program: LoadedProgram | None = None,
    *,
    choices: Sequence[str] = (),
    settings: Sequence[str] = (),
    speed: float = SPEED,
    folder: Path | None = None,
    machine: Any = None,
) -> Iterator[tuple[PanelServer, Any]]:
    """A panel of a virtual machine, or of another one, served in a thread."""
    target = load_target(name, settings=settings)
    twin = machine or target.twin(list(choices))
    with hosted(twin, speed) as port:
        session = Session(target, Port(port), opened_line, speed=speed)
        server = PanelServer(session, program, folder)
        session.watch = server.changed
        ready = threading.Event()

        def work() -> None:
            asyncio.run(server.serve(0, ready.set))

        thread = threading.Thread(target=work)
        thread.start()
        assert ready.wait(HANG_S)
        session.start()
        try:
            yield server, twin
        finally:
            session.close()
            server.end()
            thread.join()


def asked(
    server: PanelServer, talk: Callable[[aiohttp.ClientSession, str], Awaitable[None]]
) -> None:
    async def run() -> None:
        async with aiohttp.ClientSession() as client:
            await talk(client, f"http://127.0.0.1:{server.port}")

    asyncio.run(run())


async def heard(socket: aiohttp.ClientWebSocketResponse, true: Callable[[Any], bool]) -> Any:
    """Read states until one is as wanted."""
    while True:
        data = json.loads((await asyncio.wait_for(socket.receive(), HANG_S)).data)
        if "state" in data and true(data):
            return data


def test_nothing_from_elsewhere_reaches_the_machine() -> None:
    """A scan of ports, a page of another origin, a name that leads here, a wrong key."""
    with served("grbl") as (server, _):

        async def talk(client: aiohttp.ClientSession, root: str) -> None:
            key = {"key": server.key}
            for path in ("/", "/panel.js", "/socket", "/view", "/etc/passwd"):
                async with client.get(root + path) as answer:
                    assert answer.status == 403, path
            async with client.get(root, params={"key": server.key[:-1]}) as answer:
                assert answer.status == 403
            for head in ({"Host": "evil.example"}, {"Origin": "http://evil.example"}):
                async with client.get(root, params=key, headers=head) as answer:
                    assert answer.status == 403, head
            for origin in ("http://evil.example", "null", None):
                head = {} if origin is None else {"Origin": origin}
                with pytest.raises(aiohttp.WSServerHandshakeError):
                    await client.ws_connect(f"{root}/socket", params=key, headers=head)
            async with client.get(root, params=key) as answer:
                assert answer.status == 200
                assert "default-src 'none'" in answer.headers["Content-Security-Policy"]
            for path in ("/../server.py", "/__init__.py", "/session.py"):
                async with client.get(root + path, params=key) as answer:
                    assert answer.status == 404, path

        asked(server, talk)
        assert server.session.state.state != "closed"


def test_one_page_commands_and_all_may_stop() -> None:
    with served("grbl") as (server, twin):

        async def talk(client: aiohttp.ClientSession, root: str) -> None:
            how = {"params": {"key": server.key}, "headers": {"Origin": root}}
            one = await client.ws_connect(f"{root}/socket", **how)
            first = json.loads((await one.receive()).data)
            assert first["machine"]["name"] == "grbl"
            assert "jog" in first["can"]
            await heard(one, lambda data: data["state"]["state"] == "ready")
            other = await client.ws_connect(f"{root}/socket", **how)
            assert (await heard(other, lambda data: True))["role"] == "watch"
            await other.send_str('{"do": "jog", "x": 1.0, "feed": 300.0}')
            data = await heard(other, lambda data: data["messages"])
            assert "only watches" in data["messages"][-1]["text"]
            for wrong in ("no json", '{"do": "erase"}', '{"do": "jog", "feed": "fast"}', "[]"):
                await one.send_str(wrong)
                data = await heard(one, lambda data: data["messages"])
                assert data["messages"][-1]["bad"], wrong
            await one.send_str('{"do": "jog", "x": 50.0, "feed": 300.0}')
            await heard(one, lambda data: data["state"]["says"] == "Jog")
            await other.send_str('{"do": "stop"}')
            await heard(
                other, lambda data: any("stopped" in each["text"] for each in data["messages"])
            )
            assert not twin.is_moving
            await other.send_str('{"do": "take"}')
            assert (await heard(other, lambda data: data["role"] == "command"))["taken"]
            assert (await heard(one, lambda data: data["role"] == "watch"))["pages"] == 2
            await other.close()
            assert not (await heard(one, lambda data: data["pages"] == 1))["taken"]

        asked(server, talk)
        assert 0.0 < twin.slides.commanded_mm[0] < 49.0


def test_a_page_that_is_closed_stops_what_it_held() -> None:
    with served("grbl") as (server, twin):

        async def talk(client: aiohttp.ClientSession, root: str) -> None:
            how = {"params": {"key": server.key}, "headers": {"Origin": root}}
            page = await client.ws_connect(f"{root}/socket", **how)
            await heard(page, lambda data: data["state"]["state"] == "ready")
            await page.send_str('{"do": "jog", "x": 1.0, "feed": 300.0, "held": true}')
            await page.send_str('{"do": "keep"}')
            await page.close()
            watcher = await client.ws_connect(f"{root}/socket", **how)
            await heard(watcher, lambda data: data["state"]["state"] == "ready")

        asked(server, talk)
        assert not twin.is_moving


class TestPage:
    """The page in Chromium."""

    pytestmark = NEEDS_BROWSER

    @pytest.fixture
    def page(self, browser: Any, tmp_path: Path) -> Iterator[tuple[Any, Any, list[str]]]:
        file = tmp_path / "part.nc"
        file.write_bytes(PROGRAM)
        program = LoadedProgram.read(str(file), load_target("grbl"))
        complaints: list[str] = []
        with served("grbl", program) as (server, twin):
            page = browser.new_page(viewport={"width": 1280, "height": 900})
            page.on("console", lambda message: complaints.append(message.text))
            page.on("pageerror", lambda error: complaints.append(str(error)))
            page.set_default_timeout(HANG_S * 1000)
            page.goto(server.address)
            self.state(page, "ready")
            yield page, twin, complaints
            page.close()

    @staticmethod
    def state(page: Any, word: str) -> None:
        page.wait_for_function(
            "word => document.getElementById('state-word').textContent.startsWith(word)", arg=word
        )

    @staticmethod
    def place(page: Any, holds: str) -> None:
        """Wait until the shown X, `at`, is as wanted."""
        text = "document.getElementById('at-x').textContent"
        page.wait_for_function(f"() => {{ const at = parseFloat({text}); return {holds}; }}")

    def test_it_jogs_zeroes_runs_and_stops(self, page: tuple[Any, Any, list[str]]) -> None:
        shown, twin, complaints = page
        shown.locator("#step-size").select_option("1")
        shown.locator("#pad .e").click()
        self.place(shown, "at === 1")
        self.state(shown, "ready")
        assert twin.slides.commanded_mm[0] == pytest.approx(1.0, abs=0.01)
        shown.locator("#places button").first.click()
        self.place(shown, "at === 0")
        self.state(shown, "ready")
        shown.locator("#start").click()
        self.state(shown, "runs")
        shown.locator("#pause").click()
        self.state(shown, "paused")
        assert not twin.is_moving
        shown.locator("#go-on").click()
        self.state(shown, "runs")
        shown.keyboard.press("Escape")
        self.state(shown, "ready")
        assert not twin.is_moving
        assert not complaints

    def test_a_key_moves_it_while_it_is_held(self, page: tuple[Any, Any, list[str]]) -> None:
        shown, twin, _ = page
        shown.locator("#step-size").select_option("held")
        shown.locator("#machine").click()
        for end in ("up", "blur"):
            before = twin.slides.commanded_mm[0]
            shown.keyboard.down("ArrowRight")
            self.place(shown, f"at > {before + 0.01}")
            if end == "blur":
                shown.evaluate("window.dispatchEvent(new Event('blur'))")
            else:
                shown.keyboard.up("ArrowRight")
            self.state(shown, "ready")
            assert not twin.is_moving
            shown.keyboard.up("ArrowRight")
        assert twin.slides.commanded_mm[0] > 0.0
        assert twin.slides.commanded_mm[1] == 0.0

    def test_every_control_has_a_name(self, page: tuple[Any, Any, list[str]]) -> None:
        shown, _, _ = page
        nameless = shown.evaluate(
            "[...document.querySelectorAll('button, input, select')].filter((each) =>"
            " !(each.textContent.trim() || each.ariaLabel || (each.labels && each.labels.length)))"
            ".map((each) => each.outerHTML)"
        )
        assert nameless == []
