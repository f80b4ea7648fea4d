"""Plain drawings are read without ezdxf, and as ezdxf reads them; all others are left to ezdxf."""

from __future__ import annotations

import io
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import ezdxf
import numpy as np
import pytest

from camtool.importers.dxf import load as dxf_load
from camtool.importers.dxf.load import load
from camtool.importers.dxf.plain import PlainDocument
from camtool.importers.dxf.reader import read
from camtool.importers.dxf.shapes import WorldMap
from camtool.importers.options import ReadOptions

OCS = ezdxf.math.OCS


def data_of(document: Any) -> bytes:
    """The bytes of a document."""
    stream = io.StringIO()
    document.write(stream)
    return stream.getvalue().encode("cp1252" if document.dxfversion < "AC1021" else "utf-8")


def drawn(version: str) -> Any:
    """Every kind that is read plainly, with looks, heights, mirrored planes and odd layers."""
    doc = ezdxf.new(version, setup=True, units=4)
    doc.layers.add("CUT", color=3, linetype="DASHED")
    doc.layers.add("FINE", true_color=0x12_34_56)
    doc.layers.add("OFF").off()
    doc.layers.add("ICE").freeze()
    space = doc.modelspace()
    down = {"extrusion": (0, 0, -1)}
    space.add_line((0, 0, 5), (1, 0.5, 5), {"layer": "CUT"})
    for y in range(4):
        space.add_line((0, y), (9, y), {"layer": "cut", "color": 1 + y})
    space.add_line((0, 0), (1, 1), {"layer": "OFF"})
    space.add_line((0, 0), (1, 1), {"layer": "ICE"})
    space.add_circle((3, 4), 2, {"layer": "FINE", "color": 0})
    space.add_circle((3, 4), 1, down)
    space.add_arc((1, 2, 3), 2, 350, 20, dxfattribs={**down, "layer": "DEFPOINTS"})
    space.add_point((7, 8, 9), {"layer": "nowhere", "invisible": 1})
    space.add_point((7, 8))
    if version != "R12":
        space.add_line((5, 5), (6, 6), {"true_color": 0xFF0000, "linetype": "CENTER"})
        space.add_ellipse((0, 0), (3, 1), 0.4, 0.1, 2.0)
        space.add_ellipse((9, 0), (3, 1), 1.0)
        for bulge, count in ((0.0, 3), (0.4, 5), (-1.0, 40)):
            rows = [(k, (k * k) % 7, 0.0, 0.1 * (k == 2), bulge) for k in range(count)]
            closed = space.add_lwpolyline(rows, close=count == 5, dxfattribs={"const_width": 0.0})
            closed.dxf.elevation = bulge
        space.add_spline([(0, 0), (1, 2), (3, 1), (4, 4)])
        space.add_open_spline([(0, 0), (1, 2), (3, 1), (4, 4), (5, 0)])
        space.add_rational_spline([(0, 0), (1, 2), (3, 1), (4, 4)], [1, 2, 1, 1])
    return doc


@pytest.mark.parametrize("version", ["R12", "R2000", "R2004", "R2007", "R2010", "R2018"])
def test_reads_what_ezdxf_reads(version: str, monkeypatch: pytest.MonkeyPatch) -> None:
    data = data_of(drawn(version))
    assert isinstance(load(data, "a.dxf", plain=True).document, PlainDocument)
    plainly = read(data, "a.dxf", ReadOptions())
    monkeypatch.setattr(dxf_load, "plain_document", lambda *_: None)
    assert not isinstance(load(data, "a.dxf", plain=True).document, PlainDocument)
    with np.printoptions(threshold=sys.maxsize, precision=17):
        plain_fields = [repr(each) for each in vars(plainly).values()]
        of_ezdxf = vars(read(data, "a.dxf", ReadOptions())).values()
        assert [repr(each) for each in of_ezdxf] == plain_fields
    assert len(plainly.layers) > 3


def with_text(doc: Any) -> None:
    doc.modelspace().add_text("a")


def with_insert(doc: Any) -> None:
    doc.blocks.new("B").add_line((0, 0), (1, 1))
    doc.modelspace().add_blockref("B", (0, 0))


def with_paper(doc: Any) -> None:
    doc.paperspace().add_line((0, 0), (1, 1))


def with_other_layout(doc: Any) -> None:
    doc.layouts.new("second").add_line((0, 0), (1, 1))


def with_null_extrusion(doc: Any) -> None:
    doc.modelspace()[7].dxf.discard("extrusion")
    doc.modelspace().query("CIRCLE")[0].dxf.__dict__["extrusion"] = ezdxf.math.NULLVEC


def with_odd_colour(doc: Any) -> None:
    doc.modelspace()[0].dxf.__dict__["color"] = 300


def with_odd_layer(doc: Any) -> None:
    doc.modelspace()[0].dxf.__dict__["layer"] = "a/b"


@pytest.mark.parametrize(
    "change",
    [
        with_text,
        with_insert,
        with_paper,
        with_other_layout,
        with_null_extrusion,
        with_odd_colour,
        with_odd_layer,
    ],
)
def test_leaves_to_ezdxf(change: Callable[[Any], None]) -> None:
    doc = drawn("R2010")
    change(doc)
    assert not isinstance(load(data_of(doc), "a.dxf", plain=True).document, PlainDocument)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b"AC1024", b"AC1006"),
        (b"\n 20\n4.0\n", b"\n"),
        (b"\n 40\n2.0\n", b"\n 40\n2.0\n 40\n2.0\n"),
        (b"\n 70\n1\n", b"\n 70\n1.0\n"),
    ],
)
def test_leaves_damaged_files_to_ezdxf(old: bytes, new: bytes) -> None:
    head, entities = data_of(drawn("R2010")).split(b"  2\nENTITIES\n")
    assert old in head + entities
    damaged = (
        head.replace(b"AC1024", b"AC1006" if old == b"AC1024" else b"AC1024")
        + b"  2\nENTITIES\n"
        + entities.replace(old, new)
    )
    document = load(damaged, "a.dxf", plain=True).document
    assert not isinstance(document, PlainDocument)


def test_needs_no_ezdxf() -> None:
    doc = drawn("R2010")
    doc.modelspace().query("SPLINE").first.fit_points = []
    for spline in doc.modelspace().query("SPLINE"):
        if not len(spline.control_points):
            doc.modelspace().delete_entity(spline)
    script = (
        "import sys; from camtool.importers.dxf.reader import read; "
        "from camtool.importers.options import ReadOptions; "
        "read(sys.stdin.buffer.read(), 'a.dxf', ReadOptions()); "
        "print('ezdxf' in sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], input=data_of(doc), capture_output=True, check=True
    )
    assert done.stdout.split() == [b"False"]


@pytest.mark.parametrize("normal", [(0, 0, 1), (0, 0, -1), (0, 0, -3), (1e-5, 2e-5, -1)])
def test_the_arbitrary_axis_is_that_of_ezdxf(normal: tuple[float, float, float]) -> None:
    plane = WorldMap(np.eye(3), np.zeros(3)).plane(normal, 0.0)
    axes = [OCS(normal).to_wcs(axis) for axis in ((1, 0, 0), (0, 1, 0))]
    np.testing.assert_allclose([plane.u, plane.v], [tuple(a)[:2] for a in axes], atol=1e-15)
