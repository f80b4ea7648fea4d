"""Reading RS274-like text: lines, runs of plain blocks among them, and the words of blocks.

What a *block* is: a line with at least one word, apart from its number. `listing` has a program's
blocks, counted from 0 as in `Toolpath.block`; lines are counted from 1 in messages. Lines end with
LF, CR LF or CR, also mixed.

Blocks of moves alone, thousands in a row, are offered by columns (`PlainRuns`, `PlainBlocks`) to
readers that want them so. All other lines are read one by one: by an interpreter of the dialect's
own over `ProgramLines`, or, where blocks are rows of words and nothing else, by `blocks_of`:

    for block in blocks_of(data, Lexing(letters="GMXYZIJF")):
        for letter, number in block.words: ...           # ("X", "-1.50")
        block.fail("a Z beside X", word=2)               # ProgramError: block, line and column

Columns are those of the file's own line, from 1, and are only worked out when something is wrong,
so that words need not carry them.

Writers never use this module, readers never `format.py`."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Final, Literal, NoReturn

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.bounds import check_count
from camtool.errors import ProgramError
from camtool.kernels import words
from camtool.toolpath.program import Listing

SHOWN_CHARS: Final = 32

LINE_CHARS: Final = 4096
"""A longer line is refused where the dialect itself has no limit: no machine reads such lines."""

MIN_RUN: Final = 24

MAX_UNTRIED_LINES: Final = 256
"""Most lines between two attempts to read a run of plain lines, in a text that has none."""

ROWS_AT_ONCE: Final = 1 << 12

LETTERS: Final = "GXYZIJF"
"""Letters of plain blocks, by column."""

SURE_PART: Final = 0.999
"""Part of a limit of a rule for arcs: what keeps to it does so however it is rounded."""

# Possessive (++): a number is matched in one way only, so that no line costs more than its length.
_NUMBER: Final = r"[+-]?+(?:\d++(?:\.\d*+)?|\.\d++)"
_ODD: Final = re.compile(rb"[^\x20-\x7e\t\r\n]")
_BARE_RETURN: Final = re.compile(rb"\r(?!\n)")
_LINE_END: Final = re.compile(rb"\r\n|\n|\r")
_NO_BLANKS: Final = str.maketrans("", "", " \t")
_NO_WORDS: Final = re.compile(r"\([^()]*\)|;.*|[ \t%]")
_BLOCK_NUMBER: Final = re.compile(r"[Nn]\d+(?:\.\d*)?")

# For signs that begin no word: (message, remedy).
_SIGNS: Final = {
    ",": ("a decimal comma", "write a decimal point"),
    "#": ("a parameter", "only plain numbers can be read"),
    "[": ("an expression", "only plain numbers can be read"),
    "$": ("a command of the controller itself", "programs hold words only"),
    "/": ("a block that a switch may leave out", "write it without / or remove it"),
    "%": ("a %, which is no word and frames no program here", "remove it"),
    "=": ("an assignment", "only plain numbers can be read"),
    **dict.fromkeys("();", ("this dialect has no comments", "remove them")),
}


class ProgramLines:
    """The lines of a program, counted from 0; a lone CR ends a line too."""

    def __init__(self, data: bytes) -> None:
        self.data = _BARE_RETURN.sub(b"\n", data) if b"\r" in data else data
        self.octets = np.frombuffer(self.data, dtype=np.uint8)
        ends = np.flatnonzero(self.octets == ord("\n"))
        self.begins: Ints = np.concatenate([[0], ends + 1])
        self.count = len(self.begins) - int(self.begins[-1] == len(self.data))

    def close(self) -> None:
        """Release the program's bytes; no line can be read afterwards."""
        del self.data, self.octets, self.begins

    def text(self, number: int) -> str:
        """Return a line, each byte a character."""
        begin = int(self.begins[number])
        last = number + 1 == len(self.begins)
        end = len(self.data) if last else int(self.begins[number + 1]) - 1
        return self.data[begin:end].decode("latin-1").removesuffix("\r")


class PlainBlocks(Struct, frozen=True, eq=False):
    """N consecutive blocks that have no words but G X Y Z I J F, each at most once, G being G0 to
    G3: numbers (N, 7) and facts (N, 5) as in `camtool.kernels.words`. `first`: the index of the
    first block. `numbers` is undefined where a block does not have the word."""

    numbers: Floats
    facts: Ints
    first: int

    def __len__(self) -> int:
        return len(self.facts)

    def has(self, column: int) -> Bools:
        """Return a mask (N,), true for blocks that have the word of this column."""
        return np.asarray((self.facts[:, words.MASK] >> column) & 1 == 1)


def fill_forward(has_value: Bools, values: Floats, before: float) -> Floats:
    """Return (N,) for each row the last value given up to it; `before` where none was given
    yet."""
    latest = np.maximum.accumulate(np.where(has_value, np.arange(1, len(has_value) + 1), 0))
    return np.asarray(np.concatenate([[before], values])[latest])


def form_of(letters: str) -> int:
    """Return the code of a block with these letters in this order, as in `words.FORM`."""
    number = 0
    for letter in letters:
        number = number * 8 + LETTERS.index(letter) + 1
    return number


Take = Callable[[PlainBlocks], int]
"""Takes blocks in a row, as many as it can by columns, and says how many these are."""


class PlainRuns:
    """Finds runs of plain lines and offers them to a reader. Where lines are not plain, or the
    reader takes few of them, it tries less and less often; it offers at most twice as many as were
    taken before. `most_chars` and `free` are those of `words.plain_lines`."""

    def __init__(self, lines: ProgramLines, most_chars: int, *, free_order: bool) -> None:
        self._lines, self._most_chars, self._free = lines, most_chars, free_order
        self._numbers = np.zeros((0, 7))
        self._facts = np.empty((0, words.FACT_COLUMNS), dtype=np.int64)
        self._wait, self._waited = 1, 0
        self._most = ROWS_AT_ONCE

    def run(self, number: int, index: int, take: Take) -> tuple[int, int]:
        """Offer to `take` the plain lines from line `number` on, the first of which is block
        `index`. Return how many blocks it took, and the number of the line behind them."""
        self._waited += 1
        if self._waited < self._wait or number >= self._lines.count:
            return 0, number
        self._waited = 0
        if not len(self._facts):
            self._numbers = np.zeros((ROWS_AT_ONCE, 7))
            self._facts = np.empty((ROWS_AT_ONCE, words.FACT_COLUMNS), dtype=np.int64)
        begin = int(self._lines.begins[number])
        numbers, facts = self._numbers[: self._most], self._facts[: self._most]
        rows, _, line_behind = words.plain_lines(
            self._lines.octets, begin, number + 1, self._most_chars, self._free, numbers, facts
        )
        count = 0
        if rows >= MIN_RUN:
            count = take(PlainBlocks(numbers[:rows], facts[:rows], index))
        self._wait = 1 if count >= MIN_RUN else min(2 * self._wait, MAX_UNTRIED_LINES)
        self._most = min(2 * max(count, MIN_RUN), ROWS_AT_ONCE)
        if not count:
            return 0, number
        return count, line_behind - 1 if count == rows else int(facts[count, words.LINE]) - 1


class Lexing(Struct, frozen=True):
    """Lexical rules of a dialect whose blocks are rows of words, without comments and block
    numbers.

    `letters`: those that begin words, capitals only. `blanks`: spaces and tabs "anywhere" (even
    inside a number), or "between" words (and around them). `line_chars`: longest line."""

    letters: str
    blanks: Literal["anywhere", "between"] = "between"
    line_chars: int = LINE_CHARS


class WordBlock:
    """Words of a block, [(letter, number text)], and its place in the text."""

    __slots__ = ("index", "line", "text", "words")

    def __init__(self, index: int, line: int, text: str, words: list[tuple[str, str]]) -> None:
        self.index = index
        self.line = line
        self.text = text
        """The file's own line."""
        self.words = words

    def column(self, word: int) -> int:
        """Return the column, counted from 1, of a word's letter in its line."""
        return [match.start() + 1 for match in re.finditer("[A-Z]", self.text)][word]

    def fail(self, message: str, *, word: int | None = None, mend: str = "") -> NoReturn:
        """Raise ProgramError at this block and the column of `word` (its first word when None)."""
        raise _error(message, self.index, self.line, self.column(word or 0), mend)


def blocks_of(data: bytes, lexing: Lexing, take: Take | None = None) -> Iterator[WordBlock]:
    """Yield the blocks of a program as words, except those that `take` decodes; ProgramError at
    the first line that is no block, and for more lines than a program may have.

    In large programs thousands of lines in a row are plain moves, and a Python object for each
    would take most of the time: `take` is offered such runs as columns. It need not recognise
    faults, since every block that it leaves is yielded here."""
    check_count(max(data.count(b"\n"), data.count(b"\r")), "line")
    check_ascii(data)
    lines = ProgramLines(data)
    runs = PlainRuns(lines, lexing.line_chars, free_order=False)
    row_of_words, word = _patterns(lexing)
    number, index = 0, 0
    while number < lines.count:
        if take is not None:
            count, number = runs.run(number, index, take)
            index += count
            if count:
                continue
        text = lines.text(number)
        number += 1
        if len(text) > lexing.line_chars:
            text = text[: lexing.line_chars]
            if not set("();") & set(text):  # to shorten a comment would be no mend
                message = f"the line has more than {lexing.line_chars} characters"
                raise _error(message, index, number, lexing.line_chars + 1, "shorten it")
        packed = text.translate(_NO_BLANKS) if lexing.blanks == "anywhere" else text
        if row_of_words.fullmatch(packed) is None:
            raise _fault(text, index, number, lexing)
        letters: list[tuple[str, str]] = word.findall(packed)
        if letters:
            yield WordBlock(index, number, text, letters)
            index += 1


def check_ascii(data: bytes) -> None:
    """Raise ProgramError at the first byte that is not printable ASCII, tab or line end."""
    odd = _ODD.search(data)
    if odd:
        before = _LINE_END.split(data[: odd.start()])
        raise ProgramError(
            f"the byte 0x{data[odd.start()]:02x} belongs to no program",
            where=f"line {len(before)}, column {len(before[-1]) + 1}",
            mend="give a program of plain ASCII text",
        )


def _patterns(lexing: Lexing) -> tuple[re.Pattern[str], re.Pattern[str]]:
    """Return (a row of words, one word) as compiled patterns, for lines from which blanks are
    taken out where they may stand anywhere."""
    letters = re.escape(lexing.letters)
    blank = r"[ \t]*+" if lexing.blanks == "between" else ""
    row = rf"{blank}(?>(?:[{letters}]{_NUMBER}{blank})*)"
    return re.compile(row), re.compile(rf"([{letters}])({_NUMBER})")


def _error(message: str, index: int, line: int, column: int, mend: str) -> ProgramError:
    place = f"block {index + 1}, line {line}, column {column}"
    return ProgramError(message, where=place, mend=mend)


def _fault(raw: str, index: int, line: int, lexing: Lexing) -> ProgramError:
    """Return the error for a line that is not a row of words, at the first place where it stops
    being one."""
    columns = [
        position
        for position, sign in enumerate(raw)
        if lexing.blanks == "between" or sign not in " \t"
    ]
    packed = "".join([raw[position] for position in columns])
    row = _patterns(lexing)[0].match(packed)
    position = row.end() if row else 0
    message, mend, extra = _explain(packed[position:], lexing)
    return _error(message, index, line, columns[position + extra] + 1, mend)


def _explain(remainder: str, lexing: Lexing) -> tuple[str, str, int]:
    """Return (message, remedy, characters to pass over) for text that does not begin with a
    word."""
    sign, shown = remainder[0], repr(remainder[:SHOWN_CHARS])
    if sign in lexing.letters:
        sign_match = re.match(r"[+-]?", remainder[1:])
        column = 1 + (sign_match.end() if sign_match else 0)
        column = column if column < len(remainder) else 0
        return (
            f"no number after {sign}",
            "digits, with a point if need be, follow a letter",
            column,
        )
    if sign in _SIGNS:
        return _SIGNS[sign][0], _SIGNS[sign][1], 0
    if sign.islower() and sign.upper() in lexing.letters:
        return "this controller takes no small letters", "write capital letters", 0
    if sign.isalpha():
        return f"the letter {sign} is no word here", f"known letters: {lexing.letters}", 0
    if sign.isdigit() or sign in ".+-":
        return f"a number without its letter, {shown}", "each number has one letter before it", 0
    return f"{sign!r} begins no word", "remove it", 0


def listing(data: bytes, _machine: object) -> Listing:
    """Return the blocks of a program, each as its line stands in the file: the lines with a word
    besides their number, whichever machine it is for."""
    lines = (line.decode("latin-1") for line in _LINE_END.split(data))
    numbered = [(line.strip(), number) for number, line in enumerate(lines, 1) if has_words(line)]
    return Listing(tuple(line for line, _ in numbered), lines=tuple(n for _, n in numbered))


def has_words(line: str) -> bool:
    """Return True if a line is a block: it has words besides comments and a block number."""
    words = _NO_WORDS.sub("", line)
    return bool(_BLOCK_NUMBER.sub("", words, count=1) if words[:1] in "Nn" else words)
