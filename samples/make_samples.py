"""Writes the sample drawings of camtool: logo.dxf, logo.svg, star.csv, coupon.dxf, plate.dxf,
mount.dxf, mount.svg, sign.svg, tray.svg, board.dxf and screw.dxf.

    python samples/make_samples.py [FOLDER]

Every run writes the same files, byte for byte. All lengths are mm.
"""

from __future__ import annotations

import cmath
import math
import sys
from pathlib import Path

from dxf_writer import dxf
from shapes import Arc, Circle, Ellipse, Insert, Layer, Line, Polyline, Shape, Sheet, Spline
from svg_writer import svg

STAR_DECIMILLIMETRES = [
    (151, 86), (400, 265), (630, 86), (575, 431), (815, 639), (501, 642),
    (400, 999), (294, 645), (6, 665), (220, 428), (153, 86),
]  # fmt: skip
"""The points that the thesis on the Matlab router prints as its example, in tenths of mm."""

MIDDLE = 2.5 + 2.5j
"""Centre of the emblem, as a complex number."""


TILT_DEG = 30.0
"""Rotation of the emblem's inner ellipse and wave."""


def gear(teeth: int, tip: float, root: float, shares: tuple[float, float]) -> Polyline:
    """A gear about the centre: straight flanks between arcs on the tip and the root circle.

    `shares`: the parts of the pitch that the tip and the foot of a tooth occupy.
    """
    pitch = 2.0 * math.pi / teeth
    head, foot = shares[0] * pitch, shares[1] * pitch
    gap = pitch - foot
    vertices = []
    for tooth in range(teeth):
        middle = tooth * pitch
        for radius, angle, sweep in (
            (root, middle - 0.5 * foot, 0.0),
            (tip, middle - 0.5 * head, head),
            (tip, middle + 0.5 * head, 0.0),
            (root, middle + 0.5 * foot, gap),
        ):
            point = MIDDLE + cmath.rect(radius, angle)
            vertices.append((point.real, point.imag, math.tan(sweep / 4.0)))
    return Polyline(vertices)


def slot(radius: float, half_width: float, half_angle: float) -> Polyline:
    """A slot that follows a circle about the origin, with round ends, on the X axis."""
    reach = math.radians(half_angle)
    inner, outer = radius - half_width, radius + half_width
    corners = [(inner, reach), (inner, -reach), (outer, -reach), (outer, reach)]
    along = math.tan(2.0 * reach / 4.0)
    bulges = [-along, 1.0, along, 1.0]
    points = [cmath.rect(r, angle) for r, angle in corners]
    return Polyline([(z.real, z.imag, bulge) for z, bulge in zip(points, bulges, strict=True)])


def edge() -> list[Shape]:
    """The lower left corner of a plate."""
    return [
        Line((0.06, 1.1), (0.06, 0.32)),
        Arc((0.32, 0.32), 0.26, 180.0, 270.0),
        Line((0.32, 0.06), (1.1, 0.06)),
    ]


def bracket() -> list[Shape]:
    """A stroke along the corner of the plate, and a screw."""
    quarter = math.tan(math.pi / 8.0)
    bend = [(0.16, 0.92, 0.0), (0.16, 0.32, quarter), (0.32, 0.16, 0.0), (0.92, 0.16, 0.0)]
    return [Polyline(bend, closed=False), Circle((0.45, 0.45), 0.15)]


def around(count: int, radius: float, first: float) -> list[complex]:
    """Points on a circle about the centre."""
    return [
        MIDDLE + cmath.rect(radius, math.radians(first + 360.0 * k / count)) for k in range(count)
    ]


def corners(block: str) -> list[Insert]:
    """A block at all four corners: unchanged, rotated, rotated twice, and mirrored."""
    return [
        Insert(block, (0.0, 0.0)),
        Insert(block, (5.0, 0.0), 90.0),
        Insert(block, (5.0, 5.0), 180.0),
        Insert(block, (0.0, 5.0), 0.0, (1.0, -1.0)),
    ]


def xy(z: complex) -> tuple[float, float]:
    """A complex number as a point."""
    return z.real, z.imag


def logo() -> Sheet:
    """The emblem: a gear as a name plate, five millimetres wide."""
    m = xy(MIDDLE)
    cut: list[Shape] = [
        gear(24, 2.36, 2.1, (0.34, 0.56)),
        Circle(m, 1.9),
        *(Circle(xy(z), 0.15) for z in around(6, 1.56, 30.0)),
        *(Insert("SLOT", m, 60.0 * k) for k in range(6)),
    ]
    tilt = cmath.rect(1.0, math.radians(TILT_DEG))
    wave = [-0.62 - 0.06j, -0.52 + 0.26j, -0.2 + 0.5j, 0j, 0.2 - 0.5j, 0.52 - 0.26j, 0.62 + 0.06j]
    engrave: list[Shape] = [
        Circle(m, 1.22),
        gear(16, 1.1, 0.94, (0.3, 0.56)),
        Ellipse(m, 0.78, 0.56, TILT_DEG),
        Spline([xy(MIDDLE + z * tilt) for z in wave]),
        *(Circle(xy(MIDDLE + side * (0.28 + 0.14j) * tilt), 0.15) for side in (-1.0, 1.0)),
        *corners("BRACKET"),
    ]
    cut += corners("EDGE")
    layers = [Layer("CUT", 5, "#0000ff", cut), Layer("ENGRAVE", 1, "#ff0000", engrave)]
    blocks: dict[str, list[Shape]] = {
        "SLOT": [slot(1.56, 0.1, 15.0)],
        "EDGE": edge(),
        "BRACKET": bracket(),
    }
    return Sheet("camtool emblem", (5.0, 5.0), layers, blocks)


def coupon() -> Sheet:
    """Two parallel lines per axis, joined at one end: their distance shows the axis's backlash.

    They are 2.5 mm apart in X and 1.2 mm in Y, as on the coupon of the PIC machine.
    """
    across_x = Polyline(
        [(1.0, 1.0, 0.0), (1.0, 6.0, 0.0), (3.5, 6.0, 0.0), (3.5, 1.0, 0.0)], False
    )
    across_y = Polyline(
        [(4.5, 2.9, 0.0), (9.0, 2.9, 0.0), (9.0, 4.1, 0.0), (4.5, 4.1, 0.0)], False
    )
    layers = [Layer("X", 5, "#0000ff", [across_x]), Layer("Y", 1, "#ff0000", [across_y])]
    return Sheet("backlash coupon", (10.0, 7.0), layers, {})


def rounded(left: float, low: float, right: float, high: float, radius: float) -> Polyline:
    """A rectangle with round corners, counter-clockwise."""
    quarter = math.tan(math.pi / 8.0)
    corners_of = [
        (right, low, -1.0, 0.0, 0.0, 1.0),
        (right, high, 0.0, -1.0, -1.0, 0.0),
        (left, high, 1.0, 0.0, 0.0, -1.0),
        (left, low, 0.0, 1.0, 1.0, 0.0),
    ]
    vertices = []
    for x, y, before_x, before_y, after_x, after_y in corners_of:
        vertices.append((x + radius * before_x, y + radius * before_y, quarter))
        vertices.append((x + radius * after_x, y + radius * after_y, 0.0))
    return Polyline(vertices)


def straight(points: list[tuple[float, float]], closed: bool = True) -> Polyline:
    """Straight lines through points."""
    return Polyline([(x, y, 0.0) for x, y in points], closed)


def plate() -> Sheet:
    """A front plate, 80 by 50 mm, with a layer for each kind of milling operation."""
    star_points = [
        cmath.rect(6.0 if k % 2 == 0 else 2.6, math.radians(90.0 + 36.0 * k)) + (66.0 + 35.0j)
        for k in range(10)
    ]
    window = [(8, 8), (26, 8), (26, 17), (17, 17), (17, 26), (8, 26)]
    bend = math.tan(math.radians(120.0) / 4.0)
    wave = [(8.0 + 6.0 * k, 42.0, bend if k % 2 else -bend) for k in range(6)]
    layers = [
        Layer("OUTLINE", 5, "#0000ff", [rounded(0.0, 0.0, 80.0, 50.0, 6.0)]),
        Layer("WINDOW", 3, "#00ff00", [straight([(float(x), float(y)) for x, y in window])]),
        Layer(
            "POCKET",
            1,
            "#ff0000",
            [rounded(32.0, 8.0, 56.0, 32.0, 4.0), Circle((44.0, 20.0), 4.0)],
        ),
        Layer("SLOT", 6, "#ff00ff", [rounded(61.0, 8.0, 74.0, 24.0, 2.0)]),
        Layer(
            "HOLES",
            2,
            "#ffff00",
            [Circle((x, y), 1.5) for x, y in ((4, 4), (76, 4), (76, 46), (4, 46))],
        ),
        Layer("LINES", 4, "#00ffff", [Polyline(wave, closed=False)]),
        Layer("SIGN", 7, "#000000", [straight([xy(z) for z in star_points])]),
    ]
    return Sheet("front plate", (80.0, 50.0), layers, {})


def moved(shape: Polyline, x: float, y: float, scale: float = 1.0) -> Polyline:
    """The shape somewhere else, in another size."""
    vertices = [(a * scale + x, b * scale + y, bulge) for a, b, bulge in shape.vertices]
    return Polyline(vertices, shape.closed)


def mount() -> Sheet:
    """A mounting plate, 80 by 50 mm, all of it on one layer: outline, window, slot, four holes."""
    outlines = [
        rounded(0.0, 0.0, 80.0, 50.0, 5.0),
        rounded(14.0, 15.0, 38.0, 35.0, 2.0),
        Polyline([(50.0, 22.0, 0.0), (66.0, 22.0, 1.0), (66.0, 28.0, 0.0), (50.0, 28.0, 1.0)]),
        *(Circle((x, y), 2.5) for x, y in ((7, 7), (73, 7), (73, 43), (7, 43))),
    ]
    return Sheet("mounting plate", (80.0, 50.0), [Layer("0", 7, "#000000", outlines)], {})


def letter_a() -> list[Polyline]:
    """An A, 14 mm high and 12 mm wide."""
    legs = [(0.0, 0.0), (3.2, 0.0), (4.1, 3.0), (7.9, 3.0), (8.8, 0.0), (12.0, 0.0)]
    return [straight([*legs, (7.7, 14.0), (4.3, 14.0)]), straight([(5, 6), (7, 6), (6, 9.5)])]


def letter_d() -> list[Polyline]:
    """A D, 14 mm high and 12 mm wide."""
    outer = [(0.0, 0.0, 0.0), (5.0, 0.0, 1.0), (5.0, 14.0, 0.0), (0.0, 14.0, 0.0)]
    inner = [(3.0, 3.0, 0.0), (5.0, 3.0, 1.0), (5.0, 11.0, 0.0), (3.0, 11.0, 0.0)]
    return [Polyline(outer), Polyline(inner)]


def sign() -> Sheet:
    """A name plate, 60 by 24 mm: an outline, and letters as outlines."""
    letters = [(letter_a(), 9.0), (letter_d(), 24.0), (letter_a(), 39.0)]
    name = [moved(path, x, 5.0) for paths, x in letters for path in paths]
    edge = rounded(0.0, 0.0, 60.0, 24.0, 3.0)
    layers = [Layer("NAME", 7, "#000000", name), Layer("EDGE", 5, "#0000ff", [edge])]
    return Sheet("name plate", (60.0, 24.0), layers, {})


def rose(centre: complex) -> Polyline:
    """A compass rose: long rays to the four quarters, short ones between them."""
    radii = (19.0, 4.6, 11.5, 4.6)
    points = [centre + cmath.rect(radii[k % 4], math.radians(90.0 + 22.5 * k)) for k in range(16)]
    return straight([xy(z) for z in points])


def tray() -> Sheet:
    """A tray for the desk, 110 by 76 mm: a dish, a groove for a pen, a compass rose and a name."""
    letters = [(letter_a(), 72.0), (letter_d(), 81.0), (letter_a(), 89.4)]
    name = [moved(path, x, 20.0, 0.6) for paths, x in letters for path in paths]
    layers = [
        Layer("DISH", 1, "#ff0000", [Circle((36.0, 45.0), 23.0)]),
        Layer("GROOVE", 3, "#00ff00", [Line((17.0, 11.0), (93.0, 11.0))]),
        Layer("CARVED", 7, "#000000", [rose(84.0 + 51.0j), *name]),
        Layer("EDGE", 5, "#0000ff", [rounded(0.0, 0.0, 110.0, 76.0, 12.0)]),
    ]
    return Sheet("tray", (110.0, 76.0), layers, {})


def board() -> Sheet:
    """A circuit board, 40 by 30 mm, as layout programs export it: an outline and holes of 0.8 and
    3.2 mm on one layer."""
    pins = [Circle((11.11 + 2.54 * k, y), 0.4) for y in (10.0, 17.62) for k in range(8)]
    screws = [Circle((x, y), 1.6) for x, y in ((4, 4), (36, 4), (36, 26), (4, 26))]
    edge = rounded(0.0, 0.0, 40.0, 30.0, 2.0)
    layers = [Layer("Edge_Cuts", 2, "#ffff00", [edge, *pins, *screws])]
    return Sheet("circuit board", (40.0, 30.0), layers, {})


def screw() -> Sheet:
    """The half section of a screw of 0.8 mm with a head of 1.2 mm: its axis is Y 0."""
    outline = [(0.0, 0.0), (0.0, 0.32), (-0.08, 0.4), (-2.22, 0.4), (-2.22, 0.6), (-2.6, 0.6)]
    section = Polyline([(x, y, 0.0) for x, y in outline], closed=False)
    return Sheet("screw", (0.0, 0.6), [Layer("SECTION", 7, "#000000", [section])], {})


def star() -> str:
    """The star as CSV."""
    rows = [
        "# The example star of the thesis on the Matlab router (lines 3196-3228 of its text),",
        "# there in tenths of a millimetre, here in mm.",
        "x,y",
        *(f"{x / 10:.1f},{y / 10:.1f}" for x, y in STAR_DECIMILLIMETRES),
    ]
    return "\n".join([*rows, ""])


def main(folder: Path) -> None:
    """Write all samples into the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    texts = {
        "logo.dxf": dxf(logo()),
        "logo.svg": svg(logo()),
        "star.csv": star(),
        "coupon.dxf": dxf(coupon()),
        "plate.dxf": dxf(plate()),
        "mount.dxf": dxf(mount()),
        "mount.svg": svg(mount()),
        "sign.svg": svg(sign()),
        "tray.svg": svg(tray()),
        "board.dxf": dxf(board()),
        "screw.dxf": dxf(screw()),
    }
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="ascii", newline="\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
