"""Small drawings with something of everything: what the fuzz tests damage.

Each is bytes under a name whose extension says the format.
"""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

SAMPLES = Path(__file__).parents[2] / "samples"

SVG = b"""<?xml version="1.0" encoding="UTF-8"?>
<!DOCTYPE svg [<!ELEMENT svg ANY>]>
<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"
 xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"
 width="40mm" height="30mm" viewBox="0 0 80 60" preserveAspectRatio="xMidYMid slice">
<style>.cut { stroke: #f00; fill: none } #b { stroke: blue }</style>
<defs><symbol id="s" viewBox="0 0 4 4"><circle cx="2" cy="2" r="1.5"/></symbol>
<clipPath id="c"><rect width="9" height="9"/></clipPath></defs>
<g inkscape:groupmode="layer" inkscape:label="CUT" transform="translate(3 4) rotate(30, 2, 2)">
<path class="cut" d="M1 1 h5 v5 q2 2 4 0 t3-1 c1 1 2 2 3 0 s1-4 3 0 a2 3 20 0 1 4 4 z m1 1 l2 3"/>
<rect id="b" x="1" y="2" width="6" height="4" rx="1" clip-path="url(#c)"/>
<ellipse cx="9" cy="9" rx="3" ry="2" style="stroke:rgb(10%, 20%, 30%)"/></g>
<use xlink:href="#s" x="20" y="10" width="8" height="6" transform="matrix(1 .2 -.3 1 0 0)"/>
<svg x="30" y="5" width="50%" height="20"><polyline points="0,0 3,4 5 6"/>
<polygon points="1 1 4 1 4 5"/><line x1="1" y1="1" x2="1e1" y2="3"/></svg>
<text x="3" y="3">words</text>
</svg>
"""

CSV = b"x;y\n1,5;2,5\n3,5;4,0\n\n0;0\n1;0\n1;1\n0;0\n"

ROUTER = b"""xy=[0 100 100;
0 0 80];
lxy=[100 0;
0 80];
velxy=[480 0;
0 480];
size_of_array=2;
first_pointx=0;
first_pointy=0;
"""


def dxf(version: str = "R2010", *, binary: bool = False) -> bytes:
    """A DXF with an entity of most kinds."""
    import ezdxf

    document = ezdxf.new(version, units=0 if version == "R12" else 4, setup=True)
    space: Any = document.modelspace()
    block: Any = document.blocks.new("B")
    inner: Any = document.blocks.new("INNER")
    inner.add_circle((1, 1), 0.5)
    block.add_blockref("INNER", (2, 2), dxfattribs={"xscale": 2, "yscale": 1})
    block.add_polyline2d([(0, 0, 0), (3, 0, 0.5), (3, 2, 0)], format="xyb", close=True)
    space.add_line((0, 0), (10, 5))
    space.add_arc((5, 5), 3, 20, 250)
    space.add_circle((0, 0, 0), 4, dxfattribs={"extrusion": (0, 0, -1)})
    space.add_polyline2d([(0, 0, 0), (4, 1, 0.3), (6, 6, 0)], format="xyb")
    space.add_polyline3d([(0, 0, 1), (4, 1, 1), (6, 6, 1)])
    space.add_text("words", height=2.0)
    space.add_point((7, 7))
    space.add_solid([(0, 0), (1, 0), (0, 1), (1, 1)])
    space.add_blockref(
        "B", (9, 9), dxfattribs={"rotation": 30, "column_count": 3, "column_spacing": 5}
    )
    if version != "R12":
        space.add_lwpolyline([(0, 0, 1, 1, 0.5), (3, 0, 1, 2, 0), (3, 2, 0, 0, 0)], format="xyseb")
        space.add_ellipse((1, 2), (4, 1), 0.4, 0.3, 5.0)
        space.add_spline(degree=3).control_points = [(0, 0), (2, 4), (4, -4), (6, 0), (8, 3)]
        space.add_spline([(0, 0), (2, 1), (3, 5)])
        space.add_rational_spline([(0, 0), (2, 4), (4, -4), (6, 0)], [1, 2, 2, 1])
        space.add_mtext("more\\Pwords", dxfattribs={"char_height": 1.0})
        hatch = space.add_hatch()
        hatch.paths.add_polyline_path([(0, 0), (5, 0, 0.2), (5, 5)], is_closed=True)
        edges = hatch.paths.add_edge_path()
        edges.add_arc((2, 2), 1, 0, 360)
        space.add_mline([(0, 0), (5, 5), (9, 2)])
        space.add_linear_dim(base=(3, 8), p1=(0, 0), p2=(6, 0)).render()
    if binary:
        stream = io.BytesIO()
        document.write(stream, fmt="bin")
        return stream.getvalue()
    text = io.StringIO()
    document.write(text)
    return text.getvalue().encode("utf-8", errors="surrogateescape")


def numpy_file() -> bytes:
    """An array (4, 2) as .npy."""
    stream = io.BytesIO()
    np.save(stream, np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 3.0], [0.0, 0.0]]))
    return stream.getvalue()


def numpy_archive() -> bytes:
    """Two arrays as .npz."""
    stream = io.BytesIO()
    np.savez(stream, a=np.array([[0.0, 0.0], [2.0, 1.0]]), b=np.zeros((3, 2)))
    return stream.getvalue()


def _sample(name: str) -> Callable[[], bytes]:
    return (SAMPLES / name).read_bytes


def _board(name: str) -> Callable[[], bytes]:
    """Return the function that unpacks a file of the sample's board."""
    return lambda: zipfile.ZipFile(SAMPLES / "led.zip").read(name)


TEXTS: dict[str, Callable[[], bytes]] = {
    "r12.dxf": lambda: dxf("R12"),
    "r2010.dxf": dxf,
    "logo.dxf": _sample("logo.dxf"),
    "every.svg": lambda: SVG,
    "logo.svg": _sample("logo.svg"),
    "star.csv": _sample("star.csv"),
    "decimal.csv": lambda: CSV,
    "points.json": lambda: json.dumps([[[0, 0], [1.5, 2], [3, 0]], [[5, 5], [6, 6]]]).encode(),
    "router.m": lambda: ROUTER,
    "copper.gtl": _board("led-F_Cu.gtl"),
    "edge.gm1": _board("led-Edge_Cuts.gm1"),
    "holes.drl": _board("led.drl"),
}
"""Seeds that consist of lines."""


def png() -> bytes:
    """A dark square on white."""
    from PIL import Image

    picture = Image.new("L", (24, 20), 255)
    picture.paste(0, (6, 5, 18, 15))
    file = io.BytesIO()
    picture.save(file, "PNG", dpi=(96, 96))
    return file.getvalue()


BINARIES: dict[str, Callable[[], bytes]] = {
    "binary.dxf": lambda: dxf("R2010", binary=True),
    "array.npy": numpy_file,
    "arrays.npz": numpy_archive,
    "led.zip": _sample("led.zip"),
    "square.png": png,
}
"""Seeds that do not."""
