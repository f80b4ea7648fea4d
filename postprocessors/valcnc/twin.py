"""The PIC18F4550 of ValCNC at the other end of its serial line, as docs/wires/valcnc.md has it.

Characters go into a line until a line feed; blanks and wrong characters are dropped on the way
(L1179). The line is a block, which is then drawn step by step (L1222-1336). Whatever cannot be
decoded is passed over in silence: the thesis describes no message and no answer."""

from __future__ import annotations

from typing import Any, Final, Literal

import msgspec
import numpy as np

from camtool.errors import ProgramError
from camtool.machine.model import Machine
from camtool.records import replace
from camtool.target.twin import COMMANDED, Slides, Twin, travel_of

from .controller import DrawingProgress, ValcncModel
from .dialect import ValcncController, ValcncDialect
from .read import read_block

END: Final = ord("\n")
"""The character that ends a block; inferred from `C` and a line feed (L1482)."""

BLANKS: Final = b" \t\r"
"""Dropped wherever they stand (L1179)."""

CORRECT: Final = b"CGXYZIJ0123456789.+-"
"""The others are wrong characters; ours, since the list is lost (L1179)."""

CONNECTED: Final = b"C"
"""Character that the PC's program sends when it has opened the line (L1482)."""


class ValcncTwinSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Options for what the thesis leaves open.

    `busy`: what comes in while a block is drawn is "lost", since nothing receives it, or "kept"
    until it is done. `wrong`: a wrong character is "dropped" alone, or spoils its "block".
    `answer`: what it says when a block is done."""

    busy: Literal["lost", "kept"] = "lost"
    wrong: Literal["dropped", "block"] = "dropped"
    answer: Literal["none", "ok"] = "none"


def _with_all_defined(
    machine: Machine[ValcncController, ValcncDialect],
) -> Machine[ValcncController, ValcncDialect]:
    """Return the machine with a `[dialect]` that defines every case: where the thesis is silent
    the reader refuses, but a controller does something all the same. What this one does is on the
    page of its wire."""
    dialect = machine.dialect
    meant = {"z_order": "before", "missing_words": "keep", "full_circles": "whole"}
    defined: dict[str, Any] = {
        key: value for key, value in meant.items() if getattr(dialect, key) == "refused"
    }
    dialect = replace(dialect, **defined)
    return replace(machine, dialect=dialect)


class ValcncTwin(Twin):
    """The controller at rest at part zero, which is where its slides stand."""

    settings = ValcncTwinSettings
    wire = "9600 8N1"
    byte_s = 10.0 / 9600.0

    def __init__(
        self, machine: Machine[ValcncController, ValcncDialect], choices: ValcncTwinSettings
    ) -> None:
        super().__init__(Slides(machine))
        self._machine, self._choices = _with_all_defined(machine), choices
        self._model = ValcncModel()
        self._line, self._spoilt = bytearray(), False
        self._kept = bytearray()
        self._at = 0.0, 0.0, 0.0  # the coordinates of the last block
        self._drawn = DrawingProgress(np.zeros(3), np.zeros(3, dtype=np.int64))
        self._drawing = False

    def _wake(self) -> None:
        if self._drawing and not self.is_moving:
            self._drawing = False
            if self._choices.answer == "ok":
                self._out += b"ok\n"
            while self._kept and not self.is_moving:
                self._receive(self._kept.pop(0))

    def _receive_byte(self, octet: int) -> None:
        if not self.is_moving:
            self._receive(octet)
        elif self._choices.busy == "kept":
            self._kept.append(octet)

    def _receive(self, octet: int) -> None:
        if octet in CORRECT:
            self._line.append(octet)
        elif octet not in BLANKS and octet != END:
            self._spoilt |= self._choices.wrong == "block"
        if octet != END:
            return
        line, spoilt = bytes(self._line), self._spoilt
        self._line, self._spoilt = bytearray(), False
        if line == CONNECTED:
            self.commands.append(line + b"\n")
        elif not spoilt and len(line) <= self._machine.dialect.block_chars:
            self._block(line)

    def _block(self, line: bytes) -> None:
        """Draw the block that a received line holds; a line that is no block is ignored."""
        try:
            path, end_place = read_block(line, self._machine, self._at)
            chunks, drawn = self._model.run_on(self._drawn, path, self._machine, COMMANDED)
        except ProgramError:
            return
        self._at, self._drawn, self._drawing = end_place, drawn, True
        self.decoded.append(line + b"\n")
        self.slides.begin(travel_of(chunks), self.now, len(self.decoded) - 1)
