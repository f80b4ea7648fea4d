"""The headline error against what was really drawn: an oracle of its own reads and samples the
drawing, and measures the simulated slides against it."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import ezdxf
import numpy as np
import pytest

from camtool.api import as_drawing, read_drawing, verify
from camtool.arrays import Floats
from camtool.importers.options import ReadOptions
from camtool.jobs.drawing import read_to_scale
from camtool.pipeline import post_drawing
from camtool.planning.findings import PlanningCode
from camtool.planning.job import Job, Tool, job_of
from camtool.planning.place import place
from camtool.run import Run
from camtool.target.registry import load_target
from tests.oracles.true_curves import distances, drawn, slides_cutting

ROOT = Path(__file__).parents[2]
SCALES = (0.05, 1.0, 40.0)
TARGETS = ("linuxcnc", "grbl", "pic-mmh")

ORACLE_UM = 0.002
"""What the oracle's own chords and the report's last decimal may differ by."""

LARGE = "axes.{}.travel_mm=5000"
"""Machines large enough for every scale: only their size is made up."""


def spline_dxf(file: Path, seed: int) -> None:
    """Splines and ellipses, open and closed, and a line and an arc that are exact."""
    rng = np.random.default_rng(seed)
    document = ezdxf.new()
    document.header["$INSUNITS"] = 4
    space = document.modelspace()
    for number in range(3):
        centre = np.array([6.0 * number, 0.0])
        angle = np.linspace(0.0, 2.0 * math.pi, 8)[:-1] + rng.uniform(0.0, 0.5, 7)
        radius = rng.uniform(1.0, 2.5, 7)
        points = centre + radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        if number == 1:
            space.add_open_spline([(*p, 0.0) for p in points.tolist()])
        else:
            round_ = [*points.tolist(), points[0].tolist()]
            space.add_cad_spline_control_frame([(*p, 0.0) for p in round_])
    axis = rng.uniform(0.5, 2.0, 2)
    space.add_ellipse((0.0, 7.0), (*axis.tolist(), 0.0), float(rng.uniform(0.2, 0.9)))
    space.add_ellipse((6.0, 7.0), (2.0, 0.3, 0.0), 0.4, 0.5, 4.0)
    space.add_line((10.0, 5.0), (14.0, 6.5))
    space.add_arc((12.0, 8.0), 1.0, 20.0, 250.0)
    document.saveas(file)


def bezier_svg(file: Path, seed: int) -> None:
    """Cubic and quadratic Béziers and elliptical arcs."""
    rng = np.random.default_rng(seed)
    rows = []
    for number in range(6):
        points = rng.uniform(0.0, 4.0, (5, 2)) + np.array(
            [5.0 * (number % 3), 5.0 * (number // 3)]
        )
        a, b, c, d, e = (f"{x:.6f},{y:.6f}" for x, y in points.tolist())
        rx, ry, turn = rng.uniform(2.0, 4.0), rng.uniform(2.0, 4.0), rng.uniform(0.0, 90.0)
        rows.append(f"M {a} C {b} {c} {d} Q {c} {e} A {rx:.5f} {ry:.5f} {turn:.3f} 0 1 {a}")
    paths = "".join(f'<path fill="none" stroke="black" d="{row}"/>' for row in rows)
    file.write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="15mm" height="10mm" viewBox="0 0 15 10">'
        f"{paths}</svg>",
        encoding="utf-8",
    )


def posted(file: Path, target: str, job: Job, *settings: str) -> Run:
    """The file posted on a machine as large as the part."""
    room = [LARGE.format(axis) for axis in "xy"]
    loaded = load_target(target, settings=[*room, *settings])
    return post_drawing(as_drawing(file, loaded, job), job, loaded)


def truth_um(made: Run, file: Path, scale: float, target: str) -> Floats:
    """(S,) the distance of every slide from the true drawing at its size."""
    loaded = load_target(target, settings=[LARGE.format(axis) for axis in "xy"])
    assert made.decoded is not None
    slides = slides_cutting(made.decoded, loaded.machine)
    return 1000.0 * distances(slides, [scale * curve for curve in drawn(file)])


def check(file: Path, target: str, scale: float, fits: float = 1.0) -> Run:
    """The report's total is never below the truth, and not above it by more than so many fits.

    With d from a slide to its move and f from that to the curve, the truth t is d − f at least, so
    that the total d + f is t + 2f at most; over many places the largest of both comes nearer.
    """
    made = posted(file, target, job_of(scale=scale))
    assert made.verification is not None, made.findings
    error = made.verification.report.error_um
    truth = truth_um(made, file, scale, target)
    assert error.fit.max is not None
    assert error.total.max is not None
    assert error.total.rms is not None
    assert error.total.p95 is not None
    assert truth.max() <= error.total.max + ORACLE_UM
    assert error.total.max <= truth.max() + fits * error.fit.max + ORACLE_UM
    assert math.sqrt(float((truth**2).mean())) <= error.total.rms + ORACLE_UM
    assert float(np.quantile(truth, 0.95)) <= error.total.p95 * 1.005 + ORACLE_UM
    tolerance = load_target(target).machine.defaults.fit_tolerance_mm
    assert error.fit.max <= 1000.0 * tolerance * 1.001
    return made


WRITERS: dict[str, Callable[[Path, int], None]] = {".dxf": spline_dxf, ".svg": bezier_svg}


def random_file(kind: str, seed: int, folder: Path) -> Path:
    file = folder / f"random{kind}"
    WRITERS[kind](file, seed)
    return file


@pytest.mark.parametrize(
    ("kind", "target", "scale"),
    [
        (".dxf", "linuxcnc", 0.05),
        (".dxf", "linuxcnc", 1.0),
        (".dxf", "linuxcnc", 40.0),
        (".dxf", "pic-mmh", 1.0),
        (".svg", "grbl", 40.0),
        (".svg", "pic-mmh", 0.05),
    ],
)
def test_the_total_is_the_distance_from_the_true_curves(
    kind: str, target: str, scale: float, tmp_path: Path
) -> None:
    check(random_file(kind, 1, tmp_path), target, scale)


PLACINGS: dict[str, dict[str, object]] = {
    "lower-left": {"origin": "lower-left", "scale": 2.0},
    "centre": {"origin": "centre", "mirror": "x"},
    "turned": {"origin": "lower-left", "rotate_rad": 0.4},
    "fit": {"fit_mm": (9.0, 0.0)},
    "fit both": {"fit_mm": (12.0, 40.0), "origin": "lower-left", "rotate_rad": 0.5 * math.pi},
    "fit centre": {"fit_mm": (0.0, 14.0), "origin": "centre", "rotate_rad": -1.1, "mirror": "y"},
}


def placed_truth(file: Path, placing: dict[str, object]) -> list[Floats]:
    """The true curves where the box of what was drawn puts them."""
    turn = float(placing.get("rotate_rad", 0.0))  # type: ignore[arg-type]
    cosine, sine = math.cos(turn), math.sin(turn)
    flip = {"x": (-1.0, 1.0), "y": (1.0, -1.0)}.get(str(placing.get("mirror")), (1.0, 1.0))
    matrix = np.array([[cosine, -sine], [sine, cosine]]) @ np.diag(flip)
    curves = [points @ matrix.T for points in drawn(file)]
    low = np.concatenate(curves).min(axis=0)
    high = np.concatenate(curves).max(axis=0)
    scale = float(placing.get("scale", 1.0))  # type: ignore[arg-type]
    if room := placing.get("fit_mm"):
        sides = zip(room, (high - low).tolist(), strict=True)  # type: ignore[call-overload]
        scale = min(side / size for side, size in sides if side)
    zero = {"lower-left": low, "centre": 0.5 * (low + high)}.get(str(placing.get("origin")), 0.0)
    return [scale * (points - zero) for points in curves]


def check_placed(file: Path, target: str, placing: dict[str, object], *settings: str) -> None:
    """The report's total is never below the distance from where the true box puts the curves."""
    made = posted(file, target, job_of(**placing), *settings)
    assert made.verification is not None, made.findings
    assert made.decoded is not None
    loaded = load_target(target, settings=[*(LARGE.format(axis) for axis in "xy"), *settings])
    slides = slides_cutting(made.decoded, loaded.machine)
    truth = 1000.0 * distances(slides, placed_truth(file, placing))
    error = made.verification.report.error_um
    assert error.total.max is not None
    assert error.total.p95 is not None
    assert truth.max() <= error.total.max + ORACLE_UM
    assert float(np.quantile(truth, 0.95)) <= error.total.p95 * 1.005 + ORACLE_UM


@pytest.mark.parametrize("placing", PLACINGS.values(), ids=PLACINGS)
def test_placing_by_a_box_is_in_the_total(placing: dict[str, object], tmp_path: Path) -> None:
    check_placed(random_file(".svg", 1, tmp_path), "grbl", placing)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 10))
@pytest.mark.parametrize("kind", WRITERS)
@pytest.mark.parametrize("placing", PLACINGS.values(), ids=PLACINGS)
@pytest.mark.parametrize("target", TARGETS)
def test_placing_more_curves(
    target: str, placing: dict[str, object], kind: str, seed: int, tmp_path: Path
) -> None:
    check_placed(random_file(kind, seed, tmp_path), target, placing)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 8))
@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("kind", WRITERS)
def test_more_random_curves(
    kind: str, target: str, scale: float, seed: int, tmp_path: Path
) -> None:
    if target == "pic-mmh" and scale > 1.0:
        pytest.skip("its blocks have no digits for 600 mm")
    check(random_file(kind, seed, tmp_path), target, scale, fits=2.0)


@pytest.mark.parametrize("scale", SCALES)
def test_the_sample_too(scale: float) -> None:
    # At a twentieth of its size blends, up to the tolerance of G64, come where the fit is worst.
    check(ROOT / "samples" / "logo.dxf", "linuxcnc", scale, fits=1.2 if scale == 0.05 else 1.0)


def test_the_tolerance_is_of_the_part_whatever_brings_it_to_its_size(tmp_path: Path) -> None:
    """Unit, scale and fit change what is drawn, not the program nor its figures."""
    file = tmp_path / "a.dxf"
    spline_dxf(file, 1)
    loaded = load_target("grbl", settings=[LARGE.format(axis) for axis in "xy"])

    def made(job: Job, **reading: str) -> Run:
        read = read_to_scale(
            lambda options: read_drawing(file, target=loaded, scale=options.scale, **reading),
            ReadOptions(),
            job,
        )
        return post_drawing(read, job, loaded)

    plain, other = made(job_of(scale=2.0)), made(job_of(scale=0.2), units="cm")
    assert plain.program is not None
    assert other.program is not None
    assert plain.program.data == other.program.data
    size = plain.verification.report.dimensions[0].nominal_mm
    fitted = made(job_of(fit_mm=(size, 0.0)))
    # The box of the arcs says the scale, which may be off by both of its sides: that is no fit.
    placed = place(fitted.drawing, job_of(fit_mm=(size, 0.0)))
    apart = {other: 0.0, fitted: 1000.0 * placed.datum_off_mm}
    for one, more in apart.items():
        for name in ("fit", "total"):
            ours = getattr(one.verification.report.error_um, name).max
            ours -= more if name == "total" else 0.0
            assert ours == pytest.approx(
                getattr(plain.verification.report.error_um, name).max, rel=0.05
            )


def test_a_wall_beside_the_tool_is_as_far_off_as_the_report_says(tmp_path: Path) -> None:
    """Round an ellipse with a wide tool: the distance of its centre from the true ellipse is its
    radius, but for the error."""
    file = tmp_path / "ellipse.dxf"
    document = ezdxf.new()
    document.header["$INSUNITS"] = 4
    document.modelspace().add_ellipse((0.0, 0.0), (4.0, 1.0, 0.0), 0.6)
    document.saveas(file)
    tool = Tool(diameter_mm=3.0)
    for side in ("outside", "inside"):
        made = posted(file, "linuxcnc", job_of(scale=10.0, side=side, tool=tool))
        report = made.verification.report
        off = np.abs(truth_um(made, file, 10.0, "linuxcnc") - 1500.0)
        assert off.max() <= report.error_um.total.max + ORACLE_UM
        assert report.error_um.total.max <= off.max() + report.error_um.fit.max + ORACLE_UM
        box = np.ptp(10.0 * np.concatenate(drawn(file)), axis=0)
        for size, true in zip(report.dimensions[:2], box.tolist(), strict=True):
            assert size.nominal_mm == pytest.approx(true, abs=0.01)
            assert size.predicted_mm == pytest.approx(true, abs=0.04)


def test_what_reading_mends_is_in_the_error(tmp_path: Path) -> None:
    """Gaps that are joined, and chords that become an arc: the file says otherwise."""
    gap = tmp_path / "gap.csv"
    gap.write_text("0,0\n10,0\n\n10,0.4\n10,8\n", encoding="utf-8")
    angle = np.linspace(0.0, math.pi, 40)
    arc = tmp_path / "arc.csv"
    rows = np.round(10.0 * np.column_stack([np.cos(angle), np.sin(angle)]), 4)
    arc.write_text("\n".join(f"{x},{y}" for x, y in rows.tolist()), encoding="utf-8")
    sagitta = 10000.0 * (1.0 - math.cos(0.5 * math.pi / 39.0))
    for file, reading, least in (
        (gap, {"gap_mm": 0.5}, 200.0),
        (arc, {"recognise_arcs": True, "tolerance_mm": 0.01}, sagitta),
    ):
        read = read_drawing(file, target="linuxcnc", **reading)
        error = post_drawing(read, job_of(), load_target("linuxcnc")).verification.report.error_um
        assert error.fit.max == pytest.approx(least, rel=0.01)
        assert error.total.max >= least


def test_without_a_drawing_nobody_knows_how_far_it_lies_off(tmp_path: Path) -> None:
    file = tmp_path / "a.dxf"
    spline_dxf(file, 1)
    made = posted(file, "linuxcnc", job_of())
    assert made.verification.report.against == "drawing"
    alone = verify(made.program, "linuxcnc").report
    assert alone.against == "program"
    assert alone.error_um.fit.max is None
    assert "no drawing is known" in alone.to_text()
    assert {item.of for item in alone.dimensions} == {"centre"}


def test_a_drawing_that_was_read_for_a_smaller_part_says_so(tmp_path: Path) -> None:
    file = tmp_path / "a.dxf"
    spline_dxf(file, 1)
    read = read_drawing(file, target="linuxcnc")
    loaded = load_target("linuxcnc", settings=[LARGE.format(axis) for axis in "xy"])
    coarse = post_drawing(read, job_of(scale=40.0), loaded)
    assert PlanningCode.FIT_COARSE in {finding.code for finding in coarse.findings}
    report = coarse.verification.report
    assert report.error_um.fit.max == pytest.approx(40.0 * 1000.0 * read.fit.max_mm)
    assert report.error_um.total.max >= report.error_um.fit.max
    fine = read_drawing(file, target="linuxcnc", scale=40.0)
    found = post_drawing(fine, job_of(scale=40.0), loaded).findings
    assert PlanningCode.FIT_COARSE not in {finding.code for finding in found}
