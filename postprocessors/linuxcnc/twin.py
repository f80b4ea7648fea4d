"""A LinuxCNC behind linuxcncrsh, as docs/wires/linuxcnc.md describes it.

Lines of text come in and are answered one by one. A program is a file, which is read by the
target's own reader and run by its model as a whole; what is asked about it (line, place, state)
follows from how much of the motion is over. Nothing moves before it is switched on, enabled and
homed."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Final, Literal

import numpy as np

from camtool.arrays import Floats, Ints
from camtool.errors import CamtoolError
from camtool.machine.model import Machine
from camtool.records import replace
from camtool.target.probed import ProbedPart
from camtool.target.twin import COMMANDED, Slides, Travel, Twin, travel_of
from camtool.toolpath.moves import Toolpath

from .controller import LinuxcncModel
from .dialect import LinuxcncController, LinuxcncDialect, LinuxcncLink
from .read import read_program

HOMING_MM_S: Final = 10.0
"""The speed of its homing, in which every axis goes to machine zero; ours."""

JOINTS: Final = 6
"""Joints that it reports, whichever there are (linuxcncrsh of 2.9)."""

FRAME: Final = re.compile(r"G10 ?L20 ?P0((?: ?[XYZ]-?\d*\.?\d+)+)", re.IGNORECASE)
WORD: Final = re.compile(r"([XYZ])(-?\d*\.?\d+)", re.IGNORECASE)
PROBES: Final = re.compile(
    r"(?:G21 |G90 |G94 )*G38\.([23])((?: ?[XYZ]-?\d*\.?\d+)+) F(\d*\.?\d+)", re.IGNORECASE
)
DEBUG: Final = re.compile(r"\(DEBUG, ?(.*)\)", re.IGNORECASE)
PARAMETER: Final = re.compile(r"#(\d+)")
PROBE_PART_MM: Final = 0.002
"""Parts in which it looks at its probe."""
PAUSES: Final = re.compile(rb"^[^(;]*M0*[01](?![\d.])", re.IGNORECASE)
BLOCK: Final = re.compile(rb"[A-Za-z#]")


class LinuxcncTwinSettings(ProbedPart, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """State in which it is found. `power`: "ready" (switched on and homed), "on" (not homed), or
    "estop". The others say what its probe touches."""

    power: Literal["ready", "on", "estop"] = "ready"


class LinuxcncTwin(Twin):
    """A LinuxCNC that has just been started, its slides at machine zero."""

    settings = LinuxcncTwinSettings
    wire = "linuxcncrsh, TCP"

    def __init__(
        self, machine: Machine[LinuxcncController, LinuxcncDialect], choices: LinuxcncTwinSettings
    ) -> None:
        super().__init__(Slides(machine))
        self._machine = machine
        assert isinstance(machine.link, LinuxcncLink)
        self._link = machine.link
        self._estop, self._on = choices.power == "estop", choices.power != "estop"
        self._homed = choices.power == "ready"
        self._zero: Floats = np.zeros(3)  # zero of the work frame on the machine
        self._mode, self._status = "MANUAL", "IDLE"
        self._file, self._program = "", b""
        self._error = ""
        self._steps = False  # True if the program stops after each line
        self._travel: Travel | None = None  # motion of the whole program
        self._done = 0  # number of its outputs made so far
        self._since = 0.0  # time of it that has passed, s
        self._line_ends: Floats = np.empty(0)  # end of each line, s from the start of the program
        self._lines: Ints = np.empty(0, dtype=np.int64)
        self._halts: list[float] = []  # times at which it waits, s from the start of the program
        self._segment_s = 0.0
        self._homing = False
        self._overrides = {"feed": 100, "spindle": 100}
        self._jogs: dict[int, float] = {}  # jogged axes and their speeds, mm/s
        self._target: Floats = np.zeros(3)  # ends of the jogs
        self._choices = choices
        self._queue: list[str] = []  # MDI lines that wait for the current one
        self._display = ""
        self._parameters = dict.fromkeys(range(5061, 5071), 0.0)
        self.read_file: Callable[[str], bytes] = lambda name: Path(name).read_bytes()
        """Function that reads the file of a program."""
        self._hang_up()

    def _hang_up(self) -> None:
        """Reset the state of the connection."""
        self._text = bytearray()
        self._greeted = self._enabled = self._verbose = False
        self._echo = True

    def connect(self, now: float) -> bytes:
        """Accept a new client, which has to greet again; a running program goes on."""
        output = self.advance(now)
        self._hang_up()
        return output

    def next_s(self) -> float | None:
        """Return the time of the next wake-up: it sends nothing but answers."""
        return self.wake_s()

    # Lines.

    def _receive_byte(self, octet: int) -> None:
        if octet not in b"\r\n":
            self._text.append(octet)
            return
        line, self._text = bytes(self._text).decode("utf-8", "replace").strip(), bytearray()
        if line:
            if self._echo and self._greeted:
                self._say(line)
            self._do(line)

    def _say(self, text: str) -> None:
        self._out += f"{text}\r\n".encode()

    def _do(self, line: str) -> None:
        verb, _, argument = line.partition(" ")
        name, _, value = argument.strip().partition(" ")
        verb, name, value = verb.lower(), name.lower(), value.strip()
        if verb == "hello":
            words = line.split()
            self._greeted = len(words) == 4 and words[1] == self._link.password
            self._say("HELLO ACK EMCNETSVR 1.1" if self._greeted else "HELLO NAK")
        elif not self._greeted:
            return
        elif verb == "get":
            answer = self._get(name)
            self._say(f"GET {name.upper()} NAK" if answer is None else f"{name.upper()} {answer}")
        elif verb == "set":
            is_done = self._set(name, value)
            if self._verbose or not is_done:
                self._out += f"SET {name.upper()} {'ACK' if is_done else 'NAK'}\n\r".encode()

    # Questions.

    def _get(self, name: str) -> str | None:
        answers: dict[str, Callable[[], str]] = {
            "estop": lambda: _on_off(self._estop),
            "machine": lambda: _on_off(self._on),
            "mode": lambda: self._mode,
            "program_status": lambda: self._status,
            "program": lambda: self._file or "NONE",
            "program_line": lambda: str(self._line()),
            "joint_homed": lambda: " ".join(
                ["YES" if self._homed else "NO"] * 3 + ["NO"] * (JOINTS - 3)
            ),
            "teleop_enable": lambda: "YES" if self._homed else "NO",
            "rel_act_pos": lambda: _place(self.slides.commanded_mm - self._zero),
            "rel_cmd_pos": lambda: _place(self.slides.commanded_mm - self._zero),
            "abs_act_pos": lambda: _place(self.slides.commanded_mm),
            "abs_cmd_pos": lambda: _place(self.slides.commanded_mm),
            "pos_offset": lambda: _place(self._zero),
            "error": self._popped,
            "operator_text": lambda: "OK",
            "operator_display": self._shown,
            "probe_value": lambda: str(int(self._is_touching())),
            "probe_tripped": lambda: "YES" if self._parameters[5070] else "NO",
            "linear_unit_conversion": lambda: "MM",
            "feed_override": lambda: str(self._overrides["feed"]),
            "spindle_override": lambda: str(self._overrides["spindle"]),
            "echo": lambda: _on_off(self._echo),
            "verbose": lambda: _on_off(self._verbose),
            "enable": lambda: _on_off(self._enabled),
        }
        return answers[name]() if name in answers else None

    def _popped(self) -> str:
        error, self._error = self._error, ""
        return error or "OK"

    def _shown(self) -> str:
        text, self._display = self._display, ""
        return text or "OK"

    def _is_touching(self) -> bool:
        home = np.array(self._machine.controller.machine_zero_mm)
        return bool(self._choices.closes(self.slides.commanded_mm - home, PROBE_PART_MM))

    def _line(self) -> int:
        """Return the number of the line being executed, from 1; after the end, the last that
        moved."""
        if not len(self._lines):
            return 0
        index = int(np.searchsorted(self._line_ends, self._program_s(), side="right"))
        return int(self._lines[min(index, len(self._lines) - 1)])

    def _program_s(self) -> float:
        """Return the time since the program began, s, without pauses."""
        if self._status == "RUNNING" and self.slides.ends_s is not None:
            remaining = max(self.slides.ends_s - self.now, 0.0)
            return self._since + self._segment_s - remaining
        return self._since

    # Orders.

    def _set(self, name: str, value: str) -> bool:
        if name in ("echo", "verbose"):
            setattr(self, f"_{name}", value.lower() == "on")
            return value.lower() in ("on", "off")
        if name == "enable":
            self._enabled = value == self._link.enable_password
            return self._enabled or value.lower() == "off"
        if name in ("set_wait", "linear_unit_conversion"):
            return self._on and value.lower() in ("received", "mm")
        orders: dict[str, Callable[[str], bool]] = {
            "estop": self._set_estop,
            "machine": self._set_machine,
            "mode": self._set_mode,
            "home": self._home,
            "open": self._open,
            "run": self._run_program,
            "step": self._step,
            "pause": self._pause,
            "resume": self._resume,
            "abort": lambda _: self._abort(),
            "mdi": self._mdi,
            "jog_incr": self._jog,
            "teleop_enable": lambda _: self._homed,
            "feed_override": lambda value: self._override("feed", value, math.inf),
            "spindle_override": lambda value: self._override("spindle", value, 100.0),
        }
        if name not in orders or not self._enabled:
            return False
        is_done = orders[name](value)
        if is_done:
            self.commands.append(f"{name} {value}".strip().encode())
        return is_done

    def _override(self, name: str, value: str, highest: float) -> bool:
        """Store an override, %, as setFeedOverride and setSpindleOverride of emcrsh.cc do. The
        simulated motion stays that of 100 %."""
        if not 0.0 <= float(value) <= highest:
            self._say(f"error: invalid: {value} (valid: 0-{highest:g})")
            return False
        self._overrides[name] = round(float(value))
        return True

    def _set_estop(self, value: str) -> bool:
        self._estop = value.lower() == "on"
        if self._estop:
            self._abort()
            self._on = False
        return True

    def _set_machine(self, value: str) -> bool:
        self._on = value.lower() == "on" and not self._estop
        if not self._on:
            self._abort()
        return True

    def _set_mode(self, value: str) -> bool:
        if value.lower() not in ("manual", "auto", "mdi") or self._status != "IDLE":
            return False
        self._mode = value.upper()
        return True

    def _may_move(self) -> bool:
        return self._on and self._status == "IDLE" and self.slides.ends_s is None

    def _home(self, value: str) -> bool:
        if self._mode != "MANUAL" or not self._may_move():
            return False
        self.slides.begin(_straight(self.slides.commanded_mm, np.zeros(3)), self.now, -1)
        self._homing, self._homed = True, False
        return True

    def _jog(self, value: str) -> bool:
        words = value.lower().split()
        if len(words) != 3 or words[0] not in ("x", "y", "z") or not self._homed:
            return False
        if self._mode != "MANUAL" or not (self._may_move() or self._jogs):
            return False
        speed, distance = float(words[1]) / 60.0, float(words[2])
        place, axis = self.slides.commanded_mm, "xyz".index(words[0])
        if not self._jogs:
            self._target = place.copy()
        self._jogs[axis] = abs(speed)
        self._target[axis] += np.copysign(distance, speed)
        self.slides.begin(_jog_travel(place, self._target, self._jogs), self.now, -1)
        return True

    def _mdi(self, value: str) -> bool:
        """Execute a line of MDI: G10 L20 P0, G38.2 and G38.3, a message, or a line in absolute
        coordinates. Return True: it is acknowledged in any case."""
        if self._mode == "MDI" and self._on and self.slides.ends_s is not None:
            self._queue.append(value)
            return True
        if self._mode != "MDI" or not self._may_move() or not self._homed:
            return True  # it is acknowledged, and an operator's error is shown
        value = value.removeprefix("G21 ") if FRAME.search(value) else value
        if match := DEBUG.fullmatch(value):
            self._display = PARAMETER.sub(
                lambda number: f"{self._parameters[int(number[1])]:.6f}", match[1]
            )
            return True
        if match := PROBES.fullmatch(value):
            self._probe(match)
            return True
        match = FRAME.fullmatch(value)
        if match:
            for axis, text in WORD.findall(match[1]):
                axis_index = "XYZ".index(axis.upper())
                self._zero[axis_index] = self.slides.commanded_mm[axis_index] - float(text)
            return True
        # Axes that the line does not name stay where they are.
        x, y, z = (self.slides.commanded_mm - self._zero).tolist()
        stands = f"G21 G90 G0 X{x:.9f} Y{y:.9f} Z{z:.9f}\n"
        path = self._decoded(f"{stands}{value}\nM2\n".encode(), keeps_empty=True)
        if path is not None:
            motion = LinuxcncModel().run(path, self._machine, COMMANDED)
            self.slides.begin(travel_of(motion).shifted(self._zero), self.now, -1)
        return True

    def _probe(self, match: re.Match[str]) -> None:
        """Move until the probe touches; store the place in #5061 to #5063, in the work frame."""
        if self._is_touching():
            self._error = "Probe is already tripped when starting G38.2 or G38.3 move"
            self._queue.clear()
            return
        place = self.slides.commanded_mm
        target = place - self._zero
        for axis, text in WORD.findall(match[2]):
            target["XYZ".index(axis.upper())] = float(text)
        travel = _straight(place, target + self._zero, float(match[3]) / 60.0, PROBE_PART_MM)
        home = np.array(self._machine.controller.machine_zero_mm)
        closed = np.flatnonzero(self._choices.closes(travel.commanded - home, 0.0))
        if len(closed):
            count = int(closed[0]) + 1
            end_s = float(travel.seconds[count - 1])
            parts = travel.commanded[:count], travel.seconds[:count], travel.added_s[:count]
            travel = Travel(*parts, end_s)
        elif match[1] == "2":
            self._error = "G38.2 move finished without making contact."
            self._queue.clear()
        end = travel.commanded[-1] - self._zero
        self._parameters.update(zip(range(5061, 5064), end.tolist(), strict=True))
        self._parameters[5070] = float(bool(len(closed)))
        self.slides.begin(travel, self.now, -1)

    def _open(self, name: str) -> bool:
        try:
            self._program = self.read_file(name)
        except OSError:
            self._error = f"Unable to open file <{name}>"
            return True
        self._file = name
        return True

    def _decoded(self, data: bytes, *, keeps_empty: bool = False) -> Toolpath | None:
        try:
            path = read_program(data, self._machine, None)
        except CamtoolError as error:
            self._error = str(error)
            return None
        start = self.slides.commanded_mm - self._zero
        return replace(path, start=start) if keeps_empty or len(path) else path

    def _run_program(self, value: str, *, steps: bool = False) -> bool:
        """Run the program from its beginning; starting at another line is not modelled."""
        if self._mode != "AUTO" or not self._may_move() or not self._homed or value:
            self._error = "" if self._homed else "Can't run a program when not homed"
            return True
        path = self._decoded(self._program)
        if path is None:
            return True
        lines = self._program.replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n")
        numbers = [k for k, line in enumerate(lines, 1) if _has_words(line)]
        self.decoded += [lines[number - 1].strip() for number in numbers]
        path = path.first(path.executed_rows)
        chunks = list(LinuxcncModel().run(path, self._machine, COMMANDED))
        self._travel = travel_of(chunks).shifted(self._zero)
        ends = np.zeros(len(path))
        for chunk in chunks:
            np.add.at(ends, chunk.ledger.row, chunk.ledger.duration_s)
        self._line_ends = np.cumsum(ends)
        self._lines = np.array(numbers, dtype=np.int64)[path.block]
        halting = [k for k, number in enumerate(numbers) if PAUSES.match(lines[number - 1])]
        last = np.searchsorted(path.block, np.array(halting), side="right")
        self._halts = [float(self._line_ends[k - 1]) if k else 0.0 for k in last]
        self._done, self._since, self._steps = 0, 0.0, steps
        self._begin_segment()
        return True

    def _step(self, value: str) -> bool:
        if self._status == "IDLE":
            return self._run_program("", steps=True)
        self._steps = True
        if self._status == "PAUSED":
            self._begin_segment()
        return True

    def _pause(self, value: str) -> bool:
        if self._status == "RUNNING":
            self._since = self._program_s()
            self.slides.stop(self.now)
            self._done += self.slides.done
            self._status = "PAUSED"
        return True

    def _resume(self, value: str) -> bool:
        if self._status == "PAUSED":
            self._steps = False
            self._begin_segment()
        return True

    def _abort(self) -> bool:
        self.slides.stop(self.now)
        self._travel, self._status, self._homing = None, "IDLE", False
        self._jogs.clear()
        self._queue.clear()
        return True

    # Motion.

    def _begin_segment(self) -> None:
        """Start the motion of the program from where it is to its next halt."""
        assert self._travel is not None
        program = self._travel
        end = next((halt for halt in self._halts if halt > self._since), program.total_s)
        if self._steps:
            moves = self._line_ends[self._line_ends > self._since]
            end = min(end, float(moves[0]) if len(moves) else program.total_s)
        last = int(np.searchsorted(program.seconds, end, side="right"))
        last = len(program) if end >= program.total_s else last
        part = slice(self._done, last)
        self._segment_s = end - self._since
        self._status = "RUNNING"
        travel = Travel(
            program.commanded[part],
            np.maximum(program.seconds[part] - self._since, 0.0),
            program.added_s[part],
            self._segment_s,
        )
        self.slides.begin(travel, self.now, len(self.decoded) - 1)

    def _wake(self) -> None:
        if self.slides.ends_s is not None:
            return
        self._jogs.clear()
        if self._homing:
            self._homing, self._homed = False, True
        elif self._status == "RUNNING" and self._travel is not None:
            self._since += self._segment_s
            self._done += self.slides.done
            if self._since >= self._travel.total_s and self._since not in self._halts:
                self._status, self._travel = "IDLE", None
            else:
                self._halts = [halt for halt in self._halts if halt != self._since]
                self._status = "PAUSED"
        while self._queue and self.slides.ends_s is None:
            self._mdi(self._queue.pop(0))


def _has_words(line: bytes) -> bool:
    content = re.sub(rb"\([^()]*\)|;.*|[ \t%]", b"", line)
    return bool(re.sub(rb"^[Nn]\d+(?:\.\d*)?", b"", content))


def _on_off(value: bool) -> str:
    return "ON" if value else "OFF"


def _place(mm: Floats) -> str:
    return " ".join(f"{value:.6f}" for value in [*mm.tolist(), 0.0, 0.0, 0.0])


def _jog_travel(start: Floats, target: Floats, speeds: dict[int, float]) -> Travel:
    """Return the motion of axes that are jogged at the same time, each at its own speed to its own
    end; axes that are there stand still."""
    lengths = np.abs(target - start)
    total_s = max(float(lengths[axis]) / max(speed, 1e-9) for axis, speed in speeds.items())
    count = max(math.ceil(float(lengths.max()) / 0.01), 1)
    seconds = np.arange(1, count + 1) / count * total_s
    places = np.tile(start, (count, 1))
    for axis, speed in speeds.items():
        places[:, axis] += np.sign(target[axis] - start[axis]) * np.minimum(
            seconds * speed, lengths[axis]
        )
    return Travel(places, seconds, np.zeros(count), total_s)


def _straight(
    start: Floats, target: Floats, speed: float = HOMING_MM_S, part_mm: float = 0.01
) -> Travel:
    """Return the motion along a line, in parts of at most `part_mm`."""
    length = float(np.linalg.norm(target - start))
    count = max(int(np.ceil(length / part_mm)), 1)
    share = np.arange(1, count + 1)[:, None] / count
    seconds = share[:, 0] * length / max(speed, 1e-9)
    return Travel(start + share * (target - start), seconds, np.zeros(count), float(seconds[-1]))
