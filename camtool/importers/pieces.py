"""The pieces that readers make of entities, and which of them are read: by layer, colour and line
type.

A pattern has `*`, `?` and `[…]` and is the same in any case, as names in CAD are. A pattern that
chooses nothing is an error that names what there is: a misspelt layer must not cut everything,
or nothing."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence

from msgspec import Struct

from camtool.arrays import Floats
from camtool.errors import DrawingError
from camtool.geometry.drawing import Skipped
from camtool.importers.options import Selection
from camtool.patterns import guess, matches

MAX_COORDINATE_MM = 1e9
"""Beyond this, doubles cannot distinguish positions that differ by POSITION_EPS_MM."""


MAX_POINTS = 3_000_000
"""A drawing of more points is refused: some 500 bytes of memory are needed for each."""


class Unusable(Exception):
    """The error that an entity cannot become a piece; its text is the reason."""


class Piece(Struct, frozen=True, eq=False):
    """An entity: `vertices` (n, 3) of x, y, bulge in mm, and its place in the file.

    A closed piece may repeat its first point at its end. `source` begins with the kind of the
    entity ("CIRCLE 2F", "path outline"). `line_type` as a DXF names it, "" elsewhere. `off_mm`
    (n, 2): the largest and the rms distance of what is drawn from the segment that leaves each
    vertex; None where the segments are what is drawn."""

    vertices: Floats
    closed: bool
    layer: str
    colour: str
    source: str
    line_type: str = ""
    off_mm: Floats | None = None

    @property
    def where(self) -> str:
        """The place of the piece for messages: layer and source."""
        return f"layer {self.layer}, {self.source}"

    @property
    def kind(self) -> str:
        """The kind of the entity: the first word of the source."""
        return self.source.partition(" ")[0]


def too_many_points(file: str) -> DrawingError:
    """Return the error for a drawing of more than MAX_POINTS."""
    return DrawingError(
        f"holds more than {MAX_POINTS} points",
        file=file,
        mend="split the drawing, or leave out points that its tolerance does not need",
    )


NAMED = 12
"""At most this many names are listed when a pattern matches none of them."""


class NoMatchError(DrawingError):
    """A pattern that matches nothing in the drawing."""

    def __init__(self, what: str, pattern: str, file: str, names: Sequence[str]) -> None:
        listed = ", ".join(sorted(names)[:NAMED]) + (" …" if len(names) > NAMED else "")
        super().__init__(
            f"no {what} matches {pattern!r}",
            file=file,
            mend=f"{guess(pattern, names)}it has {listed or 'none'}",
        )
        self.pattern = pattern


NO_LINE_TYPE = "continuous"


def select_pieces(
    pieces: Sequence[Piece], selection: Selection, file: str
) -> tuple[list[Piece], list[Skipped]]:
    """Return the chosen pieces in order, and for each kind the number left out, with the reason.

    DrawingError when a pattern (except of `exclude_layers`) matches no piece at all."""
    if selection == Selection():
        return list(pieces), []
    rules = _rules(selection, pieces, file)
    chosen_pieces: list[Piece] = []
    left_out: Counter[tuple[str, str]] = Counter()
    for piece in pieces:
        reason = next((reason for reason, holds in rules if not holds(piece)), None)
        if reason is None:
            chosen_pieces.append(piece)
        else:
            left_out[piece.kind, reason] += 1
    return chosen_pieces, [
        Skipped(kind, count, explanation) for (kind, explanation), count in left_out.items()
    ]


_Rule = tuple[str, Callable[[Piece], bool]]


def _rules(selection: Selection, pieces: Sequence[Piece], file: str) -> list[_Rule]:
    """Return the conditions of the selection, each with the reason given for a piece that does not
    fulfil it."""
    rules: list[_Rule] = []
    layers = matching_names(selection.layers, (piece.layer for piece in pieces), "layer", file)
    if layers is not None:
        rules.append(("is on a layer that was not asked for", lambda piece: piece.layer in layers))
    excluded = {piece.layer for piece in pieces if matches(selection.exclude_layers, piece.layer)}
    if selection.exclude_layers:
        rules.append(("is on an excluded layer", lambda piece: piece.layer not in excluded))
    types = matching_names(selection.line_types, map(_line_type, pieces), "line type", file)
    if types is not None:
        rules.append(
            ("has a line type that was not asked for", lambda piece: _line_type(piece) in types)
        )
    colours = matching_names(selection.colours, (piece.colour for piece in pieces), "colour", file)
    if colours is not None:
        rules.append(
            ("has a colour that was not asked for", lambda piece: piece.colour in colours)
        )
    return rules


def matching_names(
    patterns: Sequence[str], names: Iterable[str], what: str, file: str
) -> set[str] | None:
    """Return the names that any pattern matches, None without patterns.

    NoMatchError, which lists the names there are, for a pattern that matches none."""
    if not patterns:
        return None
    available = list(dict.fromkeys(names))
    for pattern in patterns:
        if not any(matches((pattern,), name) for name in available):
            raise NoMatchError(what, pattern, file, available)
    return {name for name in available if matches(patterns, name)}


def _line_type(piece: Piece) -> str:
    return piece.line_type or NO_LINE_TYPE
