"""The program of a panel: its findings, its picture, and what is sent of it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgspec import Struct

from camtool.errors import InputError, OptionError
from camtool.pictures.viewer.page import viewer_page
from camtool.sending.carry import SendOptions
from camtool.sending.journal import JournalState, read_journal
from camtool.sending.prepare import Consignment, consignment, lines_of

if TYPE_CHECKING:
    from camtool.target.registry import LoadedTarget


class LoadedProgram(Struct, frozen=True, eq=False):
    """A program that was read and judged; `file` names it."""

    file: str
    data: bytes
    target: LoadedTarget
    one: Consignment

    @classmethod
    def read(cls, file: str, target: LoadedTarget) -> LoadedProgram:
        """Read and judge a program; InputError if it cannot be read."""
        try:
            data = Path(file).read_bytes()
        except OSError as error:
            raise InputError(f"cannot be read ({error.strerror})", file=file) from error
        return cls(file, data, target, consignment(data, target, source=file))

    @property
    def journal(self) -> Path:
        """Return the file of its journal, which is that of `camtool send`."""
        return Path(f"{self.file}.journal")

    def page(self) -> bytes:
        """The page of the viewer."""
        return viewer_page(self.one.run.scene())

    def facts(self) -> dict[str, Any]:
        """Return the values of the program that the page shows, and its findings."""
        one = self.one
        return {
            "name": Path(self.file).name,
            "blocks": one.blocks,
            "packets": len(one.packets),
            "seconds": one.seconds,
            "failed": one.run.failed,
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
        self, *, single: bool, first: int, resumes: bool, despite_errors: bool, speed: float
    ) -> tuple[Consignment, SendOptions]:
        """Return what is sent, and how; OptionError for a program with errors, unless they are
        allowed, and for one that cannot be resumed."""
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
        if begin or state is not None or one.run.failed:
            one = consignment(
                self.data,
                self.target,
                source=self.file,
                first=begin,
                state=state,
                despite_errors=despite_errors,
            )
        options = SendOptions(
            self.journal,
            single=single,
            speed=speed,
            more=resumes,
            file=str(Path(self.file).resolve()) if one.wire.opens_file else "",
        )
        return one, options
