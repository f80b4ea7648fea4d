"""The PIC18F8720 at the other end of its serial line, as docs/wires/pic-mmh.md describes it.

Characters go into the vector until `;`, the string goes back, and what can be deciphered is done
(L1592-1615, L1735-1770). Each step is reported by a byte; a character that comes in while
something moves stops it, and is received (L1789-1807). What cannot be deciphered is passed over in
silence (L1755-1757, L1769-1770)."""

from __future__ import annotations

import re
from typing import Final, Literal

import msgspec
import numpy as np

from camtool.arrays import Floats, Ints
from camtool.errors import ProgramError
from camtool.machine.model import Machine
from camtool.records import replace
from camtool.target.twin import COMMANDED, Slides, Travel, Twin, travel_of
from camtool.toolpath.moves import Kind

from .controller import PicMmhModel
from .dialect import PicMmhController, PicMmhDialect
from .read import read_program

JOYSTICK_HZ: Final = 170.0
"""Steps a second of the joystick (L1789-1790)."""

RETREAT_STEPS: Final = 400
"""Steps back from the switches of HOME (L1700-1705)."""

JOYSTICK_FACTOR: Final = 1.25
"""Factor by which W raises and V lowers the rate of the joystick; ours, no number is given."""

JOYSTICK_STEPS: Final = 1 << 12

END: Final = ord(";")
"""The character that ends a string (L1742-1744)."""

STEPS: Final = re.compile(rb"P([XYZ])([+-])(\d{4})")
RATE: Final = re.compile(rb"F([XYZ])([+-])(\d{3})")
COMPENSATION: Final = re.compile(rb"B([XYZ])(\d{3})")
JOYSTICK: Final = re.compile(rb"J[XYZ][+-]|&(?:[XYZ][+-]){2,3}")


class PicMmhTwinSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Options for what the thesis leaves open.

    `echo`: the "string" comes back when it has ended (L1594), each "character" at once (L1670), or
    "none". `step_byte`: one byte for each output, "bits" (0x40, and for X, Y and Z in turn a bit
    for a step and one for the negative sense), a letter for each axis ("letters": X, or x for the
    negative sense), or "none". `compensation`: whether the steps of a compensation are "reported"
    as well or "silent". `overflow`: a string that is longer than the buffer is "lost" or "kept".
    `interruption`: the character that stops a motion is "kept" as the first of a string, or
    "lost"."""

    echo: Literal["string", "character", "none"] = "string"
    step_byte: Literal["bits", "letters", "none"] = "bits"
    compensation: Literal["silent", "reported"] = "silent"
    overflow: Literal["lost", "kept"] = "lost"
    interruption: Literal["kept", "lost"] = "kept"


class PicMmhTwin(Twin):
    """The controller with an empty buffer, its part zero where its slides stand."""

    settings = PicMmhTwinSettings
    wire = "RS-232, its rate is not known"

    def __init__(
        self, machine: Machine[PicMmhController, PicMmhDialect], choices: PicMmhTwinSettings
    ) -> None:
        super().__init__(Slides(machine))
        self._given, self._machine, self._choices = machine, machine, choices
        self._model = PicMmhModel()
        self._vector = bytearray()
        self._said: Floats = np.zeros(3)  # last programmed end, mm from part zero
        self._zero: Floats = np.zeros(3)  # part zero, mm from its first place
        self._step_mm = np.array([axis.coded_step_mm for axis in machine.axes])
        self._joystick: tuple[Ints, float] | None = None  # motion that runs until it is stopped
        self._joystick_hz = JOYSTICK_HZ

    def _wake(self) -> None:
        if not self.is_moving and self._joystick is not None:
            self._run_on(*self._joystick)

    def _receive_byte(self, octet: int) -> None:
        if self.is_moving:
            self._stop()
            if self._choices.interruption == "lost":
                return
        if self._choices.echo == "character":
            self._out.append(octet)
        self._vector.append(octet)
        if octet != END:
            return
        string, self._vector = bytes(self._vector), bytearray()
        if self._choices.echo == "string":
            self._out += string
        room = self._machine.dialect.buffer_chars
        if room is None or len(string) <= room or self._choices.overflow == "kept":
            self._decode(string)

    def _stop(self) -> None:
        """Stop the motion for good (Alto): its rest is never made; the coils keep their state."""
        self.slides.stop(self.now)
        self._joystick = None
        self._said = self.slides.commanded_mm - self._zero

    def _decode(self, string: bytes) -> None:
        """Execute a received string, by its first character (L1598-1615)."""
        text = string[:-1]
        if text[:1] in (b"G", b"M"):
            self._block(string)
        elif self._command(text):
            self.commands.append(string)

    # Blocks of programs.

    def _block(self, string: bytes) -> None:
        try:
            path = read_program(string, self._machine)
        except ProgramError:
            return
        self.decoded.append(string)
        if not len(path):
            return
        kind = Kind(int(path.kind[0]))
        if kind == Kind.SET_ZERO:
            self._set_zero()
            return
        start = self.slides.commanded_mm - self._zero
        end = path.end[0].copy()
        if kind <= Kind.ARC_CCW:
            unsaid = [0, 1] if b"Z" in string else [2]
            end[unsaid] = self._said[unsaid]
            last_end, self._said = self._said, end.copy()
            if kind <= Kind.LINE and (end[:2] == last_end[:2]).all():
                end[:2] = start[:2]  # no line: stay where an arc has stopped
        else:
            at_home = [kind == Kind.HOME_XY] * 2 + [kind == Kind.HOME_Z]
            home = np.array(self._machine.controller.machine_zero_mm)
            self._said = np.where(at_home, home, self._said)
        row = replace(path, start=start, end=end[None, :])
        motion = list(self._model.run(row, self._machine, COMMANDED))
        by_passes = self._machine.controller.time_base == "iteration"
        travel = travel_of(motion, by_passes=by_passes)
        if not all(chunk.ledger.ended.all() for chunk in motion):
            # An arc that never ends is left at its nearest approach, as the model leaves it.
            travel = replace(travel, left_at=self._model.quantised(row, self._machine).end[0])
        self.slides.begin(travel.shifted(self._zero), self.now, len(self.decoded) - 1)

    def _set_zero(self) -> None:
        """Make the current position part zero. Machine zero stays at its place."""
        self._zero = self.slides.commanded_mm.copy()
        self._said = np.zeros(3)
        controller = self._given.controller
        home = np.array(controller.machine_zero_mm) - self._zero
        moved_controller = replace(controller, machine_zero_mm=tuple(home.tolist()))
        self._machine = replace(self._given, controller=moved_controller)

    # The other strings.

    def _command(self, text: bytes) -> bool:
        """Execute an interactive command; return False for a text that is none."""
        if text == b"A":
            self._stop()
        elif text == b"H":
            self._home()
        elif text == b"Q":
            self._set_zero()
        elif text in (b"W", b"V"):
            self._joystick_hz *= JOYSTICK_FACTOR if text == b"W" else 1.0 / JOYSTICK_FACTOR
        elif match := COMPENSATION.fullmatch(text):
            self.slides.compensate(b"XYZ".index(match[1]), int(match[2]) / 1000.0)
        elif match := STEPS.fullmatch(text):
            travel = _senses(match[1] + match[2]) * int(match[3])
            self.slides.begin(self._steps(travel, JOYSTICK_HZ), self.now, -1)
        elif (match := RATE.fullmatch(text)) and int(match[3]):
            self._run_on(_senses(match[1] + match[2]), float(match[3]))
        elif JOYSTICK.fullmatch(text):
            self._run_on(_senses(text[1:]), self._joystick_hz)
        else:
            return False
        return True

    def _run_on(self, senses: Ints, hz: float) -> None:
        """Step in these directions at a rate until a character comes."""
        self._joystick = senses, hz
        self.slides.begin(self._steps(senses * JOYSTICK_STEPS, hz), self.now, -1)

    def _home(self) -> None:
        """Move Z, then X, then Y to their switches, then each back from its switch to machine
        zero."""
        home = np.array(self._machine.controller.machine_zero_mm) + self._zero
        target = np.rint((home - self.slides.commanded_mm) / self._step_mm).astype(np.int64)
        legs = []
        for axis in (2, 0, 1):
            approach = np.zeros(3, dtype=np.int64)
            approach[axis] = target[axis] - RETREAT_STEPS
            legs.append(approach)
        retreats = np.eye(3, dtype=np.int64)[[2, 0, 1]] * RETREAT_STEPS
        travel = self._steps(np.array([*legs, *retreats]), JOYSTICK_HZ)
        self.slides.begin(travel, self.now, -1)
        self._said = home - self._zero

    def _steps(self, travels: Ints, hz: float) -> Travel:
        """Return the motion of travels (L, 3) or (3,) in steps, one after the other, one output
        per period."""
        most_hz = self._machine.limits.max_step_rate_hz
        period = 1.0 / min(hz, hz if most_hz is None else most_hz)
        parts = [self.slides.commanded_mm[None, :]]
        for travel in np.atleast_2d(travels):
            counts = np.arange(1, np.abs(travel).max(initial=0) + 1)
            steps = np.sign(travel) * np.minimum(counts[:, None], np.abs(travel))
            parts.append(parts[-1][-1] + steps * self._step_mm)
        commanded = np.concatenate(parts)[1:]
        seconds = period * np.arange(1.0, len(commanded) + 1.0)
        added = np.full(len(commanded), period)
        return Travel(commanded, seconds, added, len(commanded) * period)

    # What is done and reported.

    def _make_outputs(self) -> None:
        """Report the outputs that have become due, with the compensation steps in front of
        them."""
        steps, added = self.slides.advance(self.now)
        if self._choices.step_byte == "none" or not len(steps):
            return
        if self._choices.compensation == "reported" and added.any():
            rows = []
            for step, extra in zip(steps, added, strict=True):
                single_axes = np.diag(np.sign(step))
                rows += [np.repeat(single_axes, extra, axis=0), step[None, :]]
            steps = np.concatenate(rows)
        negative = steps < 0
        if self._choices.step_byte == "bits":
            code = (steps != 0) + 2 * negative
            self._out += (0x40 + code @ [1, 4, 16]).astype(np.uint8).tobytes()
        else:
            letters = np.frombuffer(b"XYZ", np.uint8) + 0x20 * negative
            self._out += letters[steps != 0].astype(np.uint8).tobytes()


def _senses(text: bytes) -> Ints:
    """Return (3,) the directions of X, Y and Z in a text such as X+Y-: 1, −1, or 0 where an axis
    is not named."""
    senses = np.zeros(3, dtype=np.int64)
    for axis, sense in zip(text[::2], text[1::2], strict=True):
        senses[b"XYZ".index(axis)] = -1 if sense == ord("-") else 1
    return senses
