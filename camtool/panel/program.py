"""The program of a panel: its findings, its picture, and what is sent of it."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import Struct

from camtool.errors import InputError, OptionError, OutputError
from camtool.pictures.scene import stock_pair
from camtool.pictures.viewer.page import viewer_page
from camtool.records import replace
from camtool.sending.carry import SendOptions
from camtool.sending.journal import JournalState, read_journal
from camtool.sending.prepare import Consignment, consignment, lines_of, tool_at_of
from camtool.stock.cutters import CutterProfile
from camtool.stock.moves import stock_moves_of_toolpath
from camtool.target.wire import Conversation, Place, ToolAt
from camtool.toolpath.moves import Kind

if TYPE_CHECKING:
    from camtool.target.registry import LoadedTarget


class BlockFacts(Struct, frozen=True):
    """Facts about the block that runs: its `number` (from 1), its end, its feed (None for a rapid
    or no motion) and the speed of the spindle, 0 if it stands."""

    number: int = 0
    end_mm: Place | None = None
    feed_mm_min: float | None = None
    rpm: float = 0.0


class Course:
    """The progress of what is sent: its blocks, and the remaining time."""

    def __init__(self, one: Consignment) -> None:
        self.one = one
        self._left_s = one.times_left_s()
        path = one.forecast.decoded
        self._path = path.first(path.executed_rows)
        self._last_row = np.maximum.accumulate(self._path.block)
        starts = np.isin(self._path.kind, (Kind.SPINDLE_CW, Kind.SPINDLE_CCW, Kind.SPINDLE_OFF))
        self._spindle_rows = np.flatnonzero(starts)

    def left_s(self, acknowledged: int) -> float:
        """Return the remaining time, s, when this number of packets is acknowledged."""
        return self._left_s[acknowledged]

    def acknowledged_block(self, talk: Conversation) -> int:
        """Return the last acknowledged block of the program (from 1), 0 if there is none."""
        if not talk.acknowledged:
            return 0
        return self.one.block_of(self.one.packets[talk.acknowledged - 1].block) + 1

    def following_block(self, talk: Conversation) -> int:
        """Return the block (from 1) after the one at which the program stopped."""
        return self.one.block_of(self.one.packets[talk.stop_index].block) + 2

    def waiting_bytes(self, talk: Conversation) -> int:
        """Return the number of bytes that were sent and are not yet acknowledged."""
        return sum(len(each.data) for each in self.one.packets[talk.acknowledged : talk.sent])

    def facts(self, talk: Conversation) -> BlockFacts:
        """Return facts about the block that runs: the one after the last acknowledged block if it
        was sent, else the last acknowledged one."""
        if not talk.sent:
            return BlockFacts()
        block = self.one.packets[min(talk.acknowledged, talk.sent - 1)].block
        row = int(np.searchsorted(self._last_row, block, side="right")) - 1
        if row < 0:
            return BlockFacts()
        path, rows = self._path, self._spindle_rows
        x, y, z = path.end[row].tolist()
        turn = int(np.searchsorted(rows, row, side="right")) - 1
        speed = float(path.value[rows[turn]]) if turn >= 0 else 0.0
        turns = turn >= 0 and path.kind[rows[turn]] != Kind.SPINDLE_OFF and speed == speed
        return BlockFacts(
            self.one.block_of(block) + 1,
            (x, y, z),
            float(path.feed[row]) if path.is_feed[row] else None,
            speed if turns else 0.0,
        )


class LoadedProgram(Struct, frozen=True, eq=False):
    """A program that was read and judged. `file`: its name; `tool_mm`: diameter of its end mill,
    with which the picture shows the stock, None if not known."""

    file: str
    data: bytes
    target: LoadedTarget
    one: Consignment
    tool_mm: float | None = None

    @classmethod
    def read(cls, file: str, target: LoadedTarget, tool_mm: float | None = None) -> LoadedProgram:
        """Read and judge a program; InputError if it cannot be read."""
        try:
            data = Path(file).read_bytes()
        except OSError as error:
            raise InputError(f"cannot be read ({error.strerror})", file=file) from error
        return cls(file, data, target, consignment(data, target, source=file), tool_mm)

    @property
    def journal(self) -> Path:
        """Return the path of the program's journal, the same as for `camtool send`."""
        return Path(f"{self.file}.journal")

    def page(self) -> bytes:
        """Return the page of the viewer."""
        scene = self.one.run.scene()
        path = scene.toolpath
        if path is None or self.tool_mm is None:
            return viewer_page(scene)
        mills = (CutterProfile(0.5 * self.tool_mm, 0.5 * self.tool_mm),)
        moves = stock_moves_of_toolpath(path, np.zeros(len(path), dtype=np.int64), mills)
        cut = partial(stock_pair, moves, scene.stock_mm, scene.thickness_mm)
        return viewer_page(replace(scene, cut=cut, tool_mm=self.tool_mm))

    def facts(self) -> dict[str, Any]:
        """Return the facts about the program that the page shows, and its findings, as data for
        JSON."""
        one = self.one
        return {
            "name": Path(self.file).name,
            "blocks": one.blocks,
            "packets": len(one.packets),
            "seconds": one.seconds,
            "failed": one.run.failed,
            "sha256": one.sha256[:16],
            "lines": [] if one.run.failed else lines_of(one, self.target),
            "findings": [
                {"severity": each.severity.name.lower(), "text": str(each)}
                for each in one.run.findings
            ],
            "left_at": self._left_at,
        }

    @property
    def _left_at(self) -> int | None:
        """The block behind which its journal says that it was left, None if it was not."""
        state = self._state()
        return None if state is None or state.finished or state.last < 0 else state.block

    def _state(self) -> JournalState | None:
        try:
            state = read_journal(self.journal)
        except InputError:
            return None
        return state if state.sha256 == self.one.sha256 else None

    def prepared(
        self,
        *,
        single: bool,
        first: int,
        resumes: bool,
        despite_errors: bool,
        speed: float,
        tool_at: ToolAt = "",
        more: bool = False,
    ) -> tuple[Consignment, SendOptions]:
        """Return what is sent, and the options of sending it; `more`: continue the journal.
        OptionError for a program with errors unless these are allowed, for one that cannot be
        resumed, and if the user must say where the tool is."""
        if self.one.run.failed and not despite_errors:
            raise OptionError(
                "the program has errors that would spoil the part",
                where=self.file,
                mend="mend it, or say that it is to be sent all the same",
            )
        state = self._state() if resumes else None
        if resumes and (state is None or state.finished):
            raise OptionError("no journal says where it was left", where=self.file)
        begin = state.block if state is not None else first
        one = self.one
        if state is not None:
            name = self.target.machine.target.name
            stated, question = tool_at_of(one.wire, state, tool_at, name)
            if question and not tool_at:
                raise OptionError(
                    f"{question}?", where=self.file, mend="say where the tool stands, and go on"
                )
            tool_at = stated
        if begin or state is not None or one.run.failed:
            one = consignment(
                self.data,
                self.target,
                source=self.file,
                first=begin,
                state=state,
                tool_at=tool_at,
                despite_errors=despite_errors,
            )
        options = SendOptions(
            self.journal,
            single=single,
            speed=speed,
            more=resumes or more,
            file=self._sent_file(one),
        )
        return one, options

    def _sent_file(self, one: Consignment) -> str:
        """Write what is sent to a file beside the program, for controllers that open a file
        themselves; return its path, "" for other controllers."""
        if not one.wire.opens_file:
            return ""
        file = Path(self.file)
        copy = file.with_name(f"{file.stem}.sent{file.suffix}").resolve()
        try:
            copy.write_bytes(one.data)
        except OSError as error:
            raise OutputError(f"cannot be written ({error.strerror})", file=str(copy)) from error
        return str(copy)
