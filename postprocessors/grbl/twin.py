"""A grbl 1.1 at the other end of its serial line, as docs/wires/grbl.md describes it.

Bytes above 0x7F and `?`, `!`, `~`, 0x18 act at once; all others go to the receive buffer and from
there, line by line, to the parser. A line is answered when it is *planned*: where the ring of
blocks is full the parser waits, and the receive buffer fills. Blocks become steps by the model of
the controller, and are planned anew with each that comes, as in grbl: a sender that is too slow
costs speed, never steps.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Generator
from itertools import pairwise
from typing import Any, Final, Literal

import msgspec
import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from camtool.arrays import Floats, Ints
from camtool.machine.model import Machine
from camtool.simulation.legs import coded_steps_mm
from camtool.simulation.speed_plan import FROM_REST, allowed_along, axis_limits
from camtool.target.twin import Slides, Travel, Twin
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath

from ..gcode.faults import Fault
from .controller import (
    ALWAYS_ON,
    COOLANT,
    NO_BLOCKS,
    SPINDLE,
    WAITS,
    blocks_from,
    dwell_s,
    joined,
    speeds_of,
    stops_of,
)
from .dialect import Dialect, GrblController
from .parser import Notes, Parser
from .steps import step_lines_fill

RX_BYTES: Final = 128
"""The receive buffer (RX_BUFFER_SIZE, serial.h); what comes beyond it is lost without a word."""

BANNER: Final = b"\r\nGrbl 1.1h ['$' for help]\r\n"
"""What it says when it begins."""

LOCKED: Final = b"[MSG:'$H'|'$X' to unlock]\r\n"
"""What it says besides while it is locked."""

STATUS, HOLD, RESUME, RESET = ord("?"), ord("!"), ord("~"), 0x18
DOOR, JOG_CANCEL = 0x84, 0x85
"""Real-time bytes (config.h)."""

FEED_OVERRIDES: Final = {0x90: None, 0x91: 10, 0x92: -10, 0x93: 1, 0x94: -1}
"""What real-time bytes add to the override of feeds, in percent; None: 100 % again (config.h)."""

RAPID_OVERRIDES: Final = {0x95: 100, 0x96: 50, 0x97: 25}
"""The override of rapids that real-time bytes set, in percent (config.h)."""

SPINDLE_OVERRIDES: Final = {0x99: None, 0x9A: 10, 0x9B: -10, 0x9C: 1, 0x9D: -1}
"""What real-time bytes add to the override of the spindle, in percent; None: 100 % again."""

LEAST_OVERRIDE, MOST_OVERRIDE = 10, 200
"""Overrides of feed and spindle stay between these, in percent (config.h)."""

ABORTED: Final = 3
"""The alarm of a reset while something moves (alarm_codes_en_US.csv)."""

CODES: Final = {"locked": 9, "not idle": 8, "statement": 3, "number": 2, "homing": 5}
"""grbl's codes for lines with $ that cannot be done, and for lines while it is locked."""

AXIS_SETTINGS: Final = {
    100: "coded_step_mm",
    110: "max_rate_mm_min",
    120: "acceleration_mm_s2",
    130: "travel_mm",
}
"""Settings of X and their keys in a machine file; Y and Z follow."""

PULL_OFF_MM: Final = 1.0
"""How far homing goes back from the switches ($27, defaults.h)."""

SEEK_MM_S: Final = 500.0 / 60.0
"""The speed of homing ($25, defaults.h); its slow second search is not simulated."""

PAUSE: Final = re.compile(r"M0*0(?![\d.])")
"""M0, which waits for the operator; grbl passes over M1."""

SYNCHRONISED: Final = frozenset(WAITS)

SPINDLES: Final = {Kind.SPINDLE_CW: "M3", Kind.SPINDLE_CCW: "M4", Kind.SPINDLE_OFF: "M5"}

COOLANTS: Final = {Kind.COOLANT_MIST: "M7", Kind.COOLANT_FLOOD: "M8", Kind.COOLANT_OFF: "M9"}


class Choices(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """How this grbl is set up. `homing`: "on" locks it until `$H` or `$X` ($22)."""

    homing: Literal["off", "on"] = "off"


class _Planned(Struct, eq=False):
    """A block in the ring: its start and way (3,) steps, length, speed without overrides, the
    highest that its axes allow, acceleration, highest speed at its start; mm and s."""

    start: Ints
    way: Ints
    length: float
    speed: float
    highest: float
    acceleration: float
    corner: float
    rapid: bool
    block: int

    @property
    def events(self) -> int:
        return int(np.abs(self.way).max())


Phase = tuple[float, float, float]
"""A part of a block at one acceleration: seconds, speed at its start, acceleration."""

Ready = Callable[[], bool]
Job = Generator[Ready, None, int]
"""A line at work: yields what it waits for, returns its error, 0 for ok."""


class GrblTwin(Twin):
    """A grbl that has just been powered."""

    wire = "115200 8N1"
    byte_s = 10.0 / 115200.0

    def __init__(self, machine: Machine[GrblController, Dialect], choices: Choices) -> None:
        super().__init__(Slides(machine))
        self._machine, self._choices = machine, choices
        self._settings = _settings(machine, homing=choices.homing == "on")
        self._alarm = choices.homing == "on"
        self._check = self._asleep = False
        self._last_feed = 0.0
        self._clear()

    def _clear(self) -> None:
        """What a reset forgets."""
        self._rx, self._line, self._overflow = bytearray(), bytearray(), False
        self._job: Job | None = None
        self._ready: Ready = lambda: True
        self._ring: list[_Planned] = []
        self._last = NO_BLOCKS
        self._phases: list[Phase] = []
        self._begun_s, self._done_mm, self._speed, self._events = 0.0, 0.0, 0.0, 0
        self._running = self._stopping = self._held = self._jogging = self._homing = False
        self._stale = False  # the plan of the block that runs is not that of the ring
        self._rest_s: float | None = None  # until then a stop or a dwell holds what comes next
        self._left_s: float | None = None  # so much of it is left behind a hold
        self._feed_percent = self._rapid_percent = self._spindle_percent = 100
        self._wco_in = self._ov_in = 0
        self._spindle, self._rpm, self._coolant, self._tool = "M5", 0.0, "M9", 0
        self._planned: Ints = np.zeros((1, 3), dtype=np.int64)
        self._path, self._notes = ToolpathBuilder(), Notes()
        self._parser = Parser(self._machine, self._path, self._notes)
        self._stand()

    def _stand(self) -> None:
        """Planner and parser begin where the slides are."""
        step_mm = coded_steps_mm(self._machine)
        steps = np.rint(self.slides.commanded_mm / step_mm)
        self._planned = steps.astype(np.int64)[None, :]
        x, y, z = (steps * step_mm).tolist()
        self._parser.position[:] = x, y, z
        self._path.moved_to(x, y, z)
        self._path.drained()

    def connected(self, now: float) -> bytes:
        """DTR resets the board: as if the power came on (the slides stay where they are)."""
        sent = self.advance(now)
        self.slides.stop(now)
        self._alarm, self._check, self._asleep = self._choices.homing == "on", False, False
        self._clear()
        self._greet()
        return sent + self._sent()

    def _greet(self) -> None:
        self._out += BANNER
        if self._alarm:
            self._out += LOCKED

    @property
    def moves(self) -> bool:
        """Whether slides move now, or a dwell runs; not while it is held."""
        return self.slides.ends_s is not None or self._rest_s is not None or self._running

    @property
    def state(self) -> str:
        """As the status report says it."""
        if self._asleep:
            return "Sleep"
        if self._alarm:
            return "Alarm"
        if self._check:
            return "Check"
        if self._held:
            return "Hold:0"
        if self._stopping and self._running:
            return "Hold:1"
        if self._homing:
            return "Home"
        if self._running or self._ring:
            return "Jog" if self._jogging else "Run"
        return "Idle"

    # Bytes.

    def _take(self, octet: int) -> None:
        if octet == STATUS:
            self._report()
        elif octet == RESET:
            self._reset()
        elif octet == HOLD:
            self._hold()
        elif octet == RESUME:
            self._resume()
        elif octet > 0x7F:
            self._real_time(octet)
        elif len(self._rx) < RX_BYTES and not self._asleep:
            self._rx.append(octet)

    def _real_time(self, octet: int) -> None:
        if octet == DOOR or (octet == JOG_CANCEL and self._jogging):
            self._hold()
        elif octet in FEED_OVERRIDES:
            self._feed_percent = _percent(self._feed_percent, FEED_OVERRIDES[octet])
            self._stale = True
        elif octet in RAPID_OVERRIDES:
            self._rapid_percent, self._stale = RAPID_OVERRIDES[octet], True
        elif octet in SPINDLE_OVERRIDES:
            self._spindle_percent = _percent(self._spindle_percent, SPINDLE_OVERRIDES[octet])
        else:
            return
        self._ov_in = 0

    def _hold(self) -> None:
        """A feed hold: slow down along the path, then stand; what dwells stops to count
        (`protocol_exec_rt_system`)."""
        if self._alarm or self._check or self._asleep or self._homing or self._held:
            return
        if self._running:
            self._stale = self._stale or not self._stopping
            self._stopping = True
            return
        self._held = True
        if self._rest_s is not None:
            self._left_s, self._rest_s = self._rest_s - self.now, None

    def _resume(self) -> None:
        if self._held:
            self._held = self._stopping = False
            if self._left_s is not None:
                self._rest_s, self._left_s = self.now + self._left_s, None

    def _reset(self) -> None:
        moving = self._running
        self.slides.stop(self.now)
        if moving:
            self._out += f"ALARM:{ABORTED}\r\n".encode()
            self._alarm = True
        self._asleep = self._check = False
        self._clear()
        self._greet()

    # The main loop.

    def next_s(self) -> float | None:
        """It says nothing at an output."""
        return self.turn_s()

    def turn_s(self) -> float | None:
        times = [at for at in (self.slides.ends_s, self._rest_s) if at is not None]
        return min(times, default=None)

    def _due(self) -> None:
        if self._rest_s is not None and self.now >= self._rest_s:
            self._rest_s = None
        if self._running and self.slides.ends_s is None:
            self._block_over()
        self._work()

    def _pass(self) -> None:
        self.slides.until(self.now)
        if not (self._running and self.slides.ends_s is None):
            self._work()

    def _work(self) -> None:
        """Do lines until one has to wait, and begin to move where grbl begins."""
        while True:
            if self._job is None:
                line = self._next_line()
                if line is None:
                    break
                self._job, self._ready = self._execute(line), lambda: True
            if not self._ready():
                break
            try:
                self._ready = next(self._job)
            except StopIteration as end:
                self._job = None
                self._out += f"error:{end.value}\r\n".encode() if end.value else b"ok\r\n"
        if self._ring and not self._running and not self._held and self._rest_s is None:
            self._running, self._phases = True, []
            self._stale = True
        if self._stale and self._running:
            self._aim()

    def _next_line(self) -> bytes | None:
        """The next whole line out of the receive buffer, without its end."""
        if self._held or self._asleep:
            return None
        for count, octet in enumerate(self._rx, 1):
            if octet in b"\r\n":
                line = bytes(self._line + self._rx[: count - 1])
                del self._rx[:count]
                self._line.clear()
                return line
        self._line += self._rx
        self._rx.clear()
        return None

    def _execute(self, raw: bytes) -> Job:
        """A line, from its bytes to its answer."""
        text = _stripped(raw)
        if len(text) > self._machine.dialect.line_chars:
            return 11
        if not text:
            if raw.strip():
                self.decoded.append(raw)
            return 0
        if text[0] == "$":
            code = yield from self._command(text)
            if not code:
                self.commands.append(raw)
            return code
        if self._alarm or self._jogging:
            return CODES["locked"]
        try:
            self._parser.line(text)
        except Fault as fault:
            return _code(fault)
        self.decoded.append(raw)
        path = self._path.drained()
        if not self._check:
            yield from self._carry_out(path, len(self.decoded) - 1)
        if self._parser.ended:
            self._parser.rewind()
        if PAUSE.search(text) and not self._check:
            yield self._idle
            self._held = True
            yield lambda: not self._held
        return 0

    def _idle(self) -> bool:
        return not self._ring and not self._running and self._rested()

    def _rested(self) -> bool:
        return self._rest_s is None and self._left_s is None

    def _carry_out(self, path: Toolpath, owner: int) -> Generator[Ready, None, None]:
        """The rows of a line, each to the planner or at once."""
        if path.running and (path.kind[: path.running] == Kind.END).any():
            path = path.first(path.running)
        for row in range(len(path)):
            kind = Kind(int(path.kind[row]))
            if kind in SYNCHRONISED:
                value = float(path.value[row])
                if self._changes_nothing(kind, value):
                    self._event(kind, value)
                    continue
                yield self._idle
                self._last = NO_BLOCKS
                self._event(kind, value)
                yield self._rested
            else:
                yield from self._plan(path, row, owner)

    def _changes_nothing(self, kind: Kind, value: float) -> bool:
        """Whether an event says what holds already, or in laser mode another power: that comes
        with the move behind it."""
        if kind in COOLANT:
            return COOLANTS[kind] == self._coolant
        if kind not in SPINDLE or SPINDLES[kind] != self._spindle:
            return False
        same = kind == Kind.SPINDLE_OFF or not abs(value - self._rpm) > 0.0  # NaN: none is said
        return same or self._machine.controller.laser_mode

    def _event(self, kind: Kind, value: float) -> None:
        if kind == Kind.DWELL:
            self._rest_s = self.now + dwell_s(value)
        elif kind in SPINDLE:
            self._spindle = SPINDLES[kind]
            self._rpm = value if value == value else self._rpm  # NaN: none is said
        elif kind in COOLANT:
            self._coolant = COOLANTS[kind]
        elif kind == Kind.TOOL_CHANGE:
            self._tool = int(value)
        elif kind == Kind.END:
            self._spindle, self._coolant = "M5", "M9"
            self._out += b"[MSG:Pgm End]\r\n"

    # The planner.

    def _plan(self, path: Toolpath, row: int, owner: int) -> Generator[Ready, None, None]:
        """A move into the ring, block by block; waits where the ring is full."""
        machine, controller = self._machine, self._machine.controller
        rows = np.array([row])
        own, self._planned, asked = blocks_from(self._planned, path, rows, machine, controller)
        if len(own) < asked and controller.laser_mode and self._spindle == "M3":
            yield self._idle
            self._last = NO_BLOCKS
        if not len(own):
            return
        last = self._last
        last = replace(last, row=np.full(len(last), row, np.int32))
        own = replace(own, row=np.full(len(own), row, np.int32))
        stops = stops_of(path, controller)
        plan = speeds_of(joined([last, own]), path, machine, FROM_REST, len(last), stops)
        ways = own.way * coded_steps_mm(machine)
        units = ways / np.linalg.norm(ways, axis=1)[:, None]
        highest = allowed_along(axis_limits(machine, "max_rate_mm_min") / 60.0, units)
        self._last = own.part(len(own) - 1, len(own))
        for k in range(len(own)):
            while len(self._ring) >= controller.buffer_blocks - 1:
                yield lambda: len(self._ring) < controller.buffer_blocks - 1
            self._ring.append(
                _Planned(
                    own.start[k].astype(np.int64),
                    own.way[k].astype(np.int64),
                    float(plan.length_mm[k]),
                    float(plan.speed_mm_s[k]),
                    float(highest[k]),
                    float(plan.acceleration_mm_s2[k]),
                    float(plan.corner_mm_s[k]),
                    not path.is_feed[row],
                    owner,
                )
            )
            self._stale = True

    def _nominal(self, block: _Planned) -> float:
        percent = self._rapid_percent if block.rapid else self._feed_percent
        if percent == 100:
            return block.speed
        wished = (block.highest if block.rapid else block.speed) * percent / 100.0
        return min(wished, block.highest)

    def _exit_speed(self) -> float:
        """How fast the block that runs may be at its end, for those behind it in the ring."""
        square, behind = 0.0, self._ring
        for k in range(len(behind) - 1, 0, -1):
            block = behind[k]
            most = min(block.corner, self._nominal(block), self._nominal(behind[k - 1]))
            square = min(most * most, square + 2.0 * block.acceleration * block.length)
        return float(np.sqrt(square))

    def _aim(self) -> None:
        """Plan the rest of the block that runs, from where it is and as fast as it is."""
        self._stale = False
        block = self._ring[0]
        if self._phases:
            self._done_mm, self._speed = self._where()
            self._events += self.slides.done
        left = max(block.length - self._done_mm, 0.0)
        a, v = block.acceleration, self._speed
        if self._stopping:
            self._phases = _slowing(left, v, a)
        else:
            self._phases = _trapezoid(left, v, self._nominal(block), a, self._exit_speed())
        self._begun_s = self.now
        count = block.events
        commanded = np.empty((count, 3))
        lines = block.start[None, :], block.way[None, :]
        step_lines_fill(lines, (0, 0), coded_steps_mm(self._machine), commanded)
        at = block.length * np.arange(1, count + 1) / count - self._done_mm
        whole = sum(seconds for seconds, _, _ in self._phases)
        reach = _distance(self._phases, whole)
        over = reach >= left - LENGTH_EPS_MM
        last = count if over else int(np.searchsorted(at, reach, side="right"))
        at = at[self._events : last]
        travel = Travel(
            commanded[self._events : last],
            _times(self._phases, at),
            np.zeros(len(at)),
            whole,
        )
        self.slides.begin(travel, self.now, block.block)

    def _where(self) -> tuple[float, float]:
        """How much of the block that runs is done, mm, and how fast it is."""
        since, done = self.now - self._begun_s, self._done_mm
        for seconds, v, a in self._phases:
            t = min(seconds, since)
            done, since = done + v * t + 0.5 * a * t * t, since - t
            if since <= 0.0:
                return done, max(v + a * t, 0.0)
        return done, _end_speed(self._phases)

    def _block_over(self) -> None:
        """The travel is over: the block, or with a hold only its slowing down."""
        block = self._ring[0]
        self._events += self.slides.done
        self._done_mm += _distance(self._phases, sum(each[0] for each in self._phases))
        self._speed = _end_speed(self._phases)
        self._phases = []
        if self._events >= block.events:
            self._ring.pop(0)
            self._done_mm, self._events = 0.0, 0
        if self._stopping and (self._speed <= 0.0 or not self._ring):
            self._running, self._speed, self._held = False, 0.0, True
            if self._jogging:
                self._ring.clear()
                self._done_mm, self._events = 0.0, 0
                self._stand()
                self._held = self._stopping = self._jogging = False
        elif not self._ring:
            self._running = self._jogging = self._homing = False
            self._speed = 0.0
            delay = self._machine.controller.idle_delay_ms
            if delay not in (0, ALWAYS_ON):
                self._rest_s = self.now + delay / 1000.0
        else:
            self._aim()

    # Lines that begin with $.

    def _command(self, text: str) -> Job:
        rest = text[1:]
        moving = not self._idle() or self._held
        if rest in ("$", "C", "X") and moving and not self._alarm:  # not "" and G: system.c
            return CODES["not idle"]
        if rest == "":
            self._out += (
                b"[HLP:$$ $# $G $I $N $x=val $Nx=line $J=line $SLP $C $X $H ~ ! ? ctrl-x]\r\n"
            )
        elif rest == "$":
            for number, value in self._settings.items():
                self._out += f"${number}={value}\r\n".encode()
        elif rest == "G":
            self._out += f"[GC:{self._modes()}]\r\n".encode()
        elif rest == "C":
            self._toggle_check()
        elif rest == "X":
            if self._alarm:
                self._alarm = False
                self._out += b"[MSG:Caution: Unlocked]\r\n"
        elif rest.startswith("J="):
            return (yield from self._jog(rest[2:]))
        elif moving:
            return CODES["not idle"]
        elif rest == "H":
            return (yield from self._home())
        elif rest == "#":
            self._out += self._frames()
        elif rest == "I":
            self._out += b"[VER:1.1h.20190825:]\r\n[OPT:V,15,128]\r\n"
        elif rest == "N":
            self._out += b"$N0=\r\n$N1=\r\n"
        elif rest == "SLP":
            self._asleep = True
            self._out += b"[MSG:Sleeping]\r\n"
        elif found := re.fullmatch(r"(\d+)=(.*)", rest):
            return self._set(int(found[1]), found[2])
        else:
            return CODES["statement"]
        return 0

    def _toggle_check(self) -> None:
        """$C; leaving it resets."""
        self._check = not self._check
        self._out += b"[MSG:Enabled]\r\n" if self._check else b"[MSG:Disabled]\r\n"
        if not self._check:
            self._parser = Parser(self._machine, self._path, self._notes)
            self._stand()
            self._greet()

    def _jog(self, text: str) -> Job:
        """$J=: a move at a feed of its own, which changes no mode."""
        if self._alarm:
            return CODES["locked"]
        if self._ring and not self._jogging:
            return CODES["not idle"]
        try:
            self._parser.line(f"$J={text}")
        except Fault as fault:
            return _code(fault)
        path = self._path.drained()
        self._jogging = True
        for row in range(len(path)):
            yield from self._plan(path, row, -1)
        self._jogging = bool(self._ring)
        return 0

    def _modes(self) -> str:
        """The modes in force as `$G` shows them."""
        modes = self._parser.modes
        words = [f"G{modes.motion}", f"G{54 + modes.frame}", f"G{modes.plane}"]
        words += ["G20" if modes.inches else "G21", "G90" if modes.absolute else "G91"]
        words += [f"G{modes.feed_mode}", self._spindle, self._coolant, f"T{self._tool}"]
        feed = self._parser.feed / (25.4 if modes.inches else 1.0)
        return " ".join([*words, f"F{feed:g}", f"S{self._rpm:g}"])

    def _home(self) -> Job:
        """$H: Z, then X and Y, to their switches at machine zero, and back from these."""
        if self._choices.homing == "off":
            return CODES["homing"]
        zero = np.array(self._machine.controller.machine_zero_mm)
        here, self._alarm, self._homing = self.slides.commanded_mm, False, True
        corners = [here, [here[0], here[1], zero[2]], zero, zero - PULL_OFF_MM]
        travel = _straight(np.array(corners), coded_steps_mm(self._machine))
        self.slides.begin(travel, self.now, -1)
        yield lambda: self.slides.ends_s is None
        self._homing = False
        self._stand()
        return 0

    def _set(self, number: int, text: str) -> int:
        """$x=value; what the model uses changes with it."""
        if number not in self._settings:
            return CODES["statement"]
        try:
            value = float(text)
        except ValueError:
            return CODES["number"]
        if not value >= 0.0 or value == float("inf"):
            return 4
        self._settings[number] = _shown(number, value)
        machine, controller = self._machine, self._machine.controller
        axis, first = number % 10, number - number % 10
        if first in AXIS_SETTINGS and axis < 3:
            if value == 0.0:
                return 4
            given: dict[str, Any] = {AXIS_SETTINGS[first]: 1.0 / value if first == 100 else value}
            if first == 100:
                given["real_step_mm"] = given["coded_step_mm"]
            name = "xyz"[axis]
            changed = msgspec.structs.replace(getattr(machine.axes, name), **given)
            axes = msgspec.structs.replace(machine.axes, **{name: changed})
            self._machine = msgspec.structs.replace(machine, axes=axes)
        elif number in (1, 11, 12, 32):
            changes: dict[int, dict[str, Any]] = {
                1: {"idle_delay_ms": int(value)},
                11: {"junction_deviation_mm": value},
                12: {"arc_tolerance_mm": value},
                32: {"laser_mode": bool(int(value))},
            }
            given = changes[number]
            self._parser.laser = given.get("laser_mode", self._parser.laser)
            controller = msgspec.structs.replace(controller, **given)
            self._machine = msgspec.structs.replace(machine, controller=controller)
        return 0

    def _frames(self) -> bytes:
        x, y, z = (0.0 - value for value in self._machine.controller.machine_zero_mm)
        rows = [f"[G54:{x:.3f},{y:.3f},{z:.3f}]"]
        rows += [f"[G{frame}:0.000,0.000,0.000]" for frame in (55, 56, 57, 58, 59, 28, 30, 92)]
        return "".join(f"{row}\r\n" for row in [*rows, "[TLO:0.000]"]).encode()

    # The status report.

    def _report(self) -> None:
        zero = np.array(self._machine.controller.machine_zero_mm)
        busy = self._running or self._homing
        mask = int(float(self._settings[10]))
        here = self.slides.commanded_mm if not mask & 1 else self.slides.commanded_mm - zero
        fields = [self.state, f"{'MPos' if mask & 1 else 'WPos'}:{_mm(here)}"]
        if mask & 2:
            blocks = self._machine.controller.buffer_blocks - 1 - len(self._ring)
            fields.append(f"Bf:{blocks},{RX_BYTES - len(self._rx)}")
        speed = self._where()[1] * 60.0 if self._running and self._phases else 0.0
        rpm = self._rpm * self._spindle_percent / 100.0 if self._spindle != "M5" else 0.0
        fields.append(f"FS:{speed:.0f},{rpm:.0f}")
        if self._wco_in > 0:
            self._wco_in -= 1
        else:
            self._wco_in = 29 if busy else 9
            self._ov_in = max(self._ov_in, 1)
            fields.append(f"WCO:{_mm(0.0 - zero)}")
        if self._ov_in > 0:
            self._ov_in -= 1
        else:
            self._ov_in = 19 if busy else 9
            percents = self._feed_percent, self._rapid_percent, self._spindle_percent
            fields.append("Ov:" + ",".join(map(str, percents)))
            on = {"M3": "S", "M4": "C"}.get(self._spindle, "")
            on += {"M8": "F", "M7": "M"}.get(self._coolant, "")
            fields += [f"A:{on}"] if on else []
        self._out += f"<{'|'.join(fields)}>\r\n".encode()


LENGTH_EPS_MM: Final = 1e-9
"""A block of which no more is left has been done."""


def _stripped(raw: bytes) -> str:
    """A line as `protocol_main_loop` hands it on: capitals, without blanks and comments."""
    text = re.sub(r"\([^)]*\)?|;.*", "", raw.decode("latin-1"))
    return "".join(sign for sign in text if sign > " " and sign != "/").upper()


def _code(fault: Fault) -> int:
    """grbl's number of an error; 20, unsupported, for what only this twin does not do."""
    found = re.search(r"\(error:(\d+)\)", fault.message)
    return int(found[1]) if found else 20


def _percent(now: int, change: int | None) -> int:
    return 100 if change is None else max(LEAST_OVERRIDE, min(MOST_OVERRIDE, now + change))


def _mm(values: Floats) -> str:
    return ",".join(f"{value + 0.0:.3f}" for value in values.tolist())


def _shown(number: int, value: float) -> str:
    """A setting as `$$` shows it: whole numbers below $11 and masks, three decimals otherwise."""
    whole = number < 11 or number in (13, 20, 21, 22, 23, 26, 30, 31, 32)
    return f"{value:.0f}" if whole else f"{value:.3f}"


def _settings(machine: Machine[GrblController, Dialect], *, homing: bool) -> dict[int, str]:
    """Numbers and values of `$$` (settings_codes_en_US.csv, defaults.h)."""
    controller, spindle = machine.controller, machine.spindle
    values: dict[int, float] = dict.fromkeys((2, 3, 4, 5, 6, 13, 20, 21, 23, 31), 0.0)
    values[32] = float(controller.laser_mode)
    values |= {0: 10.0, 1: controller.idle_delay_ms, 10: 1.0, 22: float(homing)}
    values |= {11: controller.junction_deviation_mm, 12: controller.arc_tolerance_mm}
    values |= {24: 25.0, 25: SEEK_MM_S * 60.0, 26: 250.0, 27: PULL_OFF_MM}
    values |= {30: spindle.max_rpm or 1000.0, 31: spindle.min_rpm}
    for first, key in AXIS_SETTINGS.items():
        for k, axis in enumerate(machine.axes):
            value = getattr(axis, key)
            values[first + k] = 1.0 / value if first == 100 else value or 0.0
    return {number: _shown(number, value) for number, value in sorted(values.items())}


def _straight(corners: Floats, step_mm: Floats) -> Travel:
    """Lines through corners (C, 3) mm at the speed of homing, a sample a step."""
    parts, seconds, begin = [np.empty((0, 3))], [np.empty(0)], 0.0
    for start, stop in pairwise(corners):
        count = int(np.ceil((np.abs(stop - start) / step_mm).max()))
        share = np.arange(1, count + 1)[:, None] / max(count, 1)
        parts.append(np.rint((start + share * (stop - start)) / step_mm) * step_mm)
        duration = float(np.linalg.norm(stop - start)) / SEEK_MM_S
        seconds.append(begin + duration * share[:, 0])
        begin += duration
    commanded = np.concatenate(parts)
    return Travel(commanded, np.concatenate(seconds), np.zeros(len(commanded)), begin)


# Speeds within a block: phases of one acceleration each.


def _trapezoid(left: float, v: float, nominal: float, a: float, exit_speed: float) -> list[Phase]:
    """From the speed v over `left` mm: up to `nominal`, and down to `exit_speed` at the end, as
    far as the acceleration allows."""
    if v * v - 2.0 * a * left >= exit_speed * exit_speed and v > exit_speed:
        return _slowing(left, v, a)
    phases: list[Phase] = []
    if v > nominal:
        phases.append(((v - nominal) / a, v, -a))
        left -= (v * v - nominal * nominal) / (2.0 * a)
        if left <= 0.0:
            return _slowing(left + (v * v - nominal * nominal) / (2.0 * a), v, a)
        v = nominal
    exit_speed = min(exit_speed, nominal, float(np.sqrt(v * v + 2.0 * a * left)))
    peak = min(nominal, float(np.sqrt(a * left + 0.5 * (v * v + exit_speed * exit_speed))))
    ramps = (2.0 * peak * peak - v * v - exit_speed * exit_speed) / (2.0 * a)
    phases.append(((peak - v) / a, v, a))
    phases.append((max(left - ramps, 0.0) / peak, peak, 0.0))
    phases.append(((peak - exit_speed) / a, peak, -a))
    return [phase for phase in phases if phase[0] > 0.0]


def _slowing(left: float, v: float, a: float) -> list[Phase]:
    """Slow down all along, to rest or over `left` mm."""
    end = float(np.sqrt(max(v * v - 2.0 * a * left, 0.0)))
    return [((v - end) / a, v, -a)] if v > 0.0 else []


def _distance(phases: list[Phase], seconds: float) -> float:
    done = 0.0
    for duration, v, a in phases:
        t = min(duration, seconds)
        done, seconds = done + v * t + 0.5 * a * t * t, seconds - t
    return done


def _end_speed(phases: list[Phase]) -> float:
    if not phases:
        return 0.0
    seconds, v, a = phases[-1]
    speed = v + a * seconds
    return speed if speed > SPEED_EPS_MM_S else 0.0


SPEED_EPS_MM_S: Final = 1e-9
"""What is slower stands."""


def _times(phases: list[Phase], at: Floats) -> Floats:
    """(K,) seconds from the start until `at` (K,) mm, ascending, are done."""
    times, begin, done = np.zeros(len(at)), 0.0, 0.0
    for k, (seconds, v, a) in enumerate(phases):
        way = v * seconds + 0.5 * a * seconds * seconds
        last = k == len(phases) - 1
        here = (at > done) & ((at <= done + way) | last)
        ahead = at[here] - done
        if a == 0.0:
            times[here] = begin + ahead / v
        else:
            root = np.sqrt(np.maximum(v * v + 2.0 * a * ahead, 0.0))
            times[here] = begin + np.minimum(2.0 * ahead / (v + root), seconds)
        begin, done = begin + seconds, done + way
    return np.maximum.accumulate(times)
