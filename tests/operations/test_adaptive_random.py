"""Random adaptive pockets against the slow oracle of engagement.

Polygons with arcs, islands, necks, thin walls, stars, spirals, combs and slots, with random tools
and limits of 5° to 90°.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, assume, given
from hypothesis import strategies as st

from camtool.errors import CamtoolError
from camtool.findings import Finding
from camtool.geometry.offset import offset_shape
from camtool.geometry.polylines import Polyline, Polylines
from camtool.planning.adaptive import adaptive_legs
from camtool.planning.clearing import parts_of
from camtool.planning.items import CutRun
from camtool.planning.job import Entry
from camtool.run import Run
from camtool.stock.slides import slide_moves, tools_of_rows
from camtool.target.registry import LoadedTarget, load_target
from camtool.toolpath.moves import Kind
from tests.operations.adaptive_programs import posted
from tests.operations.test_adaptive import HELIX
from tests.oracles.contours import SQUARE, closed, comb, gear, spiral, star
from tests.oracles.engagement import (
    BEHIND_SHARE,
    CHORD_SHARE,
    LEVEL_EPS_MM,
    Place,
    Stay,
    Stock,
    chords_of,
    engagements,
    lines_of,
    stays_of,
)
from tests.oracles.swept import SAG, area_of, gouges
from tests.paths import moved, scaled
from tests.planning.pocket_cases import cross, region_of, runs_of, shapes, work_of
from tests.strategies import examples

TOLERATED = 1.02
NEAR_SHARE = 0.1
"""Moves up to this part of the tool's radius away are about a place."""

THICK_SHARE = 4e-3
"""As the documentation says; ..."""

THICK_OF_STEP = 0.2
"""... but no more than this part of the step beside a straight wall, which is less below 12°."""

MAX_FRONTS = 999.0
"""Limits that make more fronts across a pocket are refused."""

FINE_SHARE = 0.0206
FINE_MM = 1.02e-3
"""Discs of this part of the tool's radius, and so much more, that fit in the tool centre region
are cleared within the limit; places that none of them reaches are as wide as the tool."""

NARROW_SLACK = 0.05
"""Places nearer than this part of such a disc to where it reaches may be taken as either."""

STEPS_WIDE = 30.0
"""Near arcs whose radius is less than so many times what the slides go beside their path, steps of
the machine are not small beside the advance of each turn, and short lines head where rounding
leads them: there limits may be exceeded a little, and findings may say so without cause."""

SLACK_SHARE = 3e-4
"""Paths may leave the region of tool centres by this part of the tool's radius."""

WALL_MM = 2.2e-3
"""Programs are rounded: they may cut so much into a wall. The ends and the centre of an arc are
each rounded by up to 0.71 µm, and the links of some adaptive pockets leave a region by 0.24‰ of
the radius."""

DEEP_SHARE = 0.01
"""Uncut strips up to twice this part of the tool's radius wide are the scallop."""

DOWN_RAD = 0.02
"""Less than this part of the tool's disc is stock where it comes down without a helix."""


class Case(NamedTuple):
    """A pocket, its tool and its limit."""

    paths: list[Polyline]
    radius_mm: float
    limit: float


@st.composite
def necks(draw: st.DrawFn) -> list[Polyline]:
    """Two chambers and a neck between them, about as wide as a tool of 2 mm."""
    wide = 2.0 * draw(st.sampled_from([0.99, 1.05, 1.2, 1.6]))
    long = draw(st.floats(0.2, 6.0))
    sizes = [draw(st.floats(3.6, 7.0)) for _ in range(4)]
    a, b, c, d = sizes
    y = draw(st.floats(0.1, min(b, d) - wide - 0.1))
    return [
        closed(
            *((0, 0), (a, 0), (a, y), (a + long, y), (a + long, 0), (a + long + c, 0)),
            *((a + long + c, d), (a + long, d), (a + long, y + wide), (a, y + wide), (a, b)),
            (0, b),
        )
    ]


@st.composite
def near_islands(draw: st.DrawFn) -> list[Polyline]:
    """A square with a square island that leaves about the width of a tool of 2 mm to a wall, or to
    a second island."""
    gap = 2.0 * draw(st.sampled_from([0.9, 0.99, 1.05, 1.1, 1.5]))
    size = draw(st.floats(0.5, 3.0))
    outer = scaled(closed((0, 0), (1, 0), (1, 1), (0, 1)), 12.0)
    island = scaled(closed((0, 0), (1, 0), (1, 1), (0, 1)), size)
    paths = [outer, moved(island, gap, draw(st.floats(2.0, 6.0)))]
    if draw(st.booleans()):
        paths.append(moved(island, gap + size + gap, paths[1].vertices[0, 1]))
    return paths


@st.composite
def cases(draw: st.DrawFn, strokes: float) -> Case:
    """A pocket whose strokes are about so many tool radii long."""
    kind = draw(st.sampled_from(["any", "any", "star", "gear", "spiral", "comb", "slot"]))
    fitting = st.floats(0.15, 0.97)
    if kind == "any":
        paths = draw(shapes())
        assume(not cross(paths))
    elif kind == "star":
        paths = [star(draw(st.integers(3, 9)), draw(st.floats(3.0, 9.0)), 10.0)]
    elif kind == "gear":
        teeth = draw(st.integers(3, 12))
        paths = [gear(teeth, draw(st.floats(4.0, 9.0)), 10.0), scaled(gear(teeth, 6, 10), 0.2)]
    elif kind == "spiral":
        paths = [spiral(draw(st.integers(1, 2)))]
    elif kind == "comb":
        paths = [comb(draw(st.integers(2, 4)))]
    else:
        long, bend = draw(st.floats(1.0, 20.0)), draw(st.sampled_from([0.0, 0.2, 1.0]))
        paths = [closed((0, 0), (long, 0, bend), (long, 2), (0, 2, bend))]
        fitting = st.sampled_from([0.5, 0.9, 0.97, 0.985, 0.999, 0.9999])
    return draw(with_tool(paths, fitting, strokes))


@st.composite
def narrow_cases(draw: st.DrawFn) -> Case:
    """A pocket with a place about as wide as the tool."""
    paths = draw(st.one_of(necks(), near_islands()))
    limit = math.radians(draw(st.floats(35.0, 90.0)))
    return Case(paths, 1.0, limit)


@st.composite
def with_tool(
    draw: st.DrawFn, paths: list[Polyline], fitting: st.SearchStrategy[float], strokes: float
) -> Case:
    """The paths with a tool and a limit: `fitting`, parts of the widest disc that fits."""
    area = area_of(region_of(paths))
    most = shapely.maximum_inscribed_circle(area).length
    radius = most * draw(fitting)
    centres = shapely.buffer(area, -radius).area
    step = centres / (strokes * radius**2)
    low_x, low_y, high_x, high_y = area.bounds
    step = max(step, max(high_x - low_x, high_y - low_y) / (MAX_FRONTS * radius))
    assume(step < 0.9)
    least = max(math.radians(5.0), math.acos(1.0 - step))
    return Case(paths, radius, draw(st.floats(least, 0.5 * math.pi)))


def fine_mm(case: Case) -> float:
    """Return the radius of the discs of tool centres that are cleared within the limit, mm."""
    return FINE_MM + FINE_SHARE * case.radius_mm


def wide_centres(case: Case, slack: float) -> shapely.Geometry:
    """Return the places of the tool's centre that fine discs reach, and those nearer to them than
    a part of these discs (below 0: only places that are farther within)."""
    fine = fine_mm(case)
    middles = shapely.buffer(area_of(region_of(case.paths)), -case.radius_mm - fine, quad_segs=200)
    return shapely.buffer(middles, fine * (1.0 + slack), quad_segs=200)


def slot_faults(case: Case, places: list[tuple[float, float]], words: list[str]) -> list[str]:
    """Return the faults of the places that are named as slots: `words` of engagements too high in
    slots where none is named, and names of slots in which a limit can be kept."""
    within = wide_centres(case, -NARROW_SLACK)
    wide = [place for place in places if shapely.intersects_xy(within, *place)]
    return [*([] if places else words), *(f"{place} is named as a slot" for place in wide)]


def slots_named(findings: Iterable[Finding]) -> list[tuple[float, float]]:
    """Return the places of the slots that findings name as cut with all of the tool."""
    named = [each.where for each in findings if each.code.name == "SLOT_AS_WIDE"]
    return [_place_of(where) for where in named]


def _place_of(where: str) -> tuple[float, float]:
    """Return the x and y mm at the end of the text that names a place."""
    x, y = map(float, re.findall(r"-?[\d.]+", where)[-2:])
    return x, y


def thick_share(case: Case) -> float:
    """Return the thickness up to which chips do not count, over the tool's radius."""
    return min(THICK_SHARE, THICK_OF_STEP * (1.0 - math.cos(case.limit)))


def too_high(
    case: Case, stock: Stock, runs: list[CutRun], every: float, phase: float
) -> tuple[list[str], list[str]]:
    """Return the places where the engagement is above its limit, and those where the tool comes
    down into stock, but for helices: first those of slots as wide as the tool, then all others."""
    radius = case.radius_mm
    lines = [chords_of(run.vertices, CHORD_SHARE * radius) for run in runs]
    stays = stays_of(lines, -1.0)
    is_helix = [len(stay.down) > 0 and stay.down[0, 2] == 0.0 for stay in stays]
    wide = wide_centres(case, NARROW_SLACK)
    in_slots, others = list[str](), list[str]()
    for place in engagements(stock, stays, every * radius, phase):
        if is_helix[place.stay] and place.travelled_mm <= math.tau * radius:
            continue
        limit = DOWN_RAD if math.isnan(place.heading) else TOLERATED * case.limit
        if place.angle > limit:
            is_wide = shapely.intersects_xy(wide, place.x, place.y)
            (others if is_wide else in_slots).append(_words(place, case.limit))
    return in_slots, others


def _words(place: Place, limit: float) -> str:
    what = "comes down into stock of" if math.isnan(place.heading) else "is engaged by"
    angle, most = math.degrees(place.angle), math.degrees(limit)
    return f"X{place.x:.4f} Y{place.y:.4f} (stay {place.stay}): {what} {angle:.2f}° of {most:.2f}°"


def uncut(case: Case, stock: Stock) -> list[str]:
    """Return the places that stay uncut beyond the scallop."""
    radius = case.radius_mm
    reached = shapely.buffer(wide_centres(case, 0.0), radius, quad_segs=200)
    deep = shapely.buffer(stock.remaining(reached), -DEEP_SHARE * radius)
    return [
        f"{part.area:.3g} mm² about {shapely.get_coordinates(part.centroid)[0].round(4).tolist()}"
        for part in shapely.get_parts(deep)
        if not part.is_empty
    ]


def faults(case: Case, every: float, phase: float) -> list[str]:
    """Return the faults of an adaptive pocket, looked at at places `every` tool radii apart."""
    own = (("strategy", "adaptive"), ("engagement_rad", case.limit))
    work = work_of(case.paths, 2.0 * case.radius_mm, own=own, entry=HELIX)
    return faults_of(runs_of(work), case, every, phase, slots_named(work.findings))


def faults_of(
    runs: list[CutRun],
    case: Case,
    every: float,
    phase: float,
    slots: list[tuple[float, float]] | None = None,
) -> list[str]:
    stock = Stock(case.radius_mm, case.radius_mm * thick_share(case))
    in_slots, others = too_high(case, stock, runs, every, phase)
    return [
        *gouges(runs, region_of(case.paths), case.radius_mm),
        *others,
        *slot_faults(case, slots or [], in_slots),
        *uncut(case, stock),
    ]


@examples(3, nightly=40)
@given(cases(20.0), st.floats(0.0, 1.0))
def test_random_pockets_are_cleared_within_their_limit(case: Case, phase: float) -> None:
    assert faults(case, 0.3, phase) == []


@pytest.mark.slow
@examples(60, nightly=1_000)
@given(st.one_of(cases(250.0), narrow_cases()), st.floats(0.0, 1.0))
def test_many_random_pockets_are_cleared_within_their_limit(case: Case, phase: float) -> None:
    assert faults(case, 0.15, phase) == []


@st.composite
def airs(draw: st.DrawFn, case: Case) -> Polyline:
    """A box of air over a side of a pocket, or within it."""
    low_x, low_y, high_x, high_y = area_of(region_of(case.paths)).bounds
    wide, high = high_x - low_x, high_y - low_y
    x, y = low_x + draw(st.floats(0.0, 0.9)) * wide, low_y + draw(st.floats(-1.0, 0.5)) * high
    right = x + draw(st.sampled_from([0.3, 2.0])) * wide
    top = y + draw(st.sampled_from([0.5, 3.0])) * high
    return closed((x, y), (right, y), (right, top), (x, top))


def air_faults(case: Case, air: Polyline, every: float, phase: float) -> list[str]:
    """Return the faults of a pocket a part of which is air at the beginning."""
    radius, area = case.radius_mm, area_of(region_of(case.paths))
    stock = Stock(radius, radius * thick_share(case))
    words, stays = list[str](), list[Stay]()
    is_first = list[bool]()
    for region in parts_of(offset_shape(region_of(case.paths), radius)):
        clearing = adaptive_legs(region, 0.5 * radius, radius, case.limit, Polylines.of([air]))
        for number, stay in enumerate(clearing.stays):
            rows = [np.insert(leg.vertices, 2, -1.0, axis=1) for leg in stay]
            points = np.concatenate([chords_of(each, CHORD_SHARE * radius) for each in rows])
            moved_on = np.append(True, np.hypot(*np.diff(points[:, :2], axis=0).T) > 1e-9)
            stays.append(Stay(points[moved_on][:, :2], np.empty((0, 3))))
            is_first.append(number == 0 and clearing.helix_mm > 0.0)
    slack = SLACK_SHARE * radius + SAG * float(np.ptp(region_of(case.paths).vertices[:, :2]))
    centres = shapely.buffer(area, slack - radius, quad_segs=400)
    for stay in stays:
        if not shapely.covers(centres, shapely.LineString(stay.points)):
            words.append("leaves the region")
    hole = shapely.Polygon(air.vertices[:, :2])
    for cell in stock.cells(np.reshape(area.bounds, (2, 2)), 3.0 * radius):
        stock.content[cell] = shapely.difference(stock.of(cell), hole)
    wide = wide_centres(case, NARROW_SLACK)
    for place in engagements(stock, stays, every * radius, phase):
        if is_first[place.stay] and place.travelled_mm <= math.tau * radius:
            continue
        limit = DOWN_RAD if math.isnan(place.heading) else TOLERATED * case.limit
        if place.angle > limit and shapely.intersects_xy(wide, place.x, place.y):
            words.append(_words(place, case.limit))
    return words + uncut(case, stock)


@examples(3, nightly=40)
@given(cases(20.0), st.data(), st.floats(0.0, 1.0))
def test_random_pockets_that_begin_in_air_keep_their_limit(
    case: Case, data: st.DataObject, phase: float
) -> None:
    assert air_faults(case, data.draw(airs(case)), 0.3, phase) == []


def test_rings_are_seen_to_exceed_a_limit_and_to_slot() -> None:
    """The oracle can complain: rings cut with half of the tool in the first one."""
    case = Case([SQUARE], 1.5, math.radians(60.0))
    runs = runs_of(work_of(case.paths, 3.0, entry=Entry("helix", angle_rad=math.radians(5.0))))
    complaints = faults_of(runs, case, 0.2, 0.5)
    assert any("is engaged by" in words for words in complaints)
    missing = faults_of(runs[:1][:0], case, 0.2, 0.5)
    assert any("mm² about" in words for words in missing)


@pytest.mark.parametrize("degrees", [5.0, 20.0, 45.0, 90.0, 120.0])
def test_the_oracle_finds_the_angle_of_a_straight_cut(degrees: float) -> None:
    """A cut of the width s beside a slot is engaged by acos(1 − s/r); chips thinner than `thick`
    do not count, so there it is acos(1 − (s − thick)/r)."""
    step = 1.0 - math.cos(math.radians(degrees))
    none = np.empty((0, 3))
    stays = [Stay(np.array([[0.0, y], [20.0, y]]), none) for y in (0.0, step)]
    for thick in (0.0, 0.2 * step):
        places = list(engagements(Stock(1.0, thick), stays, 1.7, 0.9))
        first = [place.angle for place in places if place.stay == 0 and place.travelled_mm > 0.0]
        assert first == pytest.approx([math.pi] * len(first), abs=2e-3)
        beside = [place.angle for place in places if place.stay == 1 and place.travelled_mm > 1.0]
        angle = math.acos(1.0 - step + thick)
        assert beside == pytest.approx([angle] * len(beside), abs=3e-3)


CUT_POINTS = 100
"""So many chords are cut at once."""

STOCK_FAULTS = {
    "CUT_TOO_DEEP",
    "PASS_TOO_DEEP",
    "TOOL_IN_STOCK",
    "RAPID_IN_STOCK",
    "STOCK_NOT_JUDGED",
}


def job_faults(case: Case, target: LoadedTarget, folder: Path) -> list[str]:
    """Return what the stock simulator finds wrong with a program, but for the scallop in corners
    (MATERIAL_LEFT), which the oracle judges; and what is wrong with what it says of the
    engagement: that is either kept, or a little exceeded on the predicted slides, and more only
    where the steps of the machine are coarse, or a slot that is named is as wide as the tool."""
    run = posted(case.paths, 2.0 * case.radius_mm, case.limit, target, folder)
    names = {finding.code.name for finding in run.findings}
    told = names & {"ENGAGEMENT_KEPT", "ENGAGEMENT_TOO_HIGH"}
    words = sorted(names & STOCK_FAULTS)
    stock = Stock(case.radius_mm, 0.0)
    walls = shapely.boundary(area_of(region_of(case.paths)))
    shapely.prepare(walls)
    for line in lines_of(run.decoded, CHORD_SHARE * case.radius_mm):
        deep = line[line[:, 2] <= -1.0 + LEVEL_EPS_MM][:, :2]
        for first in range(0, len(deep), CUT_POINTS):
            stock.cut(deep[first : first + CUT_POINTS + 1])
        near = shapely.dwithin(walls, shapely.points(deep), case.radius_mm - WALL_MM)
        words += [f"cuts into the wall at {place}" for place in deep[near].tolist()[:1]]
    words += uncut(case, stock)
    if len(told) != 1:
        words.append(f"{sorted(told)} of the engagement")
    slots, in_slots = slots_named(run.findings), list[str]()
    for finding in run.findings:
        if finding.code.name == "ENGAGEMENT_TOO_HIGH":
            place = _place_of(finding.where)
            angle, beside_mm = greatest_on_slides(run, case, place)
            is_right = True
            assert finding.measured is not None
            what = f"{finding.measured}° at {place}; {math.degrees(angle):.3f}° by the oracle"
            wide = wide_centres(case, NARROW_SLACK)
            coarse_mm = STEPS_WIDE * beside_mm
            if finest_mm(run, place, max(NEAR_SHARE * case.radius_mm, coarse_mm)) <= coarse_mm:
                unsure = math.atan2(beside_mm, BEHIND_SHARE * case.radius_mm)
                is_right = angle <= math.radians(finding.measured) + unsure
            elif shapely.dwithin(wide, shapely.Point(place), beside_mm):
                is_right = case.limit < angle <= TOLERATED * case.limit
            else:
                in_slots.append(what)
            if not is_right:
                words.append(f"{what}, of {math.degrees(case.limit):.3f}°")
    return words + slot_faults(case, slots, in_slots)


def greatest_on_slides(run: Run, case: Case, at_mm: tuple[float, float]) -> tuple[float, float]:
    """Return the greatest engagement, by the oracle, of the slides near a place behind entries,
    and how far the slides go beside their path, mm."""
    slides = slide_moves(run.decoded, run.target, tools_of_rows(run.decoded, run.job))
    radius, lines = case.radius_mm, [list[list[float]]()]
    rows = zip(slides.start.tolist(), slides.end.tolist(), slides.rapid.tolist(), strict=True)
    for start, end, is_rapid in rows:
        if is_rapid:
            lines.append([])
            continue
        lines[-1] += [end] if lines[-1] else [start, end]
    stays = stays_of([np.array(line) for line in lines if line], -1.0)
    is_helix = [bool(np.ptp(stay.down[:, :2], axis=0).max(initial=0.0) > 0.0) for stay in stays]
    stock = Stock(radius, max(thick_share(case) * radius, 2.0 * slides.beside_mm))
    near = NEAR_SHARE * radius
    places = engagements(stock, stays, 3.0 * radius, 0.5, (*at_mm, near))
    angles = [
        place.angle
        for place in places
        if math.dist((place.x, place.y), at_mm) < near
        and place.travelled_mm > math.tau * radius * is_helix[place.stay]
    ]
    return max(angles, default=0.0), slides.beside_mm


def finest_mm(run: Run, at_mm: tuple[float, float], near_mm: float) -> float:
    """Return the least of the radii of the arcs and the lengths of the lines of a program that
    begin or end near a place, mm."""
    return min(
        (
            math.dist(move.start[:2], move.centre or move.end[:2])
            for move in run.decoded
            if move.kind != Kind.RAPID
            and min(math.dist(move.start[:2], at_mm), math.dist(move.end[:2], at_mm)) < near_mm
        ),
        default=math.inf,
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", ["grbl", "linuxcnc"])
@examples(250, nightly=1_000, suppress_health_check=list(HealthCheck))
@given(cases(40.0))
def test_programs_of_random_pockets_in_the_stock(name: str, tmp_path: Path, case: Case) -> None:
    assert job_faults(case, load_target(name), tmp_path) == []


def square(x: float, y: float, size: float) -> Polyline:
    return closed((x, y), (x + size, y), (x + size, y + size), (x, y + size))


BAD = {
    "islands that cross": [square(0, 0, 20), square(6, 6, 4), square(8, 8, 4)],
    "a contour that crosses itself": [closed((0, 0), (20, 20), (20, 0), (0, 20))],
    "smaller than the tool": [square(0, 0, 2)],
    "a sliver": [closed((0, 0), (100, 0), (100, 0.001))],
    "too large for its tool": [square(0, 0, 20_000)],
}


@pytest.mark.parametrize("name", BAD)
def test_what_cannot_be_cleared_is_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(CamtoolError):
        assert posted(BAD[name], 4.0, math.radians(40.0), "grbl", tmp_path).data
