"""Protocol of grbl 1.1: lines, as many as its buffer takes, and their answers.

grbl answers each line with `ok` or `error:N`, in order. Its serial buffer holds 128 bytes and
drops what is beyond them without a word; so no more than 127 bytes may be in it. Counting answers
alone would trust every single one of them: an `ok` that the line doubles would let the buffer
overflow, and a block would be lost. So a query of its parser state, `$G`, goes along every hundred
bytes: its answer, `[GC:…]` and an `ok`, stands in the order of the lines, and shows whether
exactly the answers have come that are due. What has been written since the last such answer never
exceeds the buffer, whatever happens to the answers.

`ok` means planned, not done: done for certain is what lies before all that its planner can hold,
and everything once it is idle (grbl 1.1 wiki, "Grbl v1.1 Interface"; serial.c, planner.h,
stepper.c, protocol.c)."""

from __future__ import annotations

import math
import re
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from camtool.errors import MachineError
from camtool.records import replace
from camtool.target.terminal import Terminal
from camtool.target.wire import (
    HALTS,
    Conversation,
    Forecast,
    Hand,
    HandAction,
    Manner,
    Override,
    Packet,
    Place,
    SettingsConversation,
    Wire,
    WireState,
)
from camtool.toolpath.probing import AXES, CycleRun, ProbeCycle, ProbeStep

from .dialect import GrblController, GrblMachine
from .settings import BAUD, LISTED_TOLERANCE, beyond_travel, differences

BUFFER_BYTES: Final = 127
"""128 bytes (RX_BUFFER_SIZE, serial.h), of which the ring leaves one empty."""

SEGMENTS: Final = 6
"""Pieces of blocks that wait behind the planner (SEGMENT_BUFFER_SIZE, stepper.h)."""

POLL_FACTOR: Final = 5
"""Interval of status queries, in multiples of the lateness of the line (0.25 s): the wiki advises
5 Hz at most."""

SILENCE_FACTOR: Final = 10
"""Silence after which a controller is homing or is no grbl, in multiples of the lateness of the
line (0.5 s)."""

MIN_HOLD_REPORTS: Final = 3
"""Consecutive Hold reports after which an unrequested feed hold is reported to the user: a button
was pressed, or a ~ was lost."""

PROBE: Final = b"$G\n"
PROBE_EVERY: Final = 100
"""Bytes of lines between two queries. Its answer is as long as ten `ok`, so that queries more
often than this fill the line back; with fewer the buffer would run dry before the answer."""

MAX_REPORTS_DUE: Final = 3
"""Most reports that count as on their way; others were lost."""

HOLD, RESUME, STATUS, RESET, JOG_CANCEL = b"!", b"~", b"?", b"\x18", b"\x85"
HOMING: Final = b"$H\n"
UNLOCKING: Final = b"$X\n"
LISTING: Final = b"$$\n"
BUILD: Final = b"$I\n"
STANDING: Final = frozenset({"Hold:0", "Door:0", "Door:1", "Alarm", "Check", "Sleep"})
"""States in which nothing moves, whatever was sent before; Idle is one when it is said twice."""

MAX_LINE_BYTES: Final = 1000

MAX_UNKNOWN_BYTES: Final = 200
"""Bytes kept of the text of an unknown firmware, to say which it may be."""

MODES: Final = (
    frozenset({"G54", "G55", "G56", "G57", "G58", "G59"}),
    frozenset({"G17", "G18", "G19"}),
    frozenset({"G21", "G20"}),
    frozenset({"G90", "G91"}),
    frozenset({"G94", "G93"}),
)
"""Groups of modes that a startup line may leave otherwise than programs expect them."""
BEGINS_IN: Final = frozenset({"G54", "G17", "G21", "G90", "G94"})
"""The modes after a reset (gcode.c, gc_init)."""

_COMMENT = re.compile(r"\(([^()]*)\)|;(.*)")
_BLANK = re.compile(r"[ \t]")
_NUMBER = re.compile(r"N\d+(?:\.\d*)?", re.IGNORECASE)
_DWELLS = re.compile(r"G0*4(?![\d.])", re.IGNORECASE)
_PAUSES = re.compile(r"M0*[01](?![\d.])", re.IGNORECASE)
_WAITS = re.compile(r"M0+(?![\d.])", re.IGNORECASE)
"""Words that make grbl wait; it passes over M1 (gcode.c)."""

_STATUS = re.compile(
    r"<(Idle|Run|Hold:[01]|Jog|Alarm|Door:[0-3]|Check|Home|Sleep)((?:\|[A-Za-z]+:[^|<>]*)*)>"
)
_PLACE = re.compile(r"-?\d+\.\d+(?:,-?\d+\.\d+){2,}")
_OVERRIDES = re.compile(r"\d{1,3},\d{1,3},\d{1,3}")
_PROBED = re.compile(r"\[PRB:((?:-?\d+\.\d+,){2,}-?\d+\.\d+):([01])\]")
_FEED = re.compile(r"\d{1,9}(?:\.\d*)?")
_SETTING = re.compile(r"\$\d{1,3}=[^\s=]+")
_PUSHED = re.compile(r"\[[A-Za-z0-9]{1,6}:.*\]")
_STARTUP = re.compile(r">(.*):(ok|error:(\d+))")
_VERSION = re.compile(r"Grbl \d+\.\d+\w*")
_BANNER = re.compile(r"Grbl (?:1\.[1-9]|[2-9])")
_WORD = re.compile(r"G0*(\d+(?:\.\d+)?)", re.IGNORECASE)
_AXIS = re.compile(r"[XYZ]", re.IGNORECASE)
_ELSEWHERE = re.compile(r"G0*(?:10|28|30|43|53|5[5-9]|92)(?!\d)", re.IGNORECASE)
"""Words after which positions are reported in another frame than that of the beginning."""
_ORIGIN = re.compile(r"\[OPT:[^,\]]*Z")
"""Built so that zero of the machine is where the switches are (HOMING_FORCE_SET_ORIGIN)."""

ERRORS: Final = {
    1: "a letter was expected",
    2: "a number is missing or wrong",
    3: "no such $ command",
    4: "a value must not be negative",
    5: "homing is not enabled ($22)",
    6: "the pulse is shorter than 3 µs",
    7: "its memory of settings could not be read: the defaults hold",
    8: "it must be idle for this",
    9: "it is locked: home it ($H) or unlock it ($X)",
    10: "soft limits need homing",
    11: "the line is too long",
    12: "the step rate is above what it can do",
    13: "the safety door is open",
    14: "the line is longer than its memory",
    15: "the jog would leave the travel",
    16: "the jog is not written as jogs are",
    17: "laser mode needs a spindle with PWM",
    20: "a word that it does not know",
    21: "two words of one group",
    22: "no feed is set",
    23: "a whole number was expected",
    24: "two words that both need axes",
    25: "a word twice",
    26: "an axis is missing",
    27: "the line number is out of range",
    28: "a value is missing",
    29: "G59.x does not exist",
    30: "G53 needs G0 or G1",
    31: "axes that no word needs",
    32: "an arc without an axis in its plane",
    33: "the end of the arc is off its circle",
    34: "the radius of the arc is none",
    35: "an arc without an offset in its plane",
    36: "words that nothing needs",
    37: "the tool length offset is on another axis",
    38: "the tool number is too large",
}
ALARMS: Final = {
    1: "a limit switch was hit; its position is lost",
    2: "the target is outside of the travel; its position is kept",
    3: "it was reset while it moved; its position is lost",
    4: "the probe touches already, before it was to move",
    5: "the probe did not touch",
    6: "homing: it was reset",
    7: "homing: the door was opened",
    8: "homing: the switch did not open",
    9: "homing: no switch was found",
}
STATES: Final = {
    "Idle": "it stands, and nothing waits",
    "Run": "it moves",
    "Hold:0": "it is held, and stands; ~ goes on",
    "Hold:1": "it is being held, and still moves",
    "Jog": "it jogs",
    "Alarm": "it is locked: home it ($H) or unlock it ($X)",
    "Door:0": "the door is closed; ~ goes on",
    "Door:1": "the door is open, and it stands",
    "Door:2": "the door is open, and it retracts",
    "Door:3": "the door is closed, and it goes back",
    "Check": "it checks programs and does not move",
    "Home": "it homes",
    "Sleep": "it sleeps; a reset wakes it",
}


class GrblWire(Wire):
    """grbl 1.1 over a serial port."""

    baud = BAUD
    place = "told"
    unlocks = True
    question = STATUS
    by_hand = frozenset({"home", "zero", "jog", "hold", "unlock", "line"})
    overrides = ("feed", "rapid", "spindle")
    ready = (
        "opening the port may reset the controller: where it is then, is zero to it until it is "
        "homed or zeroed",
    )
    stopping = (
        "it is held, then reset: the slides come to rest, then the spindle stops; homing is reset "
        "at once"
    )

    def packets(self, data: bytes, machine: GrblMachine, forecast: Forecast) -> Sequence[Packet]:
        """Return one packet for each line with words, without blanks and comments."""
        packets = list(_packets(data, forecast))
        for packet in packets:
            if len(packet.data) > BUFFER_BYTES - len(PROBE):
                raise MachineError(
                    f"its line has {len(packet.data)} characters, more than the buffer holds",
                    where=f"block {packet.block + 1}",
                )
        return packets

    def conversation(
        self, packets: Sequence[Packet], machine: GrblMachine, manner: Manner
    ) -> GrblConversation:
        """Return the conversation that sends these lines."""
        return GrblConversation(packets, machine, manner)

    def terminal(self, machine: GrblMachine) -> GrblTerminal:
        """Return the terminal, which explains the numbers of errors, alarms and settings."""
        return GrblTerminal()

    def command(
        self, action: str, machine: GrblMachine, values: Mapping[str, float], manner: Manner
    ) -> GrblConversation:
        """Return the conversation that homes (`$H`), unlocks (`$X`), zeroes (G10 L20 of G54) or
        jogs (`$J=`)."""
        if action == "unlock":
            return GrblConversation((), machine, replace(manner, unlock=True))
        return GrblConversation((), machine, manner, (hand_line(action, values).rstrip(b"\n"),))

    def probing(self, cycle: ProbeCycle, machine: GrblMachine, manner: Manner) -> GrblProbing:
        """Return the conversation that touches by G38.3 at each place, and sets a zero by G10
        L20."""
        return GrblProbing(cycle, machine, manner)

    def travel_mm(self, machine: GrblMachine) -> tuple[Place, Place]:
        """Return the travel in machine coordinates: from −travel to 0 (limits.c,
        system_check_travel_limits)."""
        _, (u, v, w) = super().travel_mm(machine)
        x, y, z = (0.0 if math.isfinite(each) else each for each in (u, v, w))
        return (-u, -v, -w), (x, y, z)

    def settings(
        self, machine: GrblMachine, manner: Manner, changes: Sequence[str] = ()
    ) -> GrblSettings:
        """Return the conversation that reads the settings, writes each change, and reads them
        again."""
        return GrblSettings(machine, manner, changes)

    def recognised(self, heard: str) -> str:
        """Return grbl's version, which it sends when the port resets it, and its state; "" if
        `heard` has neither."""
        version = _VERSION.search(heard)
        status = _STATUS.search(heard)
        words = [version[0]] if version else ["grbl"]
        if status:
            words.append(STATES[status[1]])
        return ": ".join(words) if version or status else ""

    def hand(self, machine: GrblMachine, manner: Manner) -> GrblHand:
        """Return one conversation for all orders by hand: `command` would reset grbl before
        each."""
        return GrblHand(machine, manner)


def _packets(data: bytes, forecast: Forecast) -> Iterator[Packet]:
    """Yield the packets of the lines that are blocks, as their reader counts them. A line that
    stops the program carries the comments since the last block as its note."""
    block, notes = 0, list[str]()
    for line in re.split(r"\r\n|\n|\r", data.decode("latin-1")):
        notes += [(one or other).strip() for one, other in _COMMENT.findall(line)]
        words = _BLANK.sub("", _COMMENT.sub("", line)).replace("%", "")
        if not _NUMBER.sub("", words, count=1):
            continue
        note = "; ".join(notes) if _PAUSES.search(words) else ""
        notes = []
        data = words.encode("latin-1") + b"\n"
        waits = bool(_WAITS.search(words))
        yield Packet(data, block, forecast.seconds_of(block), note=note, waits=waits)
        block += 1


class _Line:
    """A line that was sent: a packet, a query or a command; and whether its answer has come."""

    def __init__(self, data: bytes, packet: int | None = None) -> None:
        self.data = data
        self.packet = packet
        """Number of packets sent with this line included; None for a line that is no packet."""
        self.seen = False
        """Of a query: whether its report has come, and only its `ok` is missing."""

    @property
    def is_probe(self) -> bool:
        return self.data == PROBE


class GrblConversation(Conversation):
    """The conversation with a grbl: greeting, settings, homing, `commands`, then the packets."""

    def __init__(
        self,
        packets: Sequence[Packet],
        machine: GrblMachine,
        manner: Manner,
        commands: Sequence[bytes] = (),
    ) -> None:
        super().__init__(packets, manner)
        self._machine = machine
        controller = machine.controller
        blocks = controller.buffer_blocks if isinstance(controller, GrblController) else 16
        self._depth = blocks - 1 + SEGMENTS
        unlocking = (b"$X",) if manner.unlock else ()
        homing = (b"$H",) if manner.home else ()
        queries = (b"$$",) if manner.checked and packets else ()
        self._commands = deque(each + b"\n" for each in (*unlocking, *queries, *homing, *commands))
        self._listing: list[str] = []
        self._rest = b""
        self._out_lines: deque[_Line] = deque()  # sent, not answered yet
        self._unconfirmed = 0  # bytes sent since the last answered query
        self._since_probe = 0  # bytes sent since the last query
        self._confirmed = 0  # packets before the last answered query
        self._probed = 0  # packets before the last query sent
        self._phase = "greeting"
        self._offset: Place | None = None  # work zero, once grbl has reported it
        self._frame: Place | None = None  # the work zero with which the program begins
        self._standing = None if manner.home else manner.standing
        self._restarted = False  # True if opening the port has reset grbl
        self._stood = False  # True if it stood still before the reset
        self._idle = 0  # consecutive Idle reports
        self._idle_since = 0.0  # the first of them
        self._holds = 0  # consecutive Hold reports while it should run
        self._due = self._stale = 0  # reports due, and those from before a ~
        self._resumes = False  # True: resume as soon as it stands
        self._polled = self._answered = 0.0
        self._waiting = False  # a requested report has not come yet
        self._resets = 0  # banners expected after resets
        self._begun = 0.0  # time of that request
        self._known = False  # True once it has sent anything that grbl sends
        self._fresh = False  # True if it has restarted since the reset was sent
        self._heard = b""  # bytes received before that
        self._locked = False  # True while settings are read to advise on the lock
        self._messages: list[str] = []  # its messages about the lock
        self._closed = ""  # closed switches, as reported
        self._startup: list[str] = []  # startup lines
        self._beyond = ""  # why the program would leave the travel, on a usual machine
        self._modes_asked = False
        self._failing = self._alarm = ""
        self._halted = 0.0
        self._reset_sent = self._slows = False
        self._reported = self._stands_at = ""  # places in the last reports
        self._asked_again = 0
        self._acted = False  # True if anything but queries was sent
        self._feed = 0.0
        self._aims: dict[Override, int] = {}  # wanted overrides, %
        self._steered = 0  # reports since the last override byte
        self._moves = 0  # consecutive reports of motion while it should stop
        self._jogs = any(each.startswith(b"$J=") for each in commands)

    @property
    def at_mm(self) -> Place | None:
        """Place of the tool by grbl's machine position, so that frames that the program sets do
        not matter."""
        if self._frame is None or self.machine_mm is None:
            return None
        return _difference(self.machine_mm, self._frame)

    @property
    def is_still(self) -> bool:
        """True after a hold that grbl has confirmed."""
        return self.state is WireState.FINISHED or (
            self._stood and self.is_over and not self._alarm
        )

    # Requests of the user.

    def begin(self, now: float) -> None:
        """Ask for the state. A controller that the port resets reports it by itself."""
        self._answered = now
        self._poll(now)

    def pause(self, now: float) -> None:
        """Send a feed hold."""
        self._resumes = False
        if self.state is WireState.SENDING:
            self.state, self._halted = WireState.PAUSING, now
            self._idle = 0
            self._write(HOLD)

    def resume(self, now: float) -> None:
        """Resume from a hold; after a single block, send the next one."""
        if self.state is WireState.PAUSING:  # grbl passes over ~ until it stands
            self._resumes = True
        elif self.state in HALTS:
            was_held = self.why != SINGLE
            self.state, self.why, self._idle, self._holds = WireState.SENDING, "", 0, 0
            if was_held:
                self._stale = self._due
                self._write(RESUME)
            self._go_on(now, anew=True)

    def stop(self, now: float) -> None:
        """Send a feed hold, and a reset when the machine stands. While homing, grbl reacts to
        nothing but a reset."""
        if self.is_over or self.state is WireState.STOPPING:
            return
        self._unwrite()
        if self._phase != "greeting" and not self._acted:
            self._end(WireState.STOPPED, "stopped before it was told to move")
            return
        self.state, self._halted, self._idle = WireState.STOPPING, now, 0
        if self._homes or (self._phase == "greeting" and self._resets):
            self._reset(now)
        else:
            # A jog ends by its own byte; ! also holds one that has not begun yet.
            self._write(JOG_CANCEL + HOLD if self._jogs else HOLD)
            self._poll(now)

    def hurry(self, now: float) -> None:
        """Reset grbl at once, although it moves and loses its position."""
        self.stop(now)
        if not self.is_over and not self._reset_sent:
            self._reset(now)

    def override(self, name: Override, percent: int, now: float) -> None:
        """Send real-time bytes, each after the report that shows the one before carried out."""
        self._aims[name] = override_aim(name, percent)
        self._steer(name)

    def _steer(self, name: Override) -> None:
        """Send the next byte towards the override that is wanted."""
        step = override_step(name, self._aims[name], self.overrides.get(name, 100))
        if step:
            self._write(step)
            self._steered = 0
        else:
            del self._aims[name]

    def _fail(self, reason: str, now: float) -> None:
        """Stop the machine, and give the reason."""
        if not self.is_over and not self._failing:
            self._failing = reason
            self.stop(now)
        if self.state is WireState.STOPPED:
            self._end(WireState.FAILED, reason)

    @property
    def _unattended(self) -> str:
        if not self._acted or self._reset_sent:
            return ""
        if self.sent:
            return "it goes on with the lines that it has, and then stands with its spindle on"
        return "it goes on to the end of what it was told"

    # The clock.

    def tick(self, now: float) -> None:
        """Ask for reports, and notice answers that are overdue."""
        if self.is_over:
            return
        patience = self.manner.patience_s
        if self.state is WireState.STOPPING:
            elapsed = now - self._halted
            if self._reset_sent and elapsed >= patience:
                reason, self._stood = self._failing or "it was told to stop", False
                self._end(
                    WireState.FAILED, f"{reason}; it did not confirm the stop: switch it off"
                )
                return
            # While homing, begun before the port was opened, it reads nothing and sends nothing.
            homes = self._phase == "greeting" and self._answered <= self._halted
            if not self._reset_sent and elapsed >= (
                SILENCE_FACTOR * self.manner.late_s if homes else patience
            ):
                self._reset(now)
        elif self._phase == "greeting" and now - self._answered >= patience:
            self._end(WireState.FAILED, self._unknown())
            return
        elif self._phase == "greeting" and self._resets and now - self._begun >= patience:
            missing_text = "where its work zero is" if self._fresh else "that it has begun anew"
            self._end(WireState.FAILED, f"it was reset, and does not say {missing_text}")
            return
        elif self._phase != "greeting" and not self._homes and now - self._answered >= patience:
            self._fail("it does not answer any more", now)
        if (
            now >= self._polled + POLL_FACTOR * self.manner.late_s
        ):  # as `_schedule_poll` reckons it
            if self.state is WireState.PAUSING and now - self._halted >= patience / 2.0:
                self._write(HOLD)
                self._halted = now
            self._poll(now)
        self._schedule_poll(now)

    @property
    def _homes(self) -> bool:
        """True during homing: grbl then reacts to nothing but a reset."""
        return any(line.data == HOMING for line in self._out_lines)

    @property
    def _unlocks(self) -> bool:
        """True until homing or unlocking has been answered."""
        orders = {*self._commands, *(line.data for line in self._out_lines)}
        return bool({HOMING, UNLOCKING} & orders)

    def _poll(self, now: float) -> None:
        if not self._homes:
            self._due = min(self._due + 1, MAX_REPORTS_DUE)
            self._write(STATUS)
        self._polled = now
        self._schedule_poll(now)

    def _schedule_poll(self, now: float) -> None:
        if not self.is_over:
            self.next_s = self._polled + POLL_FACTOR * self.manner.late_s

    # What it says.

    def receive(self, data: bytes, now: float) -> None:
        """Handle received bytes, line by line."""
        if self.is_over:
            return
        if not self._known:
            self._heard = (self._heard + data)[:MAX_UNKNOWN_BYTES]
        *lines, self._rest = (self._rest + data).split(b"\n")
        for line in lines:
            if not self.is_over:
                self._line(line.decode("latin-1").strip("\r"), now)
        if len(self._rest) > MAX_LINE_BYTES:
            self._rest = b""
            self._fail("what it says is no line of grbl", now)

    def _line(self, line: str, now: float) -> None:
        if not line:
            return
        stopping = self.state is WireState.STOPPING
        if self._phase == "greeting" and not stopping and not _parse_report(line):
            self._take_message(line)
            return
        self._known, self._answered = True, now
        status = _STATUS.fullmatch(line)
        if status:
            self._status(status[1], status[2], now)
        elif line.startswith("Grbl "):
            self._banner(now)
        elif line == "ok" or re.fullmatch(r"error:\d+", line):
            self._answer(line, now)
        elif re.fullmatch(r"ALARM:\d+", line):
            self._alarm = f"{line}: {ALARMS.get(int(line[6:]), 'it says no more')}"
            if not (stopping and self._reset_sent):  # else its banner follows
                self._end(WireState.FAILED, self._failing or self._alarm)
        elif line.startswith("[GC:") and line.endswith("]"):
            self._check_query(line, now)
        elif _SETTING.fullmatch(line) and self._phase == "settings":
            self._listing.append(line)
        elif _PUSHED.fullmatch(line):
            if line.startswith("[MSG:"):
                self._tell(f"it says: {line[5:-1]}")
            elif _ORIGIN.match(line):
                self._beyond = ""
        elif _STARTUP.fullmatch(line):
            self._take_message(line)
        elif not stopping:
            self._fail(f"an answer that it cannot have meant: {line[:40]!r}", now)

    def _take_message(self, line: str) -> None:
        """Handle messages and startup lines. During the greeting any other line is accepted too,
        since a port that has just been opened may send some, unless it names another firmware."""
        if self._phase == "greeting" and line.startswith("[MSG:") and "unlock" not in line:
            self._messages.append(line[5:].rstrip("]"))
        elif self._phase == "greeting" and re.match(r"grbl", line, re.IGNORECASE):
            self._end(
                WireState.FAILED,
                f"it says {line[:60]!r}, but camtool speaks to grbl 1.1: load that into the board",
            )
        startup = _STARTUP.fullmatch(line)
        if startup is None or startup[1] in self._startup:
            return
        if self._phase != "greeting" or self._fresh:
            self._startup.append(startup[1])
            message = "it has run its startup line"
            if startup[3]:
                meaning = ERRORS.get(int(startup[3]), "it says no more")
                message = f"{startup[2]}, {meaning}, to its startup line"
            self._tell(f"{message} {startup[1]}")

    def _unknown(self) -> str:
        """Return why the conversation fails where nothing was understood: what was received, and
        what that may be."""
        text = "".join(chr(octet) if 0x20 <= octet < 0x7F else " " for octet in self._heard)
        text, strange = (
            " ".join(text.split())[:60],
            sum(not 0x20 <= octet < 0x7F and octet not in b"\t\r\n" for octet in self._heard),
        )
        if self._known:
            return "it does not answer any more"
        if not self._heard:
            return (
                "nothing answers: is it a grbl, is it switched on, and is --baud its rate? One "
                "that has hit a limit is silent until its reset button is pressed"
            )
        if 4 * strange > len(self._heard):
            heard = self._heard[:8].hex(" ")
            return (
                f"what it says is no text ({heard}): its rate may be another, give it with --baud"
            )
        if re.search("marlin|echo:", text, re.IGNORECASE):
            return f"it says {text!r}, as Marlin does: that is another firmware than grbl"
        return f"it says {text!r}, which is no grbl 1.1: are port and --baud those of the machine?"

    @property
    def _reasons(self) -> str:
        """Messages about the lock and the closed switches, as the end of a sentence."""
        reasons = [f"it says {each!r}" for each in dict.fromkeys(self._messages)]
        if self._closed:
            reasons.append(f"it reports closed switches: {_switches(self._closed)}")
        return "".join(f"; {each}" for each in reasons)

    def _advice(self) -> str:
        """Return why grbl is locked and what to do, judged by its settings."""
        values = dict(each[1:].split("=", 1) for each in self._listing)
        if set(self._closed) & set("XYZ"):
            mend = "move it off the switch by hand, or set $5 if it is not pressed, then --unlock"
        elif float(values.get("22", "0")) == 0.0:
            mend = "homing is off ($22=0): see why it is locked, then give --unlock"
        else:
            mend = "home it (--home), or give --unlock where the tool was placed by hand"
        return f"it is locked{self._reasons}: {mend}"

    def _status(self, state: str, fields: str, now: float) -> None:
        self._where(fields, now)
        self._idle = self._idle + 1 if state == "Idle" else 0
        if self._idle == 1:
            self._idle_since = now
        stale, self._stale = self._stale > 0, max(self._stale - 1, 0)
        self._due = max(self._due - 1, 0)
        self._holds = self._holds + 1 if state == "Hold:0" and not stale else 0
        is_still = state == "Hold:0" or self._idle >= 2 or state.startswith("Door:1")
        if self.state is WireState.STOPPING:
            self._stopping(state, now)
        elif self._phase == "greeting":
            self._check_first_report(state, now)
        elif state == "Alarm" and not self._locked and not self._unlocks:
            self._end(WireState.FAILED, f"it is locked{self._reasons}: home it or unlock it")
        elif self.state is WireState.PAUSING and is_still:
            self.state, self._holds = WireState.PAUSED, 0
            if self._resumes:
                self.resume(now)
        elif state.startswith("Door") and self.state is WireState.SENDING:
            self.state, self.why = WireState.WAITING, "its door is open: close it and go on"
            self.is_program_stop = False
        elif self.state is WireState.SENDING and state == "Hold:0":
            if stale:
                return
            if self._stops():
                stop = self.packets[self.acknowledged : self.sent][:1]
                if stop and stop[0].waits:  # it has waited for all that is before it
                    self.done = max(self.done, self.acknowledged)
                self.state, self.why = WireState.WAITING, self._stop_note()
                self.is_program_stop = True
            elif self._holds >= MIN_HOLD_REPORTS:
                self.state, self.why = WireState.WAITING, "it is held"
                self.is_program_stop = False
        elif self.state is WireState.WAITING and state in ("Run", "Idle"):
            self.state, self.why = (
                WireState.SENDING,
                "",
            )  # somebody has resumed it at the machine
            self._go_on(now)
        elif self._idle >= 2 and self.state is WireState.SENDING:
            self._at_rest(now)

    def _stopping(self, state: str, now: float) -> None:
        """Handle a report while the machine is being stopped: reset it when it stands."""
        if self._reset_sent:
            return
        self._moves = self._moves + 1 if state in ("Run", "Jog") else 0
        if state in STANDING or state == "Home" or self._idle >= 2:
            stands = state not in ("Home", "Alarm")
            # A report may be damaged: the place counts when the next one says it too.
            if stands and self.place_mm is not None and self._stands_at != self._reported:
                self._stands_at, self._asked_again = self._reported, self._asked_again + 1
                if self._asked_again < MAX_ASKED_AGAIN:
                    self._poll(now)
                    return
                stands = False
            self._stood = stands and self._reported != ""
            self._reset(now)
        elif state == "Hold:1" or self._slows:
            self._halted = now
        elif self._moves >= 2:  # the first such report may be older than the hold
            self._write(JOG_CANCEL + HOLD if state == "Jog" else HOLD)

    def _where(self, fields: str, now: float) -> None:
        """Store the position in the work frame from the fields of a status report, and whether the
        feed falls from one report to the next, which means that the machine slows down."""
        values = dict(field.split(":", 1) for field in fields.split("|") if field)
        feed, before = values.get("FS", values.get("F", "")).partition(",")[0], self._feed
        self._feed = float(feed) if _FEED.fullmatch(feed) else 0.0
        speed = values.get("FS", "").partition(",")[2]
        self.feed_mm_min, self.rpm = self._feed, float(speed) if _FEED.fullmatch(speed) else None
        self._slows = self._feed < before
        reports_overrides = bool(_OVERRIDES.fullmatch(values.get("Ov", "")))
        if reports_overrides:
            names: tuple[Override, ...] = ("feed", "rapid", "spindle")
            self.overrides = dict(zip(names, map(int, values["Ov"].split(",")), strict=True))
        self._steered += 1
        if self._aims and (reports_overrides or self._steered >= MAX_REPORTS_DUE):
            for override in list(self._aims):
                self._steer(override)
        closed = values.get("Pn", "")
        if closed and closed != self._closed and self._phase != "greeting":
            self._tell(f"it reports closed switches: {_switches(closed)}")
        self._closed = closed
        self._reported = values.get("MPos", values.get("WPos", ""))
        for name in ("WCO", "MPos", "WPos"):
            text = values.get(name)
            if text is None:
                continue
            if not _PLACE.fullmatch(text):
                self._fail(f"a report with a place that is none: {text[:40]!r}", now)
                return
            x, y, z = (float(each) for each in text.split(",")[:3])
            offset = self._offset or (0.0, 0.0, 0.0)
            if name == "WCO":
                self._offset = (x, y, z)
            elif name == "WPos":
                self.place_mm = (x, y, z)
                self.machine_mm = _difference(self.place_mm, _difference((0.0, 0.0, 0.0), offset))
            else:
                self.machine_mm = (x, y, z)
                self.place_mm = _difference(self.machine_mm, offset)

    def _check_first_report(self, state: str, now: float) -> None:
        """Handle the first report: go on only with a controller at rest, and reset it, so that
        nothing of an earlier sender is left in its buffer."""
        if state == "Idle":
            if self._resets == 0:
                self._resets, self._begun = 1, now
                self._write(RESET)
            elif self._fresh and (self._offset or self._standing is None):
                self._ready(now)
        elif state == "Hold:0" and self.manner.standing is not None:
            # Another sender has gone, for example one that was killed at a stop (M0): drop what it
            # has left in the buffer, and keep the place.
            if self._resets == 0:
                self._resets, self._begun = 1, now
                self._write(RESET)
        elif state == "Alarm" and self._unlocks:
            self._ready(now)
        elif state == "Alarm":
            self._phase, self._locked = "settings", True
            self._put(_Line(LISTING))
        elif state in ("Run", "Home", "Jog"):
            if self.why != "moves":
                self.why = "moves"
                self._tell("it still moves: waiting until it stands")
        else:
            meaning = STATES.get(state, "")
            drops = ", and ^X in camtool console drops what it has" if state == "Hold:0" else ""
            self._end(WireState.FAILED, f"it is not ready: {state}, {meaning}{drops}")

    def _banner(self, now: float) -> None:
        if self.state is WireState.STOPPING and self._reset_sent:
            if self._failing:
                self._end(WireState.FAILED, "; ".join(filter(None, (self._failing, self._alarm))))
            else:
                self._end(
                    WireState.STOPPED, f"stopped: {self._alarm or 'it has begun anew, and stands'}"
                )
        elif self._phase != "greeting":
            self._end(WireState.FAILED, "the controller was reset while it worked")
        elif self.state is WireState.STOPPING:
            self._reset(now)  # a hold received after its banner would stay in force
        elif self._resets:
            self._fresh, self._offset = True, None
            self._poll(now)
        else:  # it has restarted by itself: the next report says its state
            self._restarted = True

    def _ready(self, now: float) -> None:
        """Begin to send. Fail if a program that continues finds the machine at another place than
        it needs; tell the controller its place if the user stated it."""
        if self._standing is not None:
            place_said, stated_place = self.machine_mm, self._standing.said_mm
            place = _difference(place_said, self._offset) if place_said and self._offset else None
            reason = self._standing.refusal(place, restarted=self._restarted)
            if place_said is None or reason:
                self._end(WireState.FAILED, reason or "it does not say where it stands")
                return
            if stated_place is not None:  # until the next reset: what it remembers stays as it is
                self._frame = _difference(place_said, stated_place)
                words = "".join(
                    f"{axis}{value:.4f}" for axis, value in zip("XYZ", stated_place, strict=True)
                )
                self._commands.append(f"G21G92{words}\n".encode())
        self._phase, self.why, self._idle = "commands", "", 0
        self.state = WireState.SENDING
        self._go_on(now)

    def _check_query(self, line: str, now: float) -> None:
        """Handle the answer to a query: all lines before it must have been answered, and the query
        itself not yet."""
        head = self._out_lines[0] if self._out_lines else None
        if self.state is WireState.STOPPING:
            return
        if head is None or not head.is_probe:
            self._fail("an answer is missing: a line of the program may be lost", now)
        elif head.seen:
            self._fail("an answer has come twice", now)
        else:
            head.seen = True
            if not self.sent:
                self._compare_modes(line)

    def _compare_modes(self, line: str) -> None:
        """Fail if the program would begin in other modes than it expects."""
        modes, unset = set(line[4:-1].split()), set(BEGINS_IN)
        for packet in self.packets:
            text = packet.data.decode("latin-1")
            words = {f"G{number}" for number in _WORD.findall(text)}
            unset -= {each for each in unset for group in MODES if each in group and words & group}
            if _AXIS.search(text):
                break
        for group in MODES:
            active = group & modes
            if active and group & unset and not active & unset:
                self._end(
                    WireState.FAILED,
                    f"its startup line leaves {next(iter(active))}, and the program does not say "
                    f"{next(iter(group & unset))} before it moves: write that there, or empty the "
                    "line ($N0= or $N1=)",
                )
                return

    def _answer(self, line: str, now: float) -> None:
        if self.state is WireState.STOPPING:
            return
        if not self._out_lines:
            self._fail("an answer more than lines were sent", now)
            return
        head = self._out_lines[0]
        if line != "ok":
            meaning = ERRORS.get(int(line[6:]), "it says no more")
            line_text = head.data.decode("latin-1").strip()
            self._fail(f"{line} to {line_text}: {meaning}", now)
            return
        if head.is_probe and not head.seen:
            self._fail("an answer more than lines were sent", now)
            return
        self._out_lines.popleft()
        self._idle = 0
        if head.is_probe:
            self._confirm()
        elif head.packet is not None:
            self.acknowledged = head.packet
        elif head.data == LISTING:
            if self._locked:
                self._end(WireState.FAILED, self._advice())
                return
            self._phase = "commands"
            self._compare(now)
        elif head.data == BUILD and self._beyond:
            self._fail(self._beyond, now)
        self._go_on(now)

    def _confirm(self) -> None:
        """Record that a query was answered: grbl has taken all lines before it."""
        self._confirmed = self.acknowledged
        self._unconfirmed = sum(len(line.data) for line in self._out_lines)
        self.done = max(self.done, self._confirmed - self._depth)

    def _compare(self, now: float) -> None:
        try:
            errors, remarks = differences("\n".join(self._listing), self._machine)
        except MachineError as error:
            self._fail(str(error), now)
            return
        for remark in remarks:
            self._tell(remark)
        if errors:
            self._fail("; ".join(errors), now)
        zero, reach = self._frame or self._offset, self.manner.reach_mm
        if zero is None or reach is None or errors:
            return
        if not any(_ELSEWHERE.search(each.data.decode("latin-1")) for each in self.packets):
            self._beyond = beyond_travel("\n".join(self._listing), zero, reach)
        if self._beyond:
            self._commands.appendleft(BUILD)

    # Sending.

    def _go_on(self, now: float, *, anew: bool = False) -> None:
        """Write the lines that fit into grbl's buffer now."""
        if self.state is not WireState.SENDING or self._phase in ("greeting", "settings"):
            return
        if self._commands:
            if not self._out_lines:
                line = self._commands.popleft()
                if line == LISTING:
                    self._phase = "settings"
                self._put(_Line(line))
            return
        if any(line.packet is None and not line.is_probe for line in self._out_lines):
            return
        if self._startup and not self._modes_asked and self.packets:
            self._modes_asked = True
            self._probe()
        if self._modes_asked and not self.sent and self._out_lines:
            return
        if self.single:
            if anew or not self.sent:
                self._next_packet()
                self._probe()
            return
        while self.sent < len(self.packets):
            size = len(self.packets[self.sent].data) + len(PROBE)
            if self._unconfirmed + size > BUFFER_BYTES:
                break
            self._next_packet()
            if self._since_probe >= PROBE_EVERY:
                self._probe()
        # With no query under way, nothing would ever make room.
        awaits_probe = self.sent < len(self.packets) and any(
            line.is_probe for line in self._out_lines
        )
        if self._since_probe and not awaits_probe:
            self._probe()

    def _next_packet(self) -> None:
        if self.sent < len(self.packets):
            self._frame = self._frame or self._offset
            packet = self.packets[self.sent]
            self.sent += 1
            self._since_probe += len(packet.data)
            self._put(_Line(packet.data, self.sent))

    def _probe(self) -> None:
        self._since_probe = 0
        self._put(_Line(PROBE))

    def _put(self, line: _Line) -> None:
        self._acted = self._acted or not (line.is_probe or line.data in (LISTING, BUILD))
        self._out_lines.append(line)
        self._unconfirmed += len(line.data)
        self._idle = 0
        self._write(line.data)

    def _at_rest(self, now: float) -> None:
        """Handle a rest, which is two Idle reports in a row without an answer between them: finish
        the program, go on, or fail if an answer is missing."""
        if self._phase == "settings":
            return
        if self._out_lines:
            missing = self._out_lines[0].packet is not None or self._out_lines[0].is_probe
            if missing and now > self._idle_since + self._dwell_s():
                self._fail("an answer is missing: a line of the program may be lost", now)
            return
        if self._commands:
            return
        self.done = self._confirmed
        if self.done == len(self.packets):
            self._end(WireState.FINISHED)
        elif self.single and self.sent == self.done:
            self.state, self.why = WireState.PAUSED, SINGLE
        else:  # single blocks were wanted, and are not any more
            self._go_on(now)

    def _dwell_s(self) -> float:
        """Return the total dwell, s, of the lines that are sent but not answered: for that time
        the machine may report Idle although it is not done."""
        packets_out = {line.packet for line in self._out_lines}
        return sum(
            packet.seconds
            for number, packet in enumerate(self.packets[: self.sent], 1)
            if number in packets_out and _DWELLS.search(packet.data.decode("latin-1"))
        )

    def _reset(self, now: float) -> None:
        self._reset_sent, self._halted = True, now
        self._rest = b""
        self._out_lines.clear()
        self._write(RESET)

    def _stops(self) -> bool:
        """Return True if a block that stops the program is among those sent and not yet done."""
        texts = (packet.data.decode("latin-1") for packet in self._under_way())
        return any(_PAUSES.search(text) for text in texts)

    def _under_way(self) -> Sequence[Packet]:
        return self.packets[max(0, self.acknowledged - 1) : self.sent]

    def _stop_note(self) -> str:
        notes = [packet.note for packet in self._under_way() if packet.note]
        return f"the program waits: {notes[0]}" if notes else "the program waits"


SINGLE: Final = "single block"


MAX_ASKED_AGAIN: Final = 5
"""Reports of a machine that stands, but says another place each time; then its place counts as
unknown."""

MIN_HELD_S: Final = 0.03
"""Shortest time of a piece of a jog that lasts as long as a key is held: a line and its answer
take up to 20 ms on a USB line."""

HELD_PIECES: Final = 3
"""Pieces that wait behind the distance in which the machine can stop."""

OVERRIDE_BYTES: Final[dict[Override, tuple[int, Mapping[int, int]]]] = {
    "feed": (0x90, {10: 0x91, -10: 0x92, 1: 0x93, -1: 0x94}),
    "spindle": (0x99, {10: 0x9A, -10: 0x9B, 1: 0x9C, -1: 0x9D}),
}
"""The byte that sets an override to 100 %, and those that change it by so much (config.h)."""
RAPIDS: Final = {100: 0x95, 50: 0x96, 25: 0x97}
OVERRIDE_RANGE: Final = (10, 200)


def override_step(name: Override, percent: int, before: int) -> bytes:
    """Return the next byte that changes an override from `before` towards `percent`, b"" when it
    is there. grbl keeps one flag for each of these bytes and no count (system.c), so a second one
    is lost unless the first has been carried out."""
    if percent == before:
        return b""
    if name == "rapid":
        return bytes([RAPIDS[percent]])
    reset, changes = OVERRIDE_BYTES[name]
    by = percent - before
    if abs(percent - 100) < abs(by):
        return bytes([reset])
    size = 10 if abs(by) >= 10 else 1
    return bytes([changes[size if by > 0 else -size]])


def override_aim(name: Override, percent: int) -> int:
    """Return the override, %, nearest to `percent` that grbl can have."""
    if name == "rapid":
        return min(RAPIDS, key=lambda percentage: abs(percentage - percent))
    low, high = OVERRIDE_RANGE
    return min(max(percent, low), high)


class GrblProbing(GrblConversation):
    """A cycle of touches, one line after the other, each when the one before has been answered.
    Touches are G38.3, which ends without an alarm where nothing was touched, so that the tool can
    go back. Its `ok` comes after `[PRB:x,y,z:1]`, in the frame of the machine."""

    def __init__(self, cycle: ProbeCycle, machine: GrblMachine, manner: Manner) -> None:
        super().__init__((), machine, manner)
        self._run = CycleRun(cycle)
        self._report: tuple[Place, bool] | None = None  # the probe report of the current line

    def _ready(self, now: float) -> None:
        if self._offset is None or self.machine_mm is None:
            return  # the next report will contain both
        if "P" in self._closed:
            self._end(WireState.FAILED, f"the probe touches already: {TOUCHES_MEND}")
            return
        super()._ready(now)

    def _go_on(self, now: float, *, anew: bool = False) -> None:
        super()._go_on(now, anew=anew)
        is_free = self._phase == "commands" and not self._commands and not self._out_lines
        if not is_free or self.state is not WireState.SENDING:
            return
        if not self._run.has_begun:
            assert self.machine_mm is not None
            assert self._offset is not None
            self._frame = self._offset
            self._run.begin(_difference(self.machine_mm, self._frame))
        if self._run.step is not None:
            self._report = None
            self._put(_Line(_probe_line(self._run.step)))

    def _answer(self, line: str, now: float) -> None:
        step, frame = self._run.step, self._frame
        if line == "ok" and step is not None and frame is not None and self._out_lines:
            touched = None
            if step.action in ("touch", "guard"):
                if self._report is None:
                    self._fail("it does not say where the probe stands: its report is lost", now)
                    return
                place, has_touched = self._report
                touched = _difference(place, frame) if has_touched else None
                if touched is not None and (reason := self._run.refusal(touched)):
                    self._fail(reason, now)
                    return
            elif step.action == "zero":
                at = {**dict(zip(AXES, self._run.place, strict=True)), **step.axes}
                change = _difference(self._run.place, (at["x"], at["y"], at["z"]))
                self._frame = _difference(frame, _difference((0.0, 0.0, 0.0), change))
            self._run.answer(touched)
        super()._answer(line, now)

    def _line(self, line: str, now: float) -> None:
        report = _PROBED.fullmatch(line)
        if report is not None:
            x, y, z = (float(each) for each in report[1].split(",")[:3])
            self._report = (x, y, z), report[2] == "1"
        super()._line(line, now)

    def _at_rest(self, now: float) -> None:
        if self._out_lines and self._idle >= MIN_IDLE_REPORTS:
            self._fail("an answer is missing: a line may be lost", now)
        elif self._run.failure and not self._out_lines:
            self._end(WireState.FAILED, self._run.failure)
        else:
            super()._at_rest(now)


MIN_IDLE_REPORTS: Final = 4
"""Idle reports in a row after which the answer to a line that probes is lost."""

TOUCHES_MEND: Final = "lift it, look at its cable, or set $6 if it is not closed"


def _probe_line(step: ProbeStep) -> bytes:
    """Return the line that makes a step of a probing cycle."""
    axes = "".join(f"{axis.upper()}{value:.4f}" for axis, value in step.axes.items())
    if step.action == "zero":
        return f"G21G10L20P0{axes}\n".encode()
    if step.action == "go":
        return f"G90G21G0{axes}\n".encode()
    return f"G90G21G38.3{axes}F{step.feed:.1f}\n".encode()


class GrblSettings(GrblConversation, SettingsConversation):
    """A grbl that is asked for its settings, before and after it has taken changes of them. It
    answers while it is locked too."""

    def __init__(self, machine: GrblMachine, manner: Manner, changes: Sequence[str]) -> None:
        self._changes = sorted(changes, key=_setting_order)
        lines = [each.encode("ascii") for each in self._changes]
        super().__init__((), machine, manner, (b"$$", *lines, b"$$"))
        self.written: list[str] = []
        self._awaited: _Line | None = None  # the line whose answer is due
        self._awaited_since = 0.0
        self._is_listed = False

    @property
    def _unlocks(self) -> bool:
        return True  # settings can be read and written while it is locked

    def tick(self, now: float) -> None:
        """Notice a line whose answer is overdue, although reports come."""
        head = self._out_lines[0] if self._out_lines else None
        if head is not self._awaited:
            self._awaited, self._awaited_since = head, now
        elif head is not None and now - self._awaited_since >= self.manner.patience_s:
            text = head.data.decode("ascii").strip()
            self._end(WireState.FAILED, f"no answer to {text}, which it may have taken")
            return
        super().tick(now)

    def _answer(self, line: str, now: float) -> None:
        head = self._out_lines[0].data.decode("ascii").strip() if self._out_lines else ""
        if head in self._changes and line != "ok" and self.state is WireState.SENDING:
            meaning = ERRORS.get(int(line[6:]), "it says no more")
            self._end(WireState.FAILED, f"{line} to {head}: {meaning}")
            return
        if head in self._changes and line == "ok":
            self.written.append(head)
        super()._answer(line, now)

    def _compare(self, now: float) -> None:
        listing, self._listing = self._listing, []
        if not self._is_listed:
            self.before, self._is_listed = listing, True
            return
        self.after = listing
        expected = listed_settings(self.before) | listed_settings(self._changes)
        read_back = listed_settings(self.after)
        different = [
            f"${number} is {read_back.get(number, 'missing')} instead of {value}"
            for number, value in expected.items()
            if not _are_equal(read_back.get(number, ""), value)
        ]
        if different:
            self._end(WireState.FAILED, f"read back otherwise: {'; '.join(different)}")
        else:
            self._end(WireState.FINISHED)


def listed_settings(lines: Sequence[str]) -> dict[int, str]:
    """Return the values of a listing by their numbers; ValueError for a line that is no
    setting."""
    pairs = (line.removeprefix("$").partition("=")[::2] for line in lines)
    return {int(number): value for number, value in pairs}


def _are_equal(value: str, other: str) -> bool:
    try:
        return abs(float(value) - float(other)) <= LISTED_TOLERANCE
    except ValueError:
        return value == other


def _setting_order(line: str) -> tuple[int, int]:
    """Return a sort key for changes: homing is switched on before the soft limits, which need it,
    and off after them."""
    number = int(line[1:].partition("=")[0])
    if number == HOMING_SETTING:
        return (-1 if float(line.partition("=")[2]) else 1), number
    return 0, number


HOMING_SETTING: Final = 22


class GrblHand(GrblConversation, Hand):
    """A grbl moved by hand, asked for its state four times a second.

    A jog that lasts as long as a key is held is a chain of short jogs, no longer than the distance
    in which the machine can stop, as grbl's page on jogging advises: whatever becomes of the
    sender, the machine stands soon. 0x85 ends it at once (jogging.md)."""

    def __init__(self, machine: GrblMachine, manner: Manner) -> None:
        super().__init__((), machine, manner)
        self._held: Mapping[str, float] = {}
        self._room_mm = math.inf  # length that a held jog may still go within the travel
        self._homes_now = False
        self._released = False
        self._queued_s = 0.0  # the time up to which the pieces of a held jog last
        self._typed = False  # whether answers are those to a typed line
        self._refusal = ""

    def order(self, action: HandAction, values: Mapping[str, float], now: float) -> None:
        """Carry out an order: home (`$H`), unlock (`$X`), zero (G10 L20 of G54) or jog (`$J=`)."""
        self._begin(action, hand_line(action, values), now)

    def say(self, line: str, now: float) -> None:
        """Send a real-time byte at once, another line when grbl is ready for it."""
        word = line.strip()
        if word in ("?", "!", "~"):
            self._write(word.encode())
            return
        data = Terminal.unescape(word) + b"\n"
        if len(data) > BUFFER_BYTES:
            raise MachineError(f"the line has {len(data)} characters, more than its buffer holds")
        self._begin("line", data, now)
        self._typed = True

    def _begin(self, action: str, line: bytes, now: float) -> None:
        self.check_ready(action)
        if self.says == "Alarm" and (line[:1] != b"$" or line[:3] == b"$J="):
            raise MachineError(
                f"it is locked{self._reasons}", mend="home it, or unlock it if its place is known"
            )
        self.state, self.why, self._idle = WireState.SENDING, "", 0
        self._jogs, self._typed, self._acted = line.startswith(b"$J="), False, True
        self._homes_now = line == HOMING
        self._put(_Line(line))
        self._poll(now)

    def hold(self, values: Mapping[str, float], now: float) -> None:
        """Begin a held jog, which is a chain of short jogs."""
        self.check_ready("jog")
        if self.says == "Alarm":
            raise MachineError("it is locked", mend="home it, or unlock it if its place is known")
        self._held, self._released = dict(values), False
        self._room_mm = values.get("room", math.inf)
        self.state, self.why, self._idle = WireState.SENDING, "", 0
        self._jogs, self._acted, self._queued_s = True, True, now
        self._lengthen(now)

    def release(self, now: float) -> None:
        """Cancel the held jog; a piece that grbl has not read yet is cancelled as soon as it
        has."""
        if self._held:
            self._held, self._released = {}, True
            self._write(JOG_CANCEL)
            self._poll(now)

    def _lengthen(self, now: float) -> None:
        """Append a short jog to a held jog when it would otherwise end before the machine can
        stop."""
        if not self._held:
            return
        self._schedule_poll(now)
        speed = self._held["feed"] / 60.0
        senses = {axis: self._held[axis] for axis in "xyz" if self._held.get(axis)}
        norm = sum(sense * sense for sense in senses.values()) ** 0.5
        rates = [axis.acceleration_mm_s2 for axis in self._machine.axes]
        accelerations = [rate for rate in rates if rate is not None]
        stops_s = speed / (2.0 * min(accelerations)) if accelerations else 0.5
        # A line that finds the planner full waits with its end already computed, and grbl goes
        # there although the jog was cancelled meanwhile (motion_control.c, mc_line): it must
        # never be full. Speeding up holds back as much as braking takes.
        room = self._depth - SEGMENTS - 2 * HELD_PIECES
        piece_s = max(MIN_HELD_S, 2.0 * stops_s / room)
        self.next_s = min(max(self.next_s, now), now + piece_s)
        if self._out_lines or self._queued_s - now > stops_s + HELD_PIECES * piece_s:
            return
        length = min(speed * piece_s, self._room_mm)
        self._room_mm -= length
        if length <= 0.0:
            self._held = {}
            return
        axes = {axis: sense / norm * length for axis, sense in senses.items()}
        self._put(_Line(hand_line("jog", {**axes, "feed": self._held["feed"]})))
        self._queued_s = max(self._queued_s, now) + piece_s

    def tick(self, now: float) -> None:
        """Lengthen a held jog, and ask for reports."""
        if self._held:
            self._lengthen(now)
            if now < self._polled + POLL_FACTOR * self.manner.late_s:
                return
        super().tick(now)
        self._lengthen(now)

    def _line(self, line: str, now: float) -> None:
        is_known = _STATUS.fullmatch(line) or line == "ok" or line.startswith(("Grbl ", "ALARM:"))
        if self._typed and self._phase != "greeting" and not is_known:
            self._answered = now
            meaning = GrblTerminal().meaning(line)
            self._tell(f"{line}    {meaning}" if meaning else line)
            if not line.startswith("error:"):
                return
        super()._line(line, now)

    def _answer(self, line: str, now: float) -> None:
        """Handle an answer; the refusal of an order is shown to the user and ends nothing but that
        order."""
        if not self._out_lines or self._phase == "greeting" or self.state is not WireState.SENDING:
            super()._answer(line, now)
            return
        self._out_lines.popleft()
        self._idle = 0
        if line != "ok":
            self._held, self._homes_now = {}, False
            if not self._typed:
                meaning = ERRORS.get(int(line[6:]), "it says no more")
                self._tell(f"it refuses ({line}): {meaning}")
        if self._released:
            self._write(JOG_CANCEL)
        self._lengthen(now)

    def _status(self, state: str, fields: str, now: float) -> None:
        self.says = state
        if state != "Alarm" or self.state is WireState.STOPPING:
            if self._released and state == "Jog":
                self._write(JOG_CANCEL)
            if self.state is WireState.READY and self._idle > 2:
                self.why = ""
            super()._status(state, fields, now)
            return
        self._where(fields, now)
        self.is_homed = False
        if self._phase == "greeting":
            self._phase = "commands"
        if not self._out_lines:
            self.state, self.why = WireState.READY, f"it is locked{self._reasons}"

    def _end(self, state: WireState, why: str = "") -> None:
        """Become ready for the next order instead of ending, when an order is finished."""
        if state is WireState.FINISHED and self.state is WireState.SENDING:
            self.state, self.why, self._released = WireState.READY, "", False
            self.is_homed |= self._homes_now
            self._typed = self._homes_now = False
            return
        super()._end(state, why)


def hand_line(action: str, values: Mapping[str, float]) -> bytes:
    """Return the line that homes ("home"), unlocks ("unlock"), makes the place zero of G54
    ("zero") or jogs by these lengths ("jog"); `values` as of `Wire.command`."""
    if action in ("home", "unlock"):
        return HOMING if action == "home" else UNLOCKING
    axes = "".join(f"{axis.upper()}{values[axis]:.3f}" for axis in "xyz" if axis in values)
    if action == "zero":
        return f"G21G10L20P1{axes}\n".encode()
    return f"$J=G91G21{axes}F{values['feed']:.1f}\n".encode()


SETTINGS: Final = {
    0: "step pulse, µs",
    1: "step idle delay, ms (255: motors stay on)",
    2: "step pulses inverted (mask of axes)",
    3: "directions inverted (mask of axes)",
    4: "step enable inverted",
    5: "limit switches inverted",
    6: "probe inverted",
    10: "what status reports hold (mask)",
    11: "junction deviation, mm",
    12: "arc tolerance, mm",
    13: "reports in inches",
    20: "soft limits",
    21: "hard limits",
    22: "homing",
    23: "homing directions inverted (mask of axes)",
    24: "homing locate feed, mm/min",
    25: "homing search feed, mm/min",
    26: "homing debounce, ms",
    27: "homing pull-off, mm",
    30: "highest spindle speed, rev/min",
    31: "lowest spindle speed, rev/min",
    32: "laser mode",
}
"""Settings that belong to no axis (settings_codes_en_US.csv)."""
OF_AXES: Final = {
    100: "steps per mm",
    110: "highest rate, mm/min",
    120: "mm/s²",
    130: "travel, mm",
}
"""Settings of X; Y and Z follow."""
FIELDS: Final = {
    "MPos": "machine position",
    "WPos": "work position",
    "WCO": "work zero on the machine",
    "Bf": "free blocks, free bytes",
    "FS": "feed, spindle",
    "F": "feed",
    "Ln": "line",
    "Pn": "switches that are closed",
    "Ov": "overrides of feed, rapids, spindle, %",
    "A": "spindle (S cw, C ccw), flood (F), mist (M)",
}
"""Fields of a status report (report.c)."""


LAST_WORDS: Final = ("ALARM:1", "ALARM:2")
"""Alarms after which it answers nothing until it is reset (protocol.c,
protocol_exec_rt_system)."""


class GrblTerminal(Terminal):
    """Typed lines; ? ! ~ and ^X alone are sent as the real-time bytes that they are."""

    stop = JOG_CANCEL + HOLD
    asks = knock = STATUS
    leaves = RESET
    about = (
        "a line is answered by ok or error:N. Alone on a line: ? how it stands, ! feed hold, "
        "~ go on, ^X reset; $$ settings, $G modes, $X unlock, $H home"
    )

    def __init__(self) -> None:
        super().__init__()
        self.ready = False
        self._typed = self._resets = False
        self._homes = 0  # the answers that are due up to that of homing

    def halt(self) -> bytes:
        """Return the bytes that stop the machine: a feed hold, or a reset while it homes."""
        stop = super().halt()
        self._typed = True  # the reports that follow are to be seen
        if not self._homes:
            return stop
        self.due, self._resets, self._homes = 1, True, 0
        return RESET

    def is_urgent(self, line: str) -> bool:
        """Return True for holds, resets and the command to resume."""
        return line.strip().lower() in ("!", "~", "^x", r"\x18", r"\x84", r"\x85")

    def decode(self, data: bytes) -> list[str]:
        """Return the lines to show, without the reports that only the first query asked for."""
        return [line for line in super().decode(data) if self._typed or not line.startswith("<")]

    def encode(self, line: str) -> bytes:
        """Return a real-time byte as it is, without a line end; only a reset has an answer, its
        banner. Other lines are encoded as for all wires."""
        word, self._typed = line.strip(), True
        if word in ("?", "!", "~"):
            return word.encode()
        if word.upper() == "^X" or word == "\\x18":
            self.due, self._resets, self._homes = 1, True, 0
            return RESET
        if word.lower() in (r"\x84", r"\x85"):
            return self.unescape(word)
        self.due += 1
        if word.upper() == "$H":
            self._homes = self.due
        return super().encode(word)

    def meaning(self, line: str) -> str:
        """Return the meaning of an error, alarm, setting or report."""
        if line == "ok" or line.startswith("error:"):
            self.due, self._homes = max(self.due - 1, 0), max(self._homes - 1, 0)
        self.ready = self.ready or _parse_report(line)
        if line.startswith("Grbl "):
            if self.due and not self._resets:
                self.failed = "the controller has begun anew"
            self.due, self._resets, self._homes, self.stands = 0, False, 0, True
        elif line in LAST_WORDS and self.due:
            self.failed = f"{line}, {ALARMS[int(line[6:])]}; it takes nothing more until a reset"
        if match := re.fullmatch(r"(error|ALARM):(\d+)", line):
            texts = ERRORS if match[1] == "error" else ALARMS
            return texts.get(int(match[2]), "it says no more")
        if match := re.fullmatch(r"\$(\d+)=.*", line):
            number = int(match[1])
            first, axis = number - number % 10, number % 10
            if first in OF_AXES and axis < 3:
                return f"{'XYZ'[axis]}: {OF_AXES[first]}"
            return SETTINGS.get(number, "")
        if match := _STATUS.fullmatch(line):
            self.stands = match[1] == "Idle" or match[1] in STANDING
            fields = [each.split(":", 1) for each in match[2].split("|") if each]
            sentences = [f"{FIELDS.get(name, name)} {value}" for name, value in fields]
            return "; ".join([STATES[match[1]], *sentences])
        return ""


def _difference(one: Place, other: Place) -> Place:
    (a, b, c), (x, y, z) = one, other
    return a - x, b - y, c - z


def _parse_report(line: str) -> bool:
    return bool(_STATUS.fullmatch(line) or _BANNER.match(line))


SWITCHES: Final = {"P": "probe", "D": "door", "H": "hold", "R": "reset", "S": "start"}
"""Letters of a report's `Pn:`; others are limit switches of axes (report.c)."""


def _switches(letters: str) -> str:
    """Return the names of the switches for the letters of `Pn:`."""
    return ", ".join(SWITCHES.get(letter, f"limit of {letter}") for letter in letters)
