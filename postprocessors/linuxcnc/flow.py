"""The order in which lines are read: O words (sub, call, if, while, do, repeat) and M98, M99.

`Flow.step` gives the next line of words, and None at the % that ends a program. As LinuxCNC it
knows no structure of the program, only labels and a place to seek: a condition that does not hold
skips lines up to a word with the same label (interp_o_word.cc). Labels of branches and loops
belong to the sub in which they stand; those of subs to the program.

What is executed is bounded: `MAX_CALL_LEVELS` calls within calls, and `most_lines` lines in all.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, Final, NoReturn

from msgspec import Struct

from camtool.errors import ProgramError

from ..gcode.faults import LineFault
from .expressions import Scanner, evaluate, whole_number
from .lines import ParsedLine, column_of
from .parameters import ARGUMENTS, Parameters
from .texts import Folder, ProgramText

if TYPE_CHECKING:
    from .expressions import Value

MAX_CALL_LEVELS: Final = 10
"""Calls within calls are fewer than this (INTERP_SUB_ROUTINE_LEVELS)."""

MAX_CALLERS_SHOWN: Final = 3

KINDS: Final = (
    *("sub", "endsub", "call", "do", "while", "repeat", "if", "elseif", "else", "endif"),
    *("break", "continue", "endwhile", "endrepeat", "return"),
)

OF_THE_PROGRAM: Final = ("sub", "program", "endsub", "call", "M98", "return", "M99")
"""Words whose labels are the program's, not those of the sub in which they stand."""

CONDITIONS: Final = ("while", "repeat", "if", "elseif")
"""Words that are followed by an expression."""


class EndOfFile(LineFault):
    """Raised when the file ends before the program does."""


class TextPosition(Struct):
    """A line of a text, counted from 0."""

    text: ProgramText
    line: int


class FlowLabel(Struct):
    """A label: its first place, the word that used it, and the repetitions left of a `repeat`, −1
    before it begins."""

    kind: str
    place: TextPosition
    left: int = -1


class Call(Struct):
    """An active call: the name of the sub, its kind ("call", "M98"), the place to return to, the
    parameters before it, and the modes that M70 and M73 have saved in it (None: none). `again`:
    the calls of M98 L still to make. The first call stands for the program itself."""

    sub: str = ""
    kind: str = ""
    back: TextPosition | None = None
    called: TextPosition | None = None
    before: dict[int, float | None] | None = None
    saved: Any = None
    restores: bool = False
    again: int = -1


class _Word(Struct):
    """An O word: its kind, its label, and the offset at which its text continues."""

    kind: str
    label: Any
    rest: int
    condition: Any = None
    words: ParsedLine | None = None


class Flow:
    """Reads one program in the order of execution. `restore` restores modes that a call has
    saved."""

    def __init__(
        self,
        text: ProgramText,
        parameters: Parameters,
        folder: Folder,
        most_lines: int,
        block_delete: bool,
        restore: Callable[[Any], None] = lambda saved: None,
    ) -> None:
        self.text, self.given, self.folder = text, parameters, folder
        self.most_lines, self.block_delete, self.restore = most_lines, block_delete, restore
        self.at = 0
        self.lines_read = 0
        self.percent = False
        self.calls = [Call()]
        self.returned: float | None = None
        self.current: ParsedLine | None = None
        """The line that was read last, at `here`."""
        self.here = TextPosition(text, 0)
        self.deleted: dict[int, None] = {}
        """Lines of the program that begin with /, counted from 1."""
        self.branches = False
        """True if there has been an O word."""
        self.keep = True
        """True if lines may be read again."""
        self._labels: dict[str, FlowLabel] = {}
        self._seeking: str | None = None
        self._seeking_sub: str | None = None
        self._defining: str | None = None
        self._executed_if = False
        self._breaking = False
        self._continuing = False
        self.given.show(
            {
                "_value": lambda: self.returned or 0.0,
                "_value_returned": lambda: float(self.returned is not None),
                "_call_level": lambda: float(self.level),
            }
        )

    # Reading

    def step(self, within: int = 0) -> ParsedLine | None:
        """Return the next line of words; None at the % that ends the program, and after an O word
        that leaves fewer than `within` calls active."""
        while True:
            if self.at >= self.text.count:
                self._end_of_file()
            self.here = TextPosition(self.text, self.at)
            self.current = None
            self.lines_read += 1
            if self.lines_read > self.most_lines:
                raise LineFault(
                    f"the program executes more than {self.most_lines} lines that are read one by "
                    "one: it may loop without end",
                    mend="if it ends, raise --set dialect.most_lines=…",
                )
            line = self.current = self.text.line(self.at, keep=self.keep)
            self.at += 1
            self.given.line = self.at
            text = line.text
            if text == "%" and self.percent:
                if self._seeking is not None:
                    raise LineFault(
                        f"the program ends, and o<{_own_name(self._seeking)}> was not found"
                    )
                return None
            if line.delete:
                self.deleted[self.block_line + 1] = None
                if self.block_delete:
                    continue
            if not text:
                continue
            if line.flow is not None and self._is_of_flow(line):
                self._obey(line)
                if within and self.level < within:
                    return None
                continue
            if self._seeking is None:
                return line

    def lines_of_sub(self, number: int) -> Iterator[ParsedLine]:
        """Yield the lines of words of a sub as if it were called here."""
        line, place, level = self.current, self.here, self.level + 1
        self.current = ParsedLine(f"o{number}call")
        self._obey(self.current)
        while (inner := self.step(level)) is not None:
            yield inner
        if self.level >= level:
            raise LineFault("the program ends within the contour of a cycle", None)
        self.current, self.here = line, place

    @property
    def level(self) -> int:
        """Number of active calls; 0 in the program itself."""
        return len(self.calls) - 1

    @property
    def seeks(self) -> bool:
        """True while lines are skipped in search of a label."""
        return self._seeking is not None

    @property
    def caller(self) -> str:
        """The active call, for messages: `o<slot> called in line 7`; "" for none."""
        names = [
            f"o<{call.sub}> called in {_of_place(call.called)}"
            for call in reversed(self.calls[1:])
            if call.called is not None
        ]
        return ", ".join(names[:MAX_CALLERS_SHOWN])

    @property
    def block_line(self) -> int:
        """Line of the program itself that is being executed; in the file of a sub, the line of its
        call."""
        if not self.here.text.name:
            return self.here.line
        program_calls = [
            call.called for call in self.calls if call.called and not call.called.text.name
        ]
        return program_calls[-1].line if program_calls else 0

    def fail(self, fault: LineFault) -> NoReturn:
        """Raise ProgramError with the place of the line that was read last."""
        text, number = self.here.text, min(self.here.line, max(self.here.text.count - 1, 0))
        begin, end = int(text.begins[number]), None
        if number + 1 < len(text.begins):
            end = int(text.begins[number + 1]) - 1
        raw = text.data[begin:end].decode("latin-1").rstrip("\r")
        fault_column = fault.at
        if isinstance(fault_column, str):
            fault_column = self.current.place(fault_column) if self.current is not None else None
        if fault_column is None:
            fault_column = self.current.begin if self.current is not None else 0
        column = column_of(raw, fault_column)
        if text.name:
            where = f"file {text.name}, line {number + 1}, column {column}"
        else:
            block = text.blocks_before(number)
            where = f"block {block + 1}, line {number + 1}, column {column}"
        caller = f", in {self.caller}" if self.caller else ""
        raise ProgramError(fault.message, where=where + caller, mend=fault.mend) from None

    def _end_of_file(self) -> NoReturn:
        self.here = TextPosition(self.text, max(self.text.count - 1, 0))
        self.current = None
        if self._seeking_sub is not None:
            call = self.calls.pop()
            self.here = call.called or self.here
            raise LineFault(f"there is no sub o<{self._seeking_sub}>", mend=self.folder.mend)
        if self._seeking is not None:
            raise LineFault(f"the file ends, and o<{_own_name(self._seeking)}> was not found")
        if self.level:
            raise LineFault(
                f"the file ends within o<{self.calls[-1].sub}>", mend="end it with endsub"
            )
        raise EndOfFile("the file ends without an end of the program")

    # O words

    def _is_of_flow(self, line: ParsedLine) -> bool:
        """Return True if the O word, M98 or M99 at the start of the line changes the flow. M99
        outside of a sub does not; it ends the program."""
        assert line.flow is not None
        return not line.text.startswith("m99", line.flow) or self.level > 0

    def _obey(self, line: ParsedLine) -> None:
        if line.word is None:
            line.word = _word_of(line)
        word: _Word = line.word
        self.branches = True
        own_label = self._label(word)
        label = own_label if word.kind in OF_THE_PROGRAM else f"{self._scope()}#{own_label}"
        if word.kind in ("sub", "program") and self._defining is not None:
            raise LineFault("a sub within a sub", line.flow)
        skips = self._seeking is not None and self._seeking != label
        value = 0.0
        if word.kind in ("endsub", "return", "M99"):
            if skips:
                return
            self._take_result(line, word)
        elif self._defining is not None:
            return
        elif word.kind == "":
            raise LineFault("no word of O lines", word.rest)
        elif word.kind == "call" and self._seeking is not None:
            return
        elif word.kind in CONDITIONS:
            if skips:
                return
            value = self._condition(line, word)
        if not skips and self._seeking is None and word.kind not in ("call", "M98"):
            _check_rest(line, word)
        if skips or (self._seeking_sub is not None and word.kind not in ("sub", "program")):
            return
        self._carry_out(word, label, value)

    def _carry_out(self, word: _Word, label: str, value: float) -> None:
        kind = word.kind
        if kind in ("sub", "program"):
            self._begin_sub(kind, label)
        elif kind in ("endsub", "return", "M99"):
            self._end_sub(kind)
        elif kind in ("call", "M98"):
            self._call(word, label)
        elif kind == "do":
            self._seeking = None
            if label not in self._labels:
                self._save(kind, label)
        elif kind == "repeat":
            self._repeat(label, value)
        elif kind == "while":
            self._while(label, value)
        elif kind in ("if", "elseif", "else", "endif"):
            self._branch(kind, label, value)
        elif kind in ("break", "continue"):
            self._leave_loop(kind, label)
        else:
            self._end_loop(kind, label)

    def _scope(self) -> str:
        if self.level:
            return self.calls[-1].sub
        return self._defining or ""

    def _label(self, word: _Word) -> str:
        label = word.label
        if word.kind == "M99":
            return self.calls[-1].sub
        if word.kind == "M98":
            return self._m98_label(word)
        return label if isinstance(label, str) else str(label(self.given))

    def _save(self, kind: str, label: str) -> FlowLabel:
        if label in self._labels:
            before = self._labels[label].place
            raise LineFault(
                f"o<{_own_name(label)}> is defined a second time: {_of_place(before)} has it"
            )
        self._labels[label] = FlowLabel(kind, TextPosition(self.here.text, self.here.line))
        return self._labels[label]

    def _label_of(self, label: str) -> FlowLabel:
        known_label = self._labels.get(label)
        if known_label is None:
            raise LineFault(f"no word with the label o<{_own_name(label)}> has come before")
        return known_label

    def _unique_label(self, kind: str, label: str, *, after_do: bool = False) -> FlowLabel:
        """Return the label of a word that may stand in one place only; LineFault where another
        line has it."""
        known_label = self._labels.get(label)
        if known_label is None:
            return self._save(kind, label)
        other = known_label.place.line != self.here.line
        if other and not (after_do and known_label.kind == "do"):
            raise LineFault(
                f"the label o<{_own_name(label)}> is also that of {_of_place(known_label.place)}"
            )
        return known_label

    def _go_to(self, label: str) -> None:
        place = self._labels[label].place
        self.text, self.at = place.text, place.line

    def _condition(self, line: ParsedLine, word: _Word) -> float:
        if word.condition is None:
            if line.text[word.rest : word.rest + 1] != "[":
                raise LineFault(f"{word.kind} without its [condition]", word.rest)
            scanner = Scanner(line.text, word.rest)
            word.condition = scanner.expression()
            word.rest = scanner.at
        return evaluate(word.condition, self.given)

    # Subs

    def _begin_sub(self, kind: str, label: str) -> None:
        call_kind = self.calls[-1].kind
        if kind == "program" and call_kind == "call":
            raise LineFault("a sub of O and a number alone is called by M98")
        if kind == "sub" and call_kind == "M98":
            raise LineFault("a sub is called by o… call, not by M98")
        if self._seeking is not None:
            self._save(kind, label)
            self._seeking = None
        self._seeking_sub = None
        if kind == "program" or self.level:
            return
        self._save(kind, label)
        self._seeking = self._defining = label

    def _end_sub(self, kind: str) -> None:
        call = self.calls[-1]
        if not self.level and self._defining is None:
            raise LineFault(f"{kind} outside of a sub")
        if call.kind == "M98" and kind != "M99":
            raise LineFault("a sub that M98 has called ends with M99")
        if call.kind == "call" and kind == "M99":
            raise LineFault("a sub that o… call has called ends with endsub")
        if kind == "endsub":
            self._seeking = None
        if not self.level:
            if kind == "endsub":
                self._defining = None
            return
        self._return(call)

    def _return(self, call: Call) -> None:
        self.calls.pop()
        self.given.leave(call.before)
        assert call.back is not None  # the first call alone has none
        self.text, self.at = call.back.text, call.back.line
        if call.restores and call.saved is not None:
            self.restore(call.saved)

    def _call(self, word: _Word, label: str) -> None:
        if len(self.calls) >= MAX_CALL_LEVELS:
            raise LineFault(
                f"{MAX_CALL_LEVELS} calls within calls, more than LinuxCNC takes: "
                f"o<{label}> may call itself without end"
            )
        caller = self.calls[-1]
        return_place = TextPosition(self.text, self.at)
        go_on = self._way_to(label)
        if word.kind == "M98":
            self.calls.append(Call(label, "M98", return_place, self.here))
            self.given.enter(None)
            times = self._times(word)
            if times == 0:
                return
            if times is not None:
                caller.again = (times if caller.again == -1 else caller.again) - 1
                if caller.again > 0:
                    return_place.line -= 1
                else:
                    caller.again = -1
        else:
            arguments = self._arguments(word)
            before = self.given.enter(arguments)
            self.calls.append(Call(label, "call", return_place, self.here, before))
        go_on()

    def _way_to(self, label: str) -> Callable[[], None]:
        """Return a function that jumps to a sub: to its known place, or by a search from the
        beginning of its own file or from the present line on."""
        local_name = label.rsplit("/", 1)[-1]
        if local_name in self._labels:
            return lambda: self._go_to(local_name)
        file_text = self.folder.find(label)

        def seek() -> None:
            if file_text is not None:
                self.text, self.at = file_text, 0
            self._seeking = self._seeking_sub = local_name

        return seek

    def _arguments(self, word: _Word) -> list[float]:
        line = self.current
        assert line is not None  # it has the call
        if word.condition is None:
            values: list[Value] = []
            scanner = Scanner(line.text, word.rest)
            while line.text[scanner.at : scanner.at + 1] in ("[", "("):
                if line.text[scanner.at] == "(":
                    scanner.at = line.text.find(")", scanner.at) + 1
                    continue
                if len(values) >= len(ARGUMENTS):
                    raise LineFault(
                        f"a call with more than {len(ARGUMENTS)} arguments", scanner.at
                    )
                values.append(scanner.expression())
            word.rest = scanner.at
            _check_rest(line, word)
            word.condition = values
        return [evaluate(value, self.given) for value in word.condition]

    def _take_result(self, line: ParsedLine, word: _Word) -> None:
        """Store the value of `endsub [value]` and `return [value]`."""
        if self._defining is not None:
            return
        if word.kind != "M99" and line.text[word.rest : word.rest + 1] == "[":
            if word.condition is None:
                scanner = Scanner(line.text, word.rest)
                word.condition = scanner.expression()
                word.rest = scanner.at
            self.returned = evaluate(word.condition, self.given)
        elif word.condition is not None:
            self.returned = evaluate(word.condition, self.given)
        else:
            self.returned = None

    def _m98_label(self, word: _Word) -> str:
        assert word.words is not None
        words = word.words.block(self.given).words
        if "p" not in words:
            raise LineFault("M98 without the P of its sub", None)
        return str(whole_number(words["p"], 0))

    def _times(self, word: _Word) -> int | None:
        assert word.words is not None
        count = word.words.block(self.given).words.get("l")
        return None if count is None else int(count)

    # Branches and loops

    def _branch(self, kind: str, label: str, value: float) -> None:
        if kind == "if":
            self._unique_label(kind, label)
            self._executed_if = value != 0.0
            self._seeking = None if self._executed_if else label
            return
        if self._label_of(label).kind != "if":
            raise LineFault(f"{kind} without its if: o<{_own_name(label)}> is another word")
        if kind == "endif":
            self._seeking = None
            self._executed_if = True
        elif self._executed_if:
            self._seeking = label
        elif (kind == "elseif" and value != 0.0) or (kind == "else" and self._seeking == label):
            self._seeking = None
            self._executed_if = True

    def _while(self, label: str, value: float) -> None:
        loop = self._unique_label("while", label, after_do=True)
        self._seeking = None
        if loop.kind == "while":
            if value == 0.0:
                self._seeking = label
        elif value != 0.0 and not self._breaking:
            self._go_to(label)
        else:
            self._breaking = False

    def _repeat(self, label: str, value: float) -> None:
        loop = self._unique_label("repeat", label)
        self._seeking = None
        if loop.kind != "repeat":
            return
        if loop.left == -1:
            loop.left = round(value)
        if loop.left > 0:
            loop.left -= 1
        else:
            self._seeking = label
            loop.left = -1

    def _leave_loop(self, kind: str, label: str) -> None:
        if self._label_of(label).kind not in ("while", "do"):
            raise LineFault(
                f"{kind} without its while or do: o<{_own_name(label)}> is another word"
            )
        if kind == "continue" and self._seeking == label:
            return
        self._seeking = label
        if kind == "break":
            self._breaking = True
        else:
            self._continuing = True

    def _end_loop(self, kind: str, label: str) -> None:
        loop_kind = "repeat" if kind == "endrepeat" else "while"
        if self._label_of(label).kind != loop_kind:
            raise LineFault(
                f"{kind} without its {loop_kind}: o<{_own_name(label)}> is another word"
            )
        if self._seeking == label:
            self._seeking = None
            if not self._continuing:
                return
            self._continuing = False
        self._go_to(label)


def _word_of(line: ParsedLine) -> _Word:
    """Return the O word, M98 or M99 that begins a line."""
    text, begin = line.text, line.flow
    assert begin is not None
    if text[begin] == "m":
        if text.startswith("m99", begin):
            return _Word("M99", None, begin + 3)
        call_line = ParsedLine(text[begin + 3 :])
        return _Word("M98", None, len(text), words=call_line)
    begin += 1
    label: Any
    if text[begin : begin + 1] == "<":
        end = text.find(">", begin)
        if end < 0:
            raise LineFault("a name without its closing >", begin)
        label, begin = text[begin + 1 : end], end + 1
    else:
        digits = begin
        while text[digits : digits + 1].isdigit():
            digits += 1
        if digits > begin and text[digits : digits + 1] != ".":
            label, begin = str(int(text[begin:digits])), digits
        else:
            scanner = Scanner(text, begin)
            label = scanner.whole_number()
            label = str(label) if isinstance(label, int) else label
            begin = scanner.at
    for kind in KINDS:
        if text.startswith(kind, begin):
            return _Word(kind, label, begin + len(kind))
    if text[begin : begin + 1] in ("", "(", ";"):
        return _Word("program", label, begin)
    return _Word("", label, begin)


def _check_rest(line: ParsedLine, word: _Word) -> None:
    """Raise LineFault where more than comments follows an O word."""
    position = word.rest
    while position < len(line.text) and line.text[position] != ";":
        if line.text[position] != "(":
            raise LineFault("more than comments behind an O word", position)
        position = line.text.find(")", position) + 1


def _own_name(label: str) -> str:
    """Return a label without the name of its sub."""
    return label.rsplit("#", 1)[-1]


def _of_place(place: TextPosition) -> str:
    line = f"line {place.line + 1}"
    return f"{line} of {place.text.name}" if place.text.name else line
