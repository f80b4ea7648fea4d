"""Slots as wide as the tool, where the region of its middle is a line and has no area.

With a tool thinner by a hair the region of the middle is a band as thin as that hair. What of it
lies beyond the region of the true tool is a slot. Of the hairs that show all of the slots the
thinnest is taken, so that the band is the middle of the slot as near as can be.
"""

from __future__ import annotations

import numpy as np

from camtool.geometry.distance import nearest
from camtool.geometry.measure import length, sample
from camtool.geometry.offset import offset_shape
from camtool.geometry.polylines import Floats, Polyline, Polylines, Segments
from camtool.planning.contours.along import Along
from camtool.planning.pockets.clip import outside_parts

SLOT_TOLERANCE = 1e-3
"""A slot narrower than the tool by up to this part of its diameter counts as wide as the tool."""

HAIRS = (1e-5, 1e-4, 3e-4, SLOT_TOLERANCE)
"""Parts of the diameter by which the tool is taken thinner, in turn."""

ALL_OF_IT = 0.98
"""A thinner hair is taken when it shows this part of the length that the tolerance shows."""

BEYOND = 3.0
"""How far from the region of the true tool a slot begins, in hairs: sharp corners reach out."""

SLOT_LEAST = 0.5
"""The shortest band, all round, that counts as a slot, over the tool's diameter."""

STEPS = 200
"""In how many places a band is measured."""


def slot_ways(region: Polylines, tool_radius_mm: float) -> list[Floats]:
    """(n, 3) x, y, bulge: open paths along the middles of slots as wide as the tool."""
    diameter = 2.0 * tool_radius_mm
    widest = _bands(region, tool_radius_mm, SLOT_TOLERANCE * diameter)
    if not widest:
        return []
    whole = sum(length(path) for path in widest)
    for hair in HAIRS:
        bands = _bands(region, tool_radius_mm, hair * diameter)
        if sum(length(path) for path in bands) >= ALL_OF_IT * whole:
            break
    ways: list[Polyline] = []
    for band in bands:
        if not _covered(band, ways, BEYOND * hair * diameter):
            ways.append(_once(band, BEYOND * hair * diameter))
    return [_without_specks(way.vertices, BEYOND * hair * diameter) for way in ways]


def _bands(region: Polylines, radius: float, hair_mm: float) -> list[Polyline]:
    """The edges of the bands that a tool thinner by a hair shows beyond the true tool's region."""
    thinner = offset_shape(region, radius - hair_mm)
    true = offset_shape(region, radius)
    if len(true):
        edges = outside_parts(thinner, offset_shape(true, -BEYOND * hair_mm))
    else:
        edges = list(thinner)
    return [path for path in edges if length(path) >= 2.0 * SLOT_LEAST * radius]


def _covered(path: Polyline, others: list[Polyline], near_mm: float) -> bool:
    """Whether all of a path runs beside others: it is the other edge of a band."""
    if not others:
        return False
    points = sample(path, length(path) / STEPS)
    return bool((nearest(points, Segments.of(Polylines.of(others))).distance <= near_mm).all())


def _once(band: Polyline, near_mm: float) -> Polyline:
    """An open path along a band: one side of it where the other one is beside it; else round."""
    if not band.closed:
        return band
    along = Along.of(band)
    half = 0.5 * along.total_mm
    at = np.arange(STEPS) / STEPS * half
    begin = float(at[np.hypot(*(along.at(at) - along.at(at + half)).T).argmax()])
    one = Polyline(along.piece(begin, begin + half))
    other = Polyline(along.piece(begin + half, begin + 2.0 * half))
    if _covered(other, [one], near_mm):
        return one
    return Polyline(along.piece(begin, begin + 2.0 * half))


def _without_specks(vertices: Floats, speck_mm: float) -> Floats:
    """An open path (n, 3) without segments as short as a band is wide: they lead across it."""
    step = np.hypot(*np.diff(vertices[:, :2], axis=0).T)
    return np.asarray(vertices[np.concatenate([step > speck_mm, [True]])])
