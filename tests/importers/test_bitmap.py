"""Pictures of pixels: shapes rendered at several sizes, traced, and compared with the truth."""

import io
import math
import struct
import zlib

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from camtool.errors import DrawingError, OptionError
from camtool.geometry.drawing import Drawing
from camtool.geometry.measure import path_lengths, point_at, signed_areas
from camtool.geometry.polylines import Segments
from camtool.importers.bitmap import pixels
from camtool.importers.bitmap.centre import thin
from camtool.importers.bitmap.outline import crossings, enclosed_area, outlines
from camtool.importers.bitmap.strokes import MEETING_PX, strokes
from camtool.importers.options import ReadOptions
from camtool.importers.read import read_bytes
from camtool.pictures import draw
from tests.strategies import examples

SIDE_MM = 40.0
HALF_PIXEL = 0.5

SHAPES = {
    "disc": '<circle cx="20" cy="20" r="12"/>',
    "ring": '<path fill-rule="evenodd" d="M8 20a12 12 0 1 0 24 0a12 12 0 1 0-24 0z'
    'M14 20a6 6 0 1 0 12 0a6 6 0 1 0-12 0z"/>',
    "letter": '<path fill-rule="evenodd" d="M11 8H22A7 7 0 0 1 22 22L29 32H24L18 22H15V32H11Z'
    'M15 12V18H21A3 3 0 0 0 21 12Z"/>',
}
"""In a square of 40 mm; the letter is an R."""


def page(shape: str, transform: str) -> str:
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{SIDE_MM}mm" height="{SIDE_MM}mm" '
        f'viewBox="0 0 {SIDE_MM:g} {SIDE_MM:g}"><g transform="{transform}">{shape}</g></svg>'
    )


def rendered(svg: str, side: int, *, stairs: bool) -> bytes:
    """The SVG as a PNG of so many pixels a side, on nothing: with smooth edges or stairs."""
    # A page of whole pixels: resvg rounds its size.
    data = draw.png(svg.replace(f'="{SIDE_MM}mm"', f'="{side}"'), side)
    if not stairs:
        return data
    clear = np.asarray(Image.open(io.BytesIO(data)))[:, :, 3]
    return png(np.where(clear >= 128, 0, 255).astype(np.uint8))


def png(values: np.ndarray, mode: str | None = None, **more: object) -> bytes:
    out = io.BytesIO()
    Image.fromarray(values, mode).save(out, "PNG", **more)
    return out.getvalue()


def traced(data: bytes, **options: object) -> Drawing:
    options = {"width_mm": SIDE_MM, **options}
    return read_bytes(data, "p.png", ReadOptions(**options))


def dense(drawing: Drawing) -> np.ndarray:
    """Points all along its paths."""
    segments = Segments.of(drawing.paths)
    share = np.linspace(0.0, 1.0, 40)
    rows = np.repeat(np.arange(len(segments)), len(share))
    return point_at(segments, rows, np.tile(share, len(segments)))


def apart(one: Drawing, other: Drawing) -> float:
    """The largest distance of a point of one drawing from the lines of the other, mm."""
    lines = shapely.multilinestrings(
        [
            shapely.LineString(dense_path)
            for dense_path in np.split(dense(other), len(dense(other)) // 40)
        ]
    )
    return float(shapely.distance(shapely.points(dense(one)), lines).max())


turns = st.tuples(
    st.floats(-180.0, 180.0),  # degrees
    st.sampled_from([-1.0, 1.0]),  # mirrored or not
    st.floats(0.6, 1.1),  # as large
    st.floats(-3.0, 3.0),
    st.floats(-3.0, 3.0),
)


@examples(40)
@given(st.sampled_from(sorted(SHAPES)), st.sampled_from([90, 151, 240]), turns, st.booleans())
def test_contours_lie_within_the_limit_and_half_a_pixel_of_the_truth(
    shape: str, side: int, turn: tuple[float, float, float, float, float], stairs: bool
) -> None:
    angle, mirror, size, dx, dy = turn
    transform = (
        f"translate({20 + dx} {20 + dy}) rotate({angle}) scale({mirror * size} {size}) "
        "translate(-20 -20)"
    )
    svg = page(SHAPES[shape], transform)
    truth = read_bytes(svg.encode(), "p.svg", ReadOptions())
    found = traced(rendered(svg, side, stairs=stairs))
    pixel = SIDE_MM / side
    assert len(found.paths) == len(truth.paths)
    assert found.paths.closed.all()
    corner = MEETING_PX * pixel if shape == "letter" else 0.0
    limit = (ReadOptions().smooth_px + HALF_PIXEL) * pixel + corner
    assert apart(found, truth) <= limit
    # The tips of sharp corners, where less than half of a pixel is dark, are cut.
    assert apart(truth, found) <= limit + (HALF_PIXEL * pixel if shape == "letter" else 0.0)
    # What is dark lies on the left: holes go the other way round.
    areas, wanted = (np.sort(signed_areas(each.paths)) for each in (found, truth))
    off = np.abs(np.sort(np.abs(areas)) - np.sort(np.abs(wanted)))
    assert (off <= HALF_PIXEL * pixel * np.sort(path_lengths(truth.paths))).all()
    assert (areas < 0.0).sum() == len(areas) - 1
    if not stairs:
        # Smooth edges say where they lie: far better than half a pixel but for corners.
        assert path_lengths(found.paths).sum() == pytest.approx(
            path_lengths(truth.paths).sum(), rel=0.04
        )


def test_a_disc_is_a_circle_and_a_square_four_lines() -> None:
    svg = page(SHAPES["disc"], "")
    for stairs in (False, True):
        found = traced(rendered(svg, 200, stairs=stairs))
        assert len(found.paths) == 1
        assert np.abs(found.paths.vertices[:, 2]).tolist() == [1.0, 1.0]
        across = np.ptp(found.paths.vertices[:, 0])
        assert across == pytest.approx(24.0, abs=0.1)
    square = traced(
        rendered(page('<rect x="10" y="8" width="20" height="16"/>', ""), 200, stairs=True)
    )
    corners = sorted(square.paths.vertices[:, :2].round(6).tolist())
    assert corners == [[10.0, 16.0], [10.0, 32.0], [30.0, 16.0], [30.0, 32.0]]


@pytest.mark.parametrize(("angle", "limit"), [(0, 0.02), (5.7, 0.25), (13, 0.25), (30, 0.25)])
def test_stairs_become_straight_lines(angle: float, limit: float) -> None:
    """A turned rectangle of black and white alone: four lines, within a quarter of a pixel."""
    svg = page('<rect x="8" y="12" width="24" height="16"/>', f"rotate({angle} 20 20)")
    found = traced(rendered(svg, 400, stairs=True))
    truth = read_bytes(svg.encode(), "p.svg", ReadOptions())
    assert len(found.paths.vertices) == 4
    assert apart(found, truth) <= limit * SIDE_MM / 400


def test_lines_at_the_threshold_are_closed_and_enclose_what_is_dark() -> None:
    rng = np.random.default_rng(5)
    for height, width in ((1, 1), (1, 7), (8, 5), (30, 40)):
        ink = rng.choice([0.0, 1.0], (height, width)).astype(np.float32)
        lines = outlines(ink, 0.5)
        assert sum(map(len, lines)) == crossings(ink, 0.5)
        sure = [np.concatenate([line, line[:1]]) for line in lines]
        for line in sure:
            steps = np.abs(np.diff(line, axis=0))
            assert steps.max(initial=0.0) <= 1.0  # none jumps
        centres = shapely.points(
            *(each.ravel() + 0.5 for each in np.meshgrid(np.arange(width), np.arange(height)))
        )
        inside = np.zeros(ink.size)
        for line in sure:
            sign = math.copysign(1.0, enclosed_area(line[:-1]))
            inside += sign * shapely.contains(shapely.Polygon(line), centres)
        dark = ink[::-1].ravel()  # rows upwards
        assert np.array_equal(inside, dark)


def test_specks_vanish_below_their_size_and_others_stay() -> None:
    values = np.full((60, 80), 255, dtype=np.uint8)
    values[10:40, 10:50] = 0
    values[20:23, 20:23] = 255  # a hole of nine pixels
    values[50:52, 60:62] = 0  # a speck of four
    sizes = {0.0: 3, 3.0: 3, 4.0: 2, 8.0: 2, 9.0: 1}  # corners of specks are cut
    for speckle, count in sizes.items():
        assert len(traced(png(values), speckle_px=speckle).paths) == count, speckle
    found = traced(png(values), speckle_px=9.0)
    assert [(one.kind, one.count) for one in found.skipped] == [("speck", 2)]
    assert [finding.code.name for finding in found.findings] == ["ENTITY_SKIPPED"]


def bar(angle: float, *, cross: bool) -> str:
    rest = '<rect x="17" y="6" width="6" height="28"/>' if cross else ""
    return page('<rect x="6" y="17" width="28" height="6"/>' + rest, f"rotate({angle} 20 20)")


@examples(30)
@given(st.floats(-90.0, 90.0), st.sampled_from([150, 301]), st.booleans(), st.booleans())
def test_centre_lines_of_a_bar_and_of_a_cross(
    angle: float, side: int, cross: bool, stairs: bool
) -> None:
    found = traced(rendered(bar(angle, cross=cross), side, stairs=stairs), trace="centre")
    pixel = SIDE_MM / side
    assert len(found.paths) == (2 if cross else 1)
    assert not found.paths.closed.any()
    turn = math.radians(-angle)  # y upwards
    middles = [shapely.LineString([(-14, 0), (14, 0)])]
    middles += [shapely.LineString([(0, -14), (0, 14)])] if cross else []
    truth = shapely.affinity.affine_transform(
        shapely.MultiLineString(middles),
        [math.cos(turn), -math.sin(turn), math.sin(turn), math.cos(turn), 20.0, 20.0],
    )
    points = dense(found)
    # Where strokes cross askew, thinning leaves two junctions beside each other.
    limit = 2.0 * pixel + (0.1 * 6.0 if cross else 0.0)
    assert shapely.distance(shapely.points(points), truth).max() <= limit
    # From half a width before one end to half a width before the other.
    long = path_lengths(found.paths)
    assert (np.abs(long - 22.0) <= 1.5 + 2.0 * pixel).all()


def test_a_ring_has_one_closed_centre_line_and_a_disc_none() -> None:
    ring = traced(rendered(page(SHAPES["ring"], ""), 200, stairs=False), trace="centre")
    assert ring.paths.closed.tolist() == [True]
    off = np.hypot(*(dense(ring) - 20.0).T) - 9.0
    assert np.abs(off).max() <= 1.5 * SIDE_MM / 200
    with pytest.raises(DrawingError, match="--trace outline"):
        traced(rendered(page(SHAPES["disc"], ""), 200, stairs=False), trace="centre")


def test_thinning_keeps_what_hangs_together() -> None:
    """As many parts and as many holes as before: by counting corners, edges and pixels."""
    rng = np.random.default_rng(8)
    for _ in range(20):
        coarse = rng.random((9, 11)) < 0.6
        dark = np.kron(coarse, np.ones((7, 7), dtype=bool))
        lines = thin(dark)
        assert not (lines & ~dark).any()
        assert lines.sum() < dark.sum() or not dark.any()
        assert _parts_and_holes(lines) == _parts_and_holes(dark)
        assert np.array_equal(thin(lines), lines)


def _parts_and_holes(dark: np.ndarray) -> tuple[int, int]:
    """Parts that hang together over edges or corners, and light ones over edges alone."""
    return _parts(dark, diagonal=True), _parts(~np.pad(dark, 1), diagonal=False)


def _parts(on: np.ndarray, *, diagonal: bool) -> int:
    steps = [(0, 1), (1, 0), (0, -1), (-1, 0)]
    steps += [(1, 1), (1, -1), (-1, 1), (-1, -1)] if diagonal else []
    left, count = set(map(tuple, np.argwhere(on).tolist())), 0
    while left:
        waiting, count = [left.pop()], count + 1
        while waiting:
            row, column = waiting.pop()
            for dy, dx in steps:
                if (row + dy, column + dx) in left:
                    left.remove((row + dy, column + dx))
                    waiting.append((row + dy, column + dx))
    return count


def test_open_strokes_keep_their_ends() -> None:
    points = np.column_stack([np.arange(30.0), np.repeat([0.0, 1.0], 15)])
    found = strokes(points, 0.75, closed=False).vertices
    assert found[[0, -1], :2].tolist() == points[[0, -1]].tolist()
    assert len(found) < 6


# What pixels are made of.


SQUARE = np.full((40, 40), 255, dtype=np.uint8)
SQUARE[10:30, 5:25] = 0
EXPECTED = [[5.0, 10.0], [5.0, 30.0], [25.0, 10.0], [25.0, 30.0]]


def corners(data: bytes, **options: object) -> list[list[float]]:
    return sorted(traced(data, **options).paths.vertices[:, :2].round(3).tolist())


@pytest.mark.parametrize("mode", ["1", "L", "LA", "P", "RGB", "RGBA", "I;16", "clear", "cut out"])
def test_every_mode_of_png_gives_the_same(mode: str) -> None:
    image = Image.fromarray(SQUARE)
    more: dict[str, object] = {}
    if mode == "I;16":
        image = Image.fromarray(SQUARE.astype(np.uint16) * 257)
    elif mode == "clear":  # black everywhere, and transparent but for the square
        image = Image.fromarray(np.dstack([np.zeros_like(SQUARE)] * 3 + [255 - SQUARE]))
    elif mode == "cut out":  # one colour of a palette is transparent
        image, more = image.convert("P"), {"transparency": 255}
    else:
        image = image.convert(mode)
    out = io.BytesIO()
    image.save(out, "PNG", **more)
    assert corners(out.getvalue()) == EXPECTED


@pytest.mark.parametrize("mode", ["L", "RGB", "CMYK"])
def test_every_mode_of_jpeg_gives_the_same(mode: str) -> None:
    out = io.BytesIO()
    Image.fromarray(SQUARE).convert(mode).save(out, "JPEG", quality=95)
    assert np.array(corners(out.getvalue())) == pytest.approx(np.array(EXPECTED), abs=0.1)


@pytest.mark.parametrize("orientation", range(1, 9))
def test_a_camera_held_sideways_is_turned_back(orientation: int) -> None:
    image = Image.fromarray(SQUARE)
    undo = {2: 0, 3: 3, 4: 1, 5: 5, 6: 2, 7: 6, 8: 4}  # by which transposition it is stored
    if orientation > 1:
        image = image.transpose(Image.Transpose(undo[orientation]))
    exif = Image.Exif()
    exif[0x0112] = orientation
    out = io.BytesIO()
    image.save(out, "PNG", exif=exif)
    assert corners(out.getvalue()) == EXPECTED


def test_threshold_and_inverting() -> None:
    grey = np.full((40, 40), 100, dtype=np.uint8)
    grey[10:30, 5:25] = 40
    with pytest.raises(DrawingError, match=r"darker than the threshold .*--threshold 0\.7"):
        traced(png(grey))
    light = np.abs(np.array(corners(png(grey), threshold=0.725)) - EXPECTED)
    assert light.max() <= 0.2
    assert corners(png(255 - SQUARE), invert=True) == EXPECTED


@pytest.mark.parametrize("tone", [0, 120, 255])
def test_a_picture_of_one_tone_shows_nothing(tone: int) -> None:
    with pytest.raises(DrawingError, match="one tone"):
        traced(png(np.full((9, 9), tone, dtype=np.uint8)))


# How large it is.


def test_a_size_must_be_given_and_only_one() -> None:
    data = png(SQUARE, dpi=(254, 254))
    with pytest.raises(DrawingError, match=r"40 x 40 pixels.*--width 60mm.*254 dpi: --own-dpi"):
        read_bytes(data, "p.png", ReadOptions())
    by_width = read_bytes(data, "p.png", ReadOptions(width_mm=4.0))
    for options in ({"dpi": 254.0}, {"own_dpi": True}):
        found = read_bytes(data, "p.png", ReadOptions(**options))
        assert found.paths.vertices == pytest.approx(by_width.paths.vertices, rel=1e-4)
    with pytest.raises(DrawingError, match="more than one size"):
        read_bytes(data, "p.png", ReadOptions(width_mm=4.0, dpi=254.0))
    with pytest.raises(DrawingError, match="--units"):
        read_bytes(data, "p.png", ReadOptions(units="mm"))
    with pytest.raises(DrawingError, match="says no pixels an inch"):
        read_bytes(png(SQUARE), "p.png", ReadOptions(own_dpi=True))
    with pytest.raises(DrawingError, match="two different"):
        read_bytes(png(SQUARE, dpi=(100, 200)), "p.png", ReadOptions(own_dpi=True))


@pytest.mark.parametrize(
    "wrong",
    [{"width_mm": 0.0}, {"width_mm": math.inf}, {"threshold": 0.0}, {"threshold": 1.0},
     {"threshold": math.nan}, {"speckle_px": -1.0}, {"smooth_px": math.nan}, {"trace": "edge"}],
)  # fmt: skip
def test_options_of_pictures_out_of_range_are_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(OptionError):
        ReadOptions(**wrong)


@pytest.mark.parametrize(
    ("options", "flag"),
    [
        ({"width_mm": 9.0}, "--width"),
        ({"trace": "centre"}, "--trace"),
        ({"invert": True}, "--inv"),
    ],
)
def test_flags_of_pictures_are_refused_elsewhere(options: dict[str, object], flag: str) -> None:
    with pytest.raises(OptionError, match=flag):
        read_bytes(page(SHAPES["disc"], "").encode(), "p.svg", ReadOptions(**options))


# Broken, and too large.


@given(st.integers(0, 2**32 - 1), st.integers(1, 12), st.booleans())
def test_damaged_pictures_are_read_or_refused(seed: int, count: int, jpeg: bool) -> None:
    rng = np.random.default_rng(seed)
    out = io.BytesIO()
    Image.fromarray(SQUARE).save(out, "JPEG" if jpeg else "PNG")
    data = bytearray(out.getvalue())
    for at in rng.integers(4, len(data), count):
        data[at] = int(rng.integers(256))
    cut = bytes(data[: int(rng.integers(8, len(data) + 1))])
    refused: DrawingError | None = None
    try:
        traced(cut)
    except DrawingError as error:
        refused = error
    assert refused is None or (refused.file == "p.png" and refused.mend)


def test_a_cut_off_picture_is_broken() -> None:
    with pytest.raises(DrawingError, match="broken PNG"):
        traced(png(SQUARE)[:-60])


def test_a_picture_of_too_many_pixels_is_refused_before_it_is_decoded() -> None:
    def chunk(name: bytes, data: bytes) -> bytes:
        return (
            struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        )

    for width, height in ((60_000, 40_000), (6_000, 5_000)):
        head = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0))
        data = b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", b"") + chunk(b"IEND", b"")
        assert width * height > pixels.MAX_PIXELS
        with pytest.raises(DrawingError, match="more than 24 million"):
            traced(data)


def test_noise_is_refused() -> None:
    noise = np.random.default_rng(2).integers(0, 256, (700, 700)).astype(np.uint8)
    with pytest.raises(DrawingError, match="too rough"):
        traced(png(noise), speckle_px=0.0)


def test_the_same_picture_gives_the_same() -> None:
    data = rendered(page(SHAPES["letter"], "rotate(7 20 20)"), 200, stairs=False)
    one, other = (traced(data).paths.vertices for _ in range(2))
    assert one.tobytes() == other.tobytes()
