"""A grbl 1.1 at the other end of its serial line, as docs/wires/grbl.md describes it.

Bytes above 0x7F and `?`, `!`, `~`, 0x18 set flags at once; all others go to the receive buffer and
from there, line by line, to the parser. The main program is one generator that yields where grbl's
waits: None until something happens, or a time until which it is in a delay and looks at no flag. A
line is answered when it is *planned*: where the ring of blocks is full the parser waits, and the
receive buffer fills. Blocks become steps by the model of the controller, and are planned anew with
each that comes, as in grbl: a sender that is too slow costs speed, never steps.

Places on the machine are those that grbl counts in its own steps; `_origin` is where its zero lies
among the steps of the slides, which homing and a new start of the board change."""

from __future__ import annotations

import math
import re
from collections.abc import Generator, Mapping, Sequence
from typing import Any, Final, Literal

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.machine.model import Machine
from camtool.records import replace
from camtool.simulation.legs import coded_steps_mm
from camtool.simulation.speed_plan import FROM_REST, axis_limits, max_along
from camtool.target.probed import ProbedPart
from camtool.target.twin import Slides, Travel, Twin
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath

from ..gcode.faults import LineFault
from .controller import (
    ALWAYS_ON,
    MIN_SPEED_MM_S,
    NO_BLOCKS,
    blocks_from,
    dwell_s,
    join_blocks,
    speeds_of,
    stops_of,
)
from .dialect import GrblController, GrblDialect
from .parser import (
    LENGTH,
    MM_PER_INCH,
    MOTION,
    PROBES,
    GrblBlock,
    GrblParser,
    ParserModes,
    ParserNotes,
)
from .steps import step_lines_fill

RX_BYTES: Final = 128
"""The receive buffer (RX_BUFFER_SIZE, serial.h); what comes beyond it is lost without a word."""

BANNER: Final = "\r\nGrbl 1.1h ['$' for help]\r\n"

BUILD: Final = "1.1h.20190830"
"""Version in `$I` (grbl.h)."""

HELP: Final = "[HLP:$$ $# $G $I $N $x=val $Nx=line $J=line $SLP $C $X $H ~ ! ? ctrl-x]\r\n"

STATUS, HOLD, RESUME, RESET = ord("?"), ord("!"), ord("~"), 0x18
DOOR, JOG_CANCEL = 0x84, 0x85
"""Real-time bytes (config.h)."""

FEED_OVERRIDES: Final = {0x90: None, 0x91: 10, 0x92: -10, 0x93: 1, 0x94: -1}
"""Changes of the feed override by real-time bytes, percent; None: back to 100 % (config.h)."""

RAPID_OVERRIDES: Final = {0x95: 100, 0x96: 50, 0x97: 25}
"""The override of rapids that real-time bytes set, in percent (config.h)."""

SPINDLE_OVERRIDES: Final = {0x99: None, 0x9A: 10, 0x9B: -10, 0x9C: 1, 0x9D: -1}
"""Changes of the spindle override by real-time bytes, percent; None: back to 100 %."""

SPINDLE_STOP, TOGGLE_FLOOD, TOGGLE_MIST = 0x9E, 0xA0, 0xA1
"""Real-time bytes that stop the spindle of a held machine, and switch its coolant."""

MIN_OVERRIDE, MAX_OVERRIDE = 10, 200
"""Overrides of feed and spindle stay between these, in percent (config.h)."""

HARD_LIMIT, SOFT_LIMIT, ABORTED = 1, 2, 3
PROBE_TOUCHES, PROBE_MISSED = 4, 5
HOMING_RESET, HOMING_DOOR, HOMING_STUCK, HOMING_MISSED = 6, 7, 8, 9
"""Alarms (alarm_codes_en_US.csv)."""

OK, BAD_NUMBER, BAD_STATEMENT, NEGATIVE, NO_HOMING = 0, 2, 3, 4, 5
SHORT_PULSE, READ_FAILED, NOT_IDLE, LOCKED, NO_SOFT_LIMITS = 6, 7, 8, 9, 10
TOO_LONG, BEYOND_TRAVEL = 11, 15
"""Answers to lines that its parser does not give (error_codes_en_US.csv)."""

ALARM_S: Final = 0.5
"""Wait after the report of an alarm (`report_alarm_message`)."""

DWELL_STEP_S: Final = 0.05
"""Interval at which a dwell looks at the flags (DWELL_TIME_STEP)."""

DOOR_SPINDLE_S, DOOR_COOLANT_S = 4.0, 1.0
"""Waits until spindle and coolant are restored after the door was open (SAFETY_DOOR_…_DELAY,
config.h)."""

SEGMENT_S: Final = 0.01
"""The length of a piece of a block (ACCELERATION_TICKS_PER_SECOND, config.h)."""

SEGMENTS: Final = 5
"""The steps of so many pieces are fixed already: a hold or another override begins behind them
(SEGMENT_BUFFER_SIZE − 1, stepper.h)."""

SEARCH, LOCATE = 1.5, 5.0
"""Distances of homing: a multiple of the travel, then of the pull-off (limits.c)."""

INCHES_PER_MM: Final = 0.0393701
"""As it stands in nuts_bolts.h."""

WORDS: Final = {None: "M5", Kind.SPINDLE_CW: "M3", Kind.SPINDLE_CCW: "M4"}

TEXT_BYTES: Final = 80
"""A line in its memory (LINE_BUFFER_SIZE)."""

START_LINES: Final = 2
"""`$N0` and `$N1` (N_STARTUP_LINE)."""

FRAMES: Final = 6
"""G54 to G59."""

WHOLE: Final = (0, 1, 2, 3, 10, 23, 26)
SWITCHES: Final = (4, 5, 6, 13, 20, 21, 22, 32)
REALS: Final = (11, 12, 24, 25, 27, 30, 31)
"""Settings that belong to no axis: bytes, bits, and floats."""

RPM: Final = (30, 31)
"""Settings that are shown without decimals."""

AXIS_SETTINGS: Final = {
    100: "coded_step_mm",
    110: "max_rate_mm_min",
    120: "acceleration_mm_s2",
    130: "travel_mm",
}
"""Settings of X and their keys in a machine file; Y and Z follow."""

DEFAULTS: Final = {
    0: 10.0,
    1: 25.0,
    10: 1.0,
    11: 0.01,
    12: 0.002,
    24: 25.0,
    25: 500.0,
    26: 250.0,
    27: 1.0,
    30: 1000.0,
    100: 250.0,
    110: 500.0,
    120: 10.0,
    130: 200.0,
}
"""Default settings that are not 0 (DEFAULTS_GENERIC, defaults.h)."""


class GrblTwinSettings(ProbedPart, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Set-up of a virtual grbl. `homing`: "on" has switches at both ends of the travel, and locks
    it until `$H` or `$X` ($22). `opening`: whether DTR resets the board when its port is opened,
    as that of an Uno, which then forgets its place. The others say what its probe touches."""

    homing: Literal["off", "on"] = "off"
    opening: Literal["reset", "nothing"] = "reset"


class _Planned(Struct, eq=False):
    """A block in the ring: its start and travel (3,) steps, length, programmed speed, speed
    without overrides, highest speed of its axes, acceleration, highest speed at its start; mm and
    s. `rapid` and `fixed` say which override applies, `spindle` and `rpm` what its first segment
    sets."""

    start: Ints
    way: Ints
    length: float
    asked: float
    speed: float
    highest: float
    acceleration: float
    corner: float
    rapid: bool
    fixed: bool
    spindle: Kind | None
    rpm: float
    block: int

    @property
    def events(self) -> int:
        return int(np.abs(self.way).max())


Phase = tuple[float, float, float]
"""A part of a block at one acceleration: seconds, speed at its start, acceleration."""

Wait = Generator[float | None, None, None]
"""Coroutine that waits for any event (None) or until a time."""

Line = Generator[float | None, None, int]
"""Coroutine that executes a line; it returns the error number, 0 for ok."""


class _Abort(Exception):
    """A reset: the main program ends, whatever it does, and starts again."""


# Numbers as grbl has them: 32-bit floats.


def _single(value: float | np.float32) -> float:
    return float(np.float32(value))


def _float_text(value: float, decimals: int) -> str:
    """Format a float as `printFloat` (print.c) does."""
    single = np.float32
    sign, remainder = ("-", -single(value)) if value < 0.0 else ("", single(value))
    for factor in (100.0,) * (decimals // 2) + (10.0,) * (decimals % 2):
        remainder = single(remainder * single(factor))
    remainder = single(remainder + single(0.5))
    digits = str(int(remainder) % (1 << 32) if np.isfinite(remainder) else 0).rjust(
        decimals + 1, "0"
    )
    return sign + (f"{digits[:-decimals]}.{digits[-decimals:]}" if decimals else digits)


def _read_float(text: str, place: int) -> tuple[float, int] | None:
    """Parse the number at a place of a line as `read_float` (nuts_bolts.c) does; return its value
    and its end, None for no number."""
    match = re.compile(r"([+-]?)(\d*)(\.?)(\d*)").match(text, place)
    assert match is not None
    whole_digits, decimals = match[2], match[4]
    if not whole_digits and not decimals:
        return None
    digits = (whole_digits + decimals)[:8]
    exponent = max(len(whole_digits) - 8, 0) - min(len(decimals), max(8 - len(whole_digits), 0))
    single = np.float32
    value = single(int(digits))
    while exponent <= -2:
        value, exponent = single(value * single(0.01)), exponent + 2
    if exponent < 0:
        value = single(value * single(0.1))
    for _ in range(max(exponent, 0)):
        value = single(value * single(10.0))
    return (-float(value) if match[1] == "-" else float(value)), match.end()


def _byte(value: float) -> int:
    return math.trunc(value) % 256


# Its memory, which outlives the power.


class _Memory:
    """Settings, frames (6 of 3 mm), places of G28 and G30, and lines of text."""

    def __init__(self, machine: Machine[GrblController, GrblDialect], *, homing: bool) -> None:
        controller, spindle, dialect = machine.controller, machine.spindle, machine.dialect
        values = self.defaults()
        values |= {1: controller.idle_delay_ms, 22: float(homing)}
        values |= {11: controller.junction_deviation_mm, 12: controller.arc_tolerance_mm}
        values |= {30: spindle.max_rpm or 1000.0, 31: spindle.min_rpm}
        values[32] = float(controller.laser_mode)
        for first, key in AXIS_SETTINGS.items():
            for k, axis in enumerate(machine.axes):
                value = getattr(axis, key)
                values[first + k] = 1.0 / value if first == 100 else value or 0.0
        self.settings = {number: _single(value) for number, value in sorted(values.items())}
        self.frames = [[0.0] * 3 for _ in range(FRAMES)]
        self.frames[0] = [0.0 - value for value in controller.machine_zero_mm]
        for name, place in dialect.work_offsets_mm.items():
            self.frames[int(str(name)[1:]) - 54] = [_single(value) for value in place]
        self.homes = {"G28": [0.0] * 3, "G30": [0.0] * 3}
        for home, place in dialect.homes_mm.items():
            self.homes[str(home)] = [_single(value) for value in place]
        self._texts = [bytearray(TEXT_BYTES) for _ in range(START_LINES + 1)]
        self._sums = [_checksum(text) for text in self._texts]

    @staticmethod
    def defaults() -> dict[int, float]:
        """Return the settings of a new board."""
        values = dict.fromkeys((*WHOLE, *SWITCHES, *REALS), 0.0)
        axes = [first + k for first in AXIS_SETTINGS for k in range(3)]
        return (
            values
            | {n: DEFAULTS[n - n % 10] for n in axes}
            | {number: value for number, value in DEFAULTS.items() if number < 100}
        )

    def load(self, number: int, line: bytearray) -> bool:
        """Load a text into the line buffer. If its checksum is wrong, empty the text and return
        False."""
        line[:] = self._texts[number]
        if self._sums[number] == _checksum(line):
            return True
        line[0] = 0
        self.store(number, line)
        return False

    def store(self, number: int, line: bytearray) -> None:
        """Store a text: all bytes of the line buffer, those behind its end too."""
        self._texts[number][:] = line
        self._sums[number] = _checksum(line)

    def restore(self, selection: str) -> None:
        """Execute $RST: `$` resets settings, `#` frames and stored places, `*` everything. Of the
        texts only two bytes become 0, and not the byte of their checksum."""
        if selection in "$*":
            self.settings = {n: _single(value) for n, value in sorted(self.defaults().items())}
        if selection in "#*":
            for place in (*self.frames, *self.homes.values()):
                place[:] = [0.0] * 3
        if selection == "*":
            for text in self._texts:
                text[:2] = b"\0\0"

    def setting_text(self, number: int) -> str:
        """Format a setting as `$$` shows it."""
        value = self.settings[number]
        if number in WHOLE or number in SWITCHES:
            return f"{int(value)}"
        return _float_text(value, 0 if number in RPM else 3)


def _checksum(text: bytes | bytearray) -> int:
    """Return the checksum of eeprom.c, which depends only on whether the sum was 0."""
    total = 0
    for octet in text:
        total = ((1 if total else 0) + octet) % 256
    return total


# Its parser: places on the machine, in 32-bit floats.


class _Parser(GrblParser):
    """grbl's parser with its own frames and tool lengths. The result of a line is `actions` in
    their order, then the moves of the path, a probing move among them, then `flow`."""

    def __init__(
        self, machine: Machine[GrblController, GrblDialect], path: ToolpathBuilder, memory: _Memory
    ) -> None:
        super().__init__(machine, path, ParserNotes())
        self._memory, self._rows = memory, path
        self._zero = (0.0, 0.0, 0.0)
        self.places = list(memory.frames[0])
        """Zero (3,) of the frame in force."""
        self.offset = [0.0, 0.0, 0.0]
        self.length = 0.0
        self.rpm = 0.0
        self.tool = 0
        self.actions: list[tuple[Any, ...]] = []
        self.flow: int | None = None
        self.probes = 0
        """The motion of the line, if it probes: 140 for G38.2 to 143."""
        self.jogs = False
        self.power = 0.0
        """The speed of the spindle that goes with the moves of the line."""
        self.checking = False

    def line(self, text: str) -> None:
        """Parse a line; LineFault where grbl refuses it."""
        self.actions, self.flow, self.probes, self.jogs = [], None, 0, False
        super().line(text)

    def set_position(self, place: Sequence[float]) -> None:
        """Set the position of the parser, mm on the machine."""
        self.position[:] = [_single(value) for value in place]
        self._rows.set_position(*self.position)
        self._rows.drain()

    def zero_of(self, axis: int) -> float:
        """Return the zero of an axis's program coordinates on the machine, mm."""
        value = _single(self.places[axis] + self.offset[axis])
        return _single(value + self.length) if axis == 2 else value

    def _word(self, block: GrblBlock, letter: str, value: float, digits: str, column: int) -> None:
        read = _read_float(digits, 0)
        super()._word(block, letter, value if read is None else read[0], digits, column)

    def _probe_word(self, block: GrblBlock, hundredths: int, column: int) -> str:
        block.modes.motion = PROBES + (hundredths - 20) // 10
        return "motion"

    def _words(self, block: GrblBlock) -> dict[int, float]:
        mm = MM_PER_INCH if block.modes.inches else 1.0
        coordinates = {k: block.numbers["XYZ"[k]] for k in range(3) if "XYZ"[k] in block.numbers}
        return {k: _single(value * np.float32(mm)) for k, value in coordinates.items()}

    def _frame_of(self, block: GrblBlock) -> list[float]:
        if block.modes.frame == self.modes.frame:
            return self.places
        return self._memory.frames[block.modes.frame]

    def _target(self, block: GrblBlock, words: dict[int, float], unused: set[str]) -> list[float]:
        super()._target(block, words, unused)  # for its checks only
        target = list(self.position)
        if block.once in ("G10", "G92") or block.uses == LENGTH:
            return target
        frame = self._frame_of(block)
        for k, value in words.items():
            if block.once == "G53":
                target[k] = value
            elif block.modes.absolute:
                target[k] = _single(value + _single(frame[k] + self.offset[k]))
                target[k] = _single(target[k] + self.length) if k == 2 else target[k]
            else:
                target[k] = _single(value + self.position[k])
        return target

    def _use_frame(self) -> None:
        """Do nothing: the twin's moves are in machine coordinates."""

    def _shift(self) -> list[float]:
        return [0.0, 0.0, 0.0]

    def _try_homing(self, block: GrblBlock, target: list[float]) -> bool:
        return False

    def _jog(self, block: GrblBlock, target: list[float], feed: float) -> None:
        self.jogs, self.power = True, self.rpm
        super()._jog(block, target, feed)

    def _execute(
        self,
        block: GrblBlock,
        target: list[float],
        centre: tuple[float, float] | None,
        feed: float,
    ) -> None:
        numbers, modes, before, do = block.numbers, block.modes, self.modes, self.actions.append
        words = self._words(block)
        self.modes, self.feed = modes, feed
        rpm = numbers.get("S", self.rpm)
        moves = block.uses == MOTION and bool(words)
        dark = self.laser and modes.motion not in (1, 2, 3)
        relit = self.laser and not moves and self._relights(block, before)
        if (
            (rpm != self.rpm or relit)
            and before.spindle is not None
            and not (self.laser and moves)
        ):
            do(("spindle", before.spindle, 0.0 if dark else rpm))
        self.rpm, self.power = rpm, 0.0 if dark else rpm
        self.tool = int(numbers.get("T", 0.0))
        if modes.spindle != before.spindle:
            do(("spindle", modes.spindle, self.power))
        if (modes.mist, modes.flood) != (before.mist, before.flood):
            do(("coolant", modes.mist, modes.flood))
        if block.once == "G4":
            do(("dwell", numbers["P"]))
        if block.uses == LENGTH:
            length = words.get(2, 0.0) if block.length == "set" else 0.0
            if length != self.length:
                self.length = length
                do(("offsets",))
        if modes.frame != before.frame:
            self.places = list(self._memory.frames[modes.frame])
            do(("offsets",))
        self._do_non_modal(block, words, target)
        if moves and modes.motion != 80 and block.once not in ("G28", "G30"):
            self.probes = modes.motion if modes.motion >= PROBES else 0
            if self.probes:
                self._go(Kind.LINE, target, feed)
            else:
                self._move(block, target, centre, feed)
        self.flow = block.flow if block.flow != 1 else None

    def _do_non_modal(
        self, block: GrblBlock, words: dict[int, float], target: list[float]
    ) -> None:
        action, do = block.once, self.actions.append
        if action == "G10":
            number = math.trunc(block.numbers.get("P", 0.0))
            index = number - 1 if number > 0 else block.modes.frame
            values = list(self._memory.frames[index])
            for k, value in words.items():
                if block.numbers["L"] == 20:
                    value = _single(_single(self.position[k] - self.offset[k]) - value)
                    value = _single(value - self.length) if k == 2 else value
                values[k] = value
            do(("store", self._memory.frames[index], values))
            if block.modes.frame == index:
                self.places = values
                do(("offsets",))
        elif action in ("G28", "G30"):
            self._go_home(action, words, target)
        elif action in ("G28.1", "G30.1"):
            do(("store", self._memory.homes[action[:3]], list(self.position)))
        elif action == "G92":
            frame = self._frame_of(block)
            for k, value in words.items():
                value = _single(_single(self.position[k] - frame[k]) - value)
                self.offset[k] = _single(value - self.length) if k == 2 else value
            do(("offsets",))
        elif action == "G92.1":
            self.offset = [0.0, 0.0, 0.0]
            do(("offsets",))

    def _home_of(self, action: str) -> list[float]:
        return list(self._memory.homes[action])

    def rewind(self) -> None:
        """Reset most modes, as M2 and M30 do; in check mode the zero of the frame stays."""
        self.modes = ParserModes(motion=1, inches=self.modes.inches)
        if not self.checking:
            self.places = list(self._memory.frames[0])


class GrblTwin(Twin):
    """A virtual grbl that has just been switched on."""

    settings = GrblTwinSettings
    wire = "115200 8N1"
    byte_s = 10.0 / 115200.0

    _alarm: int
    _turn_at_s: float | None
    _holding: bool
    _ended: bool
    _probing: int | None

    def __init__(
        self, machine: Machine[GrblController, GrblDialect], choices: GrblTwinSettings
    ) -> None:
        super().__init__(Slides(machine))
        self._machine, self._choices = machine, choices
        self._memory = _Memory(machine, homing=choices.homing == "on")
        self._slide_step_mm = coded_steps_mm(machine)
        zero = np.rint(np.array(machine.controller.machine_zero_mm) / self._slide_step_mm)
        self._first = -zero.astype(np.int64)
        self._ends_mm = self._travel_ends(machine, zero * self._slide_step_mm)
        self._signs: Ints = np.ones(3, dtype=np.int64)
        self._origin: Ints = zero.astype(np.int64)
        self._others = {*SPINDLE_OVERRIDES, SPINDLE_STOP, TOGGLE_FLOOD}
        self._others |= {TOGGLE_MIST} if machine.coolant.mist else set()
        self._greeted = False
        self._power_up()
        self._go_on()
        self._out.clear()

    def _travel_ends(
        self, machine: Machine[GrblController, GrblDialect], zero: Floats
    ) -> tuple[Floats, Floats] | None:
        """Return the lower and upper positions, mm, at which the slides close the limit switches;
        None without switches."""
        if self._choices.homing == "off":
            return None
        travel = [axis.travel_mm or DEFAULTS[130] for axis in machine.axes]
        return zero - np.array(travel), zero

    def _power_up(self) -> None:
        self._clear()
        self._state = "Alarm" if self._memory.settings[22] else "Idle"
        self._probe_steps: Ints = np.zeros(3, dtype=np.int64)
        self._until_s = self.now
        self._motor_s: float | None = None
        self._main = self._forever()

    def connect(self, now: float) -> bytes:
        """Reset the board by DTR, as if it were switched on. The slides stay where they are, and
        that place counts as the one at which the twin was created."""
        output = self.advance(now)
        if self._choices.opening == "nothing":
            return output
        self.slides.stop(now)
        self._set_steps(self._first)
        self._greeted = True
        self._power_up()
        self._go_on()
        return output + self._take_output()

    def _slide_steps(self) -> Ints:
        return np.rint(self.slides.commanded_mm / self._slide_step_mm).astype(np.int64)

    @property
    def _steps(self) -> Ints:
        """Position (3,) in steps by grbl's own count (`sys_position`)."""
        return np.asarray(self._signs * (self._slide_steps() - self._origin))

    def _set_steps(self, steps: Ints) -> None:
        """Set the position counter; nothing moves."""
        self._origin = self._slide_steps() - self._signs * steps

    def _mm(self, steps: Ints) -> list[float]:
        """Convert step counts to positions on the machine, mm, with the firmware's arithmetic."""
        pairs = zip(steps.tolist(), self._steps_per_mm(), strict=True)
        return [_single(np.float32(n) / np.float32(per)) if per else 0.0 for n, per in pairs]

    def _steps_per_mm(self) -> list[float]:
        return [self._memory.settings[100 + k] for k in range(3)]

    def _is_set(self, number: int) -> bool:
        return self._memory.settings[number] != 0.0

    def _say(self, text: str) -> None:
        self._out += text.encode("latin-1")

    def _message(self, text: str) -> None:
        self._say(f"[MSG:{text}]\r\n")

    @property
    def is_moving(self) -> bool:
        """True while slides move or a dwell runs, but not during a hold."""
        return self.slides.ends_s is not None or self._running or self._dwells

    @property
    def state(self) -> str:
        """State as in the status report; "Start" while it restarts and reports nothing."""
        if self._starting:
            return "Start"
        if self._state == "Hold":
            if "jog" in self._suspend:
                return "Jog"
            return "Hold:0" if "held" in self._suspend else "Hold:1"
        if self._state != "Door":
            return self._state
        if "restoring" in self._suspend:
            return "Door:3"
        if "retracted" not in self._suspend:
            return "Door:2"
        return "Door:1" if "ajar" in self._suspend else "Door:0"

    # Interrupts: bytes, the motors, the switches.

    def _receive_byte(self, octet: int) -> None:
        named = {STATUS: "report", RESUME: "start", HOLD: "hold", DOOR: "door"}
        if octet == RESET:
            self._kill()
        elif octet in named:
            self._flags.add(named[octet])
        elif octet == JOG_CANCEL:
            if self._state == "Jog":
                self._flags.add("cancel")
        elif octet in FEED_OVERRIDES or octet in RAPID_OVERRIDES:
            self._motion_overrides.add(octet)
        elif octet in self._others:
            self._other_overrides.add(octet)
        elif octet <= 0x7F and len(self._rx) < RX_BYTES:
            self._rx.append(octet)

    def _kill(self) -> None:
        """Reset (`mc_reset`): stop spindle and coolant, and also the motors if they run."""
        if "reset" in self._flags:
            return
        self._flags.add("reset")
        self._lit = self._flood = self._mist = False
        if self._state in ("Run", "Home", "Jog") or self._holding:
            if self._state == "Home":
                self._alarm = self._alarm or HOMING_RESET
            else:
                self._alarm = ABORTED
            self.slides.stop(self.now)
            self._running = False
            self._go_idle()

    def _go_idle(self) -> None:
        """End the motion of the motors (`st_go_idle`). Unless they stay on, nothing else happens
        for the time `$1`."""
        delay = self._memory.settings[1]
        if (delay != ALWAYS_ON or self._alarm or self._state == "Sleep") and self._state != "Home":
            self._motor_s = self.now + delay / 1000.0

    def next_s(self) -> float | None:
        """Return the time of the next wake-up: outputs of steps send nothing."""
        return self.wake_s()

    def wake_s(self) -> float | None:
        times = [self.slides.ends_s, self._motor_s, self._turn_at_s, *self._touches[:1]]
        if self._until_s > self.now:
            times.append(self._until_s)
        return min((time_s for time_s in times if time_s is not None), default=None)

    def _wake(self) -> None:
        if self._touches and self.now >= self._touches[0]:
            self._touches.pop(0)
            self._check_contacts()
        if self._turn_at_s is not None and self.now >= self._turn_at_s:
            self._turn_at_s, self._stopping = None, self._holding
            if self._running:
                self._plan_block()
        if self._running and self.slides.ends_s is None:
            self._block_over()
        if self._motor_s is not None and self.now >= self._motor_s:
            self._motor_s = None
        self._go_on()

    def _make_outputs(self) -> None:
        self.slides.advance(self.now)
        if not (self._running and self.slides.ends_s is None):
            self._go_on()

    def _go_on(self) -> None:
        """Let the main program run until it waits again."""
        while self._motor_s is None and self.now >= self._until_s:
            if self._ended:
                self._ended = False
                self._flags.add("stop")
            wait = next(self._main)
            if wait is None:
                break
            self._until_s = wait

    # The main program.

    def _forever(self) -> Wait:
        """Start, work until a reset, and start again (main.c)."""
        while True:
            self._clear()
            self._starting = False
            if self._greeted:
                self._say(BANNER)
            try:
                yield from self._main_loop()
            except _Abort:
                self._greeted = self._starting = True
            self._ended = self._running = False
            self.slides.stop(self.now)
            if self._memory.settings[1] != ALWAYS_ON or self._alarm or self._state == "Sleep":
                yield self.now + self._memory.settings[1] / 1000.0

    def _clear(self) -> None:
        """Set all state that a reset clears to its initial value."""
        self._rx, self._line = bytearray(), bytearray(TEXT_BYTES)
        self._flags: set[str] = set()
        self._motion_overrides: set[int] = set()
        self._other_overrides: set[int] = set()
        self._suspend: set[str] = set()
        self._alarm = 0
        self._ring: list[_Planned] = []
        self._last = NO_BLOCKS
        self._phases: list[Phase] = []
        self._begun_s, self._done_mm, self._speed, self._events = 0.0, 0.0, 0.0, 0
        self._running = self._holding = self._stopping = self._ended = self._dwells = False
        self._stale = False  # True: the running block's plan differs from the ring's
        self._turn_at_s = None
        self._touches: list[float] = []
        self._probing = None
        self._probed = self._away = self._soft_limit_hit = False
        self._probe_steps = np.zeros(3, dtype=np.int64)
        self._feed_percent = self._rapid_percent = self._spindle_percent = 100
        self._wco_in = self._ov_in = 0
        self._stop_override = ""
        self._lit = self._ccw = self._flood = self._mist = False
        self._rpm, self._fresh_rpm = 0.0, False
        self._piece_s, self._closed_limits, self._ending = self.now, [False] * 3, ""
        self._path = ToolpathBuilder()
        self._parser = _Parser(self._machine, self._path, self._memory)
        self._parser.laser = self._is_set(32)
        self._adopt_position()

    def _adopt_position(self) -> None:
        """Set the positions of planner and parser to that of the slides."""
        self._planned: Ints = self._steps[None, :]
        self._parser.set_position(self._mm(self._steps))

    def _main_loop(self) -> Wait:
        """Execute lines, one after another (`protocol_main_loop`)."""
        if self._is_set(21) and any(self._limits()):
            self._state = "Alarm"
            self._message("Check Limits")
        if self._state in ("Alarm", "Sleep"):
            self._message("'$H'|'$X' to unlock")
            self._state = "Alarm"
        else:
            self._state = "Idle"
            yield from self._startup()
        self._raw = bytearray()
        while True:
            while self._rx:
                octet = self._rx.pop(0)
                if octet not in b"\r\n":
                    self._raw.append(octet)
                    continue
                raw, self._raw = bytes(self._raw), bytearray()
                yield from self._realtime()
                yield from self._execute_and_answer(raw)
            self._start_cycle()
            yield from self._realtime()
            if not self._flags and not self._rx:
                yield None

    def _execute_and_answer(self, raw: bytes) -> Wait:
        """Execute a line and send its answer. A reset during its execution stays in force, and the
        answer is ok."""
        self._ending = ""
        try:
            code = yield from self._execute(raw)
        except _Abort:
            self._say(f"{self._ending}ok\r\n")
            raise
        self._answer(code)

    def _answer(self, code: int) -> None:
        self._say(f"error:{code}\r\n" if code else "ok\r\n")

    def _execute(self, raw: bytes) -> Line:
        text = _strip(raw)
        max_chars = self._machine.dialect.line_chars
        line_bytes = text[:max_chars].encode("latin-1")
        self._line[: len(line_bytes) + 1] = line_bytes + b"\0"
        if len(text) > max_chars:
            return TOO_LONG
        if not text:
            if raw.strip():
                self.decoded.append(raw)
            return OK
        if text[0] == "$":
            code = yield from self._command(text)
            if not code:
                self.commands.append(raw)
            return code
        if self._state in ("Alarm", "Jog"):
            return LOCKED
        return (yield from self._block(text, raw))

    def _startup(self) -> Wait:
        """Execute the startup lines, at the beginning and after homing."""
        for number in range(START_LINES):
            if not self._memory.load(number, self._line):
                self._say(">:")
                self._answer(READ_FAILED)
                continue
            text = self._line_text()
            if text:
                try:
                    code = yield from self._block(text, None)
                except _Abort:
                    self._say(f">{text}:ok\r\n")
                    raise
                self._say(f">{text}:")
                self._answer(code)

    def _line_text(self) -> str:
        return self._line.split(b"\0")[0].decode("latin-1")

    # Waiting.

    def _realtime(self) -> Wait:
        """Carry out pending flags, and wait while the machine is suspended
        (`protocol_execute_realtime`)."""
        yield from self._system()
        if self._suspend:
            yield from self._wait_suspended()

    def _delay(self, seconds: float) -> Wait:
        until = self.now + seconds
        while self.now < until:
            yield until

    def _idle_delay(self) -> Wait:
        """Wait until the motors are switched off, unless they stay on ($1)."""
        if self._memory.settings[1] != ALWAYS_ON:
            yield from self._delay(self._memory.settings[1] / 1000.0)

    def _synchronise(self) -> Wait:
        """Wait until the ring is empty and the motors stand (`protocol_buffer_synchronize`)."""
        self._start_cycle()
        while True:
            yield from self._realtime()
            if not self._ring and self._state != "Run":
                return
            yield None

    def _start_cycle(self) -> None:
        if self._ring:
            self._flags.add("start")

    def _dwell(self, seconds: float, *, can_hold: bool = True) -> Wait:
        for _ in range(round(dwell_s(seconds) / DWELL_STEP_S)):
            if can_hold:
                yield from self._realtime()
            else:
                yield from self._system()
                if "again" in self._suspend:
                    break
            self._dwells = True
            yield from self._delay(DWELL_STEP_S)
            self._dwells = False

    # Flags (`protocol_exec_rt_system`).

    def _system(self) -> Wait:
        if self._alarm:
            code, self._state = self._alarm, "Alarm"
            self._say(f"ALARM:{code}\r\n")
            yield from self._delay(ALARM_S)
            if code in (HARD_LIMIT, SOFT_LIMIT):
                self._message("Reset to continue")
                self._flags.discard("reset")
                while "reset" not in self._flags:
                    yield None
            self._alarm = 0
        flags = set(self._flags)
        if "reset" in flags:
            raise _Abort
        if "report" in flags:
            self._report()
            self._flags.discard("report")
        if flags & {"cancel", "hold", "door", "sleep"}:
            self._hold(flags)
            self._flags -= {"cancel", "hold", "door", "sleep"}
        if "start" in flags:
            if not flags & {"hold", "cancel", "door"}:
                self._resume()
            self._flags.discard("start")
        if "stop" in flags:
            self._end_cycle()
            self._flags.discard("stop")
        self._override_motion()
        self._override_others()
        if self._stale and self._running and self._turn_at_s is None:
            self._replan_later()

    def _hold(self, flags: set[str]) -> None:
        """Carry out the real-time commands that stop the machine: hold, jog cancel, door and
        sleep."""
        if self._state not in ("Alarm", "Check"):
            if self._state in ("Run", "Jog") and not self._suspend & {"cancel", "jog"}:
                self._holding = self._stale = True
                if self._state == "Jog" and "sleep" not in flags:
                    self._suspend.add("jog")
            if self._state == "Idle":
                self._suspend = {"held"}
            if "cancel" in flags and self._state != "Jog":
                self._suspend.add("cancel")
            if "hold" in flags and self._state not in ("Door", "Jog", "Sleep"):
                self._state = "Hold"
            if "door" in flags:
                self._message("Check Door")
                if "jog" not in self._suspend:
                    if self._state == "Door" and "restoring" in self._suspend:
                        self._suspend -= {"retracted", "restoring", "restored"}
                        self._suspend.add("again")
                    if self._state != "Sleep":
                        self._state = "Door"
                self._suspend.add("ajar")
        if "sleep" in flags:
            if self._state == "Alarm":
                self._suspend |= {"retracted", "held"}
            self._state = "Sleep"

    def _resume(self) -> None:
        """Execute a cycle start: begin to move, or resume a hold."""
        if self._state == "Door" and "ajar" not in self._suspend:
            if "restored" in self._suspend:
                self._state = "Idle"
            elif "retracted" in self._suspend:
                self._suspend.add("restoring")
        is_held = self._state == "Hold" and "held" in self._suspend
        if self._state != "Idle" and not is_held:
            return
        if is_held and self._stop_override:
            self._stop_override = "cycle"
            return
        self._holding = self._stopping = False
        begins = bool(self._ring) and "cancel" not in self._suspend
        self._suspend = set()
        self._state = "Run" if begins else "Idle"
        if begins:
            self._set_out()

    def _set_out(self) -> None:
        """Start the motion of the ring's first block: wake the motors and plan its first
        segments."""
        self._running, self._phases, self._speed = True, [], 0.0
        self._fresh_rpm = True
        self._set_block_power(self._ring[0])
        self._plan_block()

    def _end_cycle(self) -> None:
        """Execute the flag that the motors have come to rest."""
        if (
            self._state in ("Hold", "Door", "Sleep")
            and not self._soft_limit_hit
            and "jog" not in self._suspend
        ):
            if self._holding:
                self._suspend.add("held")
            self._holding = False
            return
        if "jog" in self._suspend:
            self._holding = self._stopping = False
            self._forget_blocks()
            self._adopt_position()
            if self._memory.settings[1] != ALWAYS_ON:
                self._until_s = self.now + self._memory.settings[1] / 1000.0
        if "ajar" in self._suspend:
            self._suspend.discard("jog")
            self._suspend.add("held")
            self._state = "Door"
        else:
            self._suspend, self._state = set(), "Idle"

    def _forget_blocks(self) -> None:
        self._ring.clear()
        self._last = NO_BLOCKS
        self._done_mm, self._events, self._phases, self._speed = 0.0, 0, [], 0.0
        self._running = self._stale = self._stopping = False

    def _override_motion(self) -> None:
        changes, self._motion_overrides = self._motion_overrides, set()
        if not changes:
            return
        feed, rapid = _percent(self._feed_percent, FEED_OVERRIDES, changes), self._rapid_percent
        for octet, percent in RAPID_OVERRIDES.items():
            rapid = percent if octet in changes else rapid
        if (feed, rapid) != (self._feed_percent, self._rapid_percent):
            self._feed_percent, self._rapid_percent = feed, rapid
            self._ov_in, self._stale = 0, True

    def _override_others(self) -> None:
        changes, self._other_overrides = self._other_overrides, set()
        percent = _percent(self._spindle_percent, SPINDLE_OVERRIDES, changes)
        if percent != self._spindle_percent:
            self._spindle_percent = percent
            if self._state == "Idle":
                self._spin(self._parser.modes.spindle, self._parser.rpm)
            else:
                self._fresh_rpm = True
            self._ov_in = 0
        if SPINDLE_STOP in changes and self._state == "Hold":
            if not self._stop_override:
                self._stop_override = "begin"
            elif self._stop_override == "on":
                self._stop_override = "restore"
        toggled = changes & {TOGGLE_FLOOD, TOGGLE_MIST}
        if toggled and self._state in ("Idle", "Run", "Hold", "Jog"):
            modes = self._parser.modes
            modes.flood ^= TOGGLE_FLOOD in toggled
            modes.mist ^= TOGGLE_MIST in toggled
            self._cool(mist=modes.mist, flood=modes.flood)

    # While it is held, its door is open, or it sleeps (`protocol_exec_rt_suspend`).

    def _wait_suspended(self) -> Wait:
        block = self._ring[0] if self._ring else None
        spindle = block.spindle if block else self._parser.modes.spindle
        rpm = block.rpm if block else self._parser.rpm
        cooled = (self._mist, self._flood) if block else _coolant_of(self._parser.modes)
        if self._is_set(32):
            self._other_overrides.add(SPINDLE_STOP)
        while self._suspend:
            before = self._snapshot()
            if "held" in self._suspend:
                if self._state in ("Door", "Sleep"):
                    yield from self._wait_retracted(spindle, rpm, cooled)
                else:
                    self._spindle_while_held(spindle, rpm)
            yield from self._system()
            if self._suspend and not self._flags and before == self._snapshot():
                yield None

    def _snapshot(self) -> tuple[Any, ...]:
        return self._state, frozenset(self._suspend), self._stop_override, self._fresh_rpm

    def _wait_retracted(self, spindle: Kind | None, rpm: float, cooled: tuple[bool, bool]) -> Wait:
        """Stop spindle and coolant; then sleep for ever, or wait at the open door until the
        program is resumed."""
        if "retracted" not in self._suspend:
            self._stop_override = ""
            self._switch_off()
            self._suspend.discard("again")
            self._suspend.add("retracted")
            return
        if self._state == "Sleep":
            self._message("Sleeping")
            self._switch_off()
            yield from self._delay(self._memory.settings[1] / 1000.0)
            while True:
                yield from self._system()
                yield None
        self._suspend.discard("ajar")  # no door is wired
        if "restoring" not in self._suspend:
            return
        if self._parser.modes.spindle is not None and "again" not in self._suspend:
            if self._is_set(32):
                self._fresh_rpm = True
            else:
                self._spin(spindle, rpm)
                yield from self._dwell(DOOR_SPINDLE_S, can_hold=False)
        if any(_coolant_of(self._parser.modes)) and "again" not in self._suspend:
            self._cool(mist=cooled[0], flood=cooled[1])
            yield from self._dwell(DOOR_COOLANT_S, can_hold=False)
        if "again" not in self._suspend:
            self._suspend.add("restored")
            self._flags.add("start")

    def _spindle_while_held(self, spindle: Kind | None, rpm: float) -> None:
        """Stop the spindle of a held machine, or start it again."""
        if self._stop_override == "begin":
            if self._parser.modes.spindle is not None:
                self._spin(None, 0.0)
                self._stop_override = "on"
            else:
                self._stop_override = ""
        elif self._stop_override in ("restore", "cycle"):
            if self._parser.modes.spindle is not None:
                self._message("Restoring spindle")
                if self._is_set(32):
                    self._fresh_rpm = True
                else:
                    self._spin(spindle, rpm)
            if self._stop_override == "cycle":
                self._flags.add("start")
            self._stop_override = ""
        elif not self._stop_override and self._fresh_rpm:
            self._spin(spindle, rpm)
            self._fresh_rpm = False

    # Spindle and coolant.

    def _speed_of(self, rpm: float) -> tuple[float, bool]:
        """Return the speed that the controller reports, and whether its output is on
        (`spindle_compute_pwm_value`)."""
        min_rpm, max_rpm = self._memory.settings[31], self._memory.settings[30]
        percent = np.float32(0.010) * np.float32(self._spindle_percent)
        rpm_wanted = _single(np.float32(rpm) * percent)
        if min_rpm >= max_rpm or rpm_wanted >= max_rpm:
            return max_rpm, True
        if rpm_wanted <= min_rpm:
            return (0.0, False) if rpm_wanted == 0.0 else (min_rpm, True)
        return rpm_wanted, True

    def _spin(self, spindle: Kind | None, rpm: float) -> None:
        """Set the spindle at once (`spindle_set_state`)."""
        if spindle is None:
            self._rpm, self._lit = 0.0, False
        else:
            self._ccw = spindle == Kind.SPINDLE_CCW
            if self._is_set(32) and self._ccw:
                rpm = 0.0
            self._rpm, self._lit = self._speed_of(rpm)
        self._ov_in = 0

    def _switch_off(self) -> None:
        self._spin(None, 0.0)
        self._cool(mist=False, flood=False)

    def _cool(self, *, mist: bool, flood: bool) -> None:
        self._mist, self._flood = mist, flood
        self._ov_in = 0

    def _spin_at_rest(self, spindle: Kind | None, rpm: float) -> Wait:
        if self._state != "Check":
            yield from self._synchronise()
            self._spin(spindle, rpm)

    def _set_block_power(self, block: _Planned) -> None:
        """Set the spindle's output for the segments of a block. In laser mode with M4 the power
        follows the speed, so it is off when the block has ended."""
        adjusted = self._is_set(32) and block.spindle == Kind.SPINDLE_CCW
        if block.spindle is None:
            self._rpm, self._lit = 0.0, False
        else:
            self._rpm, self._lit = self._speed_of(0.0 if adjusted else block.rpm)
        self._fresh_rpm = False

    # A block of a program.

    def _block(self, text: str, raw: bytes | None) -> Line:
        parser = self._parser
        parser.checking, parser.laser = self._state == "Check", self._is_set(32)
        stood = list(parser.position)
        try:
            parser.line(text)
        except LineFault as fault:
            return _code(fault)
        path = self._path.drain()
        if parser.jogs:
            return (yield from self._run_jog(path, stood))
        if raw is not None:
            self.decoded.append(raw)
        if parser.flow in (2, 30):
            self._ending = "[MSG:Pgm End]\r\n"
        power, flow, probes = parser.power, parser.flow, parser.probes
        for action in parser.actions:
            yield from self._do_action(*action)
        if probes:
            yield from self._probe(path, probes, stood)
        else:
            for row in range(len(path)):
                yield from self._line_to(path, row, power, len(self.decoded) - 1)
        if flow is not None:
            yield from self._end_or_pause(flow)
        return OK

    def _do_action(self, action: str, *values: Any) -> Wait:
        """Carry out an action of a block other than motion."""
        if action == "spindle":
            yield from self._spin_at_rest(*values)
        elif action == "coolant":
            if self._state != "Check":
                yield from self._synchronise()
                self._cool(mist=values[0], flood=values[1])
        elif action == "dwell":
            if self._state != "Check":
                yield from self._synchronise()
                yield from self._dwell(values[0])
        elif action == "store":
            place, written = values
            yield from self._synchronise()
            place[:] = written
        else:
            yield from self._offsets_changed()

    def _offsets_changed(self) -> Wait:
        yield from self._synchronise()
        self._wco_in = 0

    def _end_or_pause(self, flow: int) -> Wait:
        """Carry out M0, M2 and M30."""
        yield from self._synchronise()
        if flow == 0:
            if self._state != "Check":
                self._flags.add("hold")
                yield from self._realtime()
            return
        self._parser.rewind()
        self._feed_percent = self._rapid_percent = self._spindle_percent = 100
        if self._state != "Check":
            yield from self._offsets_changed()
            self._switch_off()
        self._message("Pgm End")
        self._ending = ""

    def _run_jog(self, path: Toolpath, stood: list[float]) -> Line:
        if self._is_set(20) and self._is_beyond_travel(self._parser.position):
            self._parser.set_position(stood)
            return BEYOND_TRAVEL
        for row in range(len(path)):
            yield from self._line_to(path, row, self._parser.rpm, -1, jogs=True)
        if self._state == "Idle" and self._ring:
            self._state = "Jog"
            self._set_out()
        return OK

    def _is_beyond_travel(self, target: Sequence[float]) -> bool:
        """Return True if a place is outside the travel, which extends from machine zero in the
        negative direction."""
        travel = [self._memory.settings[130 + k] for k in range(3)]
        return any(
            value > 0.0 or value < -travel_mm
            for value, travel_mm in zip(target, travel, strict=True)
        )

    def _soft_check(self, target: Sequence[float]) -> Wait:
        """Refuse a target beyond the travel: hold, then raise an alarm that only a reset ends."""
        if not self._is_beyond_travel(target):
            return
        self._soft_limit_hit = True
        if self._state == "Run":
            self._flags.add("hold")
            while self._state != "Idle":
                yield from self._realtime()
                if self._state != "Idle":
                    yield None
        self._kill()
        self._alarm = SOFT_LIMIT
        yield from self._realtime()

    def _line_to(
        self, path: Toolpath, row: int, power: float, owner: int, *, jogs: bool = False
    ) -> Wait:
        """Put the blocks of a move into the ring; wait while the ring is full (`mc_line`)."""
        if self._is_set(20) and not jogs:
            yield from self._soft_check(path.end[row].tolist())
        if self._state == "Check":
            return
        yield from self._realtime()
        machine, controller = self._machine, self._machine.controller
        rows = np.array([row])
        own_blocks, self._planned, target_count = blocks_from(
            self._planned, path, rows, machine, controller
        )
        spindle = self._parser.modes.spindle
        if len(own_blocks) < target_count and self._is_set(32) and spindle == Kind.SPINDLE_CW:
            yield from self._spin_at_rest(spindle, power)
        if not len(own_blocks):
            return
        last = self._last if self._ring or self._running else NO_BLOCKS
        last = replace(last, row=np.full(len(last), row, np.int32))
        own_blocks = replace(own_blocks, row=np.full(len(own_blocks), row, np.int32))
        stops = stops_of(path, controller)
        plan = speeds_of(
            join_blocks([last, own_blocks]), path, machine, FROM_REST, len(last), stops
        )
        travels = own_blocks.way * coded_steps_mm(machine)
        units = travels / np.linalg.norm(travels, axis=1)[:, None]
        highest = max_along(axis_limits(machine, "max_rate_mm_min") / 60.0, units)
        self._last = own_blocks.part(len(own_blocks) - 1, len(own_blocks))
        for k in range(len(own_blocks)):
            while len(self._ring) >= controller.buffer_blocks - 1:
                self._start_cycle()
                yield from self._realtime()
                if len(self._ring) >= controller.buffer_blocks - 1:
                    yield None
            self._ring.append(
                _Planned(
                    own_blocks.start[k].astype(np.int64),
                    own_blocks.way[k].astype(np.int64),
                    float(plan.length_mm[k]),
                    float(path.feed[row]) / 60.0 if path.is_feed[row] else float(highest[k]),
                    float(plan.speed_mm_s[k]),
                    float(highest[k]),
                    float(plan.acceleration_mm_s2[k]),
                    float(plan.corner_mm_s[k]),
                    not path.is_feed[row],
                    jogs or bool(self._probing),
                    spindle,
                    power,
                    owner,
                )
            )
            self._stale = True
            if self._running and self._turn_at_s is None:
                self._plan_block()

    # The probe and the switches.

    def _limits(self) -> list[bool]:
        """Return for X, Y and Z whether the pin of the limit switch reports it as closed."""
        if self._ends_mm is None:
            closed = [False] * 3
        else:
            closed = self._beyond_switches(self.slides.commanded_mm, self._ends_mm).tolist()
        return [each != self._is_set(5) for each in closed]

    def _beyond_switches(self, mm: Floats, ends_mm: tuple[Floats, Floats]) -> Bools:
        """Return a mask (…, 3), true for axes whose slide at `mm` is beyond the switch at its
        end."""
        (low, high), eps = ends_mm, 0.5 * self._slide_step_mm
        return np.asarray((mm > high + eps) | (mm < low - eps))

    def _touches_probe(self) -> bool:
        """Return True if the probe counts as touching; $6, and G38.4 and G38.5, invert the pin."""
        closed = bool(self._closes_probe(self.slides.commanded_mm))
        return (closed != self._is_set(6)) != self._away

    def _closes_probe(self, mm: Floats) -> Bools:
        """Return a mask (…), true for places (…, 3) at which the probe touches the blank or is
        inside it."""
        machine_zero = np.array(self._machine.controller.machine_zero_mm)
        return self._choices.closes(mm - machine_zero, 0.5 * float(self._slide_step_mm[2]))

    def _has_touched(self) -> bool:
        """Return True once the probing move under way has ended at the probe."""
        return self._probing is None

    def _probe(self, path: Toolpath, motion: int, stood: list[float]) -> Wait:
        """Execute G38.2 to G38.5 (`mc_probe_cycle`): move until the probe touches, and report
        where."""
        if self._state == "Check":
            return
        target = list(self._parser.position)
        self._parser.set_position(stood)
        yield from self._synchronise()
        self._probed, self._away = False, motion >= PROBES + 2
        if self._touches_probe():
            self._alarm = PROBE_TOUCHES
            yield from self._realtime()
            self._away = False
            return
        self._probing = motion
        owner = len(self.decoded) - 1
        for row in range(len(path)):
            yield from self._line_to(path, row, self._parser.power, owner)
        self._start_cycle()
        while True:
            yield from self._realtime()
            if self._state == "Idle":
                break
            yield None
        if self._has_touched():
            self._probed = True
        elif motion in (PROBES + 1, PROBES + 3):
            self._probe_steps = self._steps
        else:
            self._alarm = PROBE_MISSED
        self._probing, self._away = None, False
        yield from self._realtime()
        yield from self._idle_delay()
        self._forget_blocks()
        self._planned = self._steps[None, :]
        self._say(self._probe_report())
        self._parser.set_position(self._mm(self._steps) if self._probed else target)

    def _probe_report(self) -> str:
        return f"[PRB:{self._lengths_text(self._mm(self._probe_steps))}:{int(self._probed)}]\r\n"

    def _check_contacts(self) -> None:
        """Compare probe and limit switches with their last state, at the times when a travel
        reaches one of them."""
        if self._probing is not None and self._touches_probe():
            self._probing = None
            self._probe_steps = self._steps
            self._flags.add("cancel")
        limits = self._limits()
        if limits != self._closed_limits:
            self._closed_limits = limits
            if self._is_set(21) and self._state != "Alarm" and not self._alarm:
                self._kill()
                self._alarm = HARD_LIMIT

    def _contact_times(self, commanded: Floats, seconds: Floats) -> list[float]:
        """Return the times during a travel at which the probe and each switch change for the first
        time."""
        start, times = self.slides.commanded_mm, list[float]()
        path = np.concatenate([start[None, :], commanded])
        masks = list[Bools]()
        if self._probing is not None:
            masks.append(self._closes_probe(path))
        if self._ends_mm is not None and self._is_set(21):
            masks += list(self._beyond_switches(path, self._ends_mm).T)
        for mask in masks:
            changes = np.flatnonzero(mask[1:] != mask[:-1])
            times += (self.now + seconds[changes]).tolist()
        self._closed_limits = self._limits()
        return sorted(times)

    # Lines that begin with $ (`system_execute_line`).

    def _command(self, text: str) -> Line:
        head, argument = text[1:2], text[2:]
        if head == "":
            self._say(HELP)
        elif head == "J":
            if self._state not in ("Idle", "Jog"):
                return NOT_IDLE
            if not argument.startswith("="):
                return BAD_STATEMENT
            return (yield from self._block(text, b""))
        elif head in "$GCX":
            return self._show_or_switch(head) if not argument else BAD_STATEMENT
        elif self._state not in ("Idle", "Alarm"):
            return NOT_IDLE
        elif head == "#":
            if argument:
                return BAD_STATEMENT
            self._say(self._frames())
        elif head == "H":
            return (yield from self._home(argument))
        elif head == "S":
            if argument != "LP":
                return BAD_STATEMENT
            self._flags.add("sleep")
        elif head == "I":
            return self._build(argument)
        elif head == "R":
            return (yield from self._restore(argument))
        elif head == "N":
            return (yield from self._start_lines(argument))
        else:
            return self._assign(text)
        return OK

    def _show_or_switch(self, head: str) -> int:
        if head == "$":
            if self._state in ("Run", "Hold"):
                return NOT_IDLE
            for number in self._memory.settings:
                self._say(f"${number}={self._memory.setting_text(number)}\r\n")
        elif head == "G":
            self._say(f"[GC:{self._modes()}]\r\n")
        elif head == "X":
            if self._state == "Alarm":
                self._message("Caution: Unlocked")
                self._state = "Idle"
        elif self._state == "Check":
            self._kill()
            self._message("Disabled")
        elif self._state != "Idle":
            return NOT_IDLE
        else:
            self._state = "Check"
            self._message("Enabled")
        return OK

    def _modes(self) -> str:
        """Format the modes in force as `$G` shows them."""
        parser = self._parser
        modes = parser.modes
        motion = f"38.{modes.motion - PROBES + 2}" if modes.motion >= PROBES else f"{modes.motion}"
        words = [f"G{motion}", f"G{54 + modes.frame}", f"G{modes.plane}"]
        words += ["G20" if modes.inches else "G21", "G90" if modes.absolute else "G91"]
        words += [f"G{modes.feed_mode}", WORDS[modes.spindle]]
        words += ["M7"] * modes.mist + ["M8"] * modes.flood
        words += [] if modes.mist or modes.flood else ["M9"]
        words += [
            f"T{parser.tool}",
            f"F{self._rate_text(parser.feed)}",
            f"S{_float_text(parser.rpm, 0)}",
        ]
        return " ".join(words)

    def _build(self, argument: str) -> int:
        """Carry out `$I` and `$I=`."""
        if argument and not argument.startswith("="):
            return BAD_STATEMENT
        if argument:
            self._shift_line(argument[1:])
            self._memory.store(START_LINES, self._line)
            return OK
        self._memory.load(START_LINES, self._line)
        options = "VM" if self._machine.coolant.mist else "V"
        blocks = self._machine.controller.buffer_blocks - 1
        self._say(f"[VER:{BUILD}:{self._line_text()}]\r\n[OPT:{options},{blocks},{RX_BYTES}]\r\n")
        return OK

    def _shift_line(self, text: str) -> None:
        """Write the text to the start of the line buffer, followed by a zero byte."""
        self._line[: len(text) + 1] = text.encode("latin-1") + b"\0"

    def _restore(self, argument: str) -> Line:
        if argument[:3] != "ST=" or len(argument) != 4 or argument[3] not in "$#*":
            return BAD_STATEMENT
        yield from self._synchronise()
        self._memory.restore(argument[3])
        self._use_settings()
        self._message("Restoring defaults")
        self._kill()
        return OK

    def _start_lines(self, argument: str) -> Line:
        """Carry out `$N` and `$Nx=`, which executes the line before it stores it."""
        if not argument:
            for number in range(START_LINES):
                if self._memory.load(number, self._line):
                    self._say(f"$N{number}={self._line_text()}\r\n")
                else:
                    self._answer(READ_FAILED)
            return OK
        if self._state != "Idle":
            return NOT_IDLE
        parsed = _read_float(argument, 0)
        if parsed is None:
            return BAD_NUMBER
        value, end = parsed
        if argument[end : end + 1] != "=":
            return BAD_STATEMENT
        text = argument[end + 1 :]
        self._shift_line(text)
        code = yield from self._block(text, None)
        if code:
            return code
        yield from self._synchronise()
        if _byte(value) < START_LINES:  # beyond, grbl writes over what else is in its memory
            self._memory.store(_byte(value), self._line)
        return OK

    def _assign(self, text: str) -> int:
        """Carry out `$x=value` (`settings_store_global_setting`)."""
        name = _read_float(text, 1)
        if name is None:
            return BAD_NUMBER
        if text[name[1] : name[1] + 1] != "=":
            return BAD_STATEMENT
        parsed = _read_float(text, name[1] + 1)
        if parsed is None:
            return BAD_NUMBER
        value, end = parsed
        if end != len(text) or name[0] > 255.0:
            return BAD_STATEMENT
        if value < 0.0:
            return NEGATIVE
        number = _byte(name[0])
        if number not in self._memory.settings:
            return BAD_STATEMENT
        return self._set(number, value)

    def _set(self, number: int, value: float) -> int:
        settings = self._memory.settings
        if number == 0 and _byte(value) < 3:
            return SHORT_PULSE
        if number == 20 and _byte(value) and not settings[22]:
            return NO_SOFT_LIMITS
        if number in SWITCHES:
            value = float(_byte(value) != 0)
        elif number in WHOLE:
            value = float(_byte(value))
        settings[number] = value
        if number == 13:
            self._wco_in = 0
        if number == 22 and not value:
            settings[20] = 0.0
        if number in RPM:
            self._lit = False
        self._use_settings()
        return OK

    def _use_settings(self) -> None:
        """Give the model the current `$` settings. Steps per mm and accelerations of 0, by which
        grbl would divide, are ignored."""
        settings, stood = self._memory.settings, self._steps
        is_inverted = [int(settings[3]) >> axis & 1 for axis in range(3)]
        self._signs = 1 - 2 * np.array(is_inverted, dtype=np.int64)  # wired so that $3=0 is right
        self._set_steps(stood)
        axes: dict[str, Any] = {}
        for k, name in enumerate("xyz"):
            axis_values: dict[str, Any] = {"max_rate_mm_min": settings[110 + k]}
            if settings[100 + k] > 0.0:
                axis_values["coded_step_mm"] = 1.0 / settings[100 + k]
            if settings[120 + k] > 0.0:
                axis_values["acceleration_mm_s2"] = settings[120 + k]
            axes[name] = replace(getattr(self._machine.axes, name), **axis_values)
        controller = replace(
            self._machine.controller,
            idle_delay_ms=int(settings[1]),
            junction_deviation_mm=settings[11],
            arc_tolerance_mm=settings[12],
            laser_mode=bool(settings[32]),
        )
        axes_now = replace(self._machine.axes, **axes)
        self._machine = replace(self._machine, axes=axes_now, controller=controller)

    # Homing (`limits_go_home`).

    def _home(self, argument: str) -> Line:
        if not self._is_set(22):
            return NO_HOMING
        self._state = "Home"
        if argument:
            return BAD_STATEMENT  # and it stays in this state, as grbl does
        for axes in ([2], [0, 1]):
            yield from self._find_switches(axes)
        yield from self._realtime()
        self._adopt_position()
        self._state = "Idle"
        yield from self._idle_delay()
        yield from self._startup()
        return OK

    def _find_switches(self, axes: list[int]) -> Wait:
        """Move to the switches of these axes and back, twice, the second time slowly."""
        settings = self._memory.settings
        sign = [-1 if int(settings[23]) >> axis & 1 else 1 for axis in range(3)]
        search = SEARCH * max(settings[130 + axis] for axis in axes)
        pull_off, seek, feed = settings[27], settings[25], settings[24]
        approach, retract = (1, search, seek), (-1, pull_off, seek)
        for turn, distance, rate in (approach, retract, (1, LOCATE * pull_off, feed), retract):
            start = self._steps
            for axis in axes:
                start[axis] = 0
            self._set_steps(start)
            yield from self._home_to(
                axes, [turn * each for each in sign], distance, rate, turn > 0
            )
            yield from self._delay(settings[26] / 1000.0)
        position = self._steps
        for axis in axes:
            per_mm = settings[100 + axis]
            mm = -pull_off if sign[axis] > 0 else pull_off - settings[130 + axis]
            position[axis] = int(math.copysign(math.floor(abs(mm) * per_mm + 0.5), mm))
        self._set_steps(position)

    def _home_to(
        self, axes: list[int], sign: list[int], far_mm: float, rate: float, approaches: bool
    ) -> Wait:
        """Move all axes at the same rate; in an approach, each until its switch closes."""
        step_mm = self._slide_step_mm
        counts = [round(far_mm * self._memory.settings[100 + axis]) for axis in axes]
        event_count = max(counts)
        speed = max(rate, 1.0) / 60.0
        ramps = [axis.acceleration_mm_s2 or 1.0 for axis in self._machine.axes]
        ramp = min(ramps[axis] for axis in axes)
        events = np.arange(1, event_count + 1)
        begin, steps_by_event = self._slide_steps(), np.zeros((event_count, 3), dtype=np.int64)
        lasts = list[int]()
        for axis, count in zip(axes, counts, strict=True):
            axis_steps = np.minimum(events, count)
            until = self._steps_to_switch(axis, sign[axis], count) if approaches else None
            lasts.append(count if until is None else until)
            steps_by_event[:, axis] = sign[axis] * np.minimum(axis_steps, lasts[-1])
            if approaches and until is None:
                lasts[-1] = event_count
        is_missed = approaches and any(
            self._steps_to_switch(axis, sign[axis], count) is None
            for axis, count in zip(axes, counts, strict=True)
        )
        last = max(lasts)
        phases = _trapezoid(far_mm, 0.0, speed, ramp, 0.0)
        distances = far_mm * events[:last] / max(event_count, 1)
        seconds = _times_at(phases, distances)
        total = float(seconds[-1]) if last else 0.0
        travel = Travel(
            (begin + self._signs * steps_by_event[:last]) * step_mm, seconds, np.zeros(last), total
        )
        self.slides.begin(travel, self.now, -1)
        if event_count:
            # Its blocks have no spindle, so their segments stop it (`st_prep_buffer`); a startup
            # line with the same M3 and S as before does not start it again.
            self._rpm, self._lit, self._fresh_rpm = 0.0, False, False
        while self.slides.ends_s is not None and not self._flags & {"door", "reset"}:
            yield None
        done_events = self.slides.done
        self.slides.stop(self.now)
        if is_missed or self._flags & {"door", "reset"}:
            position = self._steps
            for axis, count in zip(axes, counts, strict=True):
                position[axis] = sign[axis] * min(done_events, count)
            self._set_steps(position)
        closed = self._limits()
        if "reset" in self._flags:
            self._alarm = HOMING_RESET
        if "door" in self._flags:
            self._alarm = HOMING_DOOR
        if not approaches and any(closed[axis] for axis in axes):
            self._alarm = HOMING_STUCK
        if is_missed and not self._alarm:
            self._alarm = HOMING_MISSED
        if self._alarm:
            self._kill()
            yield from self._realtime()

    def _steps_to_switch(self, axis: int, sign: int, count: int) -> int | None:
        """Return the number of steps after which the switch of an axis closes; None if it does not
        close."""
        if self._ends_mm is None:
            return 0 if self._is_set(5) else None
        direction = int(self._signs[axis]) * sign
        steps = self._slide_steps() + np.outer(direction * np.arange(count + 1), np.eye(3)[axis])
        closed = self._beyond_switches(steps * self._slide_step_mm, self._ends_mm)[:, axis]
        closing = np.flatnonzero(closed != self._is_set(5))
        return int(closing[0]) if len(closing) else None

    # Reports.

    def _length_text(self, mm: float) -> str:
        if self._is_set(13):
            return _float_text(_single(np.float32(mm) * np.float32(INCHES_PER_MM)), 4)
        return _float_text(mm, 3)

    def _lengths_text(self, mm: Sequence[float]) -> str:
        return ",".join(self._length_text(value) for value in mm)

    def _rate_text(self, mm_min: float) -> str:
        if self._is_set(13):
            return _float_text(_single(np.float32(mm_min) * np.float32(INCHES_PER_MM)), 1)
        return _float_text(mm_min, 0)

    def _frames(self) -> str:
        """Format frames, stored places and the last probe as `$#` shows them."""
        memory = self._memory
        rows = {f"G{54 + k}": place for k, place in enumerate(memory.frames)}
        rows |= memory.homes | {"G92": self._parser.offset, "TLO": [self._parser.length]}
        text = "".join(f"[{name}:{self._lengths_text(place)}]\r\n" for name, place in rows.items())
        return text + self._probe_report()

    def _report(self) -> None:
        """Send the status report (`report_realtime_status`)."""
        busy = self._state in ("Home", "Run", "Hold", "Jog", "Door")
        mask = int(self._memory.settings[10])
        offsets = [self._parser.zero_of(k) for k in range(3)]
        place = self._mm(self._steps)
        if not mask & 1:
            place = [_single(a - b) for a, b in zip(place, offsets, strict=True)]
        fields = [self.state, f"{'MPos' if mask & 1 else 'WPos'}:{self._lengths_text(place)}"]
        if mask & 2:
            blocks = self._machine.controller.buffer_blocks - 1 - len(self._ring)
            fields.append(f"Bf:{blocks},{RX_BYTES - len(self._rx)}")
        speed = self._speed_ahead() * 60.0 if self._running and self._phases and busy else 0.0
        fields.append(f"FS:{self._rate_text(speed)},{_float_text(self._rpm, 0)}")
        pins = "P" * self._touches_probe()
        pins += "".join(
            axis for axis, letters in zip("XYZ", self._limits(), strict=True) if letters
        )
        fields += [f"Pn:{pins}"] if pins else []
        if self._wco_in > 0:
            self._wco_in -= 1
        else:
            self._wco_in = 29 if busy else 9
            self._ov_in = max(self._ov_in, 1)
            fields.append(f"WCO:{self._lengths_text(offsets)}")
        if self._ov_in > 0:
            self._ov_in -= 1
        else:
            self._ov_in = 19 if busy else 9
            percents = self._feed_percent, self._rapid_percent, self._spindle_percent
            fields.append("Ov:" + ",".join(map(str, percents)))
            letters = ("C" if self._ccw else "S") * self._lit
            letters += "F" * self._flood + "M" * self._mist
            fields += [f"A:{letters}"] if letters else []
        self._say(f"<{'|'.join(fields)}>\r\n")

    # The planner and the steps.

    def _nominal(self, block: _Planned) -> float:
        percent = 100 if block.fixed else self._feed_percent
        percent = self._rapid_percent if block.rapid else percent
        if percent == 100:
            return block.speed
        return max(min(block.asked * percent / 100.0, block.highest), MIN_SPEED_MM_S)

    def _exit_speed(self) -> float:
        """Return the highest speed at the end of the current block from which the planned blocks
        behind it can still brake."""
        square, ring = 0.0, self._ring
        for k in range(len(ring) - 1, 0, -1):
            block = ring[k]
            max_speed = min(block.corner, self._nominal(block), self._nominal(ring[k - 1]))
            square = min(max_speed * max_speed, square + 2.0 * block.acceleration * block.length)
        return float(np.sqrt(square))

    def _replan_later(self) -> None:
        """Schedule a new plan that begins behind those pieces of the block that can no longer
        change."""
        done_pieces = math.floor((self.now - self._piece_s) / SEGMENT_S + SEGMENT_S / 100.0)
        self._turn_at_s = self._piece_s + (done_pieces + SEGMENTS) * SEGMENT_S

    def _plan_block(self) -> None:
        """Plan the rest of the current block from its present place and speed."""
        self._stale = False
        block = self._ring[0]
        if self._phases:
            self._done_mm, self._speed = self._progress(self.now)
            self._events += self.slides.done
        else:
            self._piece_s = self.now
        remaining = max(block.length - self._done_mm, 0.0)
        a, v = block.acceleration, self._speed
        if self._stopping:
            self._phases = _slow_down(remaining, v, a)
        else:
            self._phases = _trapezoid(remaining, v, self._nominal(block), a, self._exit_speed())
        self._begun_s = self.now
        count = block.events
        commanded = np.empty((count, 3))
        start, block_steps = self._origin + self._signs * block.start, self._signs * block.way
        step_lines_fill(
            (start[None, :], block_steps[None, :]), (0, 0), self._slide_step_mm, commanded
        )
        distances = block.length * np.arange(1, count + 1) / count - self._done_mm
        total_s = sum(seconds for seconds, _, _ in self._phases)
        reach = _distance(self._phases, total_s)
        is_end = reach >= remaining - LENGTH_EPS_MM
        last = count if is_end else int(np.searchsorted(distances, reach, side="right"))
        distances = distances[self._events : last]
        travel = Travel(
            commanded[self._events : last],
            _times_at(self._phases, distances),
            np.zeros(len(distances)),
            total_s,
        )
        self.slides.begin(travel, self.now, block.block)
        self._touches = self._contact_times(travel.commanded, travel.seconds)

    def _progress(self, now: float) -> tuple[float, float]:
        """Return the distance done in the current block, mm, and the speed there."""
        elapsed, covered = now - self._begun_s, self._done_mm
        for seconds, v, a in self._phases:
            t = min(seconds, elapsed)
            covered, elapsed = covered + v * t + 0.5 * a * t * t, elapsed - t
            if elapsed <= 0.0:
                return covered, max(v + a * t, 0.0)
        return covered, _end_speed(self._phases)

    def _speed_ahead(self) -> float:
        """Return the speed that the controller reports: that at the end of the pieces that can no
        longer change."""
        return self._progress(self.now + (SEGMENTS - 0.5) * SEGMENT_S)[1]

    def _block_over(self) -> None:
        """End the travel: that of the whole block, or during a hold that of the deceleration."""
        block = self._ring[0]
        self._events += self.slides.done
        self._done_mm += _distance(self._phases, sum(each[0] for each in self._phases))
        self._speed = _end_speed(self._phases)
        self._phases, self._touches = [], []
        if self._events >= block.events:
            self._ring.pop(0)
            self._done_mm, self._events = 0.0, 0
        if not self._ring or (self._stopping and self._speed <= 0.0):
            self._running = self._stopping = False
            self._speed, self._turn_at_s = 0.0, None
            self._ended = True
            if self._is_set(32) and block.spindle == Kind.SPINDLE_CCW:
                self._lit = False
            self._go_idle()
        else:
            if self._ring[0] is not block:
                self._set_block_power(self._ring[0])
            self._plan_block()


LENGTH_EPS_MM: Final = 1e-9
"""Remainder, mm, below which a block counts as done."""


def _strip(raw: bytes) -> str:
    """Return a line as `protocol_main_loop` passes it on: capitals, without blanks and
    comments."""
    text = re.sub(r"\([^)]*\)?|;.*", "", raw.decode("latin-1"))
    return "".join(sign for sign in text if sign > " " and sign != "/").upper()


def _code(fault: LineFault) -> int:
    """Return grbl's number of an error; 20, unsupported, for lines that only this twin refuses."""
    match = re.search(r"\(error:(\d+)\)", fault.message)
    return int(match[1]) if match else 20


def _coolant_of(modes: ParserModes) -> tuple[bool, bool]:
    return modes.mist, modes.flood


def _percent(percent: int, changes: Mapping[int, int | None], changes_wanted: set[int]) -> int:
    """Return the override, %, after the real-time bytes received."""
    for octet, change in changes.items():
        if octet in changes_wanted:
            percent = 100 if change is None else percent + change
    return max(MIN_OVERRIDE, min(MAX_OVERRIDE, percent))


# Speeds within a block: phases of one acceleration each.


def _trapezoid(
    distance: float, v: float, nominal: float, a: float, exit_speed: float
) -> list[Phase]:
    """Return the phases of a move over `distance` mm from the speed v: accelerate to `nominal`,
    and brake to `exit_speed` at the end, as far as the acceleration allows."""
    if v * v - 2.0 * a * distance >= exit_speed * exit_speed and v > exit_speed:
        return _slow_down(distance, v, a)
    phases: list[Phase] = []
    if v > nominal:
        phases.append(((v - nominal) / a, v, -a))
        distance -= (v * v - nominal * nominal) / (2.0 * a)
        if distance <= 0.0:
            return _slow_down(distance + (v * v - nominal * nominal) / (2.0 * a), v, a)
        v = nominal
    exit_speed = min(exit_speed, nominal, float(np.sqrt(v * v + 2.0 * a * distance)))
    peak = min(nominal, float(np.sqrt(a * distance + 0.5 * (v * v + exit_speed * exit_speed))))
    ramps = (2.0 * peak * peak - v * v - exit_speed * exit_speed) / (2.0 * a)
    phases.append(((peak - v) / a, v, a))
    phases.append((max(distance - ramps, 0.0) / peak, peak, 0.0))
    phases.append(((peak - exit_speed) / a, peak, -a))
    return [phase for phase in phases if phase[0] > 0.0]


def _slow_down(distance: float, v: float, a: float) -> list[Phase]:
    """Return the phase in which the speed v falls at the rate a: to rest, or over `distance` mm if
    that is shorter."""
    end = float(np.sqrt(max(v * v - 2.0 * a * distance, 0.0)))
    return [((v - end) / a, v, -a)] if v > 0.0 else []


def _distance(phases: list[Phase], seconds: float) -> float:
    covered = 0.0
    for duration, v, a in phases:
        t = min(duration, seconds)
        covered, seconds = covered + v * t + 0.5 * a * t * t, seconds - t
    return covered


def _end_speed(phases: list[Phase]) -> float:
    if not phases:
        return 0.0
    seconds, v, a = phases[-1]
    speed = v + a * seconds
    return speed if speed > SPEED_EPS_MM_S else 0.0


SPEED_EPS_MM_S: Final = 1e-9


def _times_at(phases: list[Phase], distances: Floats) -> Floats:
    """Return the times (K,) s at which the distances (K,) mm, ascending, are reached."""
    times, begin, covered = np.zeros(len(distances)), 0.0, 0.0
    for k, (seconds, v, a) in enumerate(phases):
        length = v * seconds + 0.5 * a * seconds * seconds
        last = k == len(phases) - 1
        in_phase = (distances > covered) & ((distances <= covered + length) | last)
        distance = distances[in_phase] - covered
        if a == 0.0:
            times[in_phase] = begin + distance / v
        else:
            root = np.sqrt(np.maximum(v * v + 2.0 * a * distance, 0.0))
            times[in_phase] = begin + np.minimum(2.0 * distance / (v + root), seconds)
        begin, covered = begin + seconds, covered + length
    return np.maximum.accumulate(times)
