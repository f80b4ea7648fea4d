"""Every way to place a shape in an SVG, against the extents that resvg gives it.

Four axes: how the page is sized, how the shape is reached (groups, use, symbol, inner svg), its
transform, and the shape. `overflow="visible"` stands where frames would clip, which is not applied
here. What we read is written as one plain polygon in px and rendered as well, so that pixels round
the same way in both: their extents, at ZOOM times the page's size, and their ink are the same.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from camtool.geometry.polylines import Polyline, Segments
from camtool.importers.options import ReadOptions
from camtool.importers.svg.reader import read
from tests.oracles.svg_ink import ink

ZOOM = 10
NEAR_PX = 0.1
"""Largest difference of extents; half a pixel of the magnified picture is half of it."""

EDGE_SHARE = 0.01
EDGE_PIXELS = 100
"""So much ink may differ: pixels whose centres lie on the edge, more than extents would show."""

STEPS = 128
"""Points of each segment; so many of an arc of 100 px lie within 0.01 px of it."""

PX_PER_MM = 96.0 / 25.4
NAMES = 'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'


ALIGNS = [f"x{x}Y{y}" for x in ("Min", "Mid", "Max") for y in ("Min", "Mid", "Max")]

# The attributes of the root, and the height of the page in px.
PAGES = [
    ('width="120" height="90"', 90.0),
    ('width="30mm" height="25mm"', 25.0 * PX_PER_MM),
    ('width="3cm" height="1in" viewBox="0 0 100 100"', 96.0),
    ('width="90pt" height="5pc" viewBox="-10 5 100 80"', 80.0),
    ('width="120px" height="100" viewBox="0 0 60 60" preserveAspectRatio="none"', 100.0),
    ('viewBox="0 0 110 90"', 90.0),
    ('width="100" viewBox="10 10 80 60"', 75.0),
    ('height="90" viewBox="-5 -5 100 90"', 90.0),
    ('width="7em" height="14ex" viewBox="0 0 100 100"', 112.0),
    *(
        (f'width="{w}" height="{h}" viewBox="3 4 100 90" preserveAspectRatio="{align}{how}"', h)
        for (w, h), align, how in [
            *itertools.product([(130, 60)], ALIGNS, ["", " slice"]),
            *itertools.product([(50, 120)], ALIGNS, [" meet"]),
        ]
    ),
]

TRANSFORMS = [
    "",
    "translate(12 7)",
    "translate(9)",
    "scale(1.5)",
    "scale(.7 1.3)",
    "scale(-1 1) translate(-90)",
    "rotate(30)",
    "rotate(-25 40 30)",
    "rotate(90,40,40)",
    "skewX(20)",
    "skewY(-15) translate(0 15)",
    "matrix(.8 .3 -.2 1.1 14 3)",
    "translate(50,40)rotate(45)scale(.6,.9)translate(-50 -40)",
    "matrix(0 1 1 0 0 0)",
]

# resvg draws arcs as Béziers within 0.1 of a user unit, so theirs are small units.
SHAPES = {
    "rect": '<rect x="20" y="15" width="30" height="22"/>',
    "round": '<rect x="22" y="12" width="31" height="20" rx="6" ry="9"/>',
    "circle": '<circle cx="38" cy="33" r="15.5"/>',
    "ellipse": '<ellipse cx="40" cy="30" rx="21" ry="9"/>',
    "polygon": '<polygon points="20,20 55,24 41,47"/>',
    "path": '<path d="M20 30c5-22 20-18 26 2s-9 21-18 9q-7-8-8-11z"/>',
    "arcs": '<path transform="scale(.1)" d="M250 250a180 90 30 11200 50a70 70 0 00-200-50z"/>',
    "percent": '<rect x="20%" y="15%" width="25%" height="30%"/>',
    "round_percent": '<circle cx="40%" cy="35%" r="12%"/>',
    "units": '<rect x="5mm" y=".4cm" width=".3in" height="15pt" rx=".5em"/>',
}

# {0}: the shape, {1}: a transform attribute.
WAYS = {
    "plain": "<g {1}>{0}</g>",
    "nested": '<g transform="translate(4 3)"><a><g {1}>'
    '<g transform="scale(.9)">{0}</g></g></a></g>',
    "use": '<defs><g id="s">{0}</g></defs><use href="#s" x="6" y="4" {1}/>',
    "old use": '<g id="s" display="none"/><defs><g id="t" {1}>{0}</g></defs>'
    '<use xlink:href="#t" x="-3" y="5"/>',
    "use of use": '<defs><g id="s" {1}>{0}</g><use id="t" href="#s" x="3" transform="scale(.8)"/>'
    '</defs><use href="#t" y="7" transform="rotate(5)"/>',
    "inner svg": '<g {1}><svg x="8" y="6" width="70" height="50" viewBox="0 0 80 70" '
    'overflow="visible">{0}</svg></g>',
    "inner svg slice": '<g {1}><svg x="5" y="2" width="60" height="60" viewBox="5 5 90 60" '
    'overflow="visible" preserveAspectRatio="xMinYMax slice">{0}</svg></g>',
    "inner svg bare": '<svg x="5%" y="4" overflow="visible" width="80%" height="60"><g {1}>{0}</g>'
    "</svg>",
    "inner svg percent": '<svg width="90%" height="80%" viewBox="0 0 90 90" overflow="visible" '
    'preserveAspectRatio="xMaxYMid"><g {1}>{0}</g></svg>',
    "use of svg": '<defs><svg id="s" x="5" y="6" width="30" height="20" viewBox="0 0 60 60" '
    'overflow="visible">{0}</svg></defs><use href="#s" x="4" width="60" height="55" {1}/>',
    "use of svg as it is": '<defs><svg id="s" x="5" y="6" width="60" height="40" '
    'viewBox="0 0 70 60" overflow="visible">{0}</svg></defs><use href="#s" x="4" {1}/>',
    "symbol": '<symbol id="s" viewBox="0 0 60 50" overflow="visible">{0}</symbol>'
    '<use href="#s" x="9" y="5" width="62" height="44" {1}/>',
    "symbol none": '<symbol id="s" viewBox="5 5 60 50" preserveAspectRatio="none" '
    'overflow="visible">{0}</symbol><use href="#s" width="80" height="44" {1}/>',
    "symbol whole": '<symbol id="s" overflow="visible">{0}</symbol><use href="#s" x="3" {1}/>',
    "symbol in symbol": '<symbol id="s" viewBox="0 0 60 50" overflow="visible">{0}</symbol>'
    '<symbol id="t" overflow="visible"><use href="#s" width="50" height="55" {1}/></symbol>'
    '<use href="#t" x="4" y="3" width="90" height="80"/>',
    "switch": '<switch><g systemLanguage="xx">{0}</g><g {1}>{0}</g><rect width="99"/></switch>',
    "origin": '<g {1} transform-origin="30 25">{0}</g>',
}

Case = tuple[tuple[str, float], str, str, str]

PAIRS: list[Case] = [
    (page, way, TRANSFORMS[(3 * i + 5 * j) % len(TRANSFORMS)], list(SHAPES)[(i + j) % len(SHAPES)])
    for (i, page), (j, way) in itertools.product(enumerate(PAGES), enumerate(WAYS))
]
"""Each page with each way."""

TURNED: list[Case] = [
    (PAGES[(7 * k + i) % len(PAGES)], way, transform, list(SHAPES)[(i + j + 3 * k) % len(SHAPES)])
    for (i, way), (j, transform), k in itertools.product(
        enumerate(WAYS), enumerate(TRANSFORMS), range(3)
    )
]
"""Each way with each transform, of three shapes."""


def is_fair(case: Case) -> bool:
    """resvg takes percentages in a symbol of the page, and the standard of the symbol."""
    return not (case[1].startswith("symbol") and "percent" in case[3])


def plain(vertices: np.ndarray, tall_px: float, canvas: tuple[float, float]) -> str:
    """An SVG of a closed path of ours without any transform: its points in px, on that canvas."""
    segments = Segments.of(Polyline(vertices, closed=True))
    share = np.linspace(0.0, 1.0, STEPS, endpoint=False)
    rows = [a + np.outer(share, b - a) for a, b in zip(segments.start, segments.end, strict=True)]
    for index in np.flatnonzero(segments.is_arc):
        angle = segments.start_angle[index] + share * segments.sweep[index]
        circle = np.column_stack([np.cos(angle), np.sin(angle)]) * segments.radius[index]
        rows[index] = segments.centre[index] + circle
    points = np.concatenate(rows) * PX_PER_MM
    text = " ".join(f"{x:.6f},{tall_px - y:.6f}" for x, y in points)
    size = f'width="{canvas[0]}" height="{canvas[1]}"'
    return f'<svg {NAMES} {size}><polygon points="{text}"/></svg>'


def assert_as_rendered(case: Case) -> bool:
    """Compares one case; whether there was ink to compare."""
    (page, tall), way, transform, shape = case
    attribute = f'transform="{transform}"' if transform else ""
    svg = f"<svg {NAMES} {page}>{WAYS[way].format(SHAPES[shape], attribute)}</svg>"
    theirs = ink(svg, ZOOM)
    (path,) = read(svg.encode(), "case.svg", ReadOptions(tolerance_mm=0.001)).paths
    ours = ink(plain(path.vertices, tall, theirs.canvas), ZOOM)
    assert ours.canvas == theirs.canvas
    assert (ours.inked ^ theirs.inked).sum() <= EDGE_SHARE * theirs.inked.sum() + EDGE_PIXELS, svg
    if ours.extents is None or theirs.extents is None:
        return False
    np.testing.assert_allclose(ours.extents, theirs.extents, atol=NEAR_PX + 1e-9, err_msg=svg)
    return True


def test_a_sample_is_where_resvg_draws_it() -> None:
    sample = [case for case in [*PAIRS[::62], *TURNED[::74]] if is_fair(case)]
    inked = sum(assert_as_rendered(case) for case in sample)
    assert inked > 0.8 * len(sample)


@pytest.mark.slow
@pytest.mark.parametrize("way", WAYS)
def test_all_are_where_resvg_draws_them(way: str) -> None:
    cases = [case for case in [*PAIRS, *TURNED] if case[1] == way and is_fair(case)]
    inked = sum(assert_as_rendered(case) for case in cases)
    assert inked > 0.8 * len(cases)


def test_the_comparison_can_fail(monkeypatch: pytest.MonkeyPatch) -> None:
    case: Case = (PAGES[0], "plain", "", "rect")
    assert assert_as_rendered(case)
    monkeypatch.setitem(WAYS, "plain", '<g transform="translate(0 0)"><g {1}>{0}</g></g>')
    assert assert_as_rendered(case)
    for wrong in (('width="120" height="90"', 90.2), ('width="120" height="90"', 89.8)):
        with pytest.raises(AssertionError):
            assert_as_rendered((wrong, *case[1:]))
