"""read_drawing: the format by content, files that are none, and what gets loaded."""

import contextlib
import gzip
import io
import subprocess
import sys
import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import camtool.importers
from camtool import bounds
from camtool.errors import DrawingError, OptionError
from camtool.importers import read as reader
from camtool.importers.formats import find_format
from camtool.importers.options import ReadOptions
from camtool.importers.read import read_bytes, read_drawing


def npy() -> bytes:
    stream = io.BytesIO()
    np.save(stream, np.zeros((3, 2)))
    return stream.getvalue()


def npz() -> bytes:
    stream = io.BytesIO()
    np.savez(stream, a=np.zeros((3, 2)))
    return stream.getvalue()


def zipped(name: str) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr(name, "1,2")
    return stream.getvalue()


SVG = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="10mm" height="10mm" viewBox="0 0 10 10">'
    '<rect x="1" y="1" width="2" height="3"/></svg>'
)


@pytest.mark.parametrize(
    ("content", "suffix", "wanted"),
    [
        (b"AutoCAD Binary DXF\r\n\x1a\x00\x00\x00", ".xyz", "dxf"),
        (b"  0\nSECTION\n  2\nHEADER\n", ".xyz", "dxf"),
        (b"0\r\nSECTION\r\n", ".csv", "dxf"),
        (b"999\ncomment\n0\nSECTION\n", "", "dxf"),
        (b"<svg/>", ".dxf", "svg"),
        (b"\xef\xbb\xbf\n <?xml version='1.0'?><svg/>", "", "svg"),
        (b"<!-- made by hand --><svg/>", ".txt", "svg"),
        ("<svg/>".encode("utf-16"), "", "svg"),
        (b"[[1, 2], [3, 4]]", ".svg", "points"),
        (b'{"strokes": []}', "", "points"),
        (b"1,2\n3,4\n", "", "points"),
        (b"# a\n\n1 2\n3 4\n", ".unknown", "points"),
        (b"x;y\n1;2\n", "", "points"),
        (b"0,0\n1,1\n", ".csv", "points"),
        (b"no sign of anything", ".dxf", "dxf"),
        (b"no sign of anything", ".SVG", "svg"),
        (b"no sign of anything", ".txt", "points"),
        (b"%PDF of points", ".csv", "points"),
        (b"\xff\xfe" + "0\nSECTION\n".encode("utf-16-le"), "", "dxf"),
        (b"\xef\xbb\xbf\n\n  999\nmade by\n  0\nSECTION\n", "", "dxf"),
        (b"999\rcomment\r0\rSECTION\r", "", "dxf"),
        (b"<!DOCTYPE svg [<!ENTITY a 'b>c'> ]>\n<!-- <html> --><svg:svg/>", "", "svg"),
        ("<?xml version='1.0' encoding='utf-16'?><svg/>".encode("utf-16-le"), "", "svg"),
        (b"<!-- " + 5000 * b"long " + b"--><svg/>", "", "svg"),
        (b"<!-- never ends", "", "svg"),
        (gzip.compress(b"<?xml version='1.0'?>\n<svg/>", mtime=0), "", "svg"),
        (b"ISO-10303-21;\nHEADER;", ".txt", "solid"),
        (b"/* a */\n/* b */ ISO-10303-21;", "", "solid"),
        (b"DBRep_DrawableShape\n\nCASCADE Topology V1", "", "solid"),
        (b"\nCASCADE Topology V3, (c) Open Cascade", "", "solid"),
        (b"\nOpen CASCADE Topology V4 (c)\n", "", "solid"),
        (b"from build123d import *\n", ".py", "solid"),
        (b"[1, 2]\n", ".py", "solid"),
        (npy(), "", "points"),
        (npz(), ".zip", "points"),
        (b"% star\nxy = [1 2; 3 4]\n", "", "points"),
        (b"lxy =\n[ 1 2 ]\n", ".txt", "points"),
        (b"clear all\n", ".m", "points"),
        (b"% 2 columns\n1 2\n", "", "points"),
        (b"m1,m2\n1,2\n", ".csv", "points"),
    ],
)
def test_the_content_decides_and_the_name_hints(content: bytes, suffix: str, wanted: str) -> None:
    assert find_format(content, suffix, "f") == wanted


@pytest.mark.parametrize(
    ("content", "mend"),
    [
        (b"\x1f\x8b\x08\x00", "gunzip"),
        (b"PK\x03\x04", "unpack"),
        (b"%PDF-1.4", "export SVG or DXF"),
        (b"**ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz****\n", "export STEP"),
        (b"PS\x00\x00\x00\x3f: TRANSMIT FILE", "export STEP"),
        (b"AC1027", "save it as DXF"),
        (b"\x89PNG\r\n", "save it again"),
        (b"\xff\xd8\xff\xe0", "save it again"),
        (b"words, and more words", "--format"),
        (gzip.compress(b"0\nSECTION\n", mtime=0), "gunzip"),
        (zipped("a.dxf"), "unpack"),
        (zipped("xl/workbook.xml"), "save it as CSV"),
        (zipped("Document.xml"), "from FreeCAD"),
        (b"<html><body/></html>", "export SVG or DXF"),
        (b"<?xml version='1.0'?><gpx/>", "export SVG or DXF"),
        (b"GIF89a", "save it as PNG"),
        (b"\xd0\xcf\x11\xe0", "export STEP or DXF"),
        (b"solid cube\n facet normal 0 0 1\n", "export STEP"),
        (b"IN;SP1;PU0,0;PD10,10;", "export SVG or DXF"),
        (f"{'A file':72}S      1\n".encode(), "export STEP"),
        (b"G21 G90\nG0 X1 Y2\n", "camtool verify"),
        (b"%\nO1000\n(part)\nN10 G01 X1. Y2.\n", "camtool verify"),
        (b"; by hand\nX0 Y0\nG1 X1 Y1 F100\n", "camtool verify"),
        (b"G02X02969.00Y03400.00I03012.00J03040.00F08;\n", "camtool verify"),
        (b"\x00\x01\x02 1,2", "--format"),
    ],
)
def test_what_is_no_drawing_is_told_what_to_do(content: bytes, mend: str, tmp_path: Path) -> None:
    path = tmp_path / "part.bin"
    path.write_bytes(content)
    with pytest.raises(DrawingError) as caught:
        read_drawing(path)
    assert mend in caught.value.mend
    assert caught.value.file == str(path)


class Input:
    """Standard input that holds these bytes."""

    def __init__(self, data: bytes) -> None:
        self.buffer = io.BytesIO(data)


def test_standard_input_is_told_by_its_content(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", Input(SVG.encode()))
    assert read_drawing(Path("-")).file == "<stdin>"
    monkeypatch.setattr(sys, "stdin", Input(b"1 2\n3 4\n"))
    assert read_drawing(Path("-")).used == {"stroke": 1}
    monkeypatch.setattr(sys, "stdin", Input(b"words and words"))
    with pytest.raises(DrawingError, match=r"^<stdin>: is no drawing .*--format"):
        read_drawing(Path("-"))
    monkeypatch.setattr(sys, "stdin", Input(b""))
    with pytest.raises(DrawingError, match="<stdin>: is empty"):
        read_drawing(Path("-"))
    monkeypatch.setattr(sys, "stdin", None)
    with pytest.raises(DrawingError, match="no standard input"):
        read_drawing(Path("-"))


def test_a_file_that_is_too_large_is_refused(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    path = tmp_path / "large.csv"
    with path.open("wb") as stream:  # a hole: it takes no room on the disk
        stream.truncate(reader.MAX_FILE_BYTES + 1)
    with pytest.raises(DrawingError, match="larger than 500 MB"):
        read_drawing(path)
    monkeypatch.setattr(reader, "MAX_FILE_BYTES", 10)
    with pytest.raises(DrawingError, match="is larger than"):
        read_drawing(Path("/dev/zero"))
    monkeypatch.setattr(sys, "stdin", Input(b"1,2\n3,4\n5,6\n"))
    with pytest.raises(DrawingError, match="is larger than"):
        read_drawing(Path("-"))


def test_a_file_is_read_in_pieces_into_the_memory_that_it_needs(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    path = tmp_path / "small.csv"
    path.write_bytes(b"1,2\n3,4\n" * 1000)
    tracemalloc.start()
    try:
        assert reader.file_bytes(path) == path.read_bytes()
        assert tracemalloc.get_traced_memory()[1] < 4_000_000
    finally:
        tracemalloc.stop()
    monkeypatch.setattr(bounds, "_BYTES_AT_ONCE", 7)
    assert reader.file_bytes(path) == path.read_bytes()
    monkeypatch.setattr(sys, "stdin", Input(path.read_bytes()))
    assert reader.content(Path("-")) == (path.read_bytes(), reader.STDIN)


@pytest.mark.parametrize(
    "head",
    [b"<!DOCTYPE svg [", b"<!--", b"<?", b"/*/", b"/**/", b"<!DOCTYPE a [ ] [", b" \n#\n", b"%"],
)
def test_the_format_of_a_long_head_is_found_in_no_time(head: bytes) -> None:
    """Quadratic or worse would take minutes here."""
    data = head * ((1 << 20) // len(head))
    with contextlib.suppress(DrawingError):
        find_format(data, "", "f")


def test_bytes_are_read_by_the_name_they_come_with() -> None:
    assert read_bytes(SVG.encode(), "a.svg").file == "a.svg"
    assert read_bytes(b"1;2\n3;4", "a.tsv").used == {"stroke": 1}


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(DrawingError, match="there is no such file"):
        read_drawing(tmp_path / "none.svg")
    with pytest.raises(DrawingError, match="is a directory"):
        read_drawing(tmp_path)
    empty = tmp_path / "empty.svg"
    empty.write_bytes(b" \n")
    with pytest.raises(DrawingError, match="is empty"):
        read_drawing(empty)
    with pytest.raises(DrawingError, match="cannot be read"):
        read_drawing(Path("a\x00b.svg"))
    with pytest.raises(DrawingError, match="cannot be read"):
        read_drawing(empty / "below.svg")


def test_a_file_is_read_by_its_content(tmp_path: Path) -> None:
    path = tmp_path / "part.txt"
    path.write_text(SVG)
    drawing = read_drawing(path)
    assert (len(drawing.paths), drawing.file) == (1, str(path))


def test_the_caller_may_name_the_format(tmp_path: Path) -> None:
    path = tmp_path / "part.txt"
    path.write_text(SVG)
    with pytest.raises(DrawingError, match="line 1"):
        read_drawing(path, options=ReadOptions(format="points"))


@pytest.mark.parametrize(
    "wrong",
    [{"units": "furlong"}, {"tolerance_mm": 0.0}, {"tolerance_mm": float("nan")},
     {"gap_mm": -1.0}, {"dpi": float("inf")}, {"dpi": 0.0}, {"format": "step"}],
)  # fmt: skip
def test_options_out_of_range_are_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(OptionError):
        ReadOptions(**wrong)


def test_units_know_their_size() -> None:
    options = ReadOptions(units="IN", dpi=72.0)
    assert options.mm_per("IN") == 25.4
    assert options.mm_per("px") == pytest.approx(25.4 / 72.0)


def test_the_package_has_no_other_names() -> None:
    with pytest.raises(AttributeError, match="write_drawing"):
        camtool.importers.write_drawing  # noqa: B018


def loaded(code: str) -> set[str]:
    """Top-level modules after running this code in a fresh interpreter."""
    text = f"import sys\n{code}\nprint(*{{m.split('.')[0] for m in sys.modules}})"
    run = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    return set(run.stdout.split())


def test_nothing_heavy_is_loaded_before_it_is_needed(tmp_path: Path) -> None:
    heavy = {"ezdxf", "svgpathtools", "build123d", "OCP"}
    rest = {"numpy", "scipy", "defusedxml"}
    assert not loaded("import camtool.importers") & (heavy | rest)
    path = tmp_path / "part.svg"
    path.write_text(SVG)
    code = (
        "from pathlib import Path\nfrom camtool.importers.read import read_drawing\n"
        f"read_drawing(Path({str(path)!r}))"
    )
    modules = loaded(code)
    assert "defusedxml" in modules
    assert not modules & heavy


@given(st.binary(max_size=64), st.sampled_from(["", ".dxf", ".svg", ".csv", ".bin"]))
def test_any_bytes_have_a_format_or_a_clean_error(data: bytes, suffix: str) -> None:
    try:
        name = find_format(data, suffix, "f")
    except DrawingError as error:
        name = str(error).partition(":")[0]
    assert name in ("dxf", "svg", "points", "solid", "bitmap", "f")
