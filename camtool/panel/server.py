"""The panel's server: one page, one WebSocket, on this computer alone.

The address of the page holds a key that is made anew at each start; without it nothing is
answered. Requests whose host is not this server's own address are refused, and so is a WebSocket
of a page from elsewhere: neither a page of another origin nor a scan of ports reaches the machine.
One page commands, the others watch; what a page sends is decoded strictly."""

from __future__ import annotations

import asyncio
import hmac
import re
import secrets
from collections.abc import Awaitable, Callable, Iterable
from contextlib import suppress
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

import msgspec
from aiohttp import WSMsgType, web
from msgspec import Struct

from camtool.errors import CamtoolError, OptionError
from camtool.machine.model import Machine
from camtool.panel.program import LoadedProgram
from camtool.panel.session import AXES, Session
from camtool.sending.drive import Request
from camtool.target.wire import HandAction, Override, Place, ToolAt, Wire, WireState
from camtool.toolpath import probing

if TYPE_CHECKING:
    from camtool.target.registry import LoadedTarget

HOST: Final = "127.0.0.1"

PUSH_S: Final = 0.05
"""Shortest interval between two states that are sent to a page, s."""

ASKS_S: Final = 5.0
"""Interval of pings; a page that does not answer is gone, s."""

MAX_PROBE_MM: Final = 10_000.0
"""Lengths and feeds of the probe are below this."""

MAX_MESSAGE_BYTES: Final = 4096

SUFFIXES: Final = (".nc", ".ngc", ".gcode", ".tap")
"""Extensions of files that hold programs, besides the machine's own."""

PAGE_FILES: Final = ("panel.html", "panel.css", "panel.js")

_POLICY: Final = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; frame-src "
    "'self'; img-src 'self' data:; frame-ancestors 'self'; base-uri 'none'; form-action 'none'"
)
_TYPES: Final = {"html": "text/html", "css": "text/css", "js": "text/javascript"}


class JogRequest(Struct, frozen=True, tag="jog", tag_field="do", forbid_unknown_fields=True):
    """Jog by these distances, mm, at a feed in mm/min; with `held`, in this direction until
    released."""

    feed: float
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    held: bool = False


class KeepRequest(Struct, frozen=True, tag="keep", tag_field="do", forbid_unknown_fields=True):
    """Confirm that the key of a held jog is still down."""


class GoRequest(Struct, frozen=True, tag="go", tag_field="do", forbid_unknown_fields=True):
    """Go to a place, mm, at a feed in mm/min; axes that are None stay. `machine`: to
    machine zero instead."""

    feed: float
    x: float | None = None
    y: float | None = None
    z: float | None = None
    machine: bool = False


class LeaveRequest(Struct, frozen=True, tag="leave", tag_field="do", forbid_unknown_fields=True):
    """End the program at its stop, to touch off another tool."""


class LoadRequest(Struct, frozen=True, tag="load", tag_field="do", forbid_unknown_fields=True):
    """Read and judge a program of the panel's folder."""

    name: str


class TouchRequest(Struct, frozen=True, tag="touch", tag_field="do", forbid_unknown_fields=True):
    """Touch a plate of this `thickness`, an edge, a corner or a bore, or measure the skew of a
    side over the length `along`, with a tip of this `diameter`, in the direction `towards` ("x+",
    "x-y+"), at most `reach` away, at `feed`; mm and mm/min."""

    what: Literal["plate", "edge", "corner", "bore", "skew"]
    towards: str = ""
    thickness: float = 0.0
    along: float = 10.0
    diameter: float = 0.0
    reach: float = 10.0
    feed: float = 100.0


class ReleaseRequest(
    Struct, frozen=True, tag="release", tag_field="do", forbid_unknown_fields=True
):
    """End a held jog: its key was released."""


class ZeroRequest(Struct, frozen=True, tag="zero", tag_field="do", forbid_unknown_fields=True):
    """Make the place of the tool part zero of these axes."""

    axes: str


class OrderRequest(Struct, frozen=True, tag="order", tag_field="do", forbid_unknown_fields=True):
    """Home or unlock."""

    action: Literal["home", "unlock"]


class LineRequest(Struct, frozen=True, tag="line", tag_field="do", forbid_unknown_fields=True):
    """Type a line to the controller."""

    text: str


class ChangeRequest(
    Struct, frozen=True, tag="override", tag_field="do", forbid_unknown_fields=True
):
    """Set an override, %."""

    name: Override
    percent: int


class StartRequest(Struct, frozen=True, tag="start", tag_field="do", forbid_unknown_fields=True):
    """Send the program. `single`: block by block; `first`: from this block on (from 1); `resumes`:
    from where its journal says that it was left, with the tool as `tool_at` says; `more`: after a
    stop, with the same journal; `despite_errors`: even with findings that spoil the part."""

    single: bool = False
    tool_at: ToolAt = ""
    more: bool = False
    first: int = 1
    resumes: bool = False
    despite_errors: bool = False


class HoldRequest(Struct, frozen=True, tag="pause", tag_field="do", forbid_unknown_fields=True):
    """Pause the program."""


class GoOnRequest(Struct, frozen=True, tag="resume", tag_field="do", forbid_unknown_fields=True):
    """Go on; `single`: with one block."""

    single: bool = False


class StopRequest(Struct, frozen=True, tag="stop", tag_field="do", forbid_unknown_fields=True):
    """Stop the machine. Every page may do this."""


class ConnectRequest(
    Struct, frozen=True, tag="connect", tag_field="do", forbid_unknown_fields=True
):
    """Open the port again."""


class TakeRequest(Struct, frozen=True, tag="take", tag_field="do", forbid_unknown_fields=True):
    """Command from this page from now on."""


Wanted = (
    JogRequest
    | GoRequest
    | LeaveRequest
    | TouchRequest
    | LoadRequest
    | KeepRequest
    | ReleaseRequest
    | ZeroRequest
    | OrderRequest
    | LineRequest
    | ChangeRequest
    | StartRequest
    | HoldRequest
    | GoOnRequest
    | StopRequest
    | ConnectRequest
    | TakeRequest
)
_DECODER: Final = msgspec.json.Decoder(Wanted)


class Client:
    """An open page. `shown`: number of the last message that it has; `edition`: that of the
    program it shows."""

    def __init__(self, socket: web.WebSocketResponse) -> None:
        self.socket, self.shown, self.edition = socket, 0, -1
        self.changed = asyncio.Event()


class PanelServer:
    """The pages of one session; `program` is what `StartRequest` sends, None without one, and
    `folder` holds others that can be loaded; `tool_mm`: the diameter of their end mill."""

    def __init__(
        self,
        session: Session,
        program: LoadedProgram | None = None,
        folder: Path | None = None,
        tool_mm: float | None = None,
    ) -> None:
        self.session, self.program, self.folder = session, program, folder
        self.tool_mm = tool_mm
        self._edition, self._has_run = 0, False
        self.key = secrets.token_urlsafe(24)
        self.port = 0
        self._clients: list[Client] = []
        self._commander: Client | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._work: asyncio.Task[None] | None = None
        self._end: Callable[[], object] = lambda: None

    @property
    def address(self) -> str:
        """The address to open in a browser."""
        return f"http://{HOST}:{self.port}/?key={self.key}"

    # The server.

    async def serve(self, port: int, ready: Callable[[], None]) -> None:
        """Serve until `end` is called; `ready` is called when pages can be opened."""
        self._loop = asyncio.get_running_loop()
        end_request = asyncio.Event()
        loop = self._loop
        self._end = lambda: loop.call_soon_threadsafe(end_request.set)
        app = web.Application(middlewares=[self._guard])
        app.router.add_get("/", self._page)
        app.router.add_get("/view", self._view)
        app.router.add_get("/socket", self._socket)
        app.router.add_get("/{name}", self._page)
        runner = web.AppRunner(app, access_log=None, handle_signals=False, shutdown_timeout=1.0)
        await runner.setup()
        site = web.TCPSite(runner, HOST, port)
        await site.start()
        self.port = runner.addresses[0][1]
        ready()
        try:
            await end_request.wait()
        finally:
            for client in list(self._clients):
                await client.socket.close()
            await runner.cleanup()

    def end(self) -> None:
        """End `serve`, from any thread."""
        self._end()

    def changed(self) -> None:
        """Note, from any thread, that the session's state or messages have changed."""
        loop = self._loop
        if loop is not None and not loop.is_closed():
            loop.call_soon_threadsafe(self._wake)

    def _wake(self) -> None:
        runs = self.session.state.runs
        if self._has_run and not runs:
            self._edition += 1  # its journal says where it was left
        self._has_run = runs
        for client in self._clients:
            client.changed.set()

    @web.middleware
    async def _guard(
        self, request: web.Request, handler: Callable[[web.Request], Awaitable[web.StreamResponse]]
    ) -> web.StreamResponse:
        """Handle a request only if it comes from this server's own page, opened with its key;
        refuse it otherwise."""
        own = {f"{name}:{self.port}" for name in (HOST, "localhost")}
        origin = request.headers.get("Origin")
        allowed = request.host in own and origin in (None, *(f"http://{each}" for each in own))
        key = request.query.get("key", "")
        if not allowed or not hmac.compare_digest(key.encode(), self.key.encode()):
            raise web.HTTPForbidden(text="open the address that camtool panel has printed\n")
        response = await handler(request)
        if not isinstance(response, web.WebSocketResponse):
            response.headers["Cache-Control"] = "no-store"
            response.headers["Referrer-Policy"] = "no-referrer"
            response.headers["X-Content-Type-Options"] = "nosniff"
        return response

    async def _page(self, request: web.Request) -> web.Response:
        name = request.match_info.get("name", PAGE_FILES[0])
        if name not in PAGE_FILES:
            raise web.HTTPNotFound
        text = resources.files("camtool.panel.page").joinpath(name).read_text("utf-8")
        response = web.Response(
            text=text.replace("{key}", self.key), content_type=_TYPES[name.rpartition(".")[2]]
        )
        response.headers["Content-Security-Policy"] = _POLICY
        return response

    async def _view(self, request: web.Request) -> web.Response:
        """Return the viewer page of the program, which the panel's page shows in a frame."""
        if self.program is None:
            raise web.HTTPNotFound
        page = await asyncio.to_thread(self.program.page)
        return web.Response(body=page, content_type="text/html", charset="utf-8")

    async def _socket(self, request: web.Request) -> web.WebSocketResponse:
        socket = web.WebSocketResponse(heartbeat=ASKS_S, max_msg_size=MAX_MESSAGE_BYTES)
        if "Origin" not in request.headers:
            raise web.HTTPForbidden(text="a page is to open this\n")
        await socket.prepare(request)
        client = Client(socket)
        self._clients.append(client)
        if self._commander is None:
            self._commander = client
        client.changed.set()
        pushing = asyncio.create_task(self._push(client))
        try:
            async for message in socket:
                if message.type is WSMsgType.TEXT:
                    self._take(client, message.data)
        finally:
            pushing.cancel()
            self._clients.remove(client)
            if self._commander is client:
                self._commander = None
                self.session.release()
            self._wake()
        return socket

    # What a page is told.

    async def _push(self, client: Client) -> None:
        """Send the state to a page each time it has changed, until the page is closed."""
        while not client.socket.closed:
            await client.changed.wait()
            client.changed.clear()
            if client.edition != self._edition:
                client.edition = self._edition
                await client.socket.send_str(await asyncio.to_thread(self._first))
            await client.socket.send_str(self._state(client))
            await asyncio.sleep(PUSH_S)

    def _first(self) -> str:
        """Return the first message to a page: the machine and the program, which seldom change."""
        session = self.session
        return _json(
            {
                "machine": _machine(session.target),
                "port": session.port.name,
                "can": sorted(session.wire.by_hand),
                "zeroes_each": session.wire.zeroes_each,
                "reported": session.wire.place == "told",
                "tool_at": _tool_at_choices(session.wire),
                "programs": [each.name for each in self._programs()],
                "probes": type(session.wire).probing is not Wire.probing,
                "overrides": list(session.wire.overrides),
                "ready": list(session.wire.ready),
                "stopping": session.wire.stopping,
                "program": None if self.program is None else self.program.facts(),
            }
        )

    def _state(self, client: Client) -> str:
        """Return the message with the present state, and the messages to the user that this page
        does not have yet."""
        messages = [each for each in self.session.messages if each.number > client.shown]
        if messages:
            client.shown = messages[-1].number
        return _json(
            {
                "state": self.session.state,
                "role": "command" if client is self._commander else "watch",
                "taken": self._commander is not None,
                "pages": len(self._clients),
                "messages": messages,
            }
        )

    # What a page wants.

    def _take(self, client: Client, text: str) -> None:
        """Carry out a request of a page, if this page may command."""
        session = self.session
        try:
            request = _DECODER.decode(text)
            if isinstance(request, StopRequest):
                session.stop()
            elif isinstance(request, TakeRequest):
                if self._commander is not client:
                    session.release()
                self._commander = client
                self._wake()
            elif client is not self._commander:
                session.tell("this page only watches: take the command first", bad=True)
            else:
                self._do(request)
        except msgspec.DecodeError as error:
            session.tell(f"a request that is none ({error})", bad=True)
        except CamtoolError as error:
            session.tell(str(error), bad=True)

    def _do(self, request: Any) -> None:
        session = self.session
        match request:
            case KeepRequest():
                session.keep()
            case ReleaseRequest():
                session.release()
            case JogRequest():
                self._jog(request)
            case GoRequest():
                axes = {axis: getattr(request, axis) for axis in AXES}
                places = {axis: place for axis, place in axes.items() if place is not None}
                feed = self._feed(request.feed, AXES if request.machine else places)
                if request.machine:
                    session.go_home(feed)
                else:
                    session.go(places, feed)
            case TouchRequest():
                session.touch(request.what, _cycle_of(request))
            case LeaveRequest():
                session.leave_stop()
            case LoadRequest():
                self._work = asyncio.create_task(asyncio.to_thread(self._load, request.name))
            case ZeroRequest():
                session.order("zero", {axis: 0.0 for axis in AXES if axis in request.axes})
            case OrderRequest():
                action: HandAction = request.action
                session.order(action, {})
            case LineRequest():
                session.say(request.text)
            case ChangeRequest():
                session.override(request.name, request.percent)
            case HoldRequest():
                session.request(Request.PAUSE)
            case GoOnRequest():
                session.request(Request.STEP if request.single else Request.RESUME)
            case ConnectRequest():
                session.reopen()
            case StartRequest():
                # It may have to be judged again, and the page goes on meanwhile.
                self._work = asyncio.create_task(asyncio.to_thread(self._start, request))

    def _programs(self) -> list[Path]:
        """Return the programs in the folder."""
        if self.folder is None:
            return []
        suffixes = {self.session.target.machine.target.extension, *SUFFIXES}
        with suppress(OSError):
            return sorted(
                each
                for each in self.folder.iterdir()
                if each.suffix in suffixes and each.is_file()
            )
        return []

    def _load(self, name: str) -> None:
        """Read and judge a program."""
        session = self.session
        if session.state.runs:
            session.tell("a program is running: stop it first", bad=True)
            return
        file = next((each for each in self._programs() if each.name == name), None)
        if file is None:
            session.tell(f"there is no program {name!r} in the folder", bad=True)
            return
        try:
            session.tell(f"{name} is judged")
            self.program = LoadedProgram.read(str(file), session.target, self.tool_mm)
        except CamtoolError as error:
            session.tell(str(error), bad=True)
            return
        self._edition += 1
        session.tell(f"{name} is loaded")

    def _feed(self, feed: float, axes: Iterable[str]) -> float:
        """Return the feed, mm/min, limited to what these axes can do."""
        machine = self.session.target.machine
        rates = [getattr(machine.axes, axis).max_rate_mm_min for axis in axes]
        feed = min([feed, *(rate for rate in rates if rate is not None)])
        if not feed > 0.0:
            raise OptionError("a jog needs a feed above 0", mend="give one")
        return feed

    def _jog(self, request: JogRequest) -> None:
        """Jog at the requested feed, limited to what the axes can do."""
        values = {axis: getattr(request, axis) for axis in AXES if getattr(request, axis)}
        values["feed"] = self._feed(request.feed, values)
        if request.held:
            self.session.hold(values)
        else:
            self.session.order("jog", values)

    def _start(self, request: StartRequest) -> None:
        """Start to send the program as requested."""
        if self.program is None:
            self.session.tell("no program was given: camtool panel PROGRAM", bad=True)
            return
        if self.session.state.state != WireState.READY.value:
            self.session.tell("the machine is not ready", bad=True)
            return
        try:
            one, options = self.program.prepared(
                single=request.single,
                first=request.first - 1,
                resumes=request.resumes,
                tool_at=request.tool_at,
                more=request.more,
                despite_errors=request.despite_errors,
                speed=self.session.speed,
            )
            self.session.run_program(one, options)
        except CamtoolError as error:
            self.session.tell(str(error), bad=True)


def _cycle_of(request: TouchRequest) -> Callable[[Place], probing.Measured]:
    """Return the probing cycle of a request; OptionError for numbers and directions that give
    none."""
    sizes = (
        request.reach,
        request.feed,
        request.along,
        request.thickness + 1.0,
        request.diameter + 1.0,
    )
    pairs = re.findall(r"([xy])([+-])", request.towards)
    axes: list[Any] = [axis for axis, _ in pairs]
    senses = [1 if sense == "+" else -1 for _, sense in pairs]
    count = {"edge": 1, "skew": 1, "corner": 2}.get(request.what, 0)
    if not all(0.0 < size < MAX_PROBE_MM for size in sizes):
        raise OptionError("a length or feed of the probe is out of range", mend="give it above 0")
    if count and (len(set(axes)), len(axes)) != (count, count):
        mend = "choose one of X and Y, or both for a corner"
        raise OptionError(f"{request.towards!r} is no way towards a {request.what}", mend=mend)
    how = probing.Touch(
        reach_mm=request.reach,
        fast=request.feed,
        slow=0.25 * request.feed,
        radius_mm=0.5 * request.diameter,
        sets_zero=request.what != "skew",
    )

    def measure(start: Place) -> probing.Measured:
        match request.what:
            case "plate":
                return probing.plate(start, how, request.thickness)
            case "bore":
                return probing.bore(start, how)
            case "edge":
                return probing.edge(start, axes[0], senses[0], how)
            case "skew":
                return probing.skew(start, axes[0], senses[0], how, request.along)
        by_axis = dict(zip(axes, senses, strict=True))
        return probing.corner(start, (by_axis["x"], by_axis["y"]), how, request.along)

    return measure


def _tool_at_choices(wire: Wire) -> list[ToolAt]:
    """Return the answers to --tool-at that the controller allows when a program is resumed."""
    choices: dict[str, list[ToolAt]] = {
        "told": ["", "journal", "zero", "known"],
        "kept": ["zero"],
        "steps": ["journal", "zero"],
        "homed": [""],
    }
    return choices[wire.place]


def _machine(target: LoadedTarget) -> dict[str, Any]:
    """Return the facts of a machine that the page needs."""
    machine: Machine[Any, Any] = target.machine
    axes = {
        name: {
            "step_mm": axis.coded_step_mm,
            "travel_mm": axis.travel_mm,
            "max_rate_mm_min": axis.max_rate_mm_min,
        }
        for name, axis in zip(AXES, machine.axes, strict=True)
    }
    return {
        "name": machine.target.name,
        "title": machine.target.title,
        "feed_mm_min": machine.feed.default_mm_min,
        "axes": axes,
    }


def _json(value: object) -> str:
    return msgspec.json.encode(value).decode("utf-8")
