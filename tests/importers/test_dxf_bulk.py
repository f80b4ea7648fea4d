"""Reading in bulk changes nothing: pieces and findings are those that ezdxf's entities give."""

from __future__ import annotations

import io
from typing import Any

import ezdxf
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import DrawingError
from camtool.importers.dxf import load as dxf_load
from camtool.importers.dxf.bulk import MIN_VERTICES, Bulk
from camtool.importers.dxf.reader import read
from camtool.importers.options import ReadOptions
from tests.strategies import examples

NUMBERS = st.sampled_from(["0", "1.5", "-2e1", " 7.0", "10", "3.25", "0.125"])
ODD = st.sampled_from(["nan", "x1y", "1_0", "", "1e999"])
LOOKS: st.SearchStrategy[list[Any]] = st.sampled_from(
    [
        [(8, "0")],
        [(8, "CUT")],
        [(8, "CUT"), (62, "3")],
        [(8, "CUT"), (6, "DASHED")],
        [(8, "0"), (60, "1")],
        [(8, "0"), (67, "1")],
        [(330, "FFFF"), (8, "0")],
        [(102, "{X"), (330, "B1"), (102, "}"), (8, "0")],
    ]
)
AXES = [(10, 20, 11, 21), (10, 20, 30, 11, 21, 31), (10, 20, 30, 11, 21)]


@st.composite
def lines(draw: st.DrawFn, odd: bool) -> list[tuple[int, str]]:
    """LINEs in a row, of which some are alike; `odd`: with numbers, codes and handles amiss."""
    tags: list[tuple[int, str]] = []
    look, axes = draw(LOOKS), draw(st.sampled_from(AXES))
    late = odd and draw(st.booleans())
    for k in range(draw(st.integers(1, 8))):
        if draw(st.integers(0, 3)) == 0:
            look, axes = draw(LOOKS), draw(st.sampled_from(AXES))
        numbers = NUMBERS | ODD if odd and draw(st.integers(0, 9)) == 0 else NUMBERS
        own = [(code, draw(numbers) if code not in (30, 31) else "0.0") for code in axes]
        handle = [(5, f"{0xA0 + k:X}")]
        if odd and draw(st.integers(0, 9)) == 0:
            handle = draw(st.sampled_from([[], [(5, "A0")], [(5, "A0"), (5, "A9")]]))
        if odd and draw(st.integers(0, 9)) == 0:
            own = draw(st.permutations(own))
        # Some programs write the handle where ezdxf does not look for it.
        first, second = ((), handle) if late else (handle, ())
        tags += [(0, "LINE"), *first, (100, "AcDbEntity"), *look, *second]
        tags += [(100, "AcDbLine"), *own]
    return tags


@st.composite
def polyline(draw: st.DrawFn, odd: bool) -> list[tuple[int, str]]:
    """An LWPOLYLINE that is long enough to be read in bulk."""
    corners = [f"{k % 7}.{k}" for k in range(MIN_VERTICES + draw(st.integers(-1, 3)))]
    tags = [(0, "LWPOLYLINE"), (5, "C1"), (100, "AcDbEntity"), (8, "0"), (100, "AcDbPolyline")]
    tags += [(90, str(len(corners))), (70, draw(st.sampled_from("01"))), (38, "0.0")]
    if draw(st.booleans()):
        tags.append((43, "0.5"))
    for k, corner in enumerate(corners):
        tags += [(10, corner), (20, str(k))]
        if odd and draw(st.integers(0, 20)) == 0:
            tags.append(draw(st.sampled_from([(30, "0"), (10, "1"), (20, "1"), (40, "x")])))
        for code in (40, 41, 42):
            if draw(st.integers(0, 12)) == 0:
                tags.append((code, "0.25"))
    return tags


def hatch(reference: str) -> list[tuple[int, str]]:
    """A HATCH whose boundary follows a line of the drawing."""
    corners = [(10, "0"), (20, "0"), (10, "5"), (20, "0"), (10, "5"), (20, "5")]
    path = [(92, "2"), (72, "0"), (73, "1"), (93, "3"), *corners, (97, "1"), (330, reference)]
    own = [(10, "0"), (20, "0"), (30, "0"), (2, "SOLID"), (70, "1"), (71, "1"), (91, "1"), *path]
    ends = [(75, "0"), (76, "1"), (98, "0")]
    name = [(0, "HATCH"), (5, "D1"), (100, "AcDbEntity"), (8, "0"), (100, "AcDbHatch")]
    return [*name, *own, *ends]


CIRCLE = [(0, "CIRCLE"), (5, "C9"), (100, "AcDbEntity"), (8, "0"), (100, "AcDbCircle")]
CIRCLE += [(10, "1"), (20, "2"), (40, "3")]


def drawing(entities: list[tuple[int, str]], *, version: str = "AC1015", end: str = "\n") -> bytes:
    """A file of these tags."""
    header = [(0, "SECTION"), (2, "HEADER"), (9, "$ACADVER"), (1, version), (9, "$INSUNITS")]
    tags = [*header, (70, "4"), (0, "ENDSEC"), (0, "SECTION"), (2, "ENTITIES"), *entities]
    tags += [(0, "ENDSEC"), (0, "EOF")]
    return "".join(f"{code:>3}{end}{value}{end}" for code, value in tags).encode()


def seen(data: bytes, options: ReadOptions) -> Any:
    """All that a drawing has, or why there is none."""
    try:
        found = read(data, "a.dxf", options)
    except DrawingError as error:
        return str(error)
    paths = found.paths
    columns = (paths.vertices.tolist(), paths.offsets.tolist(), paths.closed.tolist())
    names = (found.layers, found.colours, found.sources, found.line_types)
    return columns, names, found.used, found.skipped, found.findings


def by_entities(data: bytes, options: ReadOptions) -> Any:
    """The same where ezdxf gets all tags: the oracle."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(dxf_load.Bulk, "of", lambda tags, _frame: Bulk.none(tags))
        return seen(data, options)


@st.composite
def drawings(draw: st.DrawFn, odd: bool) -> bytes:
    """Lines, and what may stand among them."""
    more = draw(st.lists(st.sampled_from(["circle", "polyline", "hatch", "lines"]), max_size=3))
    entities = draw(lines(odd))
    for kind in dict.fromkeys(more):
        if kind == "circle":
            entities = [*entities, *CIRCLE]
        elif kind == "polyline":
            entities = [*draw(polyline(odd)), *entities]
        elif kind == "hatch":
            entities = [*entities, *hatch(draw(st.sampled_from(["A0", "A1", "A2", "EE"])))]
        else:
            moved = draw(lines(odd))
            entities += [(code, f"E{value}" if code == 5 else value) for code, value in moved]
    version = draw(st.sampled_from(["AC1015", "AC1009"] if odd else ["AC1015"]))
    return drawing(entities, version=version, end=draw(st.sampled_from(["\n", "\r\n", "\r"])))


@pytest.mark.parametrize("options", [ReadOptions(), ReadOptions(layout="Layout1")])
@examples(30, 2000)
@given(data=drawings(odd=False))
def test_whole_drawings_are_read_as_by_entities(data: bytes, options: ReadOptions) -> None:
    assert seen(data, options) == by_entities(data, options)


@given(data=drawings(odd=True))
def test_so_are_drawings_with_something_amiss(data: bytes) -> None:
    assert seen(data, ReadOptions()) == by_entities(data, ReadOptions())


def document() -> Any:
    """Lines of two layers, among them a block with lines, and a long polyline with arcs."""
    doc = ezdxf.new()
    block, space = doc.blocks.new("B"), doc.modelspace()
    for k in range(20):
        block.add_line((k, 0), (k, 1))
        space.add_line((k, 2, 0), (k + 1, 3 + k % 2, 0), {"layer": "CUT" if k > 9 else "0"})
    space.add_blockref("B", (30, 30))
    space.add_lwpolyline([(k, k * k % 7, 0, 0, 0.1 * (k % 3)) for k in range(50)])
    doc.layout("Layout1").add_line((0, 0), (1, 1))
    doc.layout("Layout1").add_line((0, 0), (1, 2))
    return doc


@pytest.mark.parametrize("form", ["asc", "bin"])
@pytest.mark.parametrize("layout", [None, "Layout1"])
def test_documents_in_either_form_are_read_as_by_entities(form: str, layout: str | None) -> None:
    stream: Any = io.StringIO() if form == "asc" else io.BytesIO()
    document().write(stream, fmt=form)
    data = stream.getvalue().encode() if form == "asc" else stream.getvalue()
    options = ReadOptions(layout=layout)
    assert seen(data, options) == by_entities(data, options)


def test_lines_in_a_row_become_no_entities() -> None:
    stream = io.StringIO()
    document().write(stream)
    loaded = dxf_load.load(stream.getvalue().encode(), "a.dxf")
    assert [len(each.handles) for each in loaded.lines.values()] == [9, 9, 1]
    assert len(loaded.document.modelspace()) == 4
    polyline = loaded.document.modelspace().query("LWPOLYLINE")[0]
    np.testing.assert_allclose(polyline.lwpoints.values[2], [2, 4, 0, 0, 0.2])
