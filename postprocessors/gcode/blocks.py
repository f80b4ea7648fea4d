"""Reading RS274-like text: bytes to blocks of (letter, number text), strict and quick. Shared by
the dialects whose blocks are rows of words, one block a line.

    for block in blocks_of(data, Lexing(letters="GMXYZIJF", lower_case=True)):
        for letter, number in block.words: ...           # ("X", "-1.50"), letters always capital
        block.fail("a Z beside X", word=2)               # ProgramError: block, line and column

What a *block* is: a line with at least one word. `Block.index` counts them from 0 (so does
`Toolpath.block`), `Block.line` counts lines of the file from 1; empty lines and comments are lines
but no blocks. Lines end with LF, CR LF or CR, also mixed. N words in front are taken off
where `Lexing.block_numbers` allows them. Columns are those of the file's own line, from 1, and
are only worked out when something is wrong, so that words need not carry them.

Blocks of moves alone, thousands in a row, are offered by columns (`PlainBlocks`) to readers that
want them so.

`Block.comments` holds the texts of the line's comments, without their delimiters; a line of
comments alone is given too when `Lexing.comment_lines` (with no words and an index of −1).

Writers never use this module, readers never `format.py`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final, Literal, NoReturn

import numpy as np

from camtool.arrays import Bools, Floats, Ints
from camtool.bounds import check_count
from camtool.errors import ProgramError
from camtool.kernels import words
from camtool.toolpath.program import Listing

SHOWN_CHARS: Final = 32
"""An error message shows no more of a line than this."""

LINE_CHARS: Final = 4096
"""A longer line is refused where the dialect itself has no limit: no machine reads such lines."""

LEAST_RUN: Final = 24
"""Fewer plain blocks in a row than these are read one by one."""

LONGEST_WAIT: Final = 256
"""Where no lines are plain, it is asked again after so many of them at most."""

ROWS_AT_ONCE: Final = 1 << 12
"""So many plain blocks are read in one go."""

LETTERS: Final = "GXYZIJF"
"""Those of plain blocks, by column."""

SURE_PART: Final = 0.999
"""Part of a limit of a rule for arcs: what keeps to it does so however it is rounded."""

# Possessive (++): a number is matched in one way only, so that no line costs more than its length.
_NUMBER: Final = r"[+-]?+(?:\d++(?:\.\d*+)?|\.\d++)"
_COMMENT: Final = re.compile(r"\(([^()]*)\)|;(.*)")
_ODD: Final = re.compile(rb"[^\x20-\x7e\t\r\n]")
_CONTROL: Final = re.compile(rb"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f]")
_BARE_RETURN: Final = re.compile(rb"\r(?!\n)")
_LINE_END: Final = re.compile(rb"\r\n|\n|\r")
_NO_WORDS: Final = re.compile(r"\([^()]*\)|;.*|[ \t%]")
_BLOCK_NUMBER: Final = re.compile(r"[Nn]\d+(?:\.\d*)?")

# What a sign means that begins no word: (message, mend).
_SIGNS: Final = {
    ",": ("a decimal comma", "write a decimal point"),
    "#": ("a parameter", "only plain numbers can be read"),
    "[": ("an expression", "only plain numbers can be read"),
    "$": ("a command of the controller itself", "programs hold words only"),
    "/": ("a block that a switch may leave out", "write it without / or remove it"),
    "%": ("a %, which is no word and frames no program here", "remove it"),
    "=": ("an assignment", "only plain numbers can be read"),
}

Blanks = Literal["anywhere", "between", "none"]


@dataclass(frozen=True)
class Lexing:
    """What a dialect's text may hold.

    `letters`: those that begin words. `lower_case`: small letters count as capitals. `blanks`:
    spaces and tabs "anywhere" (even inside a number), "between" words (and around them), or
    "none". `parentheses`, `semicolon`: comments of that sign. `block_numbers`: a leading N word.
    `line_chars`: longest line; `counts_blanks`: whether blanks and comments count for it (the
    controller may drop them as they come in). `foreign_comments`: comments may hold signs beyond
    ASCII (grbl takes such bytes for commands, even there).
    """

    letters: str
    lower_case: bool = False
    blanks: Blanks = "between"
    parentheses: bool = False
    semicolon: bool = False
    block_numbers: bool = False
    line_chars: int = LINE_CHARS
    counts_blanks: bool = True
    comment_lines: bool = False
    foreign_comments: bool = False


class Block:
    """One block: `words` [(letter, number text)], where it stands, and its `comments`."""

    __slots__ = ("_lexing", "behind", "comments", "index", "line", "text", "words")

    def __init__(
        self,
        index: int,
        line: int,
        text: str,
        words: list[tuple[str, str]],
        comments: tuple[str, ...],
        lexing: Lexing,
        behind: int = 0,
    ) -> None:
        self.index = index
        self.line = line
        self.behind = behind
        """Where in the program's bytes the next line begins."""
        self.text = text
        """The file's own line."""
        self.words = words
        self.comments = comments
        self._lexing = lexing

    def column(self, word: int) -> int:
        """Column, from 1, of a word's letter."""
        plain = _blanked(self.text, self._lexing).upper()
        starts = [found.start() + 1 for found in re.finditer("[A-Z]", plain)]
        numbered = len(starts) - len(self.words)
        return starts[word + numbered]

    def fail(self, message: str, *, word: int | None = None, mend: str = "") -> NoReturn:
        """ProgramError at this block and the column of `word` (its first one when None)."""
        column = self.column(word or 0) if self.words else 1
        raise ProgramError(message, where=_place(self.index, self.line, column), mend=mend)

    def fail_at(
        self, letter: str, message: str, *, number: str | None = None, mend: str = ""
    ) -> NoReturn:
        """ProgramError at the last word of that letter (and number text)."""
        at = [
            index
            for index, (other, text) in enumerate(self.words)
            if other == letter and number in (None, text)
        ]
        self.fail(message, word=at[-1] if at else None, mend=mend)


@dataclass(frozen=True, eq=False)
class PlainBlocks:
    """N blocks in a row whose lines hold nothing but words of G X Y Z I J F, each once at most, G
    being G0 to G3: numbers (N, 7) and facts (N, 6) of `camtool.kernels.words`; `first`: the index
    of the first of them. What a block has no word for is undefined in `numbers`."""

    numbers: Floats
    facts: Ints
    first: int

    def __len__(self) -> int:
        return len(self.facts)

    def behind(self, count: int) -> PlainBlocks:
        """Without so many in front."""
        return PlainBlocks(self.numbers[count:], self.facts[count:], self.first + count)

    def has(self, column: int) -> Bools:
        """(N,) whether a block has the word of this column."""
        return np.asarray((self.facts[:, words.MASK] >> column) & 1 == 1)


def filled(given: Bools, values: Floats, before: float) -> Floats:
    """(N,) the value that was given last, `before` where none was yet."""
    latest = np.maximum.accumulate(np.where(given, np.arange(1, len(given) + 1), 0))
    return np.asarray(np.concatenate([[before], values])[latest])


def form_of(letters: str) -> int:
    """The number that stands for these letters in this order (`words.FORM`)."""
    number = 0
    for letter in letters:
        number = number * 8 + LETTERS.index(letter) + 1
    return number


Take = Callable[[PlainBlocks], int]
"""Takes blocks in a row, as many as it can by columns, and says how many these are."""


def blocks_of(data: bytes, lexing: Lexing, take: Take | None = None) -> Iterator[Block]:
    """The blocks of a program one by one, but for those that `take` has taken; ProgramError at the
    first that is none, and for more lines than a program may have.

    Where thousands of lines in a row are plain, Python objects for each of them would be most of
    the time; all others, and whatever `take` does not want, are given here. So `take` need not
    know any fault: it leaves the block.
    """
    check_count(max(data.count(b"\n"), data.count(b"\r")), "line")
    _check_bytes(data, lexing)
    reader = _Lines(data, lexing)
    at, number, index = 0, 1, 0
    while at < len(data):
        if take is not None:
            plain, at, number = reader.plain(at, number, index)
            done, alone = 0, 1
            while done < len(plain):
                taken = take(plain.behind(done)) if len(plain) - done >= LEAST_RUN else 0
                done += taken
                # Where nothing is taken it is asked less and less often.
                alone = 1 if taken else 2 * alone
                for begin, line in plain.facts[done : done + alone, words.BEGIN :].tolist():
                    block, _ = reader.block(begin, line, index + done)
                    done += 1
                    if block is not None:
                        yield block
            index += len(plain)
        if at < len(data):
            block, at = reader.block(at, number, index)
            number += 1
            if block is not None:
                index += len(block.words) > 0
                yield block


class _Lines:
    """The lines of a program, read from any of them on."""

    def __init__(self, data: bytes, lexing: Lexing) -> None:
        self._data, self._lexing = data, lexing
        self._line_of_words, self._word = _patterns(lexing)
        self._numbers = np.empty((0, 7))
        self._facts = np.empty((0, words.FACT_COLUMNS), dtype=np.int64)
        self._rules = (
            lexing.line_chars,
            lexing.lower_case,
            lexing.block_numbers,
            lexing.parentheses,
            lexing.semicolon,
        )

    def plain(self, at: int, number: int, index: int) -> tuple[PlainBlocks, int, int]:
        """The plain blocks from the line of this number on, which begins at `at`; and where they
        end, in which line. They are good until the next are read."""
        if not len(self._facts):
            self._numbers = np.zeros((ROWS_AT_ONCE, 7))
            self._facts = np.empty((ROWS_AT_ONCE, words.FACT_COLUMNS), dtype=np.int64)
        octets = np.frombuffer(self._data, dtype=np.uint8)
        rows, at, number = words.plain_lines(
            octets, at, number, self._rules, self._numbers, self._facts
        )
        return PlainBlocks(self._numbers[:rows], self._facts[:rows], index), at, number

    def block(self, at: int, number: int, index: int) -> tuple[Block | None, int]:
        """The block in the line of this number, which begins at `at`, or a line of comments alone
        where these are wanted; and where the next line begins."""
        lexing = self._lexing
        end = _LINE_END.search(self._data, at)
        stop, behind = end.span() if end else (len(self._data), len(self._data))
        raw = text = self._data[at:stop].decode("latin-1")
        comments: tuple[str, ...] = ()
        if "(" in text or ";" in text or ")" in text:
            comments = _comments(raw, index, number, lexing)
            text = _blanked(text, lexing)
        if lexing.lower_case and text.isascii():
            text = text.upper()
        if lexing.blanks == "anywhere":
            text = text.replace(" ", "").replace("\t", "")
        if len(raw if lexing.counts_blanks else text) > lexing.line_chars:
            message = f"the line has more than {lexing.line_chars} characters"
            raise _error(message, index, number, lexing.line_chars + 1, "shorten it")
        if not text.isascii() or self._line_of_words.fullmatch(text) is None:
            raise _fault(raw, index, number, lexing)
        found: list[tuple[str, str]] = self._word.findall(text)
        if found and found[0][0] == "N" and lexing.block_numbers:
            del found[0]
        if found:
            return Block(index, number, raw, found, comments, lexing, behind), behind
        if comments and lexing.comment_lines:
            return Block(-1, number, raw, found, comments, lexing, behind), behind
        return None, behind


def _patterns(lexing: Lexing) -> tuple[re.Pattern[str], re.Pattern[str]]:
    """(the whole line, one word) as compiled patterns."""
    known = re.escape(lexing.letters)
    blank = r"[ \t]*+" if lexing.blanks == "between" else ""
    numbered = rf"(?>(?:N\d++(?:\.\d*+)?{blank})?)" if lexing.block_numbers else ""
    line = rf"{blank}{numbered}(?>(?:[{known}]{_NUMBER}{blank})*)"
    letters = known + ("N" if lexing.block_numbers else "")
    return re.compile(line), re.compile(rf"([{letters}])({_NUMBER})")


def _check_bytes(data: bytes, lexing: Lexing) -> None:
    """ProgramError at the first byte that is no printable ASCII, tab or line end.

    Where comments may hold other signs, each of their bytes stands as one: columns count bytes.
    """
    odd = (_CONTROL if lexing.foreign_comments else _ODD).search(data)
    if odd:
        before = _LINE_END.split(data[: odd.start()])
        raise ProgramError(
            f"the byte 0x{data[odd.start()]:02x} belongs to no program",
            where=f"line {len(before)}, column {len(before[-1]) + 1}",
            mend="give a program of plain ASCII text",
        )


def _place(index: int, line: int, column: int) -> str:
    """Block and line from 1."""
    return f"block {index + 1}, line {line}, column {column}"


def _error(message: str, index: int, line: int, column: int, mend: str = "") -> ProgramError:
    return ProgramError(message, where=_place(index, line, column), mend=mend)


def _blanked(text: str, lexing: Lexing) -> str:
    """The line with blanks in place of its comments: columns stay."""
    if not (lexing.parentheses or lexing.semicolon):
        return text
    return _COMMENT.sub(lambda found: " " * len(found[0]), text)


def _comments(raw: str, index: int, line: int, lexing: Lexing) -> tuple[str, ...]:
    """The texts of a line's comments; ProgramError where the dialect has none, and for
    parentheses that are nested or not closed."""
    found = list(_COMMENT.finditer(raw))
    for one in found:
        if not (lexing.semicolon if one[1] is None else lexing.parentheses):
            raise _error(
                "this dialect has no comments", index, line, one.start() + 1, "remove them"
            )
    rest = _COMMENT.sub(lambda one: " " * len(one[0]), raw)
    odd = re.search(r"[()]", rest)
    if odd:
        message = "a comment that is nested or not closed"
        raise _error(
            message, index, line, odd.start() + 1, "write one ( and one ) for each comment"
        )
    texts = (one[2] if one[1] is None else one[1] for one in found)
    return tuple(text.encode("latin-1").decode("utf-8", errors="replace") for text in texts)


def _fault(raw: str, index: int, line: int, lexing: Lexing) -> ProgramError:
    """Why a line is no row of words: the first place where it stops being one."""
    text = _blanked(raw, lexing)
    text = text.upper() if lexing.lower_case else text
    if lexing.blanks == "anywhere":
        kept = [at for at, sign in enumerate(text) if sign not in " \t"]
    else:
        kept = list(range(len(text)))
    packed = "".join(text[at] for at in kept)
    blank = r"[ \t]*+" if lexing.blanks == "between" else ""
    numbered = rf"(?>(?:N\d++(?:\.\d*+)?{blank})?)" if lexing.block_numbers else ""
    head = re.compile(rf"{blank}{numbered}(?>(?:[{re.escape(lexing.letters)}]{_NUMBER}{blank})*)")
    match = head.match(packed)
    at = match.end() if match else 0
    message, mend, more = _explained(packed[at:], packed[:at], lexing)
    return _error(message, index, line, kept[at + more] + 1, mend)


def _explained(rest: str, before: str, lexing: Lexing) -> tuple[str, str, int]:
    """(message, mend, characters to pass over) for text that begins with no word."""
    sign, behind = rest[0], rest[1:].lstrip()
    shown = repr(rest[:SHOWN_CHARS])
    if sign in lexing.letters:
        wrong = re.match(r"[+-]?", rest[1:])
        past = 1 + (wrong.end() if wrong else 0)
        past = past if past < len(rest) else 0
        return f"no number after {sign}", "digits, with a point if need be, follow a letter", past
    if sign in _SIGNS:
        return _SIGNS[sign][0], _SIGNS[sign][1], 0
    if sign in " \t":
        return f"a blank within the block, before {behind[:SHOWN_CHARS]!r}", "remove it", 0
    if sign.islower() and sign.upper() in lexing.letters:
        return "this controller takes no small letters", "write capital letters", 0
    if sign == "N" and before.strip() == "" and lexing.block_numbers:
        return "a block number is digits only", "write N10", 0
    if sign.isalpha():
        return f"the letter {sign} is no word here", f"known letters: {lexing.letters}", 0
    if sign.isdigit() or sign in ".+-":
        return f"a number without its letter, {shown}", "each number has one letter before it", 0
    return f"{sign!r} begins no word", "remove it", 0


class Lines:
    """The lines of a program, counted from 0; CR alone ends one too."""

    def __init__(self, data: bytes) -> None:
        self.data = _BARE_RETURN.sub(b"\n", data) if b"\r" in data else data
        self.octets = np.frombuffer(self.data, dtype=np.uint8)
        ends = np.flatnonzero(self.octets == ord("\n"))
        self.begins: Ints = np.concatenate([[0], ends + 1])
        self.count = len(self.begins) - int(self.begins[-1] == len(self.data))
        """How many lines."""

    def text(self, number: int) -> str:
        """A line, each byte a character."""
        begin = int(self.begins[number])
        last = number + 1 == len(self.begins)
        end = len(self.data) if last else int(self.begins[number + 1]) - 1
        return self.data[begin:end].decode("latin-1").removesuffix("\r")


class PlainRuns:
    """Runs of plain lines, as they are met: where lines are not plain, it is asked less and less
    often. `rules` are those of `words.plain_lines`."""

    def __init__(self, lines: Lines, rules: tuple[int, bool, bool, bool, bool]) -> None:
        self._lines, self._rules = lines, rules
        self._numbers = np.zeros((0, 7))
        self._facts = np.empty((0, words.FACT_COLUMNS), dtype=np.int64)
        self._wait, self._waited = 1, 0

    def run(self, number: int, index: int, take: Take) -> tuple[int, int]:
        """Have plain lines from this one on taken, the first of which is the block of this index:
        how many blocks, and the line behind them."""
        self._waited += 1
        if self._waited < self._wait or number >= self._lines.count:
            return 0, number
        self._waited = 0
        if not len(self._facts):
            self._numbers = np.zeros((ROWS_AT_ONCE, 7))
            self._facts = np.empty((ROWS_AT_ONCE, words.FACT_COLUMNS), dtype=np.int64)
        begin = int(self._lines.begins[number])
        rows, _, behind = words.plain_lines(
            self._lines.octets, begin, number + 1, self._rules, self._numbers, self._facts
        )
        count = 0
        if rows >= LEAST_RUN:
            count = take(PlainBlocks(self._numbers[:rows], self._facts[:rows], index))
        self._wait = 1 if count else min(2 * self._wait, LONGEST_WAIT)
        if not count:
            return 0, number
        return count, behind - 1 if count == rows else int(self._facts[count, words.LINE]) - 1


def listing(data: bytes) -> Listing:
    """The blocks of a program that its reader takes, each as its line stands in the file: the
    lines with a word besides their number."""
    lines = (line.decode("latin-1") for line in _LINE_END.split(data))
    return Listing(tuple(line.strip() for line in lines if has_words(line)))


def has_words(line: str) -> bool:
    """Whether a line is a block."""
    words = _NO_WORDS.sub("", line)
    return bool(_BLOCK_NUMBER.sub("", words, count=1) if words[:1] in "Nn" else words)
