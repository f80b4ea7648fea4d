"""Verdicts of parts that are really planned, written, read back and simulated."""

import math
from pathlib import Path

import numpy as np
import pytest

import camtool
from camtool.arrays import Floats
from camtool.errors import OptionError
from camtool.findings import Severity
from camtool.inspection.dimensions import Dimension, Kind, Limits, Place
from camtool.inspection.findings import InspectionCode
from camtool.inspection.inspector import Inspector
from camtool.inspection.sizes import edge_at, rows_of, size_of
from camtool.inspection.uncertainty import DRAWS, MachineVariant
from camtool.inspection.verdicts import SURE, Tolerances, inspect
from camtool.records import replace
from camtool.run import Run
from camtool.verification.report import InspectedReport, inspected_words, summary_lines

KNOWN = (
    "uncertainty.x.backlash_mm=0.004",
    "uncertainty.y.backlash_mm=0.002",
    "uncertainty.x.scale=0.0001",
    "uncertainty.y.scale=0.0002",
    "uncertainty.squareness_rad=0.0001",
    "uncertainty.tool_diameter_mm=0.01",
    "uncertainty.runout_mm=0.0",
    "uncertainty.temperature_k=0.0",
    "uncertainty.machine_expansion_per_k=0.0",
    "uncertainty.part_expansion_per_k=0.0",
    "uncertainty.process_mm=0.003",
)
EXACT = ("controller.model=path", "controller.grid=none")
SVG = """<svg xmlns="http://www.w3.org/2000/svg" width="50mm" height="40mm" viewBox="0 0 50 40">
<g fill="none" stroke="black"><rect x="5" y="5" width="40" height="30"/>
<circle cx="15" cy="20" r="4"/><rect x="25" y="12" width="12" height="16"/></g></svg>"""


@pytest.fixture(scope="module")
def plate(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A plate 40 × 30 mm with a hole of 8 mm and a window 12 × 16 mm; Y is up: the hole's centre
    lies at (15, 20)."""
    file = tmp_path_factory.mktemp("plate") / "plate.svg"
    file.write_text(SVG)
    return file


def posted(plate: Path, *settings: str, **job_settings: object) -> Run:
    target = camtool.load_target("linuxcnc", settings=[*EXACT, *KNOWN, *settings])
    job = camtool.job_of(tool_diameter_mm=2.0, **job_settings)
    return camtool.post(plate, target, job=job)


def dimension(
    kind: Kind, *places: Place, limits: tuple[float, float] | None = (-0.05, 0.05)
) -> Dimension:
    words = None if limits is None else Limits(*limits, "limits")
    return Dimension(kind, kind, places, "test", limits=words)


WIDTH = dimension("distance", (5.0, 20.0), (45.0, 20.0))
HEIGHT = dimension("distance", (20.0, 5.0), (20.0, 35.0))
WINDOW = dimension("distance", (25.0, 20.0), (37.0, 20.0))
HOLE = dimension("diameter", (15.0, 20.0))
PITCH = dimension("distance", (5.0, 20.0), (15.0, 20.0))
ROUND = dimension("roundness", (15.0, 20.0), limits=(0.0, 0.02))
ALL = (WIDTH, HEIGHT, WINDOW, HOLE, PITCH, ROUND)


def verdicts(run: Run, *dimensions: Dimension) -> list[InspectedReport]:
    done = inspect(run, Tolerances(dimensions))
    assert done.report is not None
    return list(done.report.inspection)


def test_an_exact_machine_makes_what_is_drawn(plate: Path) -> None:
    found = verdicts(posted(plate), *ALL)
    assert [each.nominal_mm for each in found] == pytest.approx([40, 30, 12, 8, 10, 0])
    for each in found:
        assert each.low_mm == pytest.approx(each.nominal_mm, abs=1e-3)
        assert each.high_mm == pytest.approx(each.nominal_mm, abs=1e-3)


def test_scale_backlash_and_tool_change_sizes_as_they_must(plate: Path) -> None:
    run = posted(plate)
    inspector = Inspector(run, ALL)
    machine = run.target.machine
    plain = inspector.sizes()
    large = posted(plate, f"axes.x.real_step_mm={machine.axes.x.coded_step_mm * 1.001}")
    scaled = Inspector(large, ALL).sizes()
    # The tool keeps its width when the slides go farther.
    expected = [40 + 0.001 * 42, 30, 12 + 0.001 * 10]
    assert [each.fit_mm for each in scaled[:3]] == pytest.approx(expected, abs=1e-3)
    wide = inspector.sizes(MachineVariant(machine, 0.1))
    changes = [b.fit_mm - a.fit_mm for a, b in zip(plain, wide, strict=True)]
    assert changes == pytest.approx([-0.1, -0.1, 0.1, 0.1, -0.05, 0.0], abs=1e-3)
    slack = Inspector(posted(plate, "axes.x.backlash_mm=0.06", start="25,4"), ALL).sizes()
    # The left edge is cut after X has gone down, the right one after it has gone up.
    assert abs(slack[0].fit_mm - 40.0) == pytest.approx(0.06, abs=1e-3)
    assert slack[1].fit_mm == pytest.approx(30.0, abs=1e-3)
    assert slack[5].fit_mm > 0.02


def test_a_budget_adds_up(plate: Path) -> None:
    width = verdicts(posted(plate), WIDTH)[0]
    by_input = {each.input: each.um for each in width.contributions}
    # Two edges of 3 µm; the tool's 10 µm; 42 mm of travel at 1e-4.
    assert by_input["tool_diameter_mm"] == pytest.approx(10.0, rel=1e-3)
    assert by_input["process_mm"] == pytest.approx(3.0 * math.sqrt(2.0), rel=1e-3)
    assert by_input["x.scale"] == pytest.approx(4.2, rel=0.02)
    # Of a backlash of 0 and more, half of the distribution is not there; it enters to first order.
    assert "y.scale" not in by_input or by_input["y.scale"] == pytest.approx(0.0, abs=0.01)
    assert width.guard_um == pytest.approx(1.6449 * (width.standard_um or 0.0), rel=1e-3)


def test_the_scatter_of_both_axes_is_in_a_diameter(plate: Path) -> None:
    scatter = "axes.x.repeatability_mm=0.003", "axes.y.repeatability_mm=0.004"
    hole, width = verdicts(posted(plate, *scatter), HOLE, WIDTH)
    found = [{each.input: each.um for each in one.contributions} for one in (hole, width)]
    # Of a diameter both edges, half of each in X and half in Y; a width in X has none of Y's.
    assert found[0]["x.repeatability_mm"] == pytest.approx(3.0, rel=1e-3)
    assert found[0]["y.repeatability_mm"] == pytest.approx(4.0, rel=1e-3)
    assert found[1]["x.repeatability_mm"] == pytest.approx(3.0 * math.sqrt(2.0), rel=1e-3)
    assert "y.repeatability_mm" not in found[1]


@pytest.mark.parametrize(
    ("limits", "verdict"),
    [
        ((-0.1, 0.1), "in"),
        ((-0.01, 0.01), "undecided"),
        ((0.1, 0.2), "out"),
        ((-0.2, -0.1), "out"),
        ((0.0, 0.1), "undecided"),
        (None, "predicted"),
    ],
)
def test_verdicts(plate: Path, limits: tuple[float, float] | None, verdict: str) -> None:
    one = verdicts(posted(plate), dimension("diameter", (15.0, 20.0), limits=limits))[0]
    assert one.verdict == verdict
    if limits is None:
        assert one.probability is None
    else:
        assert one.probability is not None
        assert (one.probability >= SURE) == (verdict == "in")
        assert bool(one.measure) == (verdict == "undecided")


def test_what_is_not_known_is_not_zero(plate: Path) -> None:
    target = camtool.load_target("linuxcnc", settings=[*EXACT, *KNOWN[:-1]])
    run = camtool.post(plate, target, job=camtool.job_of(tool_diameter_mm=2.0))
    width, hole = verdicts(run, WIDTH, HOLE)
    assert width.verdict == hole.verdict == "undecided"
    assert width.unknown == ("process_mm",)
    assert width.measure == "process_mm"
    assert width.probability is None
    assert width.standard_um is None


COLD = tuple(each for each in KNOWN if "temperature" not in each and "expansion" not in each)
"""All is known but the temperature and how parts and machine grow."""

GROWS = 15.0 * 2e-4
"""By which part of its size a part may differ where nothing of that is known."""


WITHIN = (
    "the room is within 20 ± 15 °C, the part grows by 0 to 200 µm/m per K, "
    "the machine grows by 0 to 30 µm/m per K"
)


def at_room(plate: Path, *settings: str) -> Run:
    target = camtool.load_target("linuxcnc", settings=[*EXACT, *COLD, *settings])
    return camtool.post(plate, target, job=camtool.job_of(tool_diameter_mm=2.0))


@pytest.mark.parametrize(
    ("limits", "verdict"),
    [
        ((-0.1, 0.1), "in"),
        ((0.1, 0.2), "out"),
        ((-0.2, -0.1), "out"),
        ((-0.035, 0.035), "undecided"),  # in without the bound of 8 mm · 0.3 %
        ((-0.01, 0.01), "undecided"),  # by what is known alone
    ],
)
def test_a_temperature_that_cannot_change_a_verdict_does_not_hinder_it(
    plate: Path, limits: tuple[float, float], verdict: str
) -> None:
    hole = dimension("diameter", (15.0, 20.0), limits=limits)
    one = verdicts(at_room(plate), hole)[0]
    assert one.verdict == verdict
    keys = "part_expansion_per_k", "machine_expansion_per_k", "temperature_k"
    assert one.unknown == keys
    (room,) = one.not_known
    assert room.um is None
    # The slides grow: a hole by the way of the tool's centre.
    assert room.at_most_um == pytest.approx(6.0 * GROWS * 1e3, rel=2e-2)
    assert room.within == WITHIN
    assert one.standard_um is not None
    assert one.unknown_um == room.at_most_um
    assert one.expanded_um == pytest.approx(2.0 * one.standard_um + (room.at_most_um or 0.0))
    assert one.guard_um == pytest.approx(
        1.6449 * one.standard_um + (room.at_most_um or 0.0), abs=1e-3
    )


def test_the_probability_is_the_worst_of_all_rooms(plate: Path) -> None:
    """Against machines that really are so much larger or smaller, in rooms of 20 °C."""
    hole = dimension("diameter", (15.0, 20.0), limits=(-0.045, 0.045))
    unknown = verdicts(at_room(plate), hole)[0]
    assert unknown.verdict == "in"
    step = at_room(plate).target.machine.axes.x.coded_step_mm
    chances = []
    for share in np.linspace(-GROWS, GROWS, 3):
        real = step * (1.0 + float(share))
        larger = f"axes.x.real_step_mm={real}", f"axes.y.real_step_mm={real}"
        one = verdicts(at_room(plate, *larger, *KNOWN), hole)[0]
        chances.append(one.probability or 0.0)
    # As if it could leave both limits at once: at most twice the share that is beyond.
    assert unknown.probability is not None
    assert 1.0 - 2.2 * (1.0 - min(chances)) <= unknown.probability <= min(chances) + 1e-6


@pytest.mark.parametrize(
    ("said", "missing", "differ_k"),
    [
        (("part_expansion_per_k=5e-6",), ("machine_expansion_per_k", "temperature_k"), 15 * 25e-6),
        (("machine_expansion_per_k=11e-6", "part_expansion_per_k=23e-6"), ("temperature_k",),
         15 * 12e-6),
        (("machine_expansion_per_k=11e-6", "temperature_k=1.0"), ("part_expansion_per_k",),
         3 * 189e-6),
        (("machine_expansion_per_k=11e-6", "part_expansion_per_k=11e-6"), (), 0.0),
        (("temperature_k=0.0",), (), 0.0),
    ],
)  # fmt: skip
def test_whatever_is_said_of_the_temperature_narrows_its_bound(
    plate: Path, said: tuple[str, ...], missing: tuple[str, ...], differ_k: float
) -> None:
    run = at_room(plate, *(f"uncertainty.{each}" for each in said))
    width = verdicts(run, WIDTH)[0]
    assert width.unknown == missing
    assert width.unknown_um == pytest.approx(42e3 * differ_k, rel=1e-2)


def test_what_nothing_bounds_hinders_every_verdict(plate: Path) -> None:
    target = camtool.load_target("linuxcnc", settings=[*EXACT, *COLD[:-1]])
    run = camtool.post(plate, target, job=camtool.job_of(tool_diameter_mm=2.0))
    hole = dimension("diameter", (15.0, 20.0), limits=(-0.5, 0.5))
    one = inspect(run, Tolerances((hole,), (), "in"))
    assert one.report is not None
    said = one.report.inspection[0]
    assert (said.verdict, said.measure) == ("undecided", "process_mm")
    assert said.unknown_um is said.guard_um is said.expanded_um is None
    assert "process_mm" in said.unknown
    assert one.failed


def test_words_of_what_is_not_known(plate: Path) -> None:
    words = [inspected_words(each) for each in verdicts(at_room(plate), HOLE, ROUND)]
    assert "; in, probability of in 99" in words[0]
    assert words[0].endswith(" not known: temperature_k (at most 18.1 µm)")
    # A circle that grows stays round.
    assert "not known" not in words[1]
    tight = dimension("diameter", (15.0, 20.0), limits=(-0.035, 0.035))
    done = inspect(at_room(plate), Tolerances((tight,)))
    assert done.report is not None
    assert list(summary_lines(done.report))[-1] == ("not known", f"temperature_k: if {WITHIN}")
    assert inspected_words(done.report.inspection[0]).endswith("; say part_expansion_per_k")
    (finding,) = [each for each in done.findings if each.code == InspectionCode.DIMENSION_NOT_IN]
    assert "does not say part_expansion_per_k, machine_expansion_per_k" in finding.message


@pytest.mark.parametrize("require", ["in", "not-out"])
def test_what_is_required(plate: Path, require: str) -> None:
    run = posted(plate)
    hole = dimension("diameter", (15.0, 20.0), limits=(-0.01, 0.01))
    done = inspect(run, Tolerances((hole,), (), require))  # type: ignore[arg-type]
    mine = [each for each in done.findings if each.code == InspectionCode.DIMENSION_NOT_IN]
    assert [each.severity for each in mine] == [
        Severity.ERROR if require == "in" else Severity.WARNING
    ]
    assert done.failed == (require == "in")


def test_what_is_not_cut_and_what_fits_nothing_are_findings(plate: Path) -> None:
    run = posted(plate)
    done = inspect(run, Tolerances((dimension("diameter", (1.0, 1.0)), HOLE)))
    assert InspectionCode.DIMENSION_UNBOUND in {each.code for each in done.findings}
    assert done.report is not None
    assert [each.kind for each in done.report.inspection] == ["diameter"]
    some = camtool.post(
        plate, run.target, job=camtool.job_of(tool_diameter_mm=2.0, select=("outer",))
    )
    done = inspect(some, Tolerances((HOLE, WIDTH)))
    assert InspectionCode.DIMENSION_NOT_CUT in {each.code for each in done.findings}
    assert done.report is not None
    assert [each.kind for each in done.report.inspection] == ["distance"]


@pytest.mark.parametrize("place", [(1.0, 1.0), (15.0, 20.0)])
def test_what_cannot_be_inspected_is_an_error_where_something_is_required(
    plate: Path, place: Place
) -> None:
    target = camtool.load_target("linuxcnc", settings=[*EXACT, *KNOWN])
    job = camtool.job_of(tool_diameter_mm=2.0, select=("outer",))
    run = camtool.post(plate, target, job=job)
    hole = dimension("diameter", place)
    assert not inspect(run, Tolerances((hole,))).failed
    assert inspect(run, Tolerances((hole,), (), "not-out")).failed


def test_slides_that_are_elsewhere_give_no_size(plate: Path) -> None:
    run = posted(plate, "axes.x.real_step_mm=0.002")  # two fifths of the step
    done = inspect(run, Tolerances(ALL, (), "not-out"))
    assert done.report is not None
    assert done.failed
    left = {each.message.split()[0] for each in done.findings if each.code == 502}
    assert "diameter" in left
    for each in done.report.inspection:
        assert math.isfinite(each.fit_mm)
        assert math.isfinite(each.standard_um or 0.0)


JOB = """
feed = "300mm/min"
step_down = "1mm"
[tools.mill]
number = 1
diameter = "2mm"
[tools.bit]
number = 2
kind = "v"
diameter = "6mm"
tip_angle = "90deg"
[tools.ball]
number = 3
kind = "ball"
diameter = "2mm"
"""
OUTLINES = """
[[operations]]
kind = "profile"
tool = "{tool}"
depth = "4mm"
{more}
"""
RIMS = """
[[operations]]
name = "rims"
kind = "chamfer"
tool = "bit"
chamfer = "0.5mm"
"""


def cut_deep(plate: Path, operations: str, *settings: str) -> Run:
    file = plate.parent / "job.toml"
    file.write_text(JOB + operations)
    target = camtool.load_target("linuxcnc", settings=[*EXACT, *KNOWN, *settings])
    return camtool.post(plate, target, job=camtool.read_job(file))


@pytest.mark.parametrize(
    ("tool", "more", "rims"),
    [
        ("mill", "", RIMS),
        ("mill", 'tabs = { count = 4, width = "3mm", height = "1.5mm" }', ""),
        ("mill", 'finish = "0.2mm"', ""),
        (
            "mill",
            'tabs = { count = 3, width = "4mm", height = "2.5mm" }\nentry = "ramp:2deg"',
            RIMS,
        ),
        ("ball", "", ""),
    ],
)
def test_an_exact_machine_makes_what_is_drawn_at_every_depth(
    plate: Path, tool: str, more: str, rims: str
) -> None:
    run = cut_deep(plate, OUTLINES.format(tool=tool, more=more) + rims)
    inspector = Inspector(run, ALL)
    assert not inspector.left_out
    for each, size in zip(inspector.dimensions, inspector.sizes(), strict=True):
        for one in (size.fit_mm, size.low_mm, size.high_mm):
            assert one == pytest.approx(each.bound.drawn_mm, abs=1e-3)


def test_a_chamfer_alone_makes_no_dimension(plate: Path) -> None:
    done = inspect(cut_deep(plate, RIMS), Tolerances(ALL))
    assert done.report is not None
    assert done.report.inspection == ()
    assert InspectionCode.DIMENSION_NOT_CUT in {each.code for each in done.findings}


def test_every_depth_counts(plate: Path) -> None:
    """The first pass comes from elsewhere than the others, so that its reversals are others."""
    slack = "axes.x.backlash_mm=0.06", "axes.y.backlash_mm=0.04"
    run = cut_deep(plate, OUTLINES.format(tool="mill", more=""), *slack)
    one = [Inspector(run, ALL).sizes()]
    inspector = Inspector(run, ALL)
    for each in inspector.dimensions:
        for cut in each.cuts:
            assert len(cut.levels_mm) == 4
    # Slide by slide, of the moves of each depth and below: the extremes are among them.
    slides = inspector.slides(run.target.machine)
    for index, each in enumerate(inspector.dimensions):
        sizes = []
        for level in (math.inf, -2.0, -3.0, -4.0):
            part = slides.of(slides.z <= level + 1e-9)
            lies = [
                edge_at(feature, cut, rows_of(part, cut, feature))
                for feature, cut in zip(each.bound.features, each.cuts, strict=True)
            ]
            size = size_of(each.bound, [*each.cuts], [lie[:1] for lie in lies])
            assert size is not None
            sizes.append(size)
        assert one[0][index].low_mm == pytest.approx(min(s.low_mm for s in sizes), abs=1e-6)
        assert one[0][index].high_mm == pytest.approx(max(s.high_mm for s in sizes), abs=1e-6)


def test_a_scaled_part_is_refused(plate: Path) -> None:
    with pytest.raises(OptionError, match="as drawn"):
        inspect(posted(plate, scale=2.0), Tolerances((WIDTH,)))


def test_each_copy_is_inspected(plate: Path) -> None:
    run = posted(plate, copies=(2, 1), pitch_mm=(50.0, 40.0))
    found = verdicts(run, WIDTH, HOLE)
    assert [each.name for each in found] == [
        "distance, copy 1",
        "distance, copy 2",
        "diameter, copy 1",
        "diameter, copy 2",
    ]
    assert found[0].fit_mm == pytest.approx(found[1].fit_mm, abs=1e-6)


@pytest.mark.parametrize(
    ("rotate", "mirror"),
    [
        pytest.param("0deg", "x", marks=pytest.mark.slow),
        pytest.param("90deg", None, marks=pytest.mark.slow),
        ("90deg", "x"),
    ],
)
def test_turned_and_mirrored_with_exchanged_axes_no_verdict_changes(
    plate: Path, rotate: str, mirror: str | None
) -> None:
    slack = "axes.x.backlash_mm=0.03", "axes.y.backlash_mm=0.01"
    plain = verdicts(posted(plate, *slack), *ALL)
    turned = rotate == "90deg"
    names = {"x": "y", "y": "x"} if turned else {"x": "x", "y": "y"}
    settings = []
    for each in (*slack, *KNOWN):
        key, value = each.split("=")
        parts = [names.get(part, part) for part in key.split(".")]
        settings.append(f"{'.'.join(parts)}={value}")
    more = {} if mirror is None else {"mirror": mirror}
    other = verdicts(
        posted(plate, *settings, rotate_rad=math.radians(90.0 if turned else 0.0), **more), *ALL
    )
    for one, two in zip(plain, other, strict=True):
        assert one.verdict == two.verdict
        assert one.fit_mm == pytest.approx(two.fit_mm, abs=2e-3)
        assert one.standard_um == pytest.approx(two.standard_um, rel=0.1, abs=0.3)


BIG = """<svg xmlns="http://www.w3.org/2000/svg" width="90mm" height="90mm" viewBox="0 0 90 90">
<circle cx="45" cy="45" r="30" fill="none" stroke="black"/></svg>"""


@pytest.mark.parametrize(
    ("scales", "lean"), [((2e-4, 2e-4), 0.0), ((3e-4, 0.0), 2e-4), ((0.0, 0.0), 2e-4)]
)
def test_what_makes_ellipses_of_circles_makes_the_least_diameter_less(
    tmp_path: Path, scales: tuple[float, float], lean: float
) -> None:
    """With the scales 1 + a and 1 + b and the squareness c, a circle of the diameter D has
    diameters from D (1 + (a + b)/2 − h) to D (1 + (a + b)/2 + h), h = √((a − b)² + c²)/2."""
    file = tmp_path / "big.svg"
    file.write_text(BIG)
    exact = [each.partition("=")[0] + "=0.0" for each in KNOWN]
    x, y = scales
    said = (
        f"uncertainty.x.scale={x}",
        f"uncertainty.y.scale={y}",
        f"uncertainty.squareness_rad={lean}",
    )
    target = camtool.load_target("linuxcnc", settings=[*EXACT, *exact, *said])
    run = camtool.post(file, target, job=camtool.job_of(tool_diameter_mm=2.0))
    random, count = np.random.default_rng(3), 100_000
    a, b = random.normal(0.0, x, count), random.normal(0.0, y, count)
    h = 0.5 * np.hypot(a - b, random.normal(0.0, lean, count))
    way = 62.0  # diameter of the path of the tool's centre, which runs outside
    for limits in ((-0.02, 0.05), (-0.05, 0.02), (-0.01, 0.01)):
        one = verdicts(run, dimension("diameter", (45.0, 45.0), limits=limits))[0]
        middle, off = one.fit_mm + way * 0.5 * (a + b), way * h
        is_in = (middle - off >= 60 + limits[0]) & (middle + off <= 60 + limits[1])
        assert one.probability is not None
        assert one.probability == pytest.approx(float(is_in.mean()), abs=0.02), limits


def test_squareness_that_nobody_says_matters_to_a_circle(plate: Path) -> None:
    """To either side it makes the same ellipse: the derivative is 0."""
    said = [each for each in KNOWN if "squareness" not in each]
    target = camtool.load_target("linuxcnc", settings=[*EXACT, *said])
    run = camtool.post(plate, target, job=camtool.job_of(tool_diameter_mm=2.0))
    wide = dimension("roundness", (15.0, 20.0), limits=(0.0, 1.0))
    width, hole, roundness = verdicts(run, WIDTH, HOLE, wide)
    assert width.unknown == ()
    assert hole.unknown == roundness.unknown == ("squareness_rad",)
    assert hole.verdict == roundness.verdict == "undecided"


def test_probabilities_agree_with_brute_force(plate: Path) -> None:
    """A width depends on scale, tool and edges exactly linearly here: 10,000 draws of them."""
    lower, upper = -0.015, 0.01
    one = verdicts(posted(plate), dimension("distance", (5, 20), (45, 20), limits=(lower, upper)))
    random = np.random.default_rng(7)
    count = 10_000
    size = one[0].fit_mm + 42.0 * random.normal(0.0, 1e-4, count)
    size -= random.normal(0.0, 0.01, count)
    size += random.normal(0.0, 0.003 * math.sqrt(2.0), count)
    size -= random.normal(0.0, 0.004, count)  # backlash, to first order
    share = float(((size >= 40 + lower) & (size <= 40 + upper)).mean())
    chance = one[0].probability
    assert chance is not None
    assert share == pytest.approx(
        chance, abs=3.0 * math.sqrt(chance * (1 - chance) / count) + 0.02
    )


PLAYED = ("axes.x.backlash_mm=0.03", "axes.y.backlash_mm=0.02", "uncertainty.process_mm=0.0")
COMPENSATED = (
    *PLAYED,
    "axes.x.compensation_mm=0.026",
    "axes.y.compensation_mm=0.02",
    "uncertainty.x.compensation_mm=0.002",
    "uncertainty.y.compensation_mm=0.003",
)


def chances_and_shares(run: Run, asked: list[Dimension], count: int) -> tuple[Floats, Floats]:
    """(D,) the probabilities that are said, and the share of `count` parts that are within their
    limits: each draw of backlash, compensation, scale, squareness and tool is a machine of its
    own, on which the program is simulated and its part measured."""
    said = verdicts(run, *asked)
    inspector, machine = Inspector(run, asked), run.target.machine
    random, inside = np.random.default_rng(11), np.zeros(len(asked))
    for _ in range(count):
        x, y = (
            replace(
                axis,
                # What compensation adds beyond what it says, backlash does not lose.
                backlash_mm=max(
                    0.0,
                    axis.backlash_mm
                    + random.normal(0.0, known.backlash_mm)
                    - random.normal(0.0, known.compensation_mm or 0.0),
                ),
                real_step_mm=axis.real_step_mm * (1.0 + random.normal(0.0, known.scale)),
            )
            for axis, known in (
                (machine.axes.x, machine.uncertainty.x),
                (machine.axes.y, machine.uncertainty.y),
            )
        )
        lean = replace(machine.mechanics, squareness_rad=random.normal(0.0, 0.0001))
        drawn = replace(machine, axes=replace(machine.axes, x=x, y=y), mechanics=lean)
        sizes = inspector.sizes(MachineVariant(drawn, random.normal(0.0, 0.01)))
        for k, (size, each) in enumerate(zip(sizes, said, strict=True)):
            assert each.upper_mm is not None
            above = each.lower_mm is None or size.low_mm >= each.lower_mm
            inside[k] += above and size.high_mm <= each.upper_mm
    return np.array([each.probability for each in said], dtype=np.float64), inside / count


ASKED = {
    PLAYED: [
        dimension("distance", (5.0, 20.0), (45.0, 20.0), limits=(-0.05, -0.02)),
        dimension("distance", (20.0, 5.0), (20.0, 35.0), limits=(-0.03, -0.005)),
        dimension("distance", (25.0, 20.0), (37.0, 20.0), limits=(-0.02, 0.01)),
        dimension("distance", (5.0, 20.0), (15.0, 20.0), limits=(-0.02, -0.01)),
        dimension("diameter", (15.0, 20.0), limits=(-0.045, 0.045)),
        dimension("roundness", (15.0, 20.0), limits=(0.0, 0.03)),
    ],
    COMPENSATED: [
        dimension("distance", (5.0, 20.0), (45.0, 20.0), limits=(-0.02, 0.02)),
        dimension("distance", (5.0, 20.0), (15.0, 20.0), limits=(-0.009, 0.01)),
        dimension("diameter", (15.0, 20.0), limits=(-0.02, 0.02)),
        dimension("diameter", (15.0, 20.0), limits=(-0.008, 0.03)),
        dimension("roundness", (15.0, 20.0), limits=(0.0, 0.006)),
        dimension("position", (15.0, 20.0), limits=(0.0, 0.006)),
    ],
}


@pytest.mark.parametrize(
    ("added", "count"),
    [
        pytest.param(added, count, marks=pytest.mark.slow if count > 1000 else ())
        for added in ASKED
        for count in (40, 10_000)
    ],
)
def test_probabilities_agree_with_simulated_parts(
    plate: Path, added: tuple[str, ...], count: int
) -> None:
    """Extremes such as the least diameter of a hole have a distribution of their own."""
    chances, shares = chances_and_shares(posted(plate, *added), ASKED[added], count)
    assert ((chances > 0.1) & (chances < 0.99)).all(), chances
    errors = np.sqrt(chances * (1.0 - chances) * (1.0 / count + 1.0 / DRAWS))
    assert (np.abs(chances - shares) < 4.0 * errors).all(), (chances, shares)


def test_from_python_as_the_command_says_it(plate: Path, tmp_path: Path) -> None:
    file = tmp_path / "tolerances.toml"
    file.write_text('[[dimension]]\nkind = "diameter"\nat = [15, 20]\nlimits = "±0.1"\n')
    done = camtool.inspect(posted(plate), file, require="in")
    assert done.report is not None
    assert [each.verdict for each in done.report.inspection] == ["in"]
    assert camtool.inspect(posted(plate)).report == posted(plate).report  # it draws none
    with pytest.raises(OptionError, match="without a drawing"):
        camtool.inspect(camtool.verify(done.data, "linuxcnc"))
