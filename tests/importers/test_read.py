"""read_drawing: the format by content, files that are none, and what gets loaded."""

import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import camtool.importers
from camtool.errors import DrawingError, OptionError
from camtool.importers import ReadOptions, read_drawing
from camtool.importers.read import find_format

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
        (b"AC1027", "save it as DXF"),
        (b"\x89PNG\r\n", "trace it"),
        (b"\xff\xd8\xff\xe0", "trace it"),
        (b"words, and more words", "--format"),
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
    heavy = {"ezdxf", "svgpathtools", "scipy", "build123d"}
    assert not loaded("import camtool.importers") & (heavy | {"numpy", "defusedxml"})
    path = tmp_path / "part.svg"
    path.write_text(SVG)
    code = (
        "from pathlib import Path\nfrom camtool.importers import read_drawing\n"
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
    assert name in ("dxf", "svg", "points", "f")
