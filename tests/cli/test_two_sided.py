"""`camtool job new --two-sided`: set-ups, stock and alignment pins, and the part cut from both
faces."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import ezdxf
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.planning.pins import proposed_pins
from tests.cli.conftest import Run
from tests.oracles.stock import Cutter, moves_of
from tests.oracles.stock import Stock as Needles

WIDE, HIGH, THICK = 80.0, 50.0, 10.0
FRONT, BACK, HOLE = (8, 8, 45, 42), (30, 12, 72, 38), (58.0, 25.0)
"""Two pockets (low x, low y, high x, high y), and a counterbored hole within the second."""


def write_hinge(folder: Path) -> None:
    document = ezdxf.new(units=4)
    space = document.modelspace()
    for layer, (x, y, right, top) in (
        ("OUTLINE", (0, 0, WIDE, HIGH)),
        ("POCKET 4mm", FRONT),
        ("BACK POCKET 3mm", BACK),
    ):
        corners = [(x, y), (right, y), (right, top), (x, top)]
        space.add_lwpolyline(corners, close=True, dxfattribs={"layer": layer})
    space.add_circle(HOLE, 5.5, dxfattribs={"layer": "POCKET 2mm"})
    space.add_circle(HOLE, 3.0, dxfattribs={"layer": "HOLES"})
    document.saveas(folder / "hinge.dxf")


def cut_needles(program: Path, low: tuple[float, float], high: tuple[float, float]) -> Needles:
    needles = Needles(low, high)
    for move in moves_of(program.read_text(encoding="ascii")):
        needles.cut(move, Cutter(1.5))
    return needles


@pytest.mark.parametrize("flip", ["x", "y"])
def test_a_new_two_sided_job_is_cut_from_both_faces(
    camtool: Run, tmp_path: Path, flip: str
) -> None:
    """Two blocks of needles, turned over by hand; what is left of each column."""
    write_hinge(tmp_path)
    new = ("--thickness", "10mm", "--tool-diameter", "3mm", "--two-sided", flip)
    made = camtool("job", "new", "hinge.dxf", *new, "-o", "hinge.toml")
    assert made.returncode == 0, made.stderr
    job = tomllib.loads((tmp_path / "hinge.toml").read_text(encoding="utf-8"))
    pins = job["setups"][1]["pins"]
    said = re.findall(r"X(-?[\d.]+) Y(-?[\d.]+)", made.stderr.decode())
    assert [[float(x), float(y)] for x, y in said] == pins
    assert "BACK POCKET 3mm" in job["setups"][1]["operations"]
    assert job["setups"][1]["operations"][-1] == "OUTLINE outer"
    assert job["setups"][0]["operations"][0] == "pins"
    checked = camtool("job", "check", "hinge.toml", "--against", "hinge.dxf", "--json", "job.json")
    assert checked.returncode == 0, checked.stderr
    assert b"set-up     bottom; the other face is up; turned over about" in checked.stdout
    described = json.loads((tmp_path / "job.json").read_text(encoding="utf-8"))
    assert described["operations"][0]["takes"]["points"] == 2
    assert [each["operations"] for each in described["setups"]] == [
        each["operations"] for each in job["setups"]
    ]
    flags = ("-t", "grbl", "--job", "hinge.toml", "--spindle", "10000")
    done = camtool("post", "hinge.dxf", *flags, "--json", "all.json")
    assert done.returncode == 0, done.stderr
    assert b"camtool: warning MATERIAL_LEFT" not in done.stderr
    programs = json.loads((tmp_path / "all.json").read_text(encoding="utf-8"))["programs"]
    corner, size = (
        [float(each.removesuffix("mm")) for each in job["stock"][key]]
        for key in ("corner", "size")
    )
    ends = (corner[0], corner[1]), (corner[0] + size[0], corner[1] + size[1])
    top, bottom = (cut_needles(tmp_path / each["program"], *ends) for each in programs)

    def turned(points: np.ndarray) -> np.ndarray:
        return points * (-1, 1) + (WIDE, 0) if flip == "y" else points * (1, -1) + (0, HIGH)

    across = (np.arange(1.3, WIDE - 1.0, 0.7), np.arange(1.3, HIGH - 1.0, 0.7))
    points = np.stack(np.meshgrid(*across), axis=-1).reshape(-1, 2)
    left = (
        THICK + np.maximum(top.at(points), -THICK) + np.maximum(bottom.at(turned(points)), -THICK)
    )

    def within(box: tuple[int, ...], by: float) -> np.ndarray:
        low, high = np.array(box[:2]) - by, np.array(box[2:]) + by
        return ((points >= low) & (points <= high)).all(axis=1)

    away = np.hypot(*(points - HOLE).T)
    front, back, bore = within(FRONT, -1.0), within(BACK, -1.0), away < 5.0
    plain = ~within(FRONT, 0.5) & ~within(BACK, 0.5) & (away > 6.0)
    assert left[plain] == pytest.approx(THICK)
    assert left[front & back] == pytest.approx(THICK - 7.0)
    assert left[front & ~within(BACK, 0.5)] == pytest.approx(THICK - 4.0)
    assert left[back & ~within(FRONT, 0.5) & (away > 6.0)] == pytest.approx(THICK - 3.0)
    assert left[bore & (away > 3.5)] == pytest.approx(THICK - 5.0)
    assert (left[away < 2.6] <= 0.0).all()
    # Pins are drilled through, where they meet again, and nothing else reaches them.
    places = np.array(pins)
    assert np.array(sorted(turned(places).tolist())) == pytest.approx(np.array(sorted(pins)))
    assert (top.at(places) <= -THICK - 3.0).all()
    assert (bottom.at(turned(places)) == 0.0).all()
    around = places[:, None] + 2.4 * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
    assert (top.at(around.reshape(-1, 2)) == 0.0).all()
    assert (bottom.at(turned(around.reshape(-1, 2))) == 0.0).all()
    # The least that both pockets leave is told.
    (floor,) = [each for each in programs[1]["report"]["findings"] if each["code"] == "FLOOR_LEFT"]
    assert floor["measured"] == pytest.approx(THICK - 7.0)


@pytest.mark.parametrize(
    ("flags", "error"),
    [
        (("--two-sided", "y", "--tool-diameter", "3mm"), "needs the thickness"),
        (("--two-sided", "y", "--thickness", "10mm"), "needs an end mill"),
        (("--two-sided", "z", "--thickness", "10mm", "--tool-diameter", "3mm"), "'z'"),
    ],
)
def test_a_two_sided_job_needs_stock_and_tool(
    camtool: Run, tmp_path: Path, flags: tuple[str, ...], error: str
) -> None:
    write_hinge(tmp_path)
    done = camtool("job", "new", "hinge.dxf", *flags)
    assert done.returncode == 2
    assert error in done.stderr.decode()


JOB = """
tool_diameter = "3mm"
[stock]
corner = [-14, -14]
size = "108x78mm"
thickness = "10mm"
spoilboard = "6mm"
[[operations]]
name = "pins"
kind = "pins"
breakthrough = "5mm"
[[operations]]
name = "pocket"
kind = "pocket"
layers = ["POCKET 4mm"]
depth = "4mm"
[[setups]]
name = "top"
operations = ["pins"]
[[setups]]
name = "bottom"
flip = "y"
operations = ["pocket"]
"""


def test_pins_are_proposed_where_they_are_missing(camtool: Run, tmp_path: Path) -> None:
    write_hinge(tmp_path)
    flags = ("-t", "grbl", "--job", "part.toml")
    (tmp_path / "part.toml").write_text(JOB, encoding="utf-8")
    done = camtool("post", "hinge.dxf", *flags)
    assert done.returncode == 2
    said = done.stderr.decode()
    assert "there are no alignment pins to drill" in said
    proposed = re.search(r"pins = \[\[.*\]\]", said)
    assert proposed is not None
    # Beside all that is drawn, not only what is cut.
    for x, y in tomllib.loads(proposed[0])["pins"]:
        assert not (-1.5 < x < WIDE + 1.5 and -1.5 < y < HIGH + 1.5)
    # As it is proposed it works; a set-up without pins is told the same.
    (tmp_path / "part.toml").write_text(JOB + proposed[0], encoding="utf-8")
    done = camtool("post", "hinge.dxf", *flags)
    assert done.returncode == 0, done.stderr
    assert "PINS_PROPOSED" not in done.stderr.decode()
    none = JOB.replace('operations = ["pins"]', 'operations = ["other"]')
    none = none.replace(
        '"pins"\nkind = "pins"\nbreakthrough = "5mm"',
        '"other"\nlayers = ["POCKET 4mm"]\ndepth = "1mm"',
    )
    (tmp_path / "part.toml").write_text(none, encoding="utf-8")
    done = camtool("post", "hinge.dxf", *flags, "-v")
    assert done.returncode == 0, done.stderr
    assert "PINS_PROPOSED" in done.stderr.decode()
    assert proposed[0] in done.stderr.decode()
    # Where the stock has no room nothing is proposed.
    small = none.replace("[-14, -14]", "[-1, -1]").replace("108x78mm", "82x52mm")
    (tmp_path / "part.toml").write_text(small, encoding="utf-8")
    done = camtool("post", "hinge.dxf", *flags, "-v", "--allow", "off-stock")
    assert "PINS_PROPOSED" not in done.stderr.decode()


def test_pins_need_set_ups(camtool: Run, tmp_path: Path) -> None:
    write_hinge(tmp_path)
    alone = JOB.split("[[setups]]", 1)[0]
    (tmp_path / "part.toml").write_text(alone, encoding="utf-8")
    done = camtool("post", "hinge.dxf", "-t", "grbl", "--job", "part.toml")
    assert done.returncode == 2
    assert "write them in the [[setups]]" in done.stderr.decode()


@given(
    part=st.tuples(*[st.floats(5.0, 200.0)] * 2),
    waste=st.tuples(*[st.floats(0.0, 40.0)] * 4),
    flip=st.sampled_from(["x", "y"]),
    off=st.floats(-10.0, 10.0),
    pin=st.floats(1.0, 8.0),
    cut=st.floats(0.5, 8.0),
)
def test_proposed_pins_are_in_the_waste_and_meet_again(
    part: tuple[float, float],
    waste: tuple[float, ...],
    flip: str,
    off: float,
    pin: float,
    cut: float,
) -> None:
    stock = (-waste[0], -waste[1], part[0] + waste[2], part[1] + waste[3])
    across = 0 if flip == "y" else 1
    line = 0.5 * (stock[across] + stock[across + 2]) + off
    found = proposed_pins(stock, (0.0, 0.0, *part), (flip, line), pin, cut)
    if found is None:
        strips = waste[1 - across], waste[3 - across]
        room = min(line - stock[across], stock[across + 2] - line)
        assert max(strips) < cut + 2.0 * pin + 1e-9 or room < 3.0 * pin + 1e-9
        return
    one, other = (np.array(place) for place in found)
    assert one[across] + other[across] == pytest.approx(2.0 * line)
    assert one[1 - across] == other[1 - across]
    assert other[across] - one[across] >= 2.0 * pin
    for place in (one, other):
        # As much stock is left around a pin as it is wide, less what rounding takes.
        assert (place - stock[:2] >= pin - 0.01).all()
        assert (stock[2:] - place >= pin - 0.01).all()
        beside = np.maximum(np.maximum(-place, place - part), 0.0)
        assert np.hypot(*beside) >= cut + 0.5 * pin
