"""Points as text: one `x,y` a line.

    # a comment        an empty line begins a new stroke
    x [mm];y [mm]      names of the columns, with their unit or without: may be left out
    1,5;2,25           the first point decides what parts the fields, for the whole file

Fields are parted by semicolon, tab, comma or blanks. A third column must be named `bulge`.

The comma is the decimal sign in a file parted by semicolons or tabs, in quoted fields, and in a
file parted by blanks when something in it proves so: a number without a comma, or one such as
`1,05`. Without a proof `1,5 2,5` may as well be two points, and is refused. So is a file with
decimal commas and decimal points: one of the two then parts thousands.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field

import numpy as np

from camtool.errors import DrawingError
from camtool.importers.points.stroke import Stroke, Table
from camtool.units import MM_PER_UNIT

_REAL = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
_REAL_COMMA = _REAL.replace(r"\.", "[.,]")
_NUMBER = re.compile(_REAL, re.ASCII)
_NUMBER_COMMA = re.compile(_REAL_COMMA, re.ASCII)
_COMMENT = re.compile(r"[#%]")
_NAME = re.compile(r"\s*[\"']?\s*([A-Za-z_µ][^,;\t]*?)[\"']?\s*")
_UNIT = re.compile(r"[^\[(]*[\[(]\s*(?P<sure>[^\])]*?)\s*[\])]|\w+?[_/]\s*(?P<maybe>[a-zµ]+)")
_QUOTED = re.compile(r"\"[^\"]*\"")
_COMMA_THEN_BLANK = re.compile(r",\s+\S")
_PROOF = re.compile(r",0\d")
_BLANK_LINE = " \t,;"

_ONE_SIGN = "write every number with one decimal sign, and no sign between thousands"
_NAMED_COLUMNS = "give two numbers a line, or name the columns x,y,bulge in the first line"


def parse_lines(text: str, file: str) -> Table:
    """The strokes of a text of points; DrawingError naming line and column."""
    return _Lines(file).parse(text)


@dataclass
class _Lines:
    """What the lines so far have said: `parted` by which sign ("" for blanks), `columns`, and
    where a decimal comma, a decimal point, and a proof of the comma's meaning were first seen."""

    file: str
    parted: str | None = None
    columns: int = 2
    unit: str | None = None
    comma_line: int = 0
    point_line: int = 0
    proven: bool = False
    rows: list[tuple[float, ...]] = field(default_factory=list)
    starts: list[tuple[int, int]] = field(default_factory=list)

    def parse(self, text: str) -> Table:
        fresh, may_name = True, True
        pattern: re.Pattern[str] | None = None
        for number, line in enumerate(text.splitlines(), start=1):
            content = _COMMENT.split(line, maxsplit=1)[0] if "#" in line or "%" in line else line
            if not content.strip(_BLANK_LINE):
                # A line that is nothing but a comment does not end a stroke.
                fresh = fresh or not line.strip(_BLANK_LINE)
                continue
            content = content.rstrip()
            named = may_name and self._names(content, number)
            may_name = False
            if named:
                continue
            if pattern is None:
                self.parted = _separator(content, self.columns)
                pattern = _row_pattern(self.parted, self.columns)
            if fresh:
                self.starts.append((len(self.rows), number))
                fresh = False
            self.rows.append(self._row(content, number, pattern))
        self._refuse_ambiguous()
        return Table(self._strokes(), self.unit)

    def _strokes(self) -> list[Stroke]:
        points = np.array(self.rows, dtype=np.float64).reshape(-1, self.columns)
        following = [*self.starts[1:], (len(points), 0)]
        return [
            Stroke(points[first:end], f"at line {line}")
            for (first, line), (end, _) in zip(self.starts, following, strict=False)
        ]

    def _row(self, content: str, line: int, pattern: re.Pattern[str]) -> tuple[float, ...]:
        """The numbers of one line; the pattern reads what is plain, and is many times faster."""
        found = pattern.fullmatch(content)
        if found is None:
            return self._diagnosed(content, line)
        if self.parted != ",":
            if "," in content:
                self._comma(content, content.count(",") < self.columns, line)
                content = content.replace(",", ".")
                found = pattern.fullmatch(content)
                assert found is not None
            elif "." in content:
                self._point(line)
            else:
                self.proven = True
        values = tuple(map(float, found.groups()))
        if not all(map(math.isfinite, values)):
            return self._diagnosed(content, line)
        return values

    def _diagnosed(self, content: str, line: int) -> tuple[float, ...]:
        """The numbers of one line, field by field; DrawingError naming the first bad one."""
        fields = _fields(content, self.parted or "")
        if len(fields) != self.columns:
            wanted = "x and y" if self.columns == 2 else "x, y and bulge"
            raise DrawingError(
                f"{len(fields)} fields, wanted {wanted}",
                file=self.file,
                where=f"line {line}",
                mend="if the comma is the decimal sign too, part x and y by a semicolon"
                if self.parted == "," and len(fields) > self.columns
                else _NAMED_COLUMNS,
            )
        return tuple(self._number(text, column, line) for text, column in fields)

    def _number(self, text: str, column: int, line: int) -> float:
        bare = text.strip("\"'").strip()
        if self.parted != "," or _QUOTED.fullmatch(text):
            if "," in bare:
                self._comma(bare, False, line)
            elif "." in bare:
                self._point(line)
            bare = bare.replace(",", ".", 1)
        value = float(bare) if _NUMBER.fullmatch(bare) else None
        if value is None or not math.isfinite(value):
            odd = "is not finite" if value is not None or _not_finite(bare) else "is no number"
            where = f"line {line}, column {column}"
            raise DrawingError(f"{text!r} {odd}", file=self.file, where=where)
        return value

    def _comma(self, content: str, proven: bool, line: int) -> None:
        """A decimal comma stands in this line."""
        self.comma_line = self.comma_line or line
        self.proven = self.proven or proven or _PROOF.search(content) is not None
        if "." in content:
            self._point(line)
        self._refuse_mixed(line)

    def _point(self, line: int) -> None:
        self.point_line = self.point_line or line
        self._refuse_mixed(line)

    def _refuse_mixed(self, line: int) -> None:
        if self.comma_line and self.point_line:
            raise DrawingError(
                f"has a decimal comma (line {self.comma_line}) and a decimal point "
                f"(line {self.point_line})",
                file=self.file,
                where=f"line {line}",
                mend=_ONE_SIGN,
            )

    def _refuse_ambiguous(self) -> None:
        if self.parted == "" and self.comma_line and not self.proven:
            raise DrawingError(
                "may be x and y with decimal commas, or two points x,y",
                file=self.file,
                where=f"line {self.comma_line}",
                mend="part x and y by a semicolon, or write decimal points",
            )

    def _names(self, content: str, line: int) -> bool:
        """Whether the line names columns; DrawingError when it names them in another order."""
        parted = next((sign for sign in (";", "\t", ",") if sign in content), "")
        fields = content.split(parted) if parted else content.split()
        found = [_NAME.fullmatch(name) for name in fields]
        names = [match[1].strip() for match in found if match]
        if len(names) < len(fields) or any(_not_finite(name) for name in names):
            return False
        first = [name.lower()[:1] for name in names]
        known = first == ["x", "y"] or not set(first) & {"x", "y"}
        bulged = len(names) == 3 and first[:2] == ["x", "y"] and names[2].lower() == "bulge"
        if not bulged and (len(names) != 2 or not known):
            raise DrawingError(
                f"columns are {content.strip()!r}",
                file=self.file,
                where=f"line {line}",
                mend="give x,y or x,y,bulge",
            )
        self.columns = len(names)
        self.unit = self._unit(names[:2], line)
        return True

    def _unit(self, names: list[str], line: int) -> str | None:
        """The unit that both names give, as in `x [in]` or `x_mm`."""
        units: set[str | None] = set()
        for name in names:
            match = _UNIT.fullmatch(name)
            unit = (match["sure"] or match["maybe"] or "").lower() if match else ""
            if unit not in MM_PER_UNIT and match and match["sure"]:
                raise DrawingError(
                    f"{match['sure']!r} is no unit of length",
                    file=self.file,
                    where=f"line {line}",
                    mend=f"use one of {', '.join(u for u in MM_PER_UNIT if u.isalpha())}",
                )
            units.add(unit if unit in MM_PER_UNIT else None)
        if len(units) > 1:
            raise DrawingError(
                "x and y have different units", file=self.file, where=f"line {line}"
            )
        return units.pop()


def _separator(content: str, columns: int) -> str:
    """What parts the fields of this line; "" for blanks."""
    content = content.strip()
    bare = _QUOTED.sub("0", content)
    if ";" in bare:
        return ";"
    if "," in bare:
        pieces = [piece.strip() for piece in bare.split(",")]
        whole = len(pieces) == columns and all(map(_NUMBER.fullmatch, pieces))
        if whole or _COMMA_THEN_BLANK.search(bare):
            return ","
        if "\t" in bare:
            return "\t"
        blank = content.split()
        return "" if len(blank) == columns and all(map(_NUMBER_COMMA.fullmatch, blank)) else ","
    return "\t" if "\t" in bare else ""


def _row_pattern(parted: str, columns: int) -> re.Pattern[str]:
    """A line of plain numbers in this dialect."""
    number = f"({_REAL})" if parted == "," else f"({_REAL_COMMA})"
    sign = rf"[^\S\t]*{parted}[^\S\t]*" if parted else r"\s+"
    return re.compile(rf"\s*{sign.join([number] * columns)}\s*", re.ASCII)


def _fields(content: str, parted: str) -> list[tuple[str, int]]:
    """Each field without its blanks, and its column; a sign within quotes parts nothing."""
    if not parted:
        return [(match[0], match.start() + 1) for match in re.finditer(r"\S+", content)]
    hidden = _QUOTED.sub(lambda match: "0" * len(match[0]), content)
    fields: list[tuple[str, int]] = []
    start = 0
    for piece in hidden.split(parted):
        text = content[start : start + len(piece)]
        fields.append((text.strip(), start + len(text) - len(text.lstrip()) + 1))
        start += len(piece) + 1
    return fields


def _not_finite(name: str) -> bool:
    return name.strip().lstrip("+-").lower() in ("nan", "inf", "infinity")
