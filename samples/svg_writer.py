"""Writes the sample drawings as SVG: mm, arcs as `A`, splines as `C`, layers as in Inkscape."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from shapes import (
    Arc,
    Circle,
    Ellipse,
    Insert,
    Line,
    Point,
    Polyline,
    Shape,
    Sheet,
    Spline,
    number,
)


def svg(sheet: Sheet) -> str:
    """The sheet as SVG.

    Y points down in SVG, so each layer is mirrored and its numbers are those of the DXF.
    """
    width, height = (number(side) for side in sheet.size)
    rows = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"',
        '     xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"',
        f'     width="{width}mm" height="{height}mm" viewBox="0 0 {width} {height}">',
        f"  <title>{sheet.title}</title>",
        "  <defs>",
    ]
    for name, shapes in sheet.blocks.items():
        rows += [f'    <g id="{name}">', *(f"      {_svg(shape)}" for shape in shapes), "    </g>"]
    rows += ["  </defs>"]
    for layer in sheet.layers:
        rows += [
            f'  <g id="{layer.name}" inkscape:groupmode="layer" inkscape:label="{layer.name}"',
            f'     transform="matrix(1 0 0 -1 0 {height})"',
            f'     fill="none" stroke="{layer.colour}" stroke-width="0.03">',
            *(f"    {_svg(shape)}" for shape in layer.shapes),
            "  </g>",
        ]
    return "\n".join([*rows, "</svg>", ""])


def _svg(shape: Shape) -> str:
    """Write a shape as an element; its numbers are in the frame of the DXF."""
    match shape:
        case Line((x1, y1), (x2, y2)):
            a, b, c, d = (number(value) for value in (x1, y1, x2, y2))
            return f'<line x1="{a}" y1="{b}" x2="{c}" y2="{d}"/>'
        case Circle((x, y), radius):
            return f'<circle cx="{number(x)}" cy="{number(y)}" r="{number(radius)}"/>'
        case Arc(centre, radius, start, end):
            sweep = (end - start) % 360.0
            large = int(sweep > 180.0)
            to = _flat(_on_circle(centre, radius, end))
            arc = f"A {number(radius)} {number(radius)} 0 {large} 1 {to}"
            return f'<path d="M {_flat(_on_circle(centre, radius, start))} {arc}"/>'
        case Ellipse((x, y), longer, shorter, turn):
            place = f'cx="{number(x)}" cy="{number(y)}"'
            turned = f'transform="rotate({number(turn)} {number(x)} {number(y)})"'
            return f'<ellipse {place} rx="{number(longer)}" ry="{number(shorter)}" {turned}/>'
        case Polyline(vertices, closed):
            return f'<path d="{_svg_polyline(vertices, closed)}"/>'
        case Spline(control):
            curves = " ".join(_flat(point) for point in control[1:])
            return f'<path d="M {_flat(control[0])} C {curves}"/>'
        case Insert(block, at, turn, scale):
            move = f"translate({_flat(at)}) rotate({number(turn)}) scale({_flat(scale)})"
            return f'<use xlink:href="#{block}" transform="{move}"/>'


def _svg_polyline(vertices: Sequence[tuple[float, float, float]], closed: bool) -> str:
    """Lines and arcs; the radius is chord · (1 + b²) / (4 |b|)."""
    ring = [*vertices, vertices[0]] if closed else list(vertices)
    parts = [f"M {_flat(ring[0][:2])}"]
    for (x1, y1, bulge), (x2, y2, _) in pairwise(ring):
        if not bulge:
            parts.append(f"L {_flat((x2, y2))}")
            continue
        radius = number(math.dist((x1, y1), (x2, y2)) * (1.0 + bulge**2) / (4.0 * abs(bulge)))
        parts.append(f"A {radius} {radius} 0 0 {int(bulge > 0.0)} {_flat((x2, y2))}")
    return " ".join([*parts, "Z"] if closed else parts)


def _on_circle(centre: Point, radius: float, degrees: float) -> Point:
    angle = math.radians(degrees)
    return centre[0] + radius * math.cos(angle), centre[1] + radius * math.sin(angle)


def _flat(point: Sequence[float]) -> str:
    return f"{number(point[0])} {number(point[1])}"
