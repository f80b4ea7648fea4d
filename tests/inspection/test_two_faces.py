"""Dimensions between features that two set-ups cut, against the geometry of turning over."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest

from camtool.api import read_job
from camtool.importers.read import read_drawing
from camtool.inspection.tolerances import dimensions_of
from camtool.inspection.verdicts import Tolerances, inspect
from camtool.pipeline import post_drawing
from camtool.target.registry import load_target

JOB = """
tool_diameter = 3
feed = 200

[stock]
corner = [-10, -10]
size = [100, 60]
thickness = 8

[[operations]]
name = "above"
kind = "pocket"
layers = ["ABOVE"]
depth = 3

[[operations]]
name = "below"
kind = "pocket"
layers = ["BELOW"]
depth = 3

[[setups]]
name = "top"
operations = ["above"]

[[setups]]
name = "bottom"
operations = ["below"]
flip = "FLIP"
line = LINE
ERROR
"""

DIMENSIONS = """
[[dimension]]
name = "centres"
kind = "distance"
from = [10, 10]
to = [52, 28]
direction = "x"
limits = "+0.1/-0.1"

[[dimension]]
name = "edges"
kind = "distance"
from = [60, 5]
to = [74, 5]
limits = "+0.1/-0.1"

[[dimension]]
name = "own"
kind = "diameter"
at = [52, 28]
limits = "+0.1/-0.1"
"""

LINES = {"y": 40.0, "x": 20.0}


def inspected(
    folder: Path, setup: str, flip: str, error: str = "", settings: tuple[str, ...] = ()
) -> dict[str, Any]:
    """The reports of the dimensions by name: circles and slots of both faces."""
    document = ezdxf.new(units=4)
    space = document.modelspace()
    space.add_circle((10.0, 10.0), 5.0, dxfattribs={"layer": "ABOVE"})
    space.add_circle((52.0, 28.0), 4.0, dxfattribs={"layer": "BELOW"})
    for left, right, layer in ((55.0, 60.0, "ABOVE"), (74.0, 79.0, "BELOW")):
        corners = [(left, 0.0), (right, 0.0), (right, 12.0), (left, 12.0)]
        space.add_lwpolyline(corners, close=True, dxfattribs={"layer": layer})
    document.saveas(folder / "a.dxf")
    text = JOB.replace("FLIP", flip).replace("LINE", str(LINES[flip])).replace("ERROR", error)
    (folder / "a.toml").write_text(text)
    (folder / "t.toml").write_text(DIMENSIONS)
    drawing = read_drawing(folder / "a.dxf")
    job = read_job(folder / "a.toml").setup(setup)
    run = post_drawing(drawing, job, load_target("linuxcnc", settings=settings))
    tolerances = Tolerances(*dimensions_of(drawing, folder / "t.toml"))
    done = inspect(run, tolerances)
    assert done.verification is not None
    return {each.name: each for each in done.verification.report.inspection}


@pytest.mark.parametrize("flip", ["x", "y"])
def test_both_set_ups_tell_the_same_distance(flip: str, tmp_path: Path) -> None:
    top, bottom = (inspected(tmp_path, name, flip) for name in ("top", "bottom"))
    for name, nominal in (("centres", 42.0), ("edges", 14.0)):
        for each in (top[name], bottom[name]):
            assert each.fit_mm == pytest.approx(nominal, abs=0.004)
            assert "flip_error" in each.unknown
            assert each.verdict == "undecided"
        assert top[name].fit_mm == pytest.approx(bottom[name].fit_mm, abs=1e-4)
    assert bottom["own"].fit_mm == pytest.approx(8.0, abs=0.01)
    assert "flip_error" not in bottom["own"].unknown
    assert "own" not in top  # its set-up inspects it


@pytest.mark.parametrize(("setup", "flip"), [("top", "x"), ("bottom", "y")])
def test_an_error_of_scale_counts_from_the_zero_of_each_face(
    setup: str, flip: str, tmp_path: Path
) -> None:
    """X of a machine that makes 0.1 % too much. About a line along Y, what the second face cuts
    lies too far on the other side; about a line along X it lies as in the first face."""
    wide = 1.001
    step = load_target("linuxcnc").machine.axes.x.coded_step_mm
    found = inspected(tmp_path, setup, flip, settings=(f"axes.x.real_step_mm={step * wide!r}",))

    def place(x: float, layer: str) -> float:
        if layer == "ABOVE" or flip == "x":
            return x * wide
        return 2.0 * LINES["y"] - (2.0 * LINES["y"] - x) * wide

    for name, a, b in (("centres", 10.0, 52.0), ("edges", 60.0, 74.0)):
        wanted = place(b, "BELOW") - place(a, "ABOVE")
        assert found[name].fit_mm == pytest.approx(wanted, abs=0.004), name


@pytest.mark.parametrize("flip", ["x", "y"])
def test_the_flip_error_is_a_source_of_uncertainty(flip: str, tmp_path: Path) -> None:
    """Against parts whose second face is put beside the first one by lot."""
    error = 0.06
    found = inspected(tmp_path, "bottom", flip, f"flip_error = {error}")
    some = np.random.default_rng(3)
    beside = some.uniform(-error, error, (20_000, 2))
    for name, (a, b) in (
        ("centres", ((10.0, 10.0), (52.0, 28.0))),
        ("edges", ((60.0, 5.0), (74.0, 5.0))),
    ):
        lengths = np.array(b)[0] + beside[:, 0] - a[0]
        shares = {one.input: one.um for one in found[name].contributions}
        assert shares["flip_error.x"] == pytest.approx(1000.0 * lengths.std(), rel=0.02)
        assert shares.get("flip_error.y", 0.0) == pytest.approx(0.0, abs=0.01)
        assert "flip_error" not in found[name].unknown
    assert math.isfinite(found["own"].fit_mm)
    assert not any("flip" in one.input for one in found["own"].contributions)
