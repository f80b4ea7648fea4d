"""Verdicts of parts that are really planned, written, read back and simulated."""

import itertools
import math
from pathlib import Path

import numpy as np
import pytest

import camtool
from camtool.errors import OptionError
from camtool.findings import Code, Severity
from camtool.inspection.dimensions import Dimension, Kind, Limits, Place
from camtool.inspection.inspector import Inspector
from camtool.inspection.uncertainty import Variant
from camtool.inspection.verdicts import SURE, Tolerances, inspect
from camtool.run import Run
from camtool.verification.report import InspectedReport

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
    wide = inspector.sizes(Variant(machine, 0.1))
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


@pytest.mark.parametrize("require", ["in", "not-out"])
def test_what_is_required(plate: Path, require: str) -> None:
    run = posted(plate)
    hole = dimension("diameter", (15.0, 20.0), limits=(-0.01, 0.01))
    done = inspect(run, Tolerances((hole,), (), require))  # type: ignore[arg-type]
    mine = [each for each in done.findings if each.code == Code.DIMENSION_NOT_IN]
    assert [each.severity for each in mine] == [
        Severity.ERROR if require == "in" else Severity.WARNING
    ]
    assert done.failed == (require == "in")


def test_what_is_not_cut_and_what_fits_nothing_are_findings(plate: Path) -> None:
    run = posted(plate)
    done = inspect(run, Tolerances((dimension("diameter", (1.0, 1.0)), HOLE)))
    assert Code.DIMENSION_UNBOUND in {each.code for each in done.findings}
    assert done.report is not None
    assert [each.kind for each in done.report.inspection] == ["diameter"]
    some = camtool.post(
        plate,
        run.target,
        job=camtool.job_of(tool_diameter_mm=2.0, select=("outer",)),
    )
    done = inspect(some, Tolerances((HOLE, WIDTH)))
    assert Code.DIMENSION_NOT_CUT in {each.code for each in done.findings}
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
    ("rotate", "mirror"), [*itertools.product(("0deg", "90deg"), (None, "x"))]
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


def test_from_python_as_the_command_says_it(plate: Path, tmp_path: Path) -> None:
    file = tmp_path / "tolerances.toml"
    file.write_text('[[dimension]]\nkind = "diameter"\nat = [15, 20]\nlimits = "±0.1"\n')
    done = camtool.inspect(posted(plate), file, require="in")
    assert done.report is not None
    assert [each.verdict for each in done.report.inspection] == ["in"]
    assert camtool.inspect(posted(plate)).report == posted(plate).report  # it draws none
    with pytest.raises(OptionError, match="without a drawing"):
        camtool.inspect(camtool.verify(done.data, "linuxcnc"))
