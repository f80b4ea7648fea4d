"""The plot of inspected dimensions within their limits."""

from itertools import cycle

import pytest

from camtool.pictures.colours import VERDICTS
from camtool.pictures.limits import MAX_ROWS, draw_limits, has_limits
from camtool.pictures.options import PictureOptions
from camtool.pictures.scene import Scene
from camtool.records import replace
from camtool.verification.report import InspectedReport
from tests.oracles import svg_page


def inspected(
    name: str, fit_mm: float, verdict: str, upper_mm: float | None = 4.01
) -> InspectedReport:
    return InspectedReport(
        name=name,
        kind="distance",
        source="test",
        places_mm=((0.0, 0.0), (4.0, 0.0)),
        nominal_mm=4.0,
        limits="±0.01",
        lower_mm=None if upper_mm is None else 3.99,
        upper_mm=upper_mm,
        fit_mm=fit_mm,
        low_mm=fit_mm - 0.001,
        high_mm=fit_mm + 0.001,
        verdict=verdict,
        standard_um=2.0,
    )


def rows(scene: Scene, options: PictureOptions | None = None) -> list[dict[str, object]]:
    """Of each row: its zone, its dot and what it says."""
    page = svg_page.parse(draw_limits(scene, options or PictureOptions()))
    found = []
    for group in page.iter():
        if group.attrib.get("class") != "dimension":
            continue
        parts = {child.tag.rpartition("}")[2]: child for child in group}
        zone = parts["rect"].attrib
        left, wide = float(zone["x"]), float(zone["width"])
        at = (float(parts["circle"].attrib["cx"]) - left) / wide
        found.append(
            {"at": at, "colour": parts["circle"].attrib["fill"], "says": parts["title"].text}
        )
    return found


def test_a_row_for_each_dimension_with_limits() -> None:
    scene = Scene(
        inspected=(
            inspected("one", 4.0, "in"),
            inspected("two", 4.01, "undecided"),
            inspected("three", 3.98, "out"),
            inspected("four", 4.0, "predicted", None),
        )
    )
    found = rows(scene)
    assert [each["says"] for each in found] == ["one: in", "two: undecided", "three: out"]
    assert [each["at"] for each in found] == pytest.approx([0.5, 1.0, -0.5], abs=1e-3)
    assert [each["colour"] for each in found] == [
        VERDICTS[each] for each in ("in", "undecided", "out")
    ]


def test_what_is_far_out_ends_at_the_edge() -> None:
    found = rows(Scene(inspected=(inspected("far", 99.0, "out"), inspected("low", 0.0, "out"))))
    assert [each["at"] for each in found] == pytest.approx([2.0, -1.0], abs=1e-3)


def test_of_many_those_that_do_not_hold_come_first() -> None:
    words = cycle(("in", "in", "undecided", "out"))
    many = tuple(inspected(f"d{k}", 4.0, next(words)) for k in range(3 * MAX_ROWS))
    found = rows(Scene(inspected=many))
    assert len(found) == MAX_ROWS
    assert sum("out" in str(each["says"]) for each in found) == 3 * MAX_ROWS // 4
    assert f"{2 * MAX_ROWS} more dimensions" in draw_limits(
        Scene(inspected=many), PictureOptions()
    )


def test_dark_and_nothing() -> None:
    scene = Scene(inspected=(inspected("one", 4.0, "in"),))
    dark = draw_limits(scene, replace(PictureOptions(), dark=True))
    assert VERDICTS["in"] not in dark
    assert has_limits(scene)
    assert not has_limits(Scene(inspected=(inspected("four", 4.0, "predicted", None),)))
