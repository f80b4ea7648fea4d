"""Leads: the tool comes to a contour and leaves it along its tangent, or in a quarter arc.

      line                    arc                   T  the direction of travel at the contour
                                   ╭── C            n  the free side, away from what is to stay
    ──────▶ P ═══ T ══▶            │                C  = P + n R, the arc's centre; it begins at
                              ╰────P ═══ T ══▶         C − T R and ends at P along T

A lead may lie where the tool does no harm: nowhere on the other side of the contour, on which the
material is that is to stay, and nowhere nearer to other wanted lines than the tool's radius (and
the allowance, where the operation leaves one on them). Both
are decided exactly: cut where it meets the contour, each of its pieces lies on one side, and so
its midpoint shows which. A lead that does not fit is halved, and at last left out."""

from __future__ import annotations

import math

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, distinct
from camtool.findings import Finding
from camtool.geometry.distance import nearest, paired_distances, points_to_segments
from camtool.geometry.intersect import crossings
from camtool.geometry.measure import Frames, dot, point_at, signed_area
from camtool.geometry.nesting import inside
from camtool.geometry.polylines import POSITION_EPS_MM, Polyline, Polylines, Segments
from camtool.planning.findings import LEAD_LEFT_OUT, LEAD_LEFT_OUT_IN_PART
from camtool.planning.items import Contour
from camtool.planning.job import Lead
from camtool.planning.naming import at_place
from camtool.planning.paths import QUARTER, MeasuredPath, reverse_vertices

LEAD_SLACK_MM = 1e-5
"""A lead may come nearer to wanted material than the tool's radius by this much."""

LEAD_HALVINGS = 4
"""A lead that does not fit is halved this many times before it is left out."""


class KeepOut(Struct, frozen=True, eq=False):
    """The closed `lines` that leads must leave alone; the operation leaves its allowance on those
    that are its `own` (M,)."""

    lines: Polylines
    own: Bools


class Border(Struct, frozen=True, eq=False):
    """The limits of a contour's leads: `line`, the contour, with the tool free on its left or
    right (`free_left`; None: nowhere); `keep_out`, from which they stay `reach_mm` away, and
    `allowance_mm` (possibly negative) farther from the operation's own lines."""

    line: Polyline
    free_left: bool | None
    keep_out: KeepOut
    reach_mm: float
    allowance_mm: float

    @classmethod
    def of(cls, contour: Contour, keep_out: KeepOut) -> Border:
        """Return the border of a contour."""
        line, material_left = contour.path, contour.material_left
        if contour.outline is not None:
            line = contour.outline
            material_left = (
                None if material_left is None else material_left != runs_back(line, contour.path)
            )
        operation = contour.setting.operation
        return cls(
            line,
            None if material_left is None else not material_left,
            keep_out,
            operation.wall_radius_mm,
            operation.allowance_mm,
        )

    def near(self, place: Floats, size_mm: float) -> Segments:
        """Return the segments from which a lead of this size at a place (2,) of the contour must
        keep away.

        An engraved contour's own cut there does not count."""
        reach = 2.0 * size_mm + self.reach_mm + max(self.allowance_mm, 0.0)
        near_lines = segments_near(self.keep_out.lines, place, reach)
        if self.free_left is None and len(near_lines):
            cut = points_to_segments(place[None], near_lines)[0] < self.reach_mm
            near_lines = near_lines[~np.isin(near_lines.path, near_lines.path[cut])]
        return near_lines

    def allows(self, lead: Segments, near_segments: Segments) -> bool:
        """Return True if the tool cuts no wanted material along this single line or arc."""
        distance, _ = paired_distances(
            lead[np.zeros(len(near_segments), dtype=np.int64)], near_segments
        )
        distances_wanted = self.reach_mm + np.where(
            self.keep_out.own[near_segments.path], self.allowance_mm, 0.0
        )
        is_far = bool((distance >= distances_wanted - LEAD_SLACK_MM).all())
        return is_far and (self.free_left is None or self._is_beside(lead))

    def _is_beside(self, lead: Segments) -> bool:
        """Return True if the whole lead lies on the free side of the contour."""
        common = crossings(lead, Segments.of(self.line))
        parts = distinct(np.concatenate([[0.0, 1.0], common.ta]))
        rows = np.zeros(len(parts) - 1, dtype=np.int64)
        distances = signed_distances(
            self.line, point_at(lead, rows, 0.5 * (parts[:-1] + parts[1:]))
        )
        return bool(((distances if self.free_left else -distances) >= -LEAD_SLACK_MM).all())


class Leads(Struct, frozen=True, eq=False):
    """The lead-in and the lead-out of a contour, (k, 3) x, y, bulge, k = 0 or 2, each including
    the place at the contour; and findings about leads that did not fit."""

    way_in: Floats
    way_out: Floats
    findings: tuple[Finding, ...]


NO_LEADS = Leads(np.empty((0, 3)), np.empty((0, 3)), ())
"""No leads: the tool goes down and up at the contour itself."""


def leads_of(
    contour: Contour, along: MeasuredPath, ends: tuple[float, float], keep_out: KeepOut
) -> Leads:
    """Return the leads of a contour that is cut along `along` between two lengths, its `ends`."""
    operation = contour.setting.operation
    if operation.lead_in.kind == operation.lead_out.kind == "none":
        return NO_LEADS
    border = Border.of(contour, keep_out)
    side = contour.material_left
    if side is not None and runs_back(contour.path, along.path):
        side = not side
    findings: list[Finding] = []
    leads_made = []
    for name, lead, length, sign in (
        ("lead-in", operation.lead_in, ends[0], -1.0),
        ("lead-out", operation.lead_out, ends[1], 1.0),
    ):
        place = along.at(np.array([length]))[0]
        heading = (
            sign * (along.directions if sign < 0.0 else along.arrivals)(np.array([length]))[0]
        )
        vertices, size = _longest_lead(lead, (place, heading), _lead_bulge(sign, side), border)
        if size < lead.length_mm and lead.kind != "none":
            findings.append(
                _shortened_finding(name, lead, size, at_place(contour.name, place.tolist()))
            )
        leads_made.append(reverse_vertices(vertices) if sign < 0.0 else vertices)
    return Leads(leads_made[0], leads_made[1], tuple(findings))


def _lead_bulge(sign: float, material_left: bool | None) -> float:
    """Return the bulge of a lead seen from the contour outwards: a quarter arc to the free side.

    What is free on the right of the travel is on the right of a lead-out, and on the left of a
    lead-in, which is seen backwards."""
    if material_left is None:
        return 0.0
    return QUARTER * (-sign if material_left else sign)


def _longest_lead(
    lead: Lead, place_and_heading: tuple[Floats, Floats], bulge: float, border: Border
) -> tuple[Floats, float]:
    """Return the longest permitted lead, as it leaves its place at the contour, and its
    size, mm."""
    place, heading = place_and_heading
    near_segments = border.near(place, lead.length_mm)
    size = lead.length_mm
    for _ in range(LEAD_HALVINGS + 1 if lead.kind != "none" else 0):
        end, bend = place + size * heading, 0.0
        if lead.kind == "arc" and bulge != 0.0:
            normal = np.array([-heading[1], heading[0]])
            end, bend = end + math.copysign(size, bulge) * normal, bulge
        lead_segments = Segments.between(place[None], end[None], np.array([bend]))
        if size > POSITION_EPS_MM and border.allows(lead_segments, near_segments):
            return np.array([[*place, bend], [*end, 0.0]]), size
        size *= 0.5
    return np.empty((0, 3)), 0.0


def runs_back(path: Polyline, other: Polyline) -> bool:
    """Return True if `other`, which is the path or a part of it, runs in the opposite
    direction."""
    other_along = MeasuredPath.of(other)
    middle = 0.5 * other_along.reach[1:2]
    point, heading = other_along.at(middle), other_along.directions(middle)
    segments = Segments.of(path)
    row = points_to_segments(point, segments).argmin(axis=1)
    frame = Frames.of(segments[row])
    own_heading = frame.tangent_at(frame.along(point) / frame.length)
    return bool(dot(own_heading, heading)[0] < 0.0)


def segments_near(lines: Polylines, place: Floats, reach_mm: float) -> Segments:
    """Return the segments of paths that may come within `reach_mm` of a place (2,), and few
    others.

    No point of an arc of a half circle at most is farther from its start than π/2 of its chord."""
    vertices, offsets = lines.vertices, lines.offsets
    following = np.arange(1, len(vertices) + 1)
    following[offsets[1:] - 1] = offsets[:-1]
    x, y = vertices[:, 0], vertices[:, 1]
    step = np.abs(x[following] - x) + np.abs(y[following] - y)
    distances = np.maximum(np.abs(x - place[0]), np.abs(y - place[1]))
    keep = distances <= reach_mm + 0.5 * math.pi * step
    keep[offsets[1:][~lines.closed] - 1] = False
    path = np.searchsorted(offsets, np.flatnonzero(keep), side="right") - 1
    ends = vertices[following[keep], :2]
    return Segments.between(vertices[keep, :2], ends, vertices[keep, 2], path)


def signed_distances(path: Polyline, points: Floats) -> Floats:
    """Return the distances (J,) of points (J, 2) from a path, positive to its left, negative to
    its right.

    The left of a closed path is its inside if it runs CCW. Beside an open path the nearest place
    decides: on a line or arc its side there, at a vertex the side of the bisector of the
    directions there; beyond its ends, the tangents go on."""
    segments = Segments.of(path)
    if path.closed:
        is_inside = inside(points, segments)
        distance = nearest(points, segments).distance
        return np.where(is_inside == (signed_area(path) > 0.0), distance, -distance)
    nearest_points = nearest(points, segments)
    frames = Frames.of(segments)
    near_frames = frames[nearest_points.segment]
    q = points - near_frames.start
    power = near_frames.curvature * dot(q, q) - 2.0 * dot(near_frames.normal, q)
    signed = np.where(power > 0.0, -nearest_points.distance, nearest_points.distance)
    start_tangents = frames.tangent_at(np.zeros(len(segments)))
    end_tangents = frames.tangent_at(np.ones(len(segments)))
    for j in range(len(points)):
        row = int(nearest_points.segment[j])
        for vertex in (row, row + 1):
            arm = points[j] - path.vertices[vertex, :2]
            if math.hypot(*arm) > nearest_points.distance[j] + POSITION_EPS_MM:
                continue
            arriving = end_tangents[vertex - 1] if vertex > 0 else np.zeros(2)
            leaving = start_tangents[vertex] if vertex < len(segments) else np.zeros(2)
            mean_direction = arriving + leaving
            across = float(mean_direction[0] * arm[1] - mean_direction[1] * arm[0])
            at_end = vertex in (0, len(segments))
            signed[j] = across if at_end else math.copysign(nearest_points.distance[j], across)
    return signed


def _shortened_finding(name: str, lead: Lead, size: float, where: str) -> Finding:
    return (LEAD_LEFT_OUT_IN_PART if size else LEAD_LEFT_OUT)(
        where=where, measured=size, limit=lead.length_mm, lead=name
    )
