"""Boards: Gerber and Excellon against a painter of points, gerbv's pixels, and bad files."""

from __future__ import annotations

import builtins
import io
import math
import os
import shutil
import subprocess
import zipfile
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image, ImageDraw

from camtool.arrays import Bools, Floats
from camtool.errors import DrawingError
from camtool.geometry.drawing import Drawing
from camtool.geometry.measure import extents, sample, signed_areas
from camtool.geometry.nesting import inside
from camtool.geometry.polylines import Polylines, Segments
from camtool.importers.read import read_bytes, read_drawing
from tests.strategies import examples

pytest.importorskip("gerbonara", reason="the extra boards is not installed")

SAMPLES = Path(__file__).parents[2] / "samples"
HEAD = "%FSLAX46Y46*%\n%MOMM*%\n"


def gerber(body: str, head: str = HEAD) -> bytes:
    return (head + body + "M02*\n").encode()


def at(x: float, y: float) -> str:
    return f"X{round(x * 1e6)}Y{round(y * 1e6)}"


def is_dark(drawing: Drawing, points: Floats) -> Bools:
    """True (P,) for points within an odd number of contours."""
    count = sum(inside(points, Segments.of(path)).astype(int) for path in drawing.paths)
    return np.asarray(count % 2 == 1)


def test_the_sample_has_nets_holes_and_an_outline() -> None:
    drawing = read_drawing(SAMPLES / "led.zip")
    layers = {layer: drawing.layers.count(layer) for layer in set(drawing.layers)}
    assert layers == {"COPPER-TOP": 7, "DRILL-0.80": 10, "DRILL-2.20": 2, "OUTLINE": 1}
    low, high = extents(drawing.paths).T
    assert [*low, *high] == pytest.approx([0.0, 0.0, 24.0, 14.0], abs=1e-9)
    assert not drawing.skipped


def test_round_pads_are_circles_again() -> None:
    drawing = read_bytes(gerber(f"%ADD10C,1.5*%\nD10*\n{at(3, 4)}D03*\n"), "pad.gbr")
    (path,) = drawing.paths
    assert len(path.vertices) == 2
    assert np.abs(path.vertices[:, 2]) == pytest.approx([1.0, 1.0])
    assert abs(signed_areas(drawing.paths)[0]) == pytest.approx(math.pi * 0.75**2, rel=1e-9)


COORDINATE = st.integers(0, 40).map(lambda k: k / 10)
SHAPE = st.one_of(
    st.tuples(st.just("disc"), COORDINATE, COORDINATE, st.sampled_from([0.3, 0.8, 1.6])),
    st.tuples(st.just("box"), COORDINATE, COORDINATE, st.sampled_from([0.4, 1.0])),
    st.tuples(st.just("ring"), COORDINATE, COORDINATE, st.sampled_from([0.9, 1.7])),
    st.tuples(st.just("stroke"), COORDINATE, COORDINATE, COORDINATE, COORDINATE),
    st.tuples(st.just("turn"), COORDINATE, COORDINATE, st.sampled_from([0.5, 1.2])),
    st.tuples(st.just("region"), COORDINATE, COORDINATE, st.sampled_from([0.7, 1.3])),
)


def written(shape: tuple) -> str:
    """A shape of the painter as Gerber; apertures 10 to 19 stand in its head."""
    kind, x, y, *rest = shape
    if kind == "disc":
        return f"D{10 + [0.3, 0.8, 1.6].index(rest[0])}*\n{at(x, y)}D03*\n"
    if kind == "box":
        return f"D{13 + [0.4, 1.0].index(rest[0])}*\n{at(x, y)}D03*\n"
    if kind == "ring":
        return f"D{15 + [0.9, 1.7].index(rest[0])}*\n{at(x, y)}D03*\n"
    if kind == "stroke":
        return f"G01*\nD17*\n{at(x, y)}D02*\n{at(*rest)}D01*\n"
    if kind == "turn":  # three quarters of a circle about (x, y), counterclockwise from +X
        (r,) = rest
        offset = f"I{round(-r * 1e6)}J0"
        return f"D17*\n{at(x + r, y)}D02*\nG75*\nG03*\n{at(x, y - r)}{offset}D01*\nG01*\n"
    (r,) = rest
    corners = [(x + r, y), (x, y + r), (x - r, y), (x, y - r), (x + r, y)]
    lines = "".join(f"{at(*corner)}D01*\n" for corner in corners[1:])
    return f"G36*\nG01*\n{at(*corners[0])}D02*\n{lines}G37*\n"


WIDTH = 0.35


def painted(shape: tuple, points: Floats) -> Floats:
    """How far (P,) points are within a shape, mm, by its definition; below 0 outside of it."""
    kind, x, y, *rest = shape
    dx, dy = points[:, 0] - x, points[:, 1] - y
    away = np.hypot(dx, dy)
    if kind == "disc":
        return rest[0] / 2 - away
    if kind == "box":
        return rest[0] / 2 - np.maximum(np.abs(dx), np.abs(dy))
    if kind == "ring":
        return np.minimum(rest[0] / 2 - away, away - rest[0] / 4)
    if kind == "stroke":
        way = np.array(rest) - (x, y)
        length = float(way @ way)
        share = (
            np.clip((dx * way[0] + dy * way[1]) / length, 0, 1) if length else np.zeros(len(dx))
        )
        return WIDTH / 2 - np.hypot(dx - share * way[0], dy - share * way[1])
    (r,) = rest
    if kind == "turn":
        angle = np.arctan2(dy, dx) % (2 * math.pi)
        ends = np.minimum(np.hypot(dx - r, dy), np.hypot(dx, dy + r))
        return WIDTH / 2 - np.where(angle <= 1.5 * math.pi, np.abs(away - r), ends)
    return (r - np.abs(dx) - np.abs(dy)) / math.sqrt(2)


APERTURES = (
    "%ADD10C,0.3*%\n%ADD11C,0.8*%\n%ADD12C,1.6*%\n%ADD13R,0.4X0.4*%\n%ADD14R,1X1*%\n"
    f"%ADD15C,0.9X0.45*%\n%ADD16C,1.7X0.85*%\n%ADD17C,{WIDTH}*%\n"
)
FAR = ("disc", 9.0, 9.0, 0.3)
"""A pad beside all others: nothing clears it, so that there is a drawing."""

EDGE_MM = 5e-4
"""Points nearer to an edge than this are not looked at: chords lie within 0.2 µm of arcs."""


@examples(60)
@given(st.lists(st.tuples(SHAPE, st.booleans()), min_size=1, max_size=8), st.integers(0, 2**31))
def test_areas_are_those_of_a_painter(shapes: list[tuple[tuple, bool]], seed: int) -> None:
    body = f"{APERTURES}%LPD*%\n{written(FAR)}"
    points = np.random.default_rng(seed).uniform(-1.5, 5.5, (400, 2))
    dark = np.zeros(len(points), dtype=bool)
    is_clear_of_edges = np.ones(len(points), dtype=bool)
    for shape, adds in shapes:
        body += f"%LP{'D' if adds else 'C'}*%\n{written(shape)}"
        within = painted(shape, points)
        dark[within > 0.0] = adds
        is_clear_of_edges &= np.abs(within) > EDGE_MM
    drawing = read_bytes(gerber(body), "shapes.gbr")
    looked = points[is_clear_of_edges]
    assert (is_dark(drawing, looked) == dark[is_clear_of_edges]).all()


def pixels(drawing: Drawing, size: tuple[int, int], low: Floats, dpi: int) -> Bools:
    """The drawing filled, a pixel an inch / dpi, as gerbv's pictures have it."""
    image = Image.new("1", size)
    filled = np.zeros((size[1], size[0]), dtype=bool)
    for path in drawing.paths:
        image.paste(0, (0, 0, *size))
        points = (sample(path, 0.02) - low) * dpi / 25.4
        points[:, 1] = size[1] - points[:, 1]
        ImageDraw.Draw(image).polygon([tuple(point) for point in points.tolist()], fill=1)
        filled ^= np.array(image)
    return filled


FILES = [
    *(Path(os.environ["GERBER_FILES"]).rglob("*.g[tb]l") if "GERBER_FILES" in os.environ else ()),
    SAMPLES / "led.zip",
]


@pytest.mark.referee
@pytest.mark.parametrize("file", FILES, ids=lambda path: path.name)
def test_copper_is_that_of_gerbv(file: Path, tmp_path: Path) -> None:
    if shutil.which("gerbv") is None:
        pytest.skip("gerbv is not installed")
    data = file.read_bytes()
    if file.suffix == ".zip":
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            data = archive.read("led-F_Cu.gtl")
    (tmp_path / "copper.gtl").write_bytes(data)
    drawing = read_bytes(data, "copper.gtl")
    low, high = extents(drawing.paths).T
    command = [
        "gerbv",
        "-x",
        "png",
        "-D",
        "600",
        "-B",
        "0",
        "-a",
        "-f",
        "#ffffff",
        "-b",
        "#000000",
    ]
    subprocess.run([*command, "-o", "copper.png", "copper.gtl"], cwd=tmp_path, check=True)
    theirs = np.array(Image.open(tmp_path / "copper.png").convert("L")) > 127
    if np.abs((high - low) / 25.4 * 600 - theirs.shape[::-1]).max() > 2.0:
        pytest.skip("gerbv frames more than the copper, such as what was cleared")
    ours = pixels(drawing, theirs.shape[::-1], low, 600)
    # Edges differ by up to a pixel. Beyond two pixels from them one pixel in a million may.
    both = np.pad(ours, 2), np.pad(theirs, 2)
    shifts = [(i, j) for i in range(-2, 3) for j in range(-2, 3)]
    near_edge = np.zeros_like(both[0])
    for i, j in shifts:
        near_edge |= np.roll(both[0], (i, j), (0, 1)) != both[0]
    assert ((both[0] != both[1]) & ~near_edge).sum() <= 1e-6 * ours.size


def test_excellon_gives_circles_by_size_and_slots() -> None:
    text = "M48\nMETRIC,TZ\nT1C0.800\nT2C1.000\n%\nT1\nX1.0Y2.0\nX3.0Y2.0\nT2\n"
    drawing = read_bytes(
        (text + "G00X5.0Y5.0\nM15\nG01X8.0Y5.0\nM16\nG05\nM30\n").encode(), "board.drl"
    )
    assert sorted(drawing.layers) == ["DRILL-0.80", "DRILL-0.80", "SLOT-1.00"]
    slot = drawing.paths[drawing.layers.index("SLOT-1.00")]
    low, high = extents(Polylines.of([slot])).T
    assert [*low, *high] == pytest.approx([4.5, 4.5, 8.5, 5.5], abs=1e-9)


def test_inches_are_converted() -> None:
    body = "%ADD10C,0.1*%\nD10*\nX1000000Y0D03*\n"
    drawing = read_bytes(gerber(body, "%FSLAX26Y26*%\n%MOIN*%\n"), "in.gbr")
    low, high = extents(drawing.paths).T
    assert [*low, *high] == pytest.approx([24.13, -1.27, 26.67, 1.27], abs=1e-9)


def test_an_outline_keeps_its_lines() -> None:
    head = "%TF.FileFunction,Profile,NP*%\n" + HEAD
    body = f"%ADD10C,0.1*%\nD10*\nG01*\n{at(0, 0)}D02*\n"
    body += "".join(f"{at(*corner)}D01*\n" for corner in [(9, 0), (9, 5), (0, 5), (0, 0)])
    drawing = read_bytes(gerber(body, head), "any.gbr")
    (path,) = drawing.paths
    assert path.closed
    assert drawing.layers == ("OUTLINE",)
    low, high = extents(Polylines.of([path])).T
    assert [*low, *high] == [0.0, 0.0, 9.0, 5.0]


def packed(files: dict[str, bytes]) -> bytes:
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return data.getvalue()


PAD = gerber(f"%ADD10C,1*%\nD10*\n{at(1, 1)}D03*\n")


def test_of_an_archive_what_is_not_cut_is_named() -> None:
    data = packed({"a.gtl": PAD, "a.gts": PAD, "b/readme.txt": b"hello", "b.gbl": PAD})
    drawing = read_bytes(data, "board.zip")
    assert sorted(drawing.layers) == ["COPPER-BOTTOM", "COPPER-TOP"]
    reasons = [each.reason for each in drawing.skipped]
    assert reasons == [
        "is neither copper, outline nor drills: a.gts",
        "is no Gerber or Excellon: readme.txt",
    ]


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (
            b"%FSLAX46Y46*%\n%MOMM*%\n%ADD10C,oops*%\nD10*\nX0Y0D03*\nM02*\n",
            "cannot be read as Gerber",
        ),
        (b"M48\nMETRIC\nT1C0.8\n%\nT7\nX1.0Y1.0\nM30\n", "cannot be read as Excellon"),
        (gerber(""), "holds no lines"),
        (packed({"a.gts": PAD}), "holds no copper, outline or drills"),
        (packed({"a.gtl": b"%FSLAX46Y46*%\nD99*\nX0Y0D03*\nM02*\n"}), "a.gtl"),
        (packed({"readme.txt": b"hello"}), "is a ZIP archive"),
    ],
)
def test_bad_boards_are_refused_in_a_line(data: bytes, message: str) -> None:
    with pytest.raises(DrawingError) as caught:
        read_bytes(data, "board.zip")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_archive_that_unpacks_to_too_much_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("camtool.importers.board.reader.MAX_UNPACKED_BYTES", 1000)
    data = packed({"a.gtl": PAD, "z.gbl": PAD + b" " * 2000})
    with pytest.raises(DrawingError, match="unpacks to more than"):
        read_bytes(data, "board.zip")


def test_damaged_archives_are_refused_in_a_line() -> None:
    """Bytes of the packed text, and of the directory at the end, in turn."""
    data = packed({"a.gtl": PAD * 40})
    for at_byte in range(4, len(data)):
        damaged = data[:at_byte] + bytes([data[at_byte] ^ 0xFF]) + data[at_byte + 1 :]
        with suppress(DrawingError):
            read_bytes(damaged, "board.zip")


def test_numbers_beyond_any_board_are_refused() -> None:
    data = gerber(f"%ADD10C,1e9*%\nD10*\n{at(1, 1)}D03*\n")
    with pytest.raises(DrawingError, match="above 10 m"):
        read_bytes(data, "any.gbr")


def test_without_the_extra_the_mend_is_its_name(monkeypatch: pytest.MonkeyPatch) -> None:
    original = builtins.__import__

    def refused(name: str, *rest: object) -> object:
        if name.startswith("gerbonara"):
            raise ImportError(name)
        return original(name, *rest)  # type: ignore[arg-type]

    monkeypatch.setattr(builtins, "__import__", refused)
    with pytest.raises(DrawingError, match=r"pip install 'camtool\[boards\]'"):
        read_bytes(PAD, "pad.gbr")


def test_no_file_is_read_for_an_include() -> None:
    """IF names a file to read: no drawing may do that."""
    body = f"%IFpyproject.toml*%\n%ADD10C,1*%\nD10*\n{at(1, 1)}D03*\n"
    try:
        drawing = read_bytes(gerber(body), "include.gbr")
    except DrawingError:
        return
    assert len(drawing.paths) == 1
