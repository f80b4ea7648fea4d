"""Damaged DXF files: a drawing, told repairs, or one clear line; never a silent change."""

from __future__ import annotations

import io

import ezdxf
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import DrawingError
from camtool.geometry.drawing import Drawing
from camtool.importers.dxf import load as dxf_load
from camtool.importers.dxf import walk as dxf_walk
from camtool.importers.dxf.reader import read
from camtool.importers.findings import DrawingCode
from camtool.importers.options import ReadOptions
from tests.strategies import examples

OPTIONS = ReadOptions(tolerance_mm=0.01, text="stroke", dimensions=True)


def every_kind(version: str):
    """A document with something of everything, in blocks within blocks."""
    doc = ezdxf.new(version, setup=True)
    doc.layers.add("CUT", color=3, linetype="DASHED")
    doc.layers.add("OFF").off()
    block = doc.blocks.new("B", base_point=(1, 1))
    block.add_line((0, 0), (5, 0))
    block.add_circle((1, 4), 0.5, dxfattribs={"layer": "CUT", "color": 0})
    block.add_attdef("TAG", (0, 0), "x")
    nest = doc.blocks.new("N")
    nest.add_blockref("B", (3, 3), dxfattribs={"rotation": 30, "xscale": 2, "yscale": -1})
    space = doc.modelspace()
    space.add_line((0, 0), (10, 0))
    space.add_arc((3, 3), 1, 300, 20, dxfattribs={"extrusion": (0, 0, -1)})
    space.add_polyline2d([(0, 0, 0.5), (4, 0, 0), (4, 4, -1)], format="xyb", close=True)
    space.add_blockref("N", (20, 0), dxfattribs={"layer": "CUT", "rotation": 45})
    array = {"column_count": 3, "row_count": 2, "column_spacing": 6, "row_spacing": 7}
    space.add_blockref("B", (0, 20), dxfattribs=array).add_attrib("TAG", "A1", (0, 20))
    space.add_text("Text", height=2)
    space.add_point((7, 7))
    space.add_solid([(0, 40), (1, 40), (0, 41), (1, 41)])
    space.add_line((0, 0), (1, 1), dxfattribs={"layer": "OFF"})
    if version != "R12":
        space.add_lwpolyline([(0, 60, 0.3), (5, 60, 0), (5, 65, -0.2)], format="xyb")
        space.add_ellipse((5, 70), (3, 1), 0.4, 0.3, 5)
        space.add_spline([(0, 80), (3, 83), (6, 79), (9, 82)])
        space.add_rational_spline([(0, 90), (1, 93), (3, 88), (4, 92)], [1, 2, 1, 2])
        hatch = space.add_hatch()
        hatch.paths.add_polyline_path([(30, 0, 0.4), (35, 0), (35, 5)], is_closed=True)
        edges = hatch.paths.add_edge_path()
        edges.add_line((40, 0), (45, 0))
        edges.add_arc((45, 2), 2, 270, 90)
        edges.add_ellipse((43, 4), (2, 0), 0.5, 0, 180)
        space.add_mtext("{\\H2;big}\\Pline")
        space.add_mline([(50, 0), (55, 0), (55, 5)])
        space.add_linear_dim(base=(60, 5), p1=(60, 0), p2=(66, 0)).render()
    return doc


def ascii_of(doc) -> bytes:
    stream = io.StringIO()
    doc.write(stream)
    return stream.getvalue().encode(doc.output_encoding, errors="dxfreplace")


def binary_of(doc) -> bytes:
    stream = io.BytesIO()
    doc.write(stream, fmt="bin")
    return stream.getvalue()


TEXTS = {version: ascii_of(every_kind(version)) for version in ("R12", "R2000", "R2018")}
BINARIES = {version: binary_of(every_kind(version)) for version in ("R12", "R2000")}
WORDS = """0 -1 nan -inf 1e308 1e-308 1e999 xyz 1_0 LINE INSERT SPLINE HATCH POLYLINE VERTEX BLOCK
ENDBLK TABLE SECTION ENDSEC EOF AcDbLine 2147483647 999999 255 100 70 66 42 40 10 20 8 5 B N *D1
1.5.2"""
GARBAGE = st.sampled_from(WORDS.split()).map(str.encode) | st.binary(max_size=4)


def attempt(data: bytes) -> None:
    """A Drawing or one line."""
    message = "part.dxf: a drawing"
    try:
        read(data, "part.dxf", OPTIONS)
    except DrawingError as error:
        message = str(error)
    assert message.startswith("part.dxf: ")
    assert "\n" not in message


@examples(60)
@given(st.data())
def test_any_lines_may_be_changed_lost_or_doubled(data):
    lines = TEXTS[data.draw(st.sampled_from(sorted(TEXTS)))].split(b"\n")
    first = lines.index(b"BLOCKS")
    for _ in range(data.draw(st.integers(1, 4))):
        row = data.draw(st.integers(first, len(lines) - 1))
        much = data.draw(st.sampled_from((1, 1, 1, 2, 8)))
        new = data.draw(st.sampled_from(("garbage", "lost", "doubled")))
        if new == "garbage":
            lines[row] = data.draw(GARBAGE)
        elif new == "lost":
            del lines[row : row + much]
        else:
            lines[row:row] = lines[row : row + much]
    attempt(b"\n".join(lines))


@examples(60)
@given(st.data())
def test_any_bytes_of_a_binary_file_may_be_changed(data):
    content = bytearray(BINARIES[data.draw(st.sampled_from(sorted(BINARIES)))])
    for _ in range(data.draw(st.integers(1, 3))):
        row = data.draw(st.integers(22, len(content) - 1))
        content[row : row + data.draw(st.integers(0, 2))] = data.draw(st.binary(max_size=8))
    attempt(bytes(content))


@examples(30)
@given(st.data())
def test_a_binary_file_that_is_cut_off_is_refused_or_has_all_its_entities(data):
    content = BINARIES[data.draw(st.sampled_from(sorted(BINARIES)))]
    end = content.index(b"ENDSEC", content.rindex(b"ENTITIES"))
    with pytest.raises(DrawingError, match=r"cut off|no DXF|empty"):
        read(content[: data.draw(st.integers(0, end))], "part.dxf", OPTIONS)
    cut = data.draw(st.integers(end + 7, len(content) - 5))
    assert used(content[:cut]) == used(content)


def used(content: bytes) -> dict[str, int]:
    return read(content, "part.dxf", OPTIONS).used


def repairs(found: Drawing) -> str:
    return " ".join(f.message for f in found.findings if f.code is DrawingCode.FILE_REPAIRED)


def lines_of(text: str) -> bytes:
    return "\n".join([*text.split(), ""]).encode()


LINE = "0 LINE 8 0 10 0 20 0 11 1 21 0"


def in_entities(words: str) -> bytes:
    return lines_of(f"0 SECTION 2 ENTITIES {words} 0 ENDSEC 0 EOF")


@pytest.mark.parametrize("number", ["1_0", "١", "1,5", "0x10", "1.5.2", "12mm"])
def test_what_only_python_or_ezdxf_take_for_a_number_is_refused(number):
    header = "0 SECTION 2 HEADER 9 $ACADVER 1 AC1021 0 ENDSEC "
    data = lines_of(header) + in_entities(LINE.replace("11 1 ", f"11 {number} "))
    with pytest.raises(DrawingError, match="is no number") as caught:
        read(data, "part.dxf", OPTIONS)
    assert caught.value.where == "line 23"


@pytest.mark.parametrize("code", ["x8", "1_0", "-8", "8.0", "12345", "596"])
def test_a_group_code_that_is_none_is_refused_with_its_line(code):
    with pytest.raises(DrawingError, match="is no group code") as caught:
        read(in_entities(LINE.replace("8 0", f"{code} 0")), "part.dxf", OPTIONS)
    assert caught.value.where == "line 7"


def test_an_entity_that_lost_its_mark_is_told():
    found = read(in_entities(f"{LINE} {LINE.replace('0 LINE', '1 LINE', 1)}"), "a", OPTIONS)
    assert found.used == {"LINE": 1}
    assert "two entities run into one" in repairs(found)


def test_a_polyline_that_lost_a_vertex_is_told():
    doc = ezdxf.new("R2000")
    doc.modelspace().add_lwpolyline([(0, 0), (4, 0), (4, 77.5)])
    data = ascii_of(doc).replace(b" 10\n4.0\n 20\n77.5\n", b" 41\n4.0\n 40\n77.5\n")
    found = read(data, "a", OPTIONS)
    assert "LWPOLYLINE counts 3 vertices and holds 2" in repairs(found)


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (lines_of(f"0 SECTION 2 ENTITEIS {LINE} 0 ENDSEC 0 EOF"), "'ENTITEIS' is unknown"),
        (lines_of(f"0 SECTION 2 ENTITIES 0 ENDSEC {LINE} 0 EOF"), "outside the sections"),
        (lines_of(f"0 SECTOIN 2 ENTITIES {LINE} 0 ENDSEC 0 EOF"), "no section"),
    ],
)
def test_entities_that_stand_nowhere_are_not_lost_in_silence(data, says):
    whole = in_entities(LINE.replace("21 0", "21 5"))
    if b"SECTOIN" in data:
        with pytest.raises(DrawingError, match=says):
            read(data, "a", OPTIONS)
    else:
        found = read(whole.replace(b"0\nEOF\n", b"") + data, "a", OPTIONS)
        assert says in repairs(found)


def test_two_sections_of_entities_are_both_read():
    data = in_entities(LINE).replace(b"0\nEOF\n", in_entities(LINE.replace("21 0", "21 5")))
    found = read(data, "a", OPTIONS)
    assert found.used == {"LINE": 2}
    assert "section ENTITIES stands twice" in repairs(found)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_marks_of_an_encoding_are_understood(encoding):
    text = in_entities(LINE.replace("8 0", "8 Größe")).decode()
    assert read(text.encode(encoding), "a", OPTIONS).layers == ("Größe",)


def test_signs_that_ascii_cannot_say_are_decoded_and_broken_bytes_are_told():
    found = read(in_entities(LINE.replace("8 0", "8 \\U+00D6l")), "a", OPTIONS)
    assert found.layers == ("Öl",)
    header = lines_of("0 SECTION 2 HEADER 9 $ACADVER 1 AC1027 0 ENDSEC")
    data = header + in_entities(LINE.replace("8 0", "8 @")).replace(b"@", b"\xd6l")
    found = read(data, "a", OPTIONS)
    assert found.layers == ("?l",)
    assert "a byte is no text in utf-8" in repairs(found)


def test_comments_are_passed_over():
    data = in_entities(f"999 remark {LINE} 999 nonsense")
    assert read(data, "a", OPTIONS).used == {"LINE": 1}


@pytest.mark.parametrize("limit", ["MAX_BYTES", "MAX_TAGS", "MAX_ENTITIES"])
def test_files_that_are_too_large_are_refused_at_once(limit, monkeypatch):
    monkeypatch.setattr(dxf_load, limit, 3)
    with pytest.raises(DrawingError, match=r"large|holds more than"):
        read(in_entities(f"{LINE} {LINE} {LINE} {LINE}"), "a", OPTIONS)


def test_blocks_within_dimensions_cannot_explode(monkeypatch):
    monkeypatch.setattr(dxf_walk, "MAX_INSERTED", 2000)
    doc = ezdxf.new("R2000", setup=True)
    space = doc.modelspace()
    space.add_linear_dim(base=(0, 5), p1=(0, 0), p2=(6, 0)).render()
    dimension = space.query("DIMENSION").first
    # Six blocks, each with a dimension that is drawn by ten of the block before.
    doc.blocks.new("B0").add_line((0, 0), (1, 0))
    for level in range(1, 7):
        drawn_by = doc.blocks.new(f"*D{90 + level}")
        for k in range(10):
            drawn_by.add_blockref(f"B{level - 1}", (k, 0))
        again = dimension.copy()
        doc.blocks.new(f"B{level}").add_entity(again)
        again.dxf.geometry = drawn_by.name
    space.add_blockref("B6", (0, 0))
    with pytest.raises(DrawingError, match="blocks repeat more than"):
        read(ascii_of(doc), "a", OPTIONS)


def test_a_spline_of_huge_degree_is_refused():
    doc = ezdxf.new("R2000")
    doc.modelspace().add_line((0, 0), (1, 0))
    spline = doc.modelspace().add_spline(degree=60, dxfattribs={"flags": 8})
    points = np.random.default_rng(1).uniform(0, 9, (70, 2))
    spline.control_points = [(*row, 0.0) for row in points.tolist()]
    spline.knots = [0.0] * 61 + [float(k) for k in range(1, 10)] + [10.0] * 61
    [item] = read(ascii_of(doc), "a", OPTIONS).skipped
    assert item.reason == "has degree 60, at most 25 is read"
