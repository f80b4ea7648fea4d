"""Protocol of LinuxCNC: it opens the program as a file, and is watched through linuxcncrsh.

linuxcncrsh takes one line of text at a time over TCP and answers it (linuxcncrsh(1) of LinuxCNC
2.9, tried with Debian's linuxcnc-uspace). LinuxCNC itself reads the program, so that nothing of it
goes over the line; `get program_line` says which line it is at. At the beginning of a program that
may be the line that is read, which is ahead of the motion, since the line of the motion before
still stands there: so a block is done for certain only when the simulated time allows it too.

A conversation is written as it is held: generators, which yield a request and are sent its answer,
or yield how long to wait."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Generator, Mapping, Sequence
from typing import Final, cast

import numpy as np

from camtool.errors import MachineError
from camtool.records import replace
from camtool.target.terminal import Terminal
from camtool.target.wire import (
    HALTS,
    LATE_S,
    Conversation,
    Forecast,
    Manner,
    Override,
    Packet,
    Place,
    Wire,
    WireState,
)
from camtool.toolpath.moves import Kind, Toolpath, changes_between_cuts
from camtool.toolpath.probing import CycleRun, ProbeCycle, ProbeStep

from ..gcode.blocks import has_words
from .dialect import LinuxcncLink, LinuxcncMachine

POLL_FACTOR: Final = 4
"""Interval of status queries, in multiples of the lateness of the line (0.2 s)."""

MAX_HOMING_S: Final = 600.0

NEAR_MM: Final = 0.02
"""Largest distance, mm, between a reported position and the same position as programmed: blends,
and encoders."""

MAX_OVERRIDE: Final = 3.0

HELD_AHEAD_S: Final = 0.3
"""Time for which a held jog has increments ahead of it, s: what it moves on if camtool is killed,
besides its braking."""

STILL_REPORTS: Final = 2
"""Consecutive equal positions after which it stands."""

UNSURE: Final = "it did not confirm the stop: stop it at the machine"

JOINTS: Final = 3
"""X, Y and Z, in the order of its joints and of the places that it reports."""

_FRAMES = re.compile(rb"G0*(?:10|52|5[5-9]|92)(?!\d)", re.IGNORECASE)
"""Words after which positions are reported in another frame than they are programmed in."""

_WAITS = re.compile(r"M0*(?:[01]|60)(?![\d.])", re.IGNORECASE)
"""Words that wait for the operator; M1 does so where the switch of optional stops is on, which the
program cannot know."""
_COMMENT = re.compile(r"\(([^()]*)\)|;(.*)|\s")
_CODE = r"\([^()]*\)|;.*|(M[ \t]*0*6(?![\d.])|G[ \t]*0*43(?![\d.]))"
_CHANGES = re.compile(_CODE, re.IGNORECASE)
"""Comments, and words that change the tool and put its length in force."""

_ENDS = re.compile(rb"[\r\n]+")
_LINES = re.compile(r"\r\n|\n|\r")

Script = Generator["str | float", str, None]
"""Coroutine of a conversation: it yields requests and waits, and receives answers."""


class _Refused(Exception):
    """Raised when the conversation cannot continue, with the reason."""


class LinuxcncWire(Wire):
    """linuxcncrsh at a TCP port (socket://HOST:5007)."""

    opens_file = True
    place = "told"
    ready = (
        "it must be switched on, homed and idle; its own limits and offsets hold",
        "LinuxCNC runs the program by itself: without this line it goes on, and is stopped at the "
        "machine",
    )
    stopping = "the program is aborted: the slides slow down and stand"
    by_hand = frozenset({"home", "zero", "jog", "hold", "line"})
    overrides = ("feed", "spindle")
    question = b"hello EMC camtool 1.0\r\n"

    def with_stops(self, data: bytes, machine: LinuxcncMachine, path: Toolpath) -> bytes:
        """Return the program with M0 behind each tool change between cuts, when the tool's length
        is in force: on the line of its M6, or of a later G43, but before anything moves or
        turns."""
        if not _link(machine).stops_at_tools:
            return data
        changes = set(path.block[changes_between_cuts(path)].tolist())
        turns = np.isin(path.kind, (Kind.SPINDLE_CW, Kind.SPINDLE_CCW))
        acting = set(path.block[path.is_motion | turns].tolist())
        lines = re.split(r"(\r\n|\n|\r)", data.decode("latin-1"))
        numbers = [k for k in range(0, len(lines), 2) if has_words(lines[k])]
        for change in changes:
            last = change + 1
            while last < len(numbers) and last not in acting | changes:
                last += 1
            group = numbers[change:last]
            if any(_WAITS.search(_COMMENT.sub("", lines[k])) for k in group):
                continue  # it stops there already
            named = [k for k in group if any(_CHANGES.findall(lines[k]))]
            for k in named[-1:]:
                lines[k] = _CHANGES.sub(
                    lambda match: f"M0 {match[0]}" if match[1] else match[0], lines[k]
                )
        return "".join(lines).encode("latin-1")

    def packets(
        self, data: bytes, machine: LinuxcncMachine, forecast: Forecast
    ) -> Sequence[Packet]:
        """Return one packet for each line that is a block; its text does not go over the wire. A
        packet that stops the program carries the comments since the last motion as its note."""
        packets: list[Packet] = []
        notes: list[str] = []
        steady = bool((np.diff(forecast.decoded.block) >= 0).all())
        for number, line in enumerate(_LINES.split(data.decode("latin-1")), 1):
            notes += [(one or other).strip() for one, other in _COMMENT.findall(line)]
            if has_words(line) and len(packets) < len(forecast):
                block = len(packets)
                seconds = float(forecast.seconds[block])
                # If lines are executed repeatedly, none is certainly done before the end.
                counts = (number if steady else 0,)
                waits = bool(_WAITS.search(_COMMENT.sub("", line)))
                note = "; ".join(filter(None, notes)) if waits else ""
                notes = notes if not (waits or seconds) else []
                text = line.encode("latin-1")
                packets.append(Packet(text, block, seconds, counts, note=note, waits=waits))
        if not packets:
            raise MachineError("the program has no blocks")
        ends = forecast.end_mm[~np.isnan(forecast.end_mm).any(axis=1)]
        if len(ends) and not any(_FRAMES.search(packet.data) for packet in packets):
            x, y, z = ends[-1].tolist()
            packets[-1] = replace(packets[-1], end_mm=(x, y, z))
        return packets

    def conversation(
        self, packets: Sequence[Packet], machine: LinuxcncMachine, manner: Manner
    ) -> LinuxcncConversation:
        """Return the conversation that opens the file, runs it, and watches it to its end."""
        link = _link(machine)
        if link.folder is not None:
            name = re.split(r"[/\\]", manner.file)[-1]
            manner = replace(manner, file=f"{link.folder.rstrip('/')}/{name}")
        if manner.standing is not None and manner.standing.said_mm is not None:
            raise MachineError(
                "LinuxCNC keeps its own place, which homing makes right",
                where=f"--tool-at {manner.standing.tool_at}",
                mend="home it, or say --tool-at known",
            )
        if re.search(r"\s", manner.file):
            raise MachineError(
                f"linuxcncrsh takes no blanks in the name of a file: {manner.file!r}",
                mend="put the program elsewhere",
            )
        return LinuxcncConversation(packets, link, manner, "run")

    def terminal(self, machine: LinuxcncMachine) -> LinuxcncTerminal:
        """Return the terminal for the commands of linuxcncrsh."""
        return LinuxcncTerminal(_link(machine))

    def travel_mm(self, machine: LinuxcncMachine) -> tuple[Place, Place]:
        """Return infinite travel: LinuxCNC itself checks the limits of its INI file."""
        x = math.inf
        return (-x, -x, -x), (x, x, x)

    def command(
        self, action: str, machine: LinuxcncMachine, values: Mapping[str, float], manner: Manner
    ) -> LinuxcncConversation:
        """Return the conversation that homes (`set home -1`), zeroes (G10 L20 of the active frame)
        or jogs (`set jog_incr`), axis by axis, or repeatedly while a key is held."""
        return LinuxcncConversation((), _link(machine), manner, action, values)

    def recognised(self, heard: str) -> str:
        """Return "LinuxCNC (linuxcncrsh)" for an answer to the greeting, which enables nothing; ""
        for any other text."""
        return "LinuxCNC (linuxcncrsh)" if heard.upper().startswith("HELLO ") else ""

    def probing(
        self, cycle: ProbeCycle, machine: LinuxcncMachine, manner: Manner
    ) -> LinuxcncConversation:
        """Return the conversation that touches by G38.3 at each place and sets a zero by G10 L20,
        in MDI."""
        return LinuxcncConversation((), _link(machine), manner, "probe", cycle=cycle)


def _link(machine: LinuxcncMachine) -> LinuxcncLink:
    assert isinstance(machine.link, LinuxcncLink)
    return machine.link


class LinuxcncConversation(Conversation):
    """Conversation of single requests, each followed by its answer."""

    def __init__(
        self,
        packets: Sequence[Packet],
        link: LinuxcncLink,
        manner: Manner,
        action: str,
        values: Mapping[str, float] | None = None,
        cycle: ProbeCycle | None = None,
    ) -> None:
        super().__init__(packets, manner)
        self._link, self._values, self._cycle = link, values or {}, cycle
        acts: dict[str, Callable[[], Script]] = {
            "run": self._run,
            "home": self._home,
            "zero": self._zero,
            "jog": self._jog,
            "hold": self._hold,
            "probe": self._probe,
        }
        self._script, self._fresh = self._session(acts[action]), True
        self._rest, self._asked, self._now = b"", "", 0.0
        self._zero_mm: Place | None = None  # zero of the work frame from machine zero
        self._skips = ""
        """Answers that begin otherwise are passed over."""
        self._begun = self._aborting = self._pausing = self._going_on = False
        self._changes: dict[Override, int] = {}
        """Overrides that it is to be told, %."""
        self._passed = -1  # last stop that it has passed
        self._taken: dict[Override, int] = {}
        """Overrides that it has taken, %."""
        self._why_aborted = ""
        self._said = ""
        """Errors that it has reported."""
        self._ends = np.cumsum([packet.seconds for packet in packets])
        self._lines = [packet.counts[0] for packet in packets]

    # Requests of the user; the script carries them out when it next may send.

    def begin(self, now: float) -> None:
        """Greet the server."""
        self._go(None, now)

    def pause(self, now: float) -> None:
        """Pause the program; the state is PAUSED when the slides stand."""
        if self.state is WireState.SENDING:
            self.state, self._pausing = WireState.PAUSING, True

    def resume(self, now: float) -> None:
        """Resume the program; with single blocks, run the next line."""
        if self.state in HALTS or self.state is WireState.PAUSING:
            self._pausing, self._going_on = False, True
            self._passed = self.stop_index if self.state is WireState.WAITING else self._passed
            self.state, self.why = WireState.SENDING, ""

    def override(self, name: Override, percent: int, now: float) -> None:
        """Set a feed or spindle override (`set feed_override`, `set spindle_override`) when the
        script next may send."""
        if name == "rapid":
            super().override(name, percent, now)
        else:
            self._changes[name] = self.overrides[name] = percent

    def stop(self, now: float) -> None:
        """Abort the program."""
        if self.is_over or self.state is WireState.STOPPING:
            return
        if self._begun:
            self._abort_at(now)
            return
        self._unwrite()
        self._end(WireState.STOPPED, "stopped before it was told to move")

    @property
    def stop_index(self) -> int:
        """Index of the next stop among those between the motions before and after the reported
        line."""
        low = high = min(self.acknowledged, len(self.packets) - 1)
        while low > 0 and not self.packets[low - 1].seconds:
            low -= 1
        while high + 1 < len(self.packets) and not self.packets[high + 1].seconds:
            high += 1
        stops = (k for k in range(max(low, self._passed + 1), high + 1) if self.packets[k].waits)
        return next(stops, super().stop_index)

    @property
    def _unattended(self) -> str:
        if self._begun and not self._aborting:
            return "LinuxCNC goes on with what it was told: stop it at the machine"
        return ""

    def _abort_at(self, now: float) -> None:
        """Abort at once, whatever answer is due: all answers before the one to the abort are
        ignored. First ask for the right to command again, which another client may have taken."""
        self._unwrite()
        self.state, self._aborting = WireState.STOPPING, True
        self._script, self._fresh = self._abort(), True
        self._write(f"set enable {self._link.enable_password}\r\n".encode())
        self._go(None, now)
        self._skips = "SET ABORT "

    # The line and the clock.

    def receive(self, data: bytes, now: float) -> None:
        """Handle received lines; echoes are ignored."""
        *lines, self._rest = _ENDS.split(self._rest + data)
        for line in lines:
            text = line.decode("latin-1").strip()
            if not text or self.is_over or text == self._asked or not self._asked:
                continue
            if not text.upper().startswith(self._skips):
                continue
            if text.startswith(("error: ", "warning: ")):  # its answer follows
                self._tell(f"it says: {text}")
                continue
            self._asked = self._skips = ""
            self._go(text, now)

    def tick(self, now: float) -> None:
        """Continue the script after a wait, or notice a missing answer."""
        if self.is_over or now < self.next_s:
            return
        if not self._asked:
            self._go(None, now)
        elif self._aborting or not self._begun:
            suffix = f"; {UNSURE}" if self._begun else ""
            reason = self._why_aborted or f"no answer to {_without_password(self._asked)!r}"
            self._end(WireState.FAILED, reason + suffix)
        else:
            self._why_aborted, self._asked = f"no answer to {_without_password(self._asked)!r}", ""
            self._abort_at(now)

    def _go(self, answer: str | None, now: float) -> None:
        """Run the script to its next wait."""
        self._now = now
        try:
            # A new script has asked nothing yet: an answer now belongs to the script before.
            was_fresh, self._fresh = self._fresh, False
            step = self._script.send(cast(str, None if was_fresh else answer))
        except StopIteration:
            return
        except _Refused as refusal:
            if self._begun and not self._aborting:
                self._why_aborted = str(refusal)
                self._abort_at(now)
            else:
                suffix = f"; {UNSURE}" if self._aborting else ""
                self._end(WireState.FAILED, (self._why_aborted or str(refusal)) + suffix)
            return
        if isinstance(step, str):
            self._asked = step
            self._write(step.encode("utf-8") + b"\r\n")
            self.next_s = now + self.manner.patience_s
        else:
            self.next_s = now + step

    # Requests.

    def _get(self, name: str) -> Generator[str | float, str, str]:
        answer = yield f"get {name}"
        head, _, value = answer.partition(" ")
        if head.upper() != name.upper():
            raise _Refused(f"an answer to 'get {name}' that is none: {answer[:60]!r}")
        return value.strip()

    def _set(self, words: str) -> Script:
        answer = yield f"set {words}"
        name = words.split(" ", 1)[0].upper()
        if answer.upper() != f"SET {name} ACK":
            raise _Refused(f"it refuses 'set {_without_password(words)}': {answer[:60]}")

    def _place(self) -> Generator[str | float, str, Place]:
        x, y, z = yield from self._coordinates("rel_act_pos")
        if self._zero_mm is None:
            a, b, c = yield from self._coordinates("abs_act_pos")
            self._zero_mm = a - x, b - y, c - z
        self.place_mm = x, y, z
        a, b, c = self._zero_mm
        self.machine_mm = x + a, y + b, z + c
        return x, y, z

    def _coordinates(self, name: str) -> Generator[str | float, str, Place]:
        text = yield from self._get(name)
        try:
            x, y, z = (float(each) for each in text.split()[:JOINTS])
        except ValueError:
            raise _Refused(f"a place that is none: {text[:60]!r}") from None
        return x, y, z

    def _errors(self) -> Generator[str | float, str, str]:
        """Read and show LinuxCNC's messages; return the one of a probing move, "" if there is
        none."""
        report = ""
        for name in ("error", "operator_text", "operator_display"):
            text = yield from self._get(name)
            if text.startswith(PROBED):
                report = text
            elif text != "OK":
                self._tell(f"it says: {text}")
                self._said = text if name == "error" else self._said
        return report

    # What is held.

    def _session(self, act: Callable[[], Script]) -> Script:
        """Greet the server, check that the machine is ready, and run `act`."""
        answer = yield f"hello {self._link.password} camtool 1.0"
        if not answer.upper().startswith("HELLO ACK"):
            raise _Refused("it does not take the password of its line (link.password)")
        yield from self._set("verbose on")
        yield from self._set("echo off")
        yield from self._set(f"enable {self._link.enable_password}")
        for name, expected, mend in (
            ("estop", "OFF", "its emergency stop is pressed: release it at the machine"),
            ("machine", "ON", "it is off: switch it on at the machine"),
            ("program_status", "IDLE", "a program runs on it: wait for its end, or abort it"),
        ):
            if (yield from self._get(name)).upper() != expected:
                raise _Refused(mend)
        yield from self._set("set_wait received")
        yield from self._set("linear_unit_conversion mm")
        while (yield from self._get("error")) != "OK":
            pass  # of earlier programs
        if act == self._run and self.manner.home:
            yield from self._homing()
        if act != self._home and not (yield from self._homed()):
            raise _Refused("it is not homed: give --home, or home it by camtool home")
        position_record = self.manner.standing
        if act == self._run and position_record is not None and not self.manner.home:
            reason = position_record.refusal((yield from self._place()), restarted=False)
            if reason:
                raise _Refused(reason)
        yield from act()

    def _homed(self) -> Generator[str | float, str, bool]:
        return (yield from self._get("joint_homed")).upper().split()[:JOINTS] == ["YES"] * JOINTS

    def _homing(self) -> Script:
        yield from self._set("mode manual")
        self._begun = True
        yield from self._set("home -1")
        end = self._now + MAX_HOMING_S
        while not (yield from self._homed()):
            if self._now > end:
                raise _Refused("homing does not end")
            yield self._poll_s
        self._begun = False

    @property
    def _poll_s(self) -> float:
        return POLL_FACTOR * self.manner.late_s

    def _run(self) -> Script:
        file = self.manner.file
        yield from self._set("mode auto")
        yield from self._set(f"open {file}")
        if (yield from self._get("program")) != file:
            message = yield from self._get("error")
            raise _Refused(f"it cannot open {file}{'' if message == 'OK' else f' ({message})'}")
        self._begun, self.state, self.sent = True, WireState.SENDING, len(self.packets)
        yield from self._set("step" if self.single else "run")
        yield from self._watch()

    def _watch(self) -> Script:
        """Wait until the controller is idle again."""
        start_s, ran, before = self._now, 0.0, self._now
        busy, still_count, last = False, 0, None
        while True:
            status = (yield from self._get("program_status")).upper()
            line = yield from self._get("program_line")
            place = yield from self._place()
            yield from self._errors()
            still_count, last = (still_count + 1 if place == last else 0), place
            time_s = self._now
            if status == "RUNNING":
                ran += time_s - before
            before = time_s
            if status != "IDLE":
                busy = True
                self._count_done(line, ran)
                yield from self._obey(status, still_count >= STILL_REPORTS - 1)
            elif busy or time_s - start_s > POLL_FACTOR * self._poll_s:
                self._finish(line, ran)
                return
            yield self._poll_s

    def _obey(self, status: str, is_still: bool) -> Script:
        """Send the user's overrides, pause or resume, and follow the status of the running
        program."""
        while self._changes:
            name, percent = self._changes.popitem()
            order = f"set {name}_override"
            answer = yield f"{order} {percent}"
            if answer.upper() == f"{order} ack".upper():
                self._taken[name] = percent
            else:  # linuxcncrsh takes no spindle above 100 %; that ends no program
                self.overrides[name] = self._taken.get(name, 100)
                self._tell(f"it refuses {percent} % of its {name}")
        if self._pausing:
            self._pausing = False
            yield from self._set("pause")
        elif self._going_on:
            self._going_on = False
            yield from self._set("step" if self.single else "resume")
        elif status == "PAUSED" and is_still:
            if self.state is WireState.PAUSING:
                self.state = WireState.PAUSED
            elif self.state is WireState.SENDING and self.single:
                self.state, self.why = WireState.PAUSED, "single block"
            elif self.state is WireState.SENDING:
                note = self.packets[self.stop_index].note
                self.state, self.is_program_stop = WireState.WAITING, True
                self.why = f"the program waits: {note}" if note else "the program waits"
        elif status == "RUNNING" and self.state in HALTS:
            self.state, self.why = (
                WireState.SENDING,
                "",
            )  # somebody has resumed it at the machine

    def _count_done(self, text: str, ran: float) -> None:
        """Count the lines before the reported one as done, as far as the simulated time allows
        that."""
        line = _whole_number(text)
        if self._lines and self._lines[0]:
            index = int(np.searchsorted(self._lines, line))
            possible = int(np.searchsorted(self._ends, ran, side="right"))
            self.acknowledged = max(self.acknowledged, min(index, len(self.packets)))
            self.done = max(self.done, min(index, possible))

    def _finish(self, text: str, ran: float) -> None:
        """End the conversation of a program that is finished; _Refused if the machine became idle
        before its end."""
        if self._said:
            raise _Refused(f"it has stopped: {self._said}")
        end, total = self.packets[-1].end_mm, float(self._ends[-1])
        index = int(np.searchsorted(self._lines, _whole_number(text)))
        remaining_s = (
            total - float(self._ends[min(index, len(self._ends) - 1)]) if self._lines[0] else 0.0
        )
        place = self.place_mm
        elsewhere = (
            end is not None
            and place is not None
            and max(abs(one - other) for one, other in zip(end, place, strict=True)) > NEAR_MM
        )
        early = MAX_OVERRIDE * ran + self.manner.patience_s < total
        if elsewhere or early or remaining_s > self.manner.patience_s:
            raise _Refused("it has stopped before the end of the program")
        self.acknowledged = self.done = len(self.packets)
        self._end(WireState.FINISHED)

    def _abort(self) -> Script:
        """Abort, and wait until the controller is idle and the slides stand."""
        yield from self._set("abort")
        end, last, still_count = self._now + self.manner.patience_s, None, 0
        while still_count < STILL_REPORTS:
            status = yield from self._get("program_status")
            place = yield from self._place()
            still_count = still_count + 1 if place == last and status.upper() == "IDLE" else 0
            last = place
            if self._now > end:
                reason = self._why_aborted or "it was told to stop"
                self._why_aborted = f"{reason}; it does not stand: stop it at the machine"
                break
            yield self._poll_s
        message = "stopped: it is idle, and gives the same place again"
        self._end(
            WireState.FAILED if self._why_aborted else WireState.STOPPED,
            self._why_aborted or message,
        )

    # By hand.

    def _home(self) -> Script:
        yield from self._homing()
        self._end(WireState.FINISHED)

    def _zero(self) -> Script:
        words = "".join(f" {axis.upper()}{self._values[axis]:.6f}" for axis in self._axes)
        yield from self._set("mode mdi")
        yield from self._set(f"mdi G10 L20 P0{words}")
        yield self._poll_s
        place = yield from self._place()
        yield from self._errors()
        yield from self._set("mode manual")
        differences = [abs(place["xyz".index(axis)] - self._values[axis]) for axis in self._axes]
        if self._said or max(differences) > NEAR_MM:
            raise _Refused(f"it has not taken it {self._said}".strip())
        self._end(WireState.FINISHED)

    @property
    def _axes(self) -> list[str]:
        return [axis for axis in "xyz" if axis in self._values]

    def _jog(self) -> Script:
        """Jog one axis after the other, and wait until the machine stands."""
        yield from self._set("mode manual")
        yield from self._set("teleop_enable on")
        self._begun = True
        for axis in self._axes:
            distance, feed = self._values[axis], self._values["feed"]
            axis_index = "xyz".index(axis)
            target = (yield from self._place())[axis_index] + distance
            sense = "-" if distance < 0.0 else ""
            yield from self._set(f"jog_incr {axis} {sense}{feed:.6f} {abs(distance):.6f}")
            end = self._now + 2.0 * 60.0 * abs(distance) / feed + 2.0 * self.manner.patience_s
            while abs((yield from self._place())[axis_index] - target) > NEAR_MM / 10.0:
                yield from self._errors()
                if self._said or self._now > end:
                    raise _Refused(self._said or f"{axis.upper()} does not arrive")
                yield self._poll_s
        yield from self._still()
        self._end(WireState.FINISHED)

    def _hold(self) -> Script:
        """Jog by short increments until the user lets go. LinuxCNC adds each to its target, so the
        machine stops within `HELD_AHEAD_S` even if the connection is lost."""
        yield from self._set("mode manual")
        yield from self._set("teleop_enable on")
        self._begun, self.state = True, WireState.SENDING
        feed = self._values["feed"] / math.sqrt(len(self._axes))
        ahead_s = HELD_AHEAD_S * self.manner.late_s / LATE_S
        told_s = self._now - ahead_s
        while True:
            now = self._now
            way_mm, told_s = feed / 60.0 * (now - told_s), now
            for axis in self._axes:
                sense = "-" if self._values[axis] < 0.0 else ""
                yield from self._set(f"jog_incr {axis} {sense}{feed:.6f} {way_mm:.6f}")
            yield from self._place()
            yield from self._errors()
            if self._said:
                raise _Refused(self._said)
            yield 0.25 * ahead_s

    def _still(self) -> Script:
        """Wait until two successive reports give the same place."""
        last = None
        while (place := (yield from self._place())) != last:
            last = place
            yield self._poll_s

    def _probe(self) -> Script:
        """Execute the steps of the cycle, one after the other, by MDI. A step that probes is over
        when its message comes, with the place in the work frame (#5061 to #5063, #5070)."""
        assert self._cycle is not None
        run = CycleRun(self._cycle)
        if _whole_number((yield from self._get("probe_value"))):
            raise _Refused("the probe touches already: lift it, or look at its cable")
        yield from self._set("mode mdi")
        run.begin((yield from self._place()))
        self._begun, self.state = True, WireState.SENDING
        number = 0
        while (step := run.step) is not None:
            yield from self._set(f"mdi {_probe_line(step)}")
            touched = None
            if step.action in ("touch", "guard"):
                number += 1
                marker = f"{PROBED} {number} #5070 #5061 #5062 #5063"
                yield from self._set(f"mdi (DEBUG,{marker})")
                touched = yield from self._touched(number, run, step)
            run.answer(touched)
        yield from self._still()
        yield from self._errors()
        if self._said:
            raise _Refused(self._said)
        yield from self._set("mode manual")
        self._end(WireState.FAILED if run.failure else WireState.FINISHED, run.failure)

    def _touched(
        self, number: int, run: CycleRun, step: ProbeStep
    ) -> Generator[str | float, str, Place | None]:
        """Wait for the message of a step that probes; return the place of the touch, None where
        nothing was touched."""
        steps = [run.place["xyz".index(axis)] - value for axis, value in step.axes.items()]
        length = sum(value * value for value in steps) ** 0.5
        end = self._now + 2.0 * 60.0 * length / step.feed + 2.0 * self.manner.patience_s
        while not (report := (yield from self._errors())):
            if self._said or self._now > end:
                raise _Refused(self._said or "it does not say where the probe stands")
            yield self._poll_s
        try:
            index, has_touched, x, y, z = (float(each) for each in report.split()[1:6])
        except ValueError:
            raise _Refused(f"a report of the probe that is none: {report[:60]!r}") from None
        if index != number:
            raise _Refused(f"a report of another touch: {report[:60]!r}")
        if not has_touched:
            return None
        if reason := run.refusal((x, y, z)):
            raise _Refused(reason)
        return x, y, z


PROBED: Final = "CAMTOOL-PROBE"
"""First word of the messages in which it says where the probe has touched."""


def _probe_line(step: ProbeStep) -> str:
    """Return the MDI line that makes a step of a probing cycle."""
    axes = "".join(f" {axis.upper()}{value:.4f}" for axis, value in step.axes.items())
    if step.action == "zero":
        return f"G21 G10 L20 P0{axes}"
    if step.action == "go":
        return f"G21 G90 G0{axes}"
    return f"G21 G90 G94 G38.3{axes} F{step.feed:.1f}"


def _whole_number(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise _Refused(f"a line that is none: {text[:60]!r}") from None


def _without_password(request: str) -> str:
    """Return a request with its password removed."""
    return re.sub(r"^(hello|(?:set )?enable) \S+", r"\1 …", request)


class LinuxcncTerminal(Terminal):
    """Typed lines for linuxcncrsh, after a greeting."""

    end = b"\r\n"
    stop = b"set abort\r\n"
    asks = b"get program_status\r\nget rel_act_pos\r\n"
    about = (
        "get program_status, get rel_act_pos, get error, set mode mdi, set mdi G0 X1, set abort; "
        "help lists them all"
    )

    def __init__(self, link: LinuxcncLink) -> None:
        super().__init__()
        self.answers = True
        self._idle, self._place = False, ""
        words = f"hello {link.password} camtool 1.0", "set verbose on", "set echo off"
        orders = [*words, f"set enable {link.enable_password}"]
        self.hello = b"".join(order.encode() + self.end for order in orders)

    def halt(self) -> bytes:
        """Return the bytes of an abort; afterwards the place is asked for until two answers
        agree."""
        self._idle, self._place = False, ""
        return super().halt()

    def is_urgent(self, line: str) -> bool:
        """Return True for the commands that stop the machine."""
        return line.lower().split() in (["set", "abort"], ["set", "estop", "on"])

    def meaning(self, line: str) -> str:
        """Return the meaning of a refusal, or from a report whether the machine stands."""
        if line.upper().startswith("PROGRAM_STATUS"):
            self._idle = line.upper().endswith(" IDLE")
        if line.upper().startswith("REL_ACT_POS"):
            self.stands = self._idle and line == self._place
            self._place = line
        if line.endswith(" NAK"):
            return "refused: not enabled, switched off, or unknown"
        return ""
