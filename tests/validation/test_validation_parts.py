"""The emblems of two theses, redrawn: details, reversals, halves and times beside the readings.

What is given of a shape and what is our drawing stands in docs/validation.md.
"""

from __future__ import annotations

import pytest

import camtool
from camtool.planning.job import Placement
from camtool.records import replace
from tests.validation.page import check, mm, signed
from tests.validation.pic_mmh_parts import REGIONS
from tests.validation.pieces import PIECES, UM, own_job, piece

EARS = {
    "puma-5": ((350, 330), (350, 370), "c, d"),  # Tabla 16, L2674-2950
    "puma-1.2-halves": ((80, 100), (80, 97), "h, j"),  # Tabla 17, cut by halves
    "puma-1": ((70, 45), (70, 103), "n, o"),  # Tabla 18
}
"""Of the left and the right ear: nominal and measured width, µm; the details' letters."""
HALVES_UM, ONE_CONTOUR_UM = 3, 59
"""How much h and j differ by halves, and in one contour, L2816-2841."""
STEPS = (
    ("puma-5", "Y", {"a": 11, "b": 20}),
    ("puma-5", "X", {"e": 15}),
    ("puma-5", "", {"i": "12, 10", "f": "15, 10"}),
    ("puma-1.2", "Y", {"Ie": 29, "ñ": 2, "ll": 24, "g": 3}),
    ("puma-1", "Y", {"k": 6, "L": 5}),
    ("puma-1", "X", {"m": 29}),
    ("gmm-5", "X", {"p, q": 3, "r, s": 4}),
    ("gmm-5", "Y", {"t": 2, "u": 3}),
    ("gmm-1.2", "", {"v": 27, "w": 29, "x": 25}),
)
"""The other details of Tablas 16-20, µm, with the axis where the tables name one."""
EXCESS_UM = {"X": 11.5, "Y": 9.5}
"""Compensation less backlash of the machine file."""
REVERSALS = {
    "puma-5": "15-16",
    "puma-1.2": "15-16",
    "puma-1": "15-16",
    "gmm-5": "45",
    "gmm-1.2": "45",
}
"""L3052-3057."""
TIMES = {"flashcut-lmm": (45 * 60, 0.94), "flashcut-puma": (23 * 60 + 30, 2.03)}
"""Seconds by the thesis at 20 ms throughout, L1676-1680, and the scale at which our drawing takes
as long."""
THROUGHOUT = "controller.single_axis_half_period_ms=20"


def ears(name: str, *settings: str, minimise: str = "rapids") -> tuple[float, float]:
    """Return the predicted widths of both ears, µm, as `--tolerances` inspects them."""
    job = replace(own_job(name), minimise=minimise)
    target = camtool.load_target("pic-mmh", settings=settings)
    run = camtool.post(PIECES / f"pic-mmh-{name}.dxf", target, job)
    run = camtool.inspect(run, PIECES / f"{name.removesuffix('-halves')}.tolerances.toml")
    assert run.report is not None
    assert run.report.inspection is not None
    left, right = (row.fit_mm for row in run.report.inspection)
    return left * UM, right * UM


def excess_by_region(axis: str) -> tuple[float, float]:
    """Return the least and the greatest excess of the compensation over the backlash, µm."""
    added = {"X": 204.0, "Y": 178.0}[axis]
    found = [added - region[3] for region in REGIONS.values() if region[0] == axis.lower()]
    return min(found), max(found)


def test_details(bless: bool) -> None:
    rows = []
    ours = {name: ears(name) for name in EARS}
    for name, (left, right, letters) in EARS.items():
        for k, (nominal, measured) in enumerate((left, right)):
            off = ours[name][k] - nominal
            # The sense of the error is the measured one in all six.
            assert off * (measured - nominal) > 0.0
            rows.append(
                [
                    name,
                    letters.split(", ")[k],
                    f"{nominal}",
                    f"{measured} ({signed(measured - nominal, 0)})",
                    f"{ours[name][k]:.1f} ({signed(off)})",
                    "partly: sense",
                ]
            )
    left, right = ears("puma-1.2")
    by_halves = abs(ours["puma-1.2-halves"][0] - ours["puma-1.2-halves"][1])
    least = ears("puma-1.2", minimise="reversals")
    assert least == pytest.approx((80.0, 80.0), abs=0.3)
    rows += [
        [
            *("puma-1.2", "h − j, one contour", "0", f"{ONE_CONTOUR_UM}"),
            *(f"{right - left:.1f}", "partly: smaller"),
        ],
        ["puma-1.2-halves", "h − j, halves", "0", f"{HALVES_UM}", f"{by_halves:.1f}", "works"],
    ]
    for part, axis, letters_um in STEPS:
        for letter, measured_um in letters_um.items():
            predicted, verdict = "–", "out: no axis, and the figure is lost"
            if isinstance(measured_um, int) and axis:
                least_um, most_um = excess_by_region(axis)
                predicted = f"{EXCESS_UM[axis]}; {signed(least_um, 0)} to {signed(most_um, 0)}"
                is_inside = least_um <= measured_um <= most_um
                verdict = "partly: in the range" if is_inside else "partly: larger"
            what = f"{letter}, a step in {axis}" if axis else letter
            rows.append([part, what, "0", f"{measured_um}", predicted, verdict])
    heads = ["part", "detail", "nominal, µm", "thesis, µm", "camtool, µm", "verdict"]
    check("pic-details", heads, rows, bless)


def test_most_steps_lie_within_what_regions_differ() -> None:
    """Twelve of the fourteen readings with an axis lie where backlash by region puts them."""
    within = []
    for _, axis, letters_um in STEPS:
        for measured_um in letters_um.values():
            if axis and isinstance(measured_um, int):
                least_um, most_um = excess_by_region(axis)
                within.append(least_um <= measured_um <= most_um)
    assert (sum(within), len(within)) == (12, 14)


def test_reversals(bless: bool) -> None:
    rows = []
    for name, given in REVERSALS.items():
        report = piece(f"pic-mmh-{name}").report
        cutting, both = report.cutting_reversals, report.reversals.x + report.reversals.y
        assert cutting == int(given.split("-")[0])
        runs = replace(own_job(name), minimise="reversals")
        halved = piece(f"pic-mmh-{name}", job=runs).report
        times = [f"{each.time_s / 60.0:.1f}" for each in (report, halved)]
        counts = (cutting, both, halved.cutting_reversals)
        rows.append([name, given, *map(str, counts), *times])
    heads = ["part", "compensations, thesis", "while cutting", "with the ways between"]
    heads += ["with `--minimise reversals`", "time, min", "with it"]
    check("pic-reversals", heads, rows, bless)


def test_the_circle_of_150_um_is_stepped_where_axes_reverse() -> None:
    """«Region C», L3032-3034: a circle of this radius is deformed at the borders of quadrants."""
    (circle,) = piece("pic-mmh-gmm-5").report.circles
    assert circle.radius_mm == pytest.approx(0.15)
    assert circle.G_um == pytest.approx(11.6, abs=0.2)


def test_times_on_the_parallel_port(bless: bool) -> None:
    rows = []
    for name, (taken_s, scale) in TIMES.items():
        plain = piece(name, THROUGHOUT)
        job = replace(own_job(name), placement=Placement(scale=scale))
        scaled = piece(name, THROUGHOUT, job=job).report
        assert scaled.time_s == pytest.approx(taken_s, rel=0.01)
        width = plain.report.dimensions[0].nominal_mm
        rows.append(
            [
                name,
                mm(width, 1),
                f"{taken_s / 60.0:.1f}",
                f"{plain.report.time_s / 60.0:.1f}",
                f"{scale * width:.1f}",
                f"{plain.report.cutting_reversals}",
            ]
        )
    heads = ["part", "width, mm", "thesis, min", "camtool, min", "as long at a width of, mm"]
    check("flashcut-emblems", [*heads, "reversals while cutting"], rows, bless)


def test_every_drawing_has_the_size_that_is_given() -> None:
    sizes = {
        "pic-mmh-puma-5": (4.86, 4.96),
        "pic-mmh-puma-1.2": (1.17, 1.19),
        "pic-mmh-puma-1.2-halves": (1.17, 1.19),
        "pic-mmh-puma-1": (0.97, 0.99),
        "pic-mmh-gmm-5": (5.0, 4.997),
        "pic-mmh-gmm-1.2": (1.21, 1.08),
    }
    for name, size in sizes.items():
        width, height = piece(name).report.dimensions[:2]
        assert (width.nominal_mm, height.nominal_mm) == pytest.approx(size, abs=1e-6)
        assert own_job(name).operations
