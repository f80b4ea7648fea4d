"""Writes led.zip: Gerber and Excellon of a board with two LEDs, as a fabricator gets them.

    python samples/make_led.py [FOLDER]

Every run writes the same bytes. The copper is a pour (GND) with three nets in it, which stand in
cleared channels of 0.4 mm; the board is 24 × 14 mm with round corners.
"""

from __future__ import annotations

import io
import sys
import zipfile
from collections.abc import Iterable
from pathlib import Path

Point = tuple[float, float]

HEAD = "%TF.FileFunction,{function}*%\n%FSLAX46Y46*%\n%MOMM*%\n%LPD*%\n"
APERTURES = "%ADD10C,0.6*%\n%ADD11C,1.4*%\n%ADD12C,2.6*%\n%ADD13C,1.8*%\n%ADD14R,1.5X1.5*%\n"
TRACK, CHANNEL = 0.6, 1.4
"""Widths of tracks and of the channels that are cleared around them (apertures 10 and 11)."""

PADS: dict[str, list[Point]] = {
    "VCC": [(3.0, 11.0), (9.0, 11.0), (15.0, 11.0)],
    "A": [(9.0, 7.0), (13.0, 3.5)],
    "B": [(15.0, 7.0), (20.0, 3.5)],
    "GND": [(3.0, 3.5), (16.0, 3.5), (21.5, 11.0)],
}
TRACKS: list[list[Point]] = [
    [(3.0, 11.0), (15.0, 11.0)],
    [(9.0, 7.0), (9.0, 5.0), (10.5, 3.5), (13.0, 3.5)],
    [(15.0, 7.0), (17.5, 7.0), (20.0, 4.5), (20.0, 3.5)],
]


def at(point: Point) -> str:
    """Coordinates in millionths of a mm."""
    return f"X{round(point[0] * 1e6)}Y{round(point[1] * 1e6)}"


def drawn(aperture: int, lines: Iterable[list[Point]]) -> str:
    """Strokes with an aperture."""
    rows = [f"D{aperture}*"]
    for line in lines:
        rows.append(f"{at(line[0])}D02*")
        rows += [f"{at(point)}D01*" for point in line[1:]]
    return "\n".join(rows) + "\n"


def flashed(aperture: int, points: Iterable[Point]) -> str:
    """Pads with an aperture."""
    return "\n".join([f"D{aperture}*", *(f"{at(point)}D03*" for point in points)]) + "\n"


def copper() -> str:
    """The copper of the top: a pour, channels cleared in it, pads and tracks."""
    corners = [(0.5, 0.5), (23.5, 0.5), (23.5, 13.5), (0.5, 13.5), (0.5, 0.5)]
    pour = "G36*\nG01*\n" + f"{at(corners[0])}D02*\n"
    pour += "".join(f"{at(point)}D01*\n" for point in corners[1:]) + "G37*\n"
    own = [point for net, points in PADS.items() if net != "GND" for point in points]
    text = HEAD.format(function="Copper,L1,Top") + APERTURES + pour
    text += "%LPC*%\n" + drawn(11, TRACKS) + flashed(12, own)
    square = [PADS["VCC"][0]]
    text += "%LPD*%\n" + drawn(10, TRACKS)
    text += flashed(13, [point for point in own if point not in square]) + flashed(14, square)
    return text + "M02*\n"


def outline() -> str:
    """The outline: lines and arcs of 1 mm radius."""
    text = HEAD.format(function="Profile,NP") + "%ADD10C,0.1*%\nG75*\nD10*\nG01*\n"
    text += at((1.0, 0.0)) + "D02*\n"
    for straight, end, (i, j) in (
        ((23.0, 0.0), (24.0, 1.0), (0.0, 1.0)),
        ((24.0, 13.0), (23.0, 14.0), (-1.0, 0.0)),
        ((1.0, 14.0), (0.0, 13.0), (0.0, -1.0)),
        ((0.0, 1.0), (1.0, 0.0), (1.0, 0.0)),
    ):
        text += f"G01*\n{at(straight)}D01*\nG03*\n"
        text += f"{at(end)}I{round(i * 1e6)}J{round(j * 1e6)}D01*\n"
    return text + "M02*\n"


def drills() -> str:
    """Holes of 0.8 mm in all pads, and two of 2.2 mm for screws."""
    text = "M48\nMETRIC,TZ\nT1C0.800\nT2C2.200\nG90\nG05\n%\nT1\n"
    text += "".join(f"X{x:.3f}Y{y:.3f}\n" for points in PADS.values() for x, y in points)
    return text + "T2\nX6.000Y7.000\nX21.500Y7.000\nM30\n"


def archive() -> bytes:
    """The ZIP archive, with fixed times."""
    files = {"led-F_Cu.gtl": copper(), "led-Edge_Cuts.gm1": outline(), "led.drl": drills()}
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_STORED) as made:
        for name, text in files.items():
            made.writestr(zipfile.ZipInfo(name, (2026, 1, 1, 0, 0, 0)), text)
    return data.getvalue()


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    (folder / "led.zip").write_bytes(archive())
