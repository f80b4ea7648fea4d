"""The tolerances in docs/verifying.md are those of the code."""

import re
from pathlib import Path

import pytest

from camtool.geometry.polylines import POSITION_EPS_MM
from camtool.importers.options import GAP_MM, TOLERANCE_MM
from camtool.target.registry import load_target
from camtool.verification.case import COVERAGE_MM, COVERAGE_RESOLUTIONS, COVERAGE_STEPS
from camtool.verification.registration import NEAR_MM, NEAR_SHARE, NEAR_SIZE

PAGE = (Path(__file__).parents[2] / "docs" / "verifying.md").read_text(encoding="utf-8")


def numbers(row: str) -> list[str]:
    """Return the numbers with their units in the second column of the row that begins so."""
    (cell,) = re.findall(rf"^\| {row}[^|]*\|([^|]*)\|", PAGE, re.MULTILINE)
    return re.findall(r"[\d.]+ (?:µm|mm|%|steps|units)", cell)


def um(value_mm: float) -> str:
    return f"{value_mm * 1000:.6g} µm"


@pytest.mark.parametrize(
    ("row", "values"),
    [
        ("gap between two ends", [um(GAP_MM)]),
        ("distance below which two positions are equal", [um(POSITION_EPS_MM)]),
        ("error of an offset", [um(POSITION_EPS_MM)]),
        (
            "coverage",
            [um(COVERAGE_MM), f"{COVERAGE_STEPS:g} steps", f"{COVERAGE_RESOLUTIONS:g} units"],
        ),
        (
            "a foreign program",
            [f"{NEAR_MM:g} mm", f"{NEAR_SHARE * 100:g} %", f"{NEAR_SIZE * 100:g} %"],
        ),
    ],
)
def test_tolerances_are_those_of_the_code(row: str, values: list[str]) -> None:
    assert numbers(row) == values


def test_the_tolerance_of_curves_is_that_of_the_machine() -> None:
    assert numbers("distance of the fitted arcs") == [
        um(TOLERANCE_MM),
        um(load_target("pic-mmh").machine.defaults.fit_tolerance_mm),
    ]
