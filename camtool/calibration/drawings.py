"""A sheet of coupons as DXF and as SVG: mm, the same bytes every time."""

from __future__ import annotations

import io
import math
from itertools import pairwise

from camtool.calibration.coupons import Path, Sheet

COLOUR = 5
"""Index of the colour of all lines in DXF: blue."""

DECIMALS = 9
"""Of numbers in SVG."""


def dxf(sheet: Sheet) -> bytes:
    """The sheet as DXF R2000, each path an LWPOLYLINE."""
    from ezdxf._options import options
    from ezdxf.filemanagement import new
    from ezdxf.units import MM

    # Without dates and GUIDs; the option is the library's own, so it is put back.
    before = options.write_fixed_meta_data_for_testing
    options.write_fixed_meta_data_for_testing = True
    try:
        document = new("R2000", units=MM)
        space = document.modelspace()
        for path in sheet.paths:
            if path.layer not in document.layers:
                document.layers.add(path.layer, color=COLOUR)
            space.add_lwpolyline(
                path.vertices,
                format="xyb",
                close=path.closed,
                dxfattribs={"layer": path.layer},
            )
        text = io.StringIO(newline="\n")
        document.write(text)
    finally:
        options.write_fixed_meta_data_for_testing = before
    return text.getvalue().encode("cp1252")


def svg(sheet: Sheet) -> bytes:
    """The sheet as SVG, Y up by the transform of its only group."""
    width, height = (_number(side) for side in sheet.size)
    rows = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<svg xmlns="http://www.w3.org/2000/svg"',
        f'     width="{width}mm" height="{height}mm" viewBox="0 0 {width} {height}">',
        f'  <g id="{sheet.kind}" transform="matrix(1 0 0 -1 0 {height})"',
        f'     fill="none" stroke="#0000ff" stroke-width="{_number(min(sheet.size) / 500.0)}">',
        *(f'    <path d="{_path(path)}"/>' for path in sheet.paths),
        "  </g>",
        "</svg>",
        "",
    ]
    return "\n".join(rows).encode()


def _path(path: Path) -> str:
    """Lines and arcs; an arc's radius is chord · (1 + b²) / (4 |b|)."""
    ring = [*path.vertices, path.vertices[0]] if path.closed else list(path.vertices)
    x, y, _ = ring[0]
    parts = [f"M {_number(x)} {_number(y)}"]
    for (x1, y1, bulge), (x2, y2, _) in pairwise(ring):
        to = f"{_number(x2)} {_number(y2)}"
        if not bulge:
            parts.append(f"L {to}")
            continue
        radius = math.dist((x1, y1), (x2, y2)) * (1.0 + bulge**2) / (4.0 * abs(bulge))
        parts.append(f"A {_number(radius)} {_number(radius)} 0 0 {int(bulge > 0.0)} {to}")
    return " ".join([*parts, "Z"] if path.closed else parts)


def _number(value: float) -> str:
    text = f"{value:.{DECIMALS}f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text
