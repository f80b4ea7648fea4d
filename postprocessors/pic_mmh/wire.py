"""Protocol of the PIC18F8720: a block, its echo, its steps, the next block.

A block goes out whole and comes back (L1592-1596, L1670-1673); what comes back is compared. Then
it is executed, and each output of steps reports a byte; any character that comes meanwhile stops
the machine (L1789-1807), so nothing is written until the block is over: when as many reports have
come as the simulation makes outputs, and its time is over. The controller says neither "done" nor
"wrong". `[link]` says what its thesis leaves open."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Final

from camtool.errors import MachineError
from camtool.target.terminal import Terminal
from camtool.target.wire import (
    PATIENCE_FACTOR,
    Forecast,
    Manner,
    Packet,
    PacketByPacket,
    Place,
    Wire,
    WireState,
)
from camtool.toolpath.moves import changes_between_cuts

from .controller import compensations
from .dialect import PicMmhLink, PicMmhMachine

if TYPE_CHECKING:
    from camtool.toolpath.moves import Toolpath

ALTO: Final = b"A;"
_ZEROES: Final = (b"Q;", b"G54;")
"""Strings that make the place of the tool part zero."""

_STEPS = re.compile(rb"P[XYZ][+-](\d{4});")

TIME_FACTOR: Final = 1.05
"""Factor on the simulated time of a block, beyond the lateness of the line."""

UNTIL_SILENT: Final = -1
"""The first of the reports of what nobody can count beforehand, as homing; behind it the fewest
that there can be."""

BY_HAND_HZ: Final = 166.0
"""Steps a second of PX and H by the line (L3196)."""

ENDLESS_S: Final = 600.0
"""Longest time for which a joystick command runs: about 100,000 steps, more than the travel."""

RETREAT_STEPS: Final = 400
"""Steps of each axis back from its switch (L1700-1705)."""

RESTOP_FACTOR: Final = 10.0
"""Wait until A; is sent again to a machine that still reports steps, in multiples of the lateness
of the line (0.5 s)."""

SILENCE_FACTOR: Final = 20
"""Silence after which a block is over, in multiples of the lateness of the line (1 s)."""

MAX_STEPS: Final = 9999
"""A block PX moves by no more steps: its number has four digits."""
MAX_COMPENSATION_UM: Final = 999
"""The largest compensation that a block BX can say: it has three digits."""


class PicMmhWire(Wire):
    """The controller over RS-232; the rate of its line is not given."""

    ready = (
        "the compensation of X and Y is set to what the machine file says (BX, BY)",
        "no key may be pressed at the machine's own interface: any character stops it",
    )
    stopping = "A; stops it at once; its motors keep their place"
    by_hand = frozenset({"home", "zero", "jog", "hold", "line"})
    zeroes_each = False

    def packets(self, data: bytes, machine: PicMmhMachine, forecast: Forecast) -> Sequence[Packet]:
        """Return the packets of the compensations, then those of the blocks; with compensation by
        region, a compensation before each block for which it changes. The thesis does not say
        whether M06 waits: the user is asked before it is sent."""
        fixed_mm = tuple(axis.compensation_mm for axis in machine.axes)[:2]
        decoded = forecast.decoded
        by_block = _by_block(decoded, machine)
        before = next(iter(by_block.values()), fixed_mm)
        packets = [Packet(text) for text in _compensations(before)]
        changes = set(decoded.block[changes_between_cuts(decoded)].tolist())
        *blocks, _ = data.split(b";")
        room = machine.dialect.buffer_chars
        for number, block in enumerate(blocks):
            text = block.strip() + b";"
            if room is not None and len(text) > room:
                raise MachineError(
                    f"has {len(text)} characters, and the controller's buffer {room}",
                    where=f"block {number + 1}",
                )
            seconds = forecast.seconds_of(number)
            added_mm = by_block.get(number, before)
            packets += [Packet(text) for text in _compensations(added_mm, before)]
            before = added_mm
            made_mm = [
                fixed if math.isnan(added) else added
                for added, fixed in zip(added_mm, fixed_mm, strict=True)
            ]
            counts = (_reports(forecast, number, machine, made_mm),)
            stops = number in changes
            ask = f"mount tool {int(text[4:6])} and touch it off" if stops else ""
            packets.append(Packet(text, number, seconds, counts, ask, waits=stops))
        return packets

    def conversation(
        self, packets: Sequence[Packet], machine: PicMmhMachine, manner: Manner
    ) -> PicMmhConversation:
        """Return the conversation that sends these blocks."""
        if manner.home:
            raise MachineError(
                "homing leaves part zero unknown to it",
                where="--home",
                mend="home it by camtool home, and go to part zero",
            )
        return PicMmhConversation(packets, machine, manner)

    def terminal(self, machine: PicMmhMachine) -> PicMmhTerminal:
        """Return the terminal, which shows the echo of strings and counts the reported steps."""
        return PicMmhTerminal(machine)

    def command(
        self, action: str, machine: PicMmhMachine, values: Mapping[str, float], manner: Manner
    ) -> PicMmhConversation:
        """Return the conversation of a command: `H;` homes; `Q;` zeroes all axes at once;
        `PX+1000;` jogs by steps; `JX+;` moves one axis until it is stopped ("hold")."""
        if action == "home":
            packets = [Packet(b"H;", counts=(UNTIL_SILENT, 3 * RETREAT_STEPS))]
        elif action == "zero":
            if not (values.keys() >= set("xyz") and not any(values.values())):
                raise MachineError(
                    "Q; makes the place where the tool stands part zero of all axes, and no other",
                    mend="zero all axes at once (camtool zero)",
                )
            packets = [Packet(b"Q;")]
        elif action == "jog":
            hz = _by_hand_hz(machine)
            packets = [
                Packet(text, seconds=count / hz, counts=(UNTIL_SILENT, count))
                for letter, axis in zip("xyz", machine.axes, strict=True)
                if letter in values
                for text, count in _steps(letter, values[letter], axis.coded_step_mm)
            ]
        elif action == "hold":
            room, feed = values.get("room", math.inf), values["feed"]
            senses = {letter: values[letter] for letter in "xyz" if values.get(letter)}
            if len(senses) != 1:
                raise MachineError(
                    "the joystick of this controller moves one axis at a time",
                    mend="hold one key at a time",
                )
            [(letter, sense)] = senses.items()
            if math.isfinite(room):  # strings that end there by themselves
                return self.command(
                    "jog", machine, {letter: math.copysign(room, sense), "feed": feed}, manner
                )
            text = f"J{letter.upper()}{'-' if sense < 0.0 else '+'};"
            steps = round(ENDLESS_S * _by_hand_hz(machine))
            packets = [Packet(text.encode(), seconds=ENDLESS_S, counts=(UNTIL_SILENT, steps))]
        else:
            return super().command(action, machine, values, manner)  # type: ignore[return-value]
        return PicMmhConversation(packets, machine, manner)


def _by_hand_hz(machine: PicMmhMachine) -> float:
    return min(BY_HAND_HZ, machine.limits.max_step_rate_hz or BY_HAND_HZ)


def _reverses_s(machine: PicMmhMachine) -> list[float]:
    """Return for each axis the seconds without reports while the controller takes up the play, in
    moves by hand."""
    assert isinstance(machine.link, PicMmhLink)
    if machine.link.compensation == "reported" and machine.link.step_byte != "none":
        return [0.0, 0.0, 0.0]
    steps = [axis.compensation_mm / axis.coded_step_mm for axis in machine.axes]
    return [count / _by_hand_hz(machine) for count in steps]


def _compensations(added_mm: Sequence[float], before_mm: Sequence[float] = ()) -> list[bytes]:
    """Return the commands (`BX204;` `BY178;`, in µm) that set the compensation of the simulation:
    those that are known and differ from `before_mm`."""
    commands = []
    for index, (letter, added) in enumerate(zip("XY", added_mm, strict=True)):
        if math.isnan(added) or (before_mm and before_mm[index] == added):
            continue
        um = round(added * 1000.0)
        if abs(um - added * 1000.0) > 1e-6 or um > MAX_COMPENSATION_UM:
            raise MachineError(
                f"the controller takes a compensation in whole µm, up to {MAX_COMPENSATION_UM}, "
                f"not {added * 1000.0:g}",
                where=f"axes.{letter.lower()}.compensation_mm, or the cells of [play_map]",
            )
        commands.append(f"B{letter}{um:03d};".encode())
    return commands


def _by_block(decoded: Toolpath, machine: PicMmhMachine) -> dict[int, tuple[float, ...]]:
    """Return the compensation of X and Y, mm, for each block; empty where it is not by region."""
    if not machine.controller.compensates_by_region:
        return {}
    rows = compensations(decoded, machine)
    return {
        int(block): tuple(added_mm)
        for block, added_mm in zip(decoded.block.tolist(), rows.tolist(), strict=True)
    }


def _reports(
    forecast: Forecast, block: int, machine: PicMmhMachine, added_mm: Sequence[float]
) -> int:
    """Return the number of bytes by which the controller reports the steps of a block."""
    link = machine.link
    assert isinstance(link, PicMmhLink)
    if link.step_byte == "none":
        return 0
    letters = link.step_byte == "letters"
    count = int(forecast.steps[block].sum() if letters else forecast.outputs[block])
    if link.compensation == "reported":
        lengths = (*added_mm, machine.axes.z.compensation_mm)
        count += sum(
            int(reversals) * round(length / axis.coded_step_mm)
            for reversals, axis, length in zip(
                forecast.reversals[block], machine.axes, lengths, strict=True
            )
        )
    return count


def _steps(letter: str, way_mm: float, step_mm: float) -> list[tuple[bytes, int]]:
    """Return the strings that move an axis by `way_mm`, each with its number of steps."""
    remaining, sense = round(abs(way_mm) / step_mm), "-" if way_mm < 0.0 else "+"
    parts = [MAX_STEPS] * (remaining // MAX_STEPS) + [remaining % MAX_STEPS] * (
        remaining % MAX_STEPS > 0
    )
    return [(f"P{letter.upper()}{sense}{part:04d};".encode(), part) for part in parts]


class PicMmhConversation(PacketByPacket):
    """A conversation that sends a block, compares its echo, and counts its steps."""

    goes_on = "it makes the string that it has to its end; any character stops it"
    halts_within = True

    def __init__(self, packets: Sequence[Packet], machine: PicMmhMachine, manner: Manner) -> None:
        super().__init__(packets, manner)
        link = machine.link
        assert isinstance(link, PicMmhLink)
        self._link = link
        if link.step_byte == "none":
            self.stands = (
                "nothing more was sent; by the simulated time it stands, and says nothing"
            )
        self._play_s = _reverses_s(machine)
        self._reverses_s = max(self._play_s)
        self._unsure_s = 0.0  # time the packet may need to take up play
        self._echo = b""
        self._count = 0
        self._over = 0.0  # end of the simulated time of the block
        self._halting = False
        self._step_mm = [axis.coded_step_mm for axis in machine.axes]
        self._play_steps = [
            round(axis.compensation_mm / axis.coded_step_mm)
            if link.compensation == "reported"
            else 0
            for axis in machine.axes
        ]
        self._base_mm: Place | None = None  # place from which steps are counted
        self._counts = [0, 0, 0]
        self._senses = [0, 0, 0]  # direction of the last step of each axis
        self._silent_steps = [0, 0, 0]  # reports of compensation still to come
        self._halt_byte = b""  # a byte that may begin A; or report a step
        self._ends = 0  # number of ; to come back, the one of A; included
        self._told = 0.0  # time at which A; was last sent
        self._count_from(manner.at_mm)

    def _count_from(self, place_mm: Place | None) -> None:
        """Count reported steps from this place on, where steps are reported."""
        self.place_mm = self._base_mm = None if self._link.step_byte == "none" else place_mm
        self._counts = [0, 0, 0]
        self.counts_steps = self.place_mm is not None

    def _count_steps(self, octets: bytes) -> None:
        """Move the place by reported steps; steps of a compensation do not move it."""
        for octet in octets:
            for axis in range(3):
                sense = self._sense(octet, axis)
                if sense and sense != self._senses[axis]:
                    if self._senses[axis]:
                        self._silent_steps[axis] = self._play_steps[axis]
                    self._senses[axis] = sense
                if sense and self._silent_steps[axis]:
                    self._silent_steps[axis] -= 1
                else:
                    self._counts[axis] += sense
        if self._base_mm is None:
            return
        columns = zip(self._base_mm, self._counts, self._step_mm, strict=True)
        x, y, z = (at + count * step for at, count, step in columns)
        self.place_mm = x, y, z

    def _sense(self, octet: int, axis: int) -> int:
        """Return the step of an axis that a byte reports: 1, −1 or 0."""
        if self._link.step_byte == "letters":
            return {"XYZ"[axis]: 1, "xyz"[axis]: -1}.get(chr(octet), 0)
        if not 0x40 < octet < 0x80:
            return 0
        return (0, 1, 0, -1)[octet >> 2 * axis & 3]

    def _send(self, packet: Packet, now: float) -> None:
        self._write(packet.data)
        if packet.data in _ZEROES:
            self._count_from(None if self.place_mm is None else (0.0, 0.0, 0.0))
        self._echo = packet.data if self._link.echo == "echo" else b""
        self._count = 0
        self.next_s = now + self.manner.patience_s
        if not self._echo:
            self._moves(now)

    def _moves(self, now: float) -> None:
        """Record that the block has been accepted and is executed from now on."""
        packet = self.packets[self.sent - 1]
        # The direction of an axis before the program is not known.
        unmoved = zip(self._play_s, self._senses, strict=True)
        self._unsure_s = sum(seconds for seconds, sense in unmoved if not sense)
        self._over = now + packet.seconds
        if self._is_counted_later:
            seconds = packet.seconds + self._reverses_s
            self._over = now + TIME_FACTOR * seconds + 2.0 * self.manner.late_s
            self.next_s = now + self._silence_s
            return
        if self._link.step_byte == "none" or self._link.echo == "none":
            self._over = now + TIME_FACTOR * packet.seconds + 2.0 * self.manner.late_s
        self._count_on(now)

    @property
    def _is_counted_later(self) -> bool:
        """True if the packet under way counts as done when nothing more is received."""
        return self.packets[self.sent - 1].counts[:1] == (UNTIL_SILENT,)

    @property
    def _silence_s(self) -> float:
        """Seconds without a received byte after which the packet counts as done. A jog is done
        with the report of its last step; how many steps homing takes is not known."""
        packet = self.packets[self.sent - 1]
        complete = packet.seconds > 0.0 and self._count >= packet.counts[1]
        return SILENCE_FACTOR * self.manner.late_s + (0.0 if complete else self._reverses_s)

    def _silent(self, now: float) -> None:
        """End the packet after a long silence: done if enough steps have been reported, else
        failed."""
        packet, reports = self.packets[self.sent - 1], self._link.step_byte != "none"
        min_count = packet.counts[1]
        if reports and self._count < min_count:
            self._fail(f"it has reported {self._count} of {min_count} steps", now)
        elif not reports and not packet.seconds:
            self._end(
                WireState.FAILED, "nothing says when it stands, since link.step_byte is none"
            )
        elif not reports and now < self._over:
            self.next_s = self._over
        else:
            self._packet_done(now)

    def _count_on(self, now: float) -> None:
        """End the packet if all its steps have been reported and its time is over; else set the
        time of the next check. Fail at too many steps."""
        counts = self.packets[self.sent - 1].counts
        missing = (counts[0] if counts else 0) - self._count
        if missing < 0:
            self._fail(f"it has reported {-missing} steps too many", now)
        elif missing:
            packet = self.packets[self.sent - 1]
            late_s = (TIME_FACTOR - 1.0) * packet.seconds + TIME_FACTOR * self._unsure_s
            self.next_s = self._over + late_s + self.manner.patience_s
        elif now >= self._over:
            self._packet_done(now)
        else:
            self.next_s = self._over

    def receive(self, data: bytes, now: float) -> None:
        """Handle received bytes: first the echo, then reports of steps."""
        if self.is_over or not data:
            return
        if self._halting:
            # A step of X in the positive sense is the letter A: only the ; behind it tells.
            echoed = data.startswith(self._echo[: len(data)])
            count = min(len(self._echo), len(data)) if echoed else 0
            self._echo = self._echo[count:]
            self._ends -= data.count(b";")
            text = (self._halt_byte + data[count:]).replace(ALTO, b"")
            is_open = self._ends > 0 and text.endswith(ALTO[:1])
            self._halt_byte = ALTO[:1] if is_open else b""
            self._count_steps(text[:-1] if is_open else text)
            if self._ends > 0 and now >= self._told + RESTOP_FACTOR * self.manner.late_s:
                self._told = now
                self._write(ALTO)
            quiet = 4.0 if self._ends <= 0 or self._link.echo == "none" else PATIENCE_FACTOR
            self.next_s = now + quiet * self.manner.late_s
            return
        if not self._busy:
            self._fail(f"it says {data[:20]!r} without being asked", now)
            return
        packet = self.packets[self.sent - 1]
        count = min(len(self._echo), len(data))
        if data[:count] != self._echo[:count]:
            block_text = packet.data.decode("latin-1")
            self._fail(f"the echo of {block_text} is another: {data[:count]!r}{self._rate}", now)
            return
        begins = bool(self._echo) and count == len(self._echo)
        self._echo, steps = self._echo[count:], data[count:]
        self._count += len(steps)
        self._count_steps(steps)
        if any(not self._is_report(octet) for octet in steps):
            self._fail(f"it says {steps[:20]!r}, which is no step", now)
        elif begins:
            self._moves(now)
        elif self._is_counted_later and not self._echo:
            self.next_s = now + self._silence_s
        elif not self._echo:
            self._count_on(now)

    @property
    def _rate(self) -> str:
        """Hint at power and baud rate for an error message before anything was understood; else
        ""."""
        return "; is it switched on, and is --baud its rate?" if not self.done else ""

    def _is_report(self, octet: int) -> bool:
        if self._link.step_byte == "letters":
            return chr(octet) in "XYZxyz"
        return self._link.step_byte == "bits" and 0x40 < octet < 0x80

    def tick(self, now: float) -> None:
        """End a block whose time is over, or fail where a byte is overdue."""
        if self.is_over or now < self.next_s:
            return
        if self._halting:
            if self._ends <= 0:
                self._stopped("stopped: A; has come back, and no step since")
            elif self._link.echo == "none" and self._link.step_byte != "none":
                self._stopped("stopped: A; was sent, and no step is reported any more")
            elif self._link.echo == "none":
                self._stopped("it was told to stop (A;); it does not say whether it stands")
            else:
                reason = self._failing or "it was told to stop"
                self._end(
                    WireState.FAILED, f"{reason}; it did not confirm the stop: switch it off"
                )
            return
        if not self._busy:
            self.next_s = now + self.manner.patience_s
            return
        packet = self.packets[self.sent - 1]
        if self._echo:
            self._fail(f"no echo of {packet.data.decode('latin-1')}{self._rate}", now)
        elif self._is_counted_later:
            self._silent(now)
        elif packet.counts and self._count < packet.counts[0]:
            self._fail(f"it has reported {self._count} of {packet.counts[0]} steps", now)
        else:
            self._count_on(now)

    def _halt(self, now: float, *, unsent: bool) -> bool:
        """Stop the machine by `A;`. Any character would stop it, but this one is a command of its
        own."""
        self._halting, self._told = True, now
        self._ends = 2 if self._echo and not unsent else 1
        self._write(ALTO)
        self.next_s = now + self.manner.patience_s
        return True

    @property
    def _unattended(self) -> str:
        return "" if self._halting else super()._unattended


class PicMmhTerminal(Terminal):
    """Strings that end with ; and go out as they are typed; steps are counted."""

    end = b";"
    stop = ALTO
    about = (
        "a string ends with ; (added where it is missing): H; home, A; stop, Q; zero here, "
        "PX+0100; steps, JX+; until a character comes, BX204; compensation, G…; blocks"
    )

    def __init__(self, machine: PicMmhMachine) -> None:
        super().__init__()
        link = machine.link
        assert isinstance(link, PicMmhLink)
        self._link, self.answers = link, link.echo == "echo"
        self._reverses_s, self._hz = max(_reverses_s(machine)), _by_hand_hz(machine)
        self._left = 0  # steps of PX still to be reported
        self._ends = 0  # number of ; to come back, the one of A; included
        self._steps: list[tuple[str, int]] = []  # kinds of outputs, each with its number
        self._echo = b""  # expected echo: its letters could also report steps

    def encode(self, line: str) -> bytes:
        """Return the bytes of a typed line with its end."""
        data = self.unescape(line.strip())
        if data and not data.endswith(self.end):
            data += self.end
        self._echo = data if self._link.echo == "echo" else b""
        self._ends, self.runs_on = 0, data[:1] in (b"J", b"&", b"F")
        match, reports = _STEPS.fullmatch(data), self._link.step_byte != "none"
        self._left = int(match[1]) if match and reports else 0
        self.due = int(self._left > 0)
        # Steps of compensation come before steps in the other direction.
        self.rests_s = self._reverses_s if data[:1] in (b"G", b"H", b"P") else 0.0
        if match and reports:
            self.rests_s = 0.0
        elif match:
            self.rests_s += int(match[1]) / self._hz
        return data

    def halt(self) -> bytes:
        """Return `A;`, which stops the machine as any character does; its echo says that the
        machine stands."""
        stop = super().halt()
        self._ends = 1 + self._echo.count(self.end)
        self._echo += stop if self._link.echo == "echo" else b""
        self._left, self.due, self.rests_s = 0, 0, 0.0
        return stop

    def is_urgent(self, line: str) -> bool:
        """Return True for the command that stops the machine."""
        return line.strip().rstrip(";") == "A"

    def decode(self, data: bytes) -> list[str]:
        """Return the echo as it is, and the outputs counted: one line for all that have come
        together."""
        lines: list[str] = []
        for octet in data:
            echoed = self._echo[:1] == bytes([octet])
            self._echo = self._echo[1:] if echoed else self._echo
            step = "" if echoed else self._output(octet)
            self._left = max(self._left - bool(step), 0)
            self.due = int(self._left > 0)
            if self._ends and octet == ord(";"):
                self._ends -= 1
                self.stands = not self._ends
            if step and self._steps and self._steps[-1][0] == step:
                self._steps[-1] = step, self._steps[-1][1] + 1
            elif step:
                self._steps.append((step, 1))
            else:
                lines += self._step_summary()
                self._rest += bytes([octet])
                if octet == ord(";"):
                    lines += super().flush()
        return lines

    def flush(self) -> list[str]:
        """Return the counted outputs and the unfinished line."""
        return [*self._step_summary(), *super().flush()]

    def _step_summary(self) -> list[str]:
        steps, self._steps = self._steps, []
        return [f"{count} × {step}" for step, count in steps]

    def _output(self, octet: int) -> str:
        """Return the axes of an output and their directions as text; "" for a byte that reports
        none."""
        if self._link.step_byte == "letters" and chr(octet) in "XYZxyz":
            return f"{chr(octet).upper()}{'+' if chr(octet).isupper() else '-'}"
        if self._link.step_byte != "bits" or not 0x40 < octet < 0x80:
            return ""
        axes = [(letter, octet >> 2 * k & 3) for k, letter in enumerate("XYZ")]
        if any(bits == 2 for _, bits in axes):
            return ""
        return " ".join(f"{letter}{'+' if bits == 1 else '-'}" for letter, bits in axes if bits)
