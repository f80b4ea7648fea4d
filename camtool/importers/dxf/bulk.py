"""Read LINEs that differ in their ends alone, and vertices of polylines, as columns.

ezdxf makes an object of each LINE, eight times as large as its text, and several of each vertex.
It gets the first of the LINEs that follow one another and say the same of themselves (layer, line
type, colour, owner and whatever else), and LWPOLYLINEs without their vertices:

    tags ──Bulk.of──▶ others: the tags for ezdxf
                 ├──▶ lines: ends and handles of the LINEs that follow one of ezdxf's
                 └──▶ vertices of ezdxf's LWPOLYLINEs

Where handles are missing or name two entities, all is left to ezdxf, which mends them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from msgspec import Struct, field

from camtool.arrays import Bools, Floats, Ints, distinct
from camtool.importers.dxf.tags import DxfSections, Tags

MIN_VERTICES = 32
"""LWPOLYLINEs of fewer vertices are read by ezdxf."""

_HANDLE, _HEIGHT, _SUBCLASS, _REFERENCE = 5, 30, 100, 330
_HANDLES = (_HANDLE, 105)
_DIVISIONS = frozenset((_SUBCLASS, 102))  # ezdxf takes no handle from behind them
_START, _END = (10, 20, 30), (11, 21, 31)
_OWN = (_HANDLE, *_START, *_END)
"""The group codes in which LINEs that are read together differ."""

_VERTEX = (10, 20, 40, 41, 42)
"""The group codes of a vertex: x, y, both widths and the bulge."""

_HATCHES = frozenset(("HATCH", "MPOLYGON"))


class BulkLines(Struct, frozen=True, eq=False):
    """LINEs as columns: their handles (K,) and `ends` (K, 2, 3), in the units of the file."""

    handles: list[str]
    ends: Floats


class Bulk(Struct, frozen=True, eq=False):
    """What was read in bulk, and the mask `others` (N,) of the tags that are left to ezdxf.

    `lines`: the LINEs that follow a LINE, by the handle of that one; `vertices` (K, 5) of an
    LWPOLYLINE, by its handle."""

    others: Bools
    lines: Mapping[str, BulkLines] = field(default_factory=dict)
    vertices: Mapping[str, Floats] = field(default_factory=dict)

    @classmethod
    def none(cls, tags: Tags) -> Bulk:
        """Return the result in which all tags are left to ezdxf."""
        return cls(np.ones(len(tags.codes), dtype=np.bool_))

    @classmethod
    def of(cls, tags: Tags, frame: DxfSections) -> Bulk:
        """Return the simple LINEs and the vertices of LWPOLYLINEs of the ENTITIES section as
        columns, and the mask of the other tags."""
        part = next((each for each in frame.sections if each.name == "ENTITIES"), None)
        if part is None or part.end is None or frame.faults:
            return cls.none(tags)
        first, last = np.searchsorted(tags.marks, [part.begin + 1, part.end]).tolist()
        marks, kinds = tags.marks[first : last + 1], np.array(tags.kinds[first:last], dtype=object)
        is_other = np.ones(len(tags.codes), dtype=np.bool_)
        try:
            lines = _lines(tags, marks, np.asarray(kinds == "LINE", dtype=np.bool_), is_other)
            polylines = np.flatnonzero(kinds == "LWPOLYLINE")
            vertices = _vertices(tags, marks[polylines], marks[polylines + 1], is_other)
        except ValueError:  # not a number: ezdxf reports where
            return cls.none(tags)
        bulk = cls(is_other, lines, vertices)
        return bulk if bulk._is_plain(tags, frame) else cls.none(tags)

    def _is_plain(self, tags: Tags, frame: DxfSections) -> bool:
        """Return True if each handle names one entity, and no hatch refers to a LINE that was read
        in bulk."""
        followers = {handle for each in self.lines.values() for handle in each.handles}
        names = {*followers, *self.lines, *self.vertices}
        has_handle = np.isin(tags.codes, _HANDLES)
        for section in frame.sections:
            if section.name == "HEADER":
                has_handle[section.begin : section.end] = False
        count = sum(len(each.handles) for each in self.lines.values())
        count += len(self.lines) + len(self.vertices)
        handle_count = sum(handle in names for handle in tags.values(np.flatnonzero(has_handle)))
        if not len(names) == count == handle_count:
            return False
        if _HATCHES.isdisjoint(tags.kinds):
            return True
        references = np.flatnonzero(self.others & (tags.codes == _REFERENCE))
        return followers.isdisjoint(tags.values(references))


def _lines(tags: Tags, marks: Ints, is_line: Bools, is_other: Bools) -> dict[str, BulkLines]:
    """Return the LINEs that repeat the attributes of the LINE before them, by the handle of the
    first of each sequence.

    Entity k has the tags marks[k] to marks[k + 1]. The tags of the LINEs returned are cleared in
    `is_other`, in place."""
    sizes = np.diff(marks)
    follows = np.zeros(len(sizes) + 1, dtype=np.bool_)
    follows[1:-1] = is_line[1:] & is_line[:-1] & (sizes[1:] == sizes[:-1])
    for size in distinct(sizes[follows[:-1]]).tolist():
        candidates = np.flatnonzero(follows[:-1] & (sizes == size))
        follows[candidates] = _say_the_same(tags, marks[candidates], size)
    firsts, lasts = (np.flatnonzero(np.diff(follows.astype(np.int8)) == step) for step in (1, -1))
    rows_by_codes: dict[tuple[int, ...], list[int]] = {}
    for row, first in enumerate(firsts.tolist()):
        codes = tuple(tags.codes[marks[first] : marks[first + 1]].tolist())
        rows_by_codes.setdefault(codes, []).append(row)
    groups: dict[str, BulkLines] = {}
    for codes, alike_rows in rows_by_codes.items():
        if not _is_simple(codes):
            continue
        heads, counts = firsts[alike_rows], (lasts - firsts)[alike_rows]
        begins = np.cumsum(counts) - counts
        rows = marks[np.arange(counts.sum()) + np.repeat(heads + 1 - begins, counts)]
        ends = np.zeros((len(rows), 6))
        for column, code in enumerate((*_START, *_END)):
            if code in codes:
                ends[:, column] = tags.numbers(rows + codes.index(code))
        place = codes.index(_HANDLE)
        handles = list(tags.values(rows + place))
        for head, begin, count in zip(
            tags.values(marks[heads] + place), begins.tolist(), counts.tolist(), strict=True
        ):
            part = slice(begin, begin + count)
            groups[head] = BulkLines(handles[part], ends[part].reshape(-1, 2, 3))
        for k in range(len(codes)):
            is_other[rows + k] = False
    return groups


def _say_the_same(tags: Tags, rows: Ints, size: int) -> Bools:
    """Return a mask (K,) of entities that equal the one before them except in handle and ends.

    Each has `size` tags from its row (K,) in `rows` on, and so has the one before it."""
    table = tags.codes[rows[:, None] + np.arange(size)]
    is_same = np.asarray((table == tags.codes[rows[:, None] + np.arange(-size, 0)]).all(axis=1))
    for k in range(size):
        candidates = np.flatnonzero(is_same & ~np.isin(table[:, k], _OWN))
        tag_rows, before = rows[candidates] + k, rows[candidates] + k - size
        # Most entities are compared with both neighbours: each value is looked up once.
        is_wanted = np.zeros(len(tags.codes), dtype=np.bool_)
        is_wanted[tag_rows] = is_wanted[before] = True
        place = np.cumsum(is_wanted) - 1
        values = np.array([*tags.raw(np.flatnonzero(is_wanted)), None], dtype=object)
        is_same[candidates] = values[place[tag_rows]] == values[place[before]]
    return is_same


def _is_simple(codes: tuple[int, ...]) -> bool:
    """Return True if a LINE of these group codes has one handle and two ends, each with its
    coordinates in consecutive tags."""
    if codes.count(_HANDLE) != 1 or _HANDLES[1] in codes:
        return False
    if not {*codes[: codes.index(_HANDLE)]}.isdisjoint(_DIVISIONS):
        return False
    for point in (_START, _END):
        if any(codes.count(code) > 1 for code in point) or point[0] not in codes:
            return False
        index = codes.index(point[0])
        count = 3 if point[2] in codes else 2
        if codes[index : index + count] != point[:count]:
            return False
    return True


def _vertices(tags: Tags, begins: Ints, ends: Ints, is_other: Bools) -> dict[str, Floats]:
    """Return the vertices (K, 5) of each LWPOLYLINE of at least MIN_VERTICES, by handle: x, y,
    start and end width, bulge.

    The k-th one has the tags begins[k] to ends[k]; the tags read are cleared in `is_other`, in
    place."""
    rows_by_handle: dict[str, Floats] = {}
    for begin, end in zip(begins.tolist(), ends.tolist(), strict=True):
        codes = tags.codes[begin:end]
        x, *columns = (np.flatnonzero(codes == code) for code in _VERTEX)
        handle, subclass = (np.flatnonzero(codes == code) for code in (_HANDLE, _SUBCLASS))
        if len(x) < MIN_VERTICES or not np.array_equal(x + 1, columns[0]) or len(handle) != 1:
            continue
        if not {*codes[: handle[0]].tolist()}.isdisjoint(_DIVISIONS):
            continue
        first = min(places.min(initial=end) for places in (x, *columns))
        if first < x[0] or not len(subclass) or subclass[-1] > x[0] or (codes == _HEIGHT).any():
            continue
        rows = np.zeros((len(x), len(_VERTEX)))
        rows[:, 0] = tags.numbers(begin + x)
        for column, places in enumerate(columns, 1):
            rows[np.searchsorted(x, places) - 1, column] = tags.numbers(begin + places)
        rows_by_handle[str(tags.value(begin + int(handle[0])))] = rows
        is_other[begin + np.concatenate([x, *columns])] = False
    return rows_by_handle
