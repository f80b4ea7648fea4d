"""Isolation: nets are apart and whole after the predicted cut, as a flood of pixels has it."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

import camtool
from camtool.errors import OptionError
from camtool.findings import Finding
from camtool.geometry.polylines import Polyline, Polylines
from camtool.pipeline import post_drawing
from camtool.planning.job import Job, Operation, Tool
from camtool.records import replace
from camtool.stock.cutters import CutterProfile
from camtool.stock.moves import StockMoves
from camtool.stock.nets import judge_nets
from camtool.stock.wanted import CopperNets
from camtool.target.registry import load_target
from tests.drawings import drawing_of
from tests.oracles.contours import closed
from tests.strategies import examples

pytest.importorskip("gerbonara", reason="the extra boards is not installed")

SAMPLES = Path(__file__).parents[2] / "samples"
VBIT = Tool(3.175, kind="v", tip_angle_rad=math.radians(30.0), tip_diameter_mm=0.1)


def circle(x: float, y: float, radius: float) -> Polyline:
    return closed((x - radius, y, 1.0), (x + radius, y, 1.0))


def isolation(tool: Tool = VBIT, depth_mm: float = 0.1, **own: float) -> Operation:
    values = tuple(sorted(own.items()))
    return Operation(
        kind="isolate", tool=tool, depth_mm=depth_mm, feed_mm_min=200.0, own=values, name="nets"
    )


def found(findings: tuple[Finding, ...]) -> dict[str, list[Finding]]:
    codes = ("NETS_APART", "NETS_JOINED", "NET_CUT")
    return {code: [each for each in findings if each.code.name == code] for code in codes}


def board(*contours, operation: Operation, target: str = "linuxcnc", settings=()):
    loaded = load_target(target, settings=settings)
    run = post_drawing(drawing_of(list(contours)), Job((operation,)), loaded)
    return found(run.findings)


PAD, OTHER = closed((0, 0), (3, 0), (3, 2), (0, 2)), closed((3.3, 0), (6, 0), (6, 2), (3.3, 2))


@pytest.mark.parametrize("target", ["grbl", "linuxcnc", "valcnc"])
def test_two_pads_are_apart(target: str) -> None:
    findings = board(PAD, OTHER, operation=isolation(), target=target)
    (proved,) = findings["NETS_APART"]
    assert proved.measured == 2
    assert not findings["NETS_JOINED"]
    assert not findings["NET_CUT"]


def test_a_tool_that_does_not_fit_leaves_them_joined() -> None:
    findings = board(PAD, OTHER, operation=isolation(Tool(0.4)))
    (short,) = findings["NETS_JOINED"]
    assert short.where.startswith("at X 3.150 Y ")


def test_rings_reach_no_other_net() -> None:
    """A gap of 0.3 mm takes one ring; those farther out go where there is room."""
    findings = board(PAD, OTHER, operation=isolation(isolation_mm=1.0))
    assert len(findings["NETS_APART"]) == 1


def test_backlash_that_cuts_a_track_is_an_error() -> None:
    """A track of 0.3 mm between two pads, on a machine whose play is wider than that."""
    track = closed(
        (0, 0), (2, 0), (2, 0.85), (4, 0.85), (4, 0), (6, 0), (6, 2), (4, 2), (4, 1.15),
        (2, 1.15), (2, 2), (0, 2),
    )  # fmt: skip
    far = closed((7, 0), (9, 0), (9, 2), (7, 2))
    sound = board(track, far, operation=isolation())
    assert sound["NETS_APART"]
    play = ("axes.x.backlash_mm=0.6", "axes.y.backlash_mm=0.6")
    faults = board(track, far, operation=isolation(), settings=play)
    assert faults["NET_CUT"] or faults["NETS_JOINED"]
    assert not faults["NETS_APART"]


def test_copper_within_an_outline_keeps_its_sides() -> None:
    """The outline of the board does not make copper a hole."""
    outline = closed((-5, -5), (12, -5), (12, 8), (-5, 8))
    drawing = drawing_of([PAD, OTHER, outline], ["COPPER-TOP", "COPPER-TOP", "OUTLINE"])
    job = Job((replace(isolation(), layers=("COPPER*",)),))
    run = post_drawing(drawing, job, load_target("linuxcnc"))
    assert found(run.findings)["NETS_APART"]
    assert run.wanted is not None
    low = run.wanted.end[run.wanted.is_feed, :2].min(axis=0)
    assert low == pytest.approx([-0.0768, -0.0768], abs=1e-3)


@pytest.mark.parametrize(
    ("operation", "message"),
    [
        (replace(isolation(), depth_mm=None), "has no depth"),
        (isolation(depth_mm=0.03), r"0\.03 mm of depth do not cut through 0\.035 mm"),
        (isolation(isolation_mm=0.05), "is less than one cut of this tool"),
        (isolation(isolation_mm=20.0), r"needs more than 50 rings"),
        (isolation(isolation_mm=1e308), r"needs more than 50 rings"),
        (isolation(Tool(0.0)), "has no width at the bottom"),
    ],
)
def test_what_cannot_be_isolated_is_said(operation: Operation, message: str) -> None:
    with pytest.raises(OptionError, match=message):
        Job((operation,))


def test_the_sample_is_proved() -> None:
    run = camtool.post(SAMPLES / "led.zip", "linuxcnc", camtool.read_job(SAMPLES / "led.toml"))
    (proved,) = found(run.findings)["NETS_APART"]
    assert proved.measured == 4
    assert not run.failed


# The proof against pixels.

CELL = 0.02
TOOL = CutterProfile(1.0, 0.06, rise=1.0 / math.tan(math.radians(15.0)))


def flood(
    contours: Polylines, paths: list[np.ndarray], radius: float
) -> tuple[list[tuple[int, int]], list[int]]:
    """Return the pairs of nets that share a label, and the number of labels of each, by pixels."""
    x, y = np.meshgrid(np.arange(-1, 9, CELL) + CELL / 3, np.arange(-1, 9, CELL) + CELL / 3)
    net = np.zeros(x.shape, dtype=int)
    for number, (centre, pad_radius) in enumerate(contours, start=1):  # type: ignore[misc]
        net[np.hypot(x - centre[0], y - centre[1]) <= pad_radius] = number
    cut = np.zeros(x.shape, dtype=bool)
    for path in paths:
        for a, b in itertools.pairwise(path):
            way = b - a
            length = float(way @ way)
            share = np.clip(((x - a[0]) * way[0] + (y - a[1]) * way[1]) / length, 0, 1)
            cut |= np.hypot(x - a[0] - share * way[0], y - a[1] - share * way[1]) <= radius
    label, _ = ndimage.label(~cut)
    of_net = []
    for number in range(1, net.max() + 1):
        labels, counts = np.unique(label[(net == number) & ~cut], return_counts=True)
        of_net.append({int(k) for k, c in zip(labels, counts, strict=True) if c > 40})
    pairs = [
        (i, j)
        for i in range(len(of_net))
        for j in range(i + 1, len(of_net))
        if of_net[i] & of_net[j]
    ]
    return pairs, [len(labels) for labels in of_net]


@examples(40)
@given(st.integers(0, 2**31))
def test_nets_are_those_of_a_flood_of_pixels(seed: int) -> None:
    """Pads of random sizes, and grooves along lines that divide the board at random."""
    random = np.random.default_rng(seed)
    pads = [
        (np.array([2.0 + 4.0 * i, 2.0 + 4.0 * j]), float(random.uniform(0.6, 1.4)))
        for i in range(2)
        for j in range(2)
    ]
    paths = []
    for _ in range(int(random.integers(1, 5))):
        straight = float(random.uniform(0.5, 7.5))
        ends = (
            [[straight, -2.0], [straight, 10.0]]
            if random.random() < 0.5
            else [[-2.0, straight], [10.0, straight]]
        )
        paths.append(np.array(ends))
    z, copper = -0.1, 0.035
    radius = 0.06 + (copper - z - 2 * copper) * math.tan(math.radians(15.0))
    near_miss = min(
        abs(abs(path[0][axis] - centre[axis]) - pad - sign * radius)
        for path in paths
        for axis in (0, 1)
        for centre, pad in pads
        for sign in (-1, 1)
        if path[0][axis] == path[1][axis]
    )
    if near_miss < 0.15:  # chips that pixels and discs count differently
        return
    start = np.array([[*path[0], z] for path in paths])
    end = np.array([[*path[1], z] for path in paths])
    rows = np.arange(len(paths))
    moves = StockMoves(start, end, rows, rows < 0, rows * 0, (TOOL,))
    contours = Polylines.of([circle(*centre, pad) for centre, pad in pads])
    report = judge_nets(moves, CopperNets("nets", contours, copper), (-1.0, -1.0, 9.0, 9.0))
    pairs, pieces = flood(pads, paths, radius)  # type: ignore[arg-type]
    assert report.nets == 4
    ours = {frozenset((each.net, each.other)) for each in report.shorts}
    assert bool(ours) == bool(pairs)
    for fault in report.opens:
        assert pieces[order(contours, report.nets, pads)[fault.net]] == fault.pieces
    assert len(report.opens) == sum(count != 1 for count in pieces)


def order(contours: Polylines, count: int, pads: list) -> list[int]:
    """Return the pad of each net: nets are numbered as shapely finds them."""
    import shapely

    from camtool.stock.nets import _area

    parts = list(shapely.get_parts(_area(contours)))
    assert len(parts) == count
    return [
        next(k for k, (centre, _) in enumerate(pads) if part.contains(shapely.Point(*centre)))
        for part in parts
    ]


def test_the_narrowest_groove_and_copper_are_measured() -> None:
    """A groove of 2 × 0.0774 mm beside a pad with a neck of 0.4 mm."""
    neck = closed(
        (0, 0), (2, 0), (2, 0.8), (4, 0.8), (4, 0), (6, 0), (6, 2), (4, 2), (4, 1.2), (2, 1.2),
        (2, 2), (0, 2),
    )  # fmt: skip
    z, copper = -0.1, 0.035
    start, end = np.array([[-1.0, 2.5, z]]), np.array([[7.0, 2.5, z]])
    rows = np.arange(1)
    moves = StockMoves(start, end, rows, rows < 0, rows, (TOOL,))
    box = (-1.0, -1.0, 7.0, 4.0)
    report = judge_nets(moves, CopperNets("nets", Polylines.of([neck]), copper), box)
    width = 2.0 * (0.06 + 0.065 * math.tan(math.radians(15.0)))
    assert report.gap is not None
    assert report.gap.width_mm == pytest.approx(width, abs=1e-3)
    assert report.copper is not None
    assert report.copper.width_mm == pytest.approx(0.4, abs=2e-3)
    x, y = report.copper.at_mm
    assert 2.0 <= x <= 4.0
    assert y == pytest.approx(1.0, abs=0.2)
