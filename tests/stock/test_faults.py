"""Faults planted into the program, or the job, of samples/plate.dxf: each is found with its place
and size, and marked at that place in a picture."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from camtool.api import read_job
from camtool.findings import Finding
from camtool.importers.read import read_drawing
from camtool.pictures.colours import GAP, channels
from camtool.pictures.draw import draw, png
from camtool.pictures.options import PictureOptions
from camtool.pipeline import post_drawing, verify_program
from camtool.planning.job import Job
from camtool.run import Run
from camtool.target.registry import load_target
from tests.oracles.png import decode

SAMPLES = Path(__file__).parents[2] / "samples"
JOB = (SAMPLES / "plate.toml").read_text()
WINDOW_MM = 12.0
SIZE_PX = 240


@dataclass(frozen=True)
class Fault:
    """A change of the job before the program is made (`asked`), of the program after (`cut`, from
    the first `since` on), or of the job by which it is judged (`really`)."""

    code: str
    box: tuple[float, float, float, float]
    size: tuple[float, float]
    asked: tuple[str, str] = ("", "")
    cut: tuple[str, str] = ("", "")
    since: str = ""
    really: tuple[str, str] = ("", "")
    view: str = "top"


FAULTS = {
    "0.05 mm too deep": Fault(
        "CUT_TOO_DEEP",
        (32.0, 8.0, 56.0, 32.0),
        (0.0499, 0.0501),
        cut=("Z-3.000", "Z-3.050"),
        since="(operation 1 ",
        view="gouge",
    ),
    "a missing tab": Fault(
        "TAB_MISSING",
        (4.0, -3.0, 12.0, 0.0),
        (0.0, 1e-6),
        cut=("X11.764 Z-5.000", "X11.764 Z-6.000"),
        since="(operation 7 ",
    ),
    "one pass too deep": Fault(
        "PASS_TOO_DEEP",
        (-3.1, -5.1, 83.1, 53.1),
        (2.999, 3.001),
        cut=("Z-3.000", "Z-1.500"),
        since="(operation 7 ",
    ),
    "a V bit too blunt": Fault(
        "CUT_TOO_DEEP",
        (60.0, 30.0, 72.0, 42.0),
        (0.3, 1.5),
        really=('tip_angle = "60deg"', 'tip_angle = "90deg"'),
        view="gouge",
    ),
    "a rapid at Z-1": Fault(
        "RAPID_IN_STOCK",
        (-1.5, -5.0, 38.5, 1.5),
        (-1.0, -1.0),
        cut=("G0 Z5.000\nM5\nX0.000 Y0.000\nM2", "G0 Z-1.000\nM5\nX0.000 Y0.000\nM2"),
        view="gouge",
    ),
    "a holder 2 mm too low": Fault(
        "TOOL_IN_STOCK",
        (-8.0, -8.0, 88.0, 58.0),
        (1.999, 2.001),
        asked=("number = 1\n", 'number = 1\nstickout = "6mm"\nholder_diameter = "20mm"\n'),
        really=("number = 1\n", 'number = 1\nstickout = "4mm"\nholder_diameter = "20mm"\n'),
    ),
    "a loose slug": Fault(
        "LOOSE_PIECE",
        (16.9, 16.9, 17.1, 17.1),
        (60.0, 66.0),
        asked=('corners = "dogbone"\ndepth = "6mm"', 'corners = "dogbone"\ndepth = "5mm"'),
        cut=("Z-5.000", "Z-6.000"),
        since="(operation 3 ",
    ),
}


def replaced(text: str, change: tuple[str, str], since: str = "") -> str:
    """The text with the first place after `since` changed."""
    head, mark, tail = text.partition(since) if since else ("", "", text)
    assert change[0] in tail
    return head + mark + tail.replace(*change, 1) if change[0] else text


def job_of(text: str) -> Job:
    with TemporaryDirectory() as folder:
        file = Path(folder) / "plate.toml"
        file.write_text(text)
        return read_job(file)


@cache
def made(job: str) -> str:
    """The program of a job."""
    drawing = read_drawing(SAMPLES / "plate.dxf")
    run = post_drawing(drawing, job_of(job), load_target("linuxcnc"))
    assert run.program is not None
    return run.program.data.decode()


def judged(program: str, job: str) -> Run:
    return verify_program(
        program.encode(),
        load_target("linuxcnc"),
        source="plate.ngc",
        drawing=read_drawing(SAMPLES / "plate.dxf"),
        job=job_of(job),
    )


def found_in(run: Run, code: str) -> list[Finding]:
    return [each for each in run.findings if each.code.name == code]


def is_marked(run: Run, x: float, y: float, view: str) -> bool:
    """True if a picture of the place has a ring in its middle, in its SVG and in its pixels."""
    half = 0.5 * WINDOW_MM
    options = PictureOptions(size_px=SIZE_PX, view=view, crop_mm=(x - half, y - half, 12.0, 12.0))
    svg = draw(run.scene(), options)
    stock = re.search(r'<image id="stock"([^>]*)>', svg)
    assert stock is not None
    left, top, wide, high = (
        float(re.findall(rf' {key}="([\d.]+)"', stock[1])[0])
        for key in ("x", "y", "width", "height")
    )
    middle = left + 0.5 * wide, top + 0.5 * high
    group = re.search(r'<g id="faults"[^>]*>(.*?)</g>', svg, re.DOTALL)
    rings = re.findall(r'cx="([\d.]+)" cy="([\d.]+)" r="([\d.]+)"', group[1] if group else "")
    pixels = decode(png(svg, SIZE_PX))[..., :3].astype(int)
    page = float(re.findall(r'viewBox="0 0 ([\d.]+)', svg)[0])
    scale = pixels.shape[1] / page
    for cx, cy, r in rings:
        if math.dist((float(cx), float(cy)), middle) < 1.5:
            row, column = round(float(cy) * scale), round((float(cx) + float(r)) * scale)
            near = pixels[row - 1 : row + 2, column - 1 : column + 2].reshape(-1, 3)
            if (abs(near - channels(GAP)).max(axis=1) < 40).any():
                return True
    return False


def test_the_sample_itself_has_one_remark() -> None:
    run = judged(made(JOB), JOB)
    found = [fault.code for fault in FAULTS.values() if found_in(run, fault.code)]
    assert found == ["LOOSE_PIECE"]  # the window is cut out without tabs


@pytest.mark.parametrize("name", FAULTS)
def test_a_planted_fault_is_found_and_pictured(name: str) -> None:
    fault = FAULTS[name]
    asked = replaced(JOB, fault.asked)
    really = replaced(JOB, fault.really) if fault.really[0] else asked
    program = replaced(made(asked), fault.cut, fault.since)
    if fault.asked[0] or fault.really[0]:
        assert not found_in(judged(made(asked), asked), fault.code)
    run = judged(program, really)
    found = found_in(run, fault.code)
    assert found, [str(each) for each in run.findings]
    places = []
    for each in found:
        place = re.search(r"X (\S+) Y (\S+)", each.where)
        assert place is not None
        x, y = float(place[1]), float(place[2])
        low, high = fault.size
        assert each.measured is not None
        if low <= each.measured <= high:
            left, bottom, right, top = fault.box
            if left <= x <= right and bottom <= y <= top:
                places.append((x, y))
    assert places, [str(each) for each in found]
    assert is_marked(run, *places[0], fault.view)
