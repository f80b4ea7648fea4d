"""Engraving: every path as it is drawn, open ones from either end."""

from __future__ import annotations

import numpy as np
import pytest

from camtool.errors import OptionError
from camtool.geometry.polylines import Polyline, Polylines
from camtool.planning.engrave import engrave
from camtool.planning.items import Chosen, Contour, Feeds, Setting
from camtool.planning.job import Operation
from tests.oracles import contours as shapes

PATHS = [shapes.SLOT, shapes.opened((0, 0), (5, 0, 1), (9, 0)), shapes.NOTCH]


def setting_of(direction: str = "drawn") -> Setting:
    operation = Operation(kind="engrave", name="marks", direction=direction)
    return Setting(operation, Feeds(100.0, 40.0), (-0.1,), 5.0)


def chosen_of(paths: list[Polyline]) -> Chosen:
    names = tuple(f"PATH {index}" for index in range(len(paths)))
    return Chosen(
        Polylines.of(paths),
        3 + np.arange(len(paths)),
        names,
        np.empty((0, 2)),
        (),
        np.zeros(len(paths), bool),
    )


def test_paths_are_kept_as_they_are_drawn() -> None:
    setting = setting_of()
    work = engrave(chosen_of(PATHS), setting)
    assert not work.findings
    for index, (item, path) in enumerate(zip(work.items, PATHS, strict=True)):
        assert isinstance(item, Contour)
        assert item.path.vertices.tolist() == path.vertices.tolist()
        assert item.path.closed == path.closed
        assert (item.name, item.source) == (f"PATH {index}", 3 + index)
        assert item.setting is setting


def test_open_paths_may_begin_at_either_end_and_closed_ones_anywhere_but_not_backwards() -> None:
    work = engrave(chosen_of(PATHS), setting_of())
    assert [item.reversible for item in work.items] == [False, True, False]
    assert all(len(item.starts) == 0 for item in work.items)
    assert all(item.material_left is None for item in work.items)


@pytest.mark.parametrize("direction", ["climb", "conventional"])
def test_a_groove_has_no_side_to_climb_on(direction: str) -> None:
    with pytest.raises(OptionError, match=direction) as caught:
        engrave(chosen_of(PATHS), setting_of(direction))
    assert caught.value.where == "operation 'marks', key direction"
    assert "drawn" in caught.value.mend


def test_nothing_chosen_is_no_work() -> None:
    assert not len(engrave(chosen_of([]), setting_of()).items)
