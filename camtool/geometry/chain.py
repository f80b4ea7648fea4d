"""Open paths joined end to end: drawings give contours as loose lines and arcs.

    ends ──pairs.py──▶ joints ──walk──▶ chains ──joined.py──▶ paths ──gaps.py──▶ what stays open

Each end takes part in one joint only. Where more than two ends meet, the straightest way goes on
and the place is told as a branch. A joint moves a line to meet its neighbour (both lines to the
middle); arcs stay exact, and two arcs with a gap get a short line between them.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from camtool.errors import GeometryError
from camtool.geometry.drawing import Branch, Gap
from camtool.geometry.gaps import open_gaps
from camtool.geometry.joined import Chains, Joined, joined
from camtool.geometry.measure import path_lengths
from camtool.geometry.pairs import Ends, joints
from camtool.geometry.polylines import POSITION_EPS_MM, Bools, Floats, Ints, Polylines


@dataclass(frozen=True, eq=False)
class Chained:
    """Paths after chaining; `members[i]` are the input paths that became path i, in order.

    `closed_gaps`: every gap above `POSITION_EPS_MM` that was bridged. `open_gaps`: for paths that
    stay open, the nearest other open end (or the own other one), when it looks like a gap.
    `branches`: where more than two ends met.
    """

    lines: Polylines
    members: tuple[tuple[int, ...], ...]
    closed_gaps: tuple[Gap, ...]
    open_gaps: tuple[Gap, ...]
    branches: tuple[Branch, ...] = ()


@dataclass(frozen=True)
class Kinds:
    """What is known of paths besides their shape, one item each; None where all are alike.

    Paths of different `groups` are never joined. At a branch, paths of one `style` (colour, line
    type) are joined first. `layers` name places; left out, the groups do.
    """

    groups: Sequence[Hashable] | None = None
    styles: Sequence[Hashable] | None = None
    layers: Sequence[str] | None = None


@dataclass(frozen=True, eq=False)
class _Paths:
    """All that chaining needs of the paths: their ends, and the names of their layers."""

    lines: Polylines
    layers: Sequence[str]
    ends: Ends = field(repr=False)

    @classmethod
    def of(cls, lines: Polylines, kinds: Kinds) -> _Paths:
        for name in ("groups", "styles", "layers"):
            items = getattr(kinds, name)
            if items is not None and len(items) != len(lines):
                raise GeometryError(f"{len(items)} {name} for {len(lines)} paths")
        group = numbered(kinds.groups, len(lines))
        style = numbered(kinds.styles, len(lines))
        layers = kinds.layers
        if layers is None:
            layers = [""] * len(lines) if kinds.groups is None else list(map(str, kinds.groups))
        return cls(lines, layers, Ends.of(lines, group, style))


def chain(
    lines: Polylines,
    gap_mm: float,
    groups: Sequence[Hashable] | None = None,
    kinds: Kinds | None = None,
) -> Chained:
    """Open paths joined where their ends lie within `gap_mm`, nearest ends first.

    Paths of different groups (layers) are never joined; `kinds` says more than `groups` alone. A
    chain whose own ends meet becomes closed, unless nothing would lie inside (a line and its
    double). Closed paths stay as they are. Results stand in the order of their first members,
    travelled as the first one drawn. GeometryError when the gap is negative or not finite, or
    groups do not fit the paths.
    """
    if not (np.isfinite(gap_mm) and gap_mm >= 0.0):
        raise GeometryError(f"a gap of {gap_mm} mm is not 0 or more")
    paths = _Paths.of(lines, kinds or Kinds(groups=groups))
    if lines.closed.all():
        return Chained(lines, tuple((index,) for index in range(len(lines))), (), ())
    from camtool.kernels.chaining import walk

    found = joints(paths.ends, max(gap_mm, POSITION_EPS_MM))
    lots = joined(lines, Chains(*walk(found.mates, ~lines.closed)))
    result, members = _in_order(lines, lots)
    first = np.array([of[0] for of in members], dtype=np.int64)
    result_ends = Ends.of(result, paths.ends.group[first], paths.ends.style[first])
    names = [paths.layers[index] for index in first.tolist()]
    return Chained(
        lines=result,
        members=members,
        closed_gaps=tuple(_closed_gaps(lots, paths.layers)),
        open_gaps=tuple(open_gaps(result_ends, path_lengths(result), names, gap_mm)),
        branches=found.named(paths.ends, paths.layers),
    )


def numbered(items: Sequence[Hashable] | None, count: int) -> Ints:
    """(count,) a number for each different item, in order of first appearance; 0 for None."""
    if items is None:
        return np.zeros(count, dtype=np.int64)
    numbers: dict[Hashable, int] = {}
    return np.array([numbers.setdefault(item, len(numbers)) for item in items], dtype=np.int64)


def _in_order(
    lines: Polylines, lots: Sequence[Joined]
) -> tuple[Polylines, tuple[tuple[int, ...], ...]]:
    """The closed paths and all chains, in the order of their first members; and the members."""
    is_closed = np.flatnonzero(lines.closed)
    members: list[tuple[int, ...]] = [(index,) for index in is_closed.tolist()]
    least = [is_closed]
    columns = [_rows_of(lines, is_closed)]
    for lot in lots:
        paths = lot.chains.entries // 2
        begins = lot.chains.begins.tolist()
        flat = paths.tolist()
        members.extend(tuple(flat[a:b]) for a, b in pairwise(begins))
        least.append(np.minimum.reduceat(paths, lot.chains.begins[:-1]))
        columns.append(_rows_of(lot.lines, np.arange(len(lot.lines))))
    order = np.argsort(np.concatenate(least), kind="stable")
    vertices, counts, closed = (np.concatenate(part) for part in zip(*columns, strict=True))
    offsets = np.concatenate([[0], np.cumsum(counts)])
    whole = Polylines(vertices, offsets, closed)
    return whole.select(order), tuple(members[index] for index in order.tolist())


def _rows_of(lines: Polylines, chosen: Ints) -> tuple[Floats, Ints, Bools]:
    counts = np.diff(lines.offsets)
    rows = np.zeros(len(lines), dtype=np.bool_)
    rows[chosen] = True
    return lines.vertices[np.repeat(rows, counts)], counts[chosen], lines.closed[chosen]


def _closed_gaps(lots: Sequence[Joined], layers: Sequence[str]) -> list[Gap]:
    """The bridged gaps, in the order of the first members of their chains."""
    found: list[tuple[int, Gap]] = []
    for lot in lots:
        paths = lot.chains.entries // 2
        least = np.minimum.reduceat(paths, lot.chains.begins[:-1]) if len(lot.chains) else paths
        for chain_of, at, size in zip(
            lot.gap_chain.tolist(), lot.gap_at.tolist(), lot.gap_size.tolist(), strict=True
        ):
            of = int(least[chain_of])
            found.append((of, Gap((at[0], at[1]), size, layers[of])))
    found.sort(key=lambda item: item[0])
    return [gap for _, gap in found]
