"""Draws the pictures of the pages anew:  python docs/images/make_images.py

The pages themselves say how each is made (their lines "camtool … docs/images/NAME", and the
README's first one); only the stages of an offset have no command, and are drawn here. Each is
kept with a palette of 256 colours: a third of its size, and no pixel differs by more than the test
of the pictures allows.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
from PIL import Image

from camtool.geometry.drawing import Drawing, Units
from camtool.geometry.measure import point_at
from camtool.geometry.offset import Offset, Slices, shape_stages
from camtool.geometry.polylines import Polyline, Polylines, Segments
from camtool.pictures.draw import render
from camtool.pictures.scene import Scene

ROOT = Path(__file__).parents[2]
PAGES = (
    "docs/tutorial.md",
    "docs/recipes.md",
    "docs/toolpaths.md",
    "docs/reversals.md",
    "docs/verifying.md",
    "docs/pictures.md",
    "docs/gallery.md",
    "docs/validation.md",
    "docs/calibration.md",
)
FIRST = "logo.png"
DISTANCE_MM = 1.6


def commands() -> dict[str, list[str]]:
    """The commands of the pages by the picture that they make, last the name of that, without the
    name of the program."""
    text = "".join((ROOT / page).read_text(encoding="utf-8") for page in PAGES)
    makes = r"^camtool (.* (?:-o|--preview|--plot \w+) docs/images/(\S+))$"
    lines = re.findall(makes, text.replace("\\\n", " "), re.MULTILINE)
    return {name: shlex.split(line) for line, name in lines} | {FIRST: first_command()}


def first_command() -> list[str]:
    """Return the README's first command, with a program that is thrown away."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    found = re.search(
        rf"camtool (post .*) -o \S+ --preview {re.escape(FIRST)}$", text, re.MULTILINE
    )
    if found is None:
        raise ValueError(f"the README says no more how {FIRST} is made")
    return [*shlex.split(found[1]), "-o", os.devnull, "--preview", f"docs/images/{FIRST}"]


def shape() -> Polylines:
    """A blot with a waist, and an island near its wall."""
    outer = [
        [0.0, 0, 0], [7, 0, 0.5], [10, 2.2, -0.4], [13, 2.2, 0.5], [16, 0, 0], [23, 0, 0],
        [23, 9, 0.3], [16, 11, 0], [13, 6.4, -0.4], [10, 6.4, 0], [7, 11, 0.6], [0, 8, 0],
    ]  # fmt: skip
    island = [[18.0, 5.2, -1.0], [20.4, 5.2, -1.0]]
    return Polylines.of([Polyline(np.array(outer), True), Polyline(np.array(island), True)])


def pieces(elements: Segments, slices: Slices) -> list[Polyline]:
    """Each slice as a path of its own."""
    sweep = elements.sweep[slices.element] * (slices.t1 - slices.t0)
    begin = point_at(elements, slices.element, slices.t0)
    end = point_at(elements, slices.element, slices.t1)
    ends = np.stack([np.column_stack([begin, np.tan(0.25 * sweep)]), np.insert(end, 2, 0, 1)], 1)
    return [Polyline(each) for each in ends if np.hypot(*(each[1] - each[0])[:2]) > 1e-6]


def stages_picture() -> Scene:
    """The source; what was thrown away; what was kept."""
    source = shape()
    stages = shape_stages(source, Offset(DISTANCE_MM))
    elements = stages.trimmed.elements
    groups = {
        "drawn": list(source),
        "1. raw offset": [
            Polyline(np.array([[*a, b], [*c, 0.0]]))
            for a, b, c in zip(
                stages.raw.elements.start,
                stages.raw.elements.bulge,
                stages.raw.elements.end,
                strict=True,
            )
        ],
        "2-4. sliced, too near": pieces(elements, stages.slices[~stages.valid]),
        "5. kept": pieces(elements, stages.final_slices),
    }
    layers = tuple(name for name, paths in groups.items() for _ in paths)
    drawing = Drawing(
        Polylines.of(path for paths in groups.values() for path in paths),
        layers,
        ("",) * len(layers),
        layers,
        "offset",
        Units("mm", 1.0, "drawn so"),
    )
    return Scene(title="The stages of an offset", drawing=drawing)


def shrink(file: Path) -> None:
    """Write a picture again with the 256 colours that suit it best."""
    with Image.open(file) as picture:
        few = picture.convert("RGB").quantize(256, kmeans=3, dither=Image.Dither.NONE)
    few.save(file, "PNG", optimize=True)


def main() -> None:
    """Make all pictures."""
    name = "docs/images/offset-stages.png"
    (ROOT / name).write_bytes(render(stages_picture(), name))
    for arguments in commands().values():
        subprocess.run([sys.executable, "-m", "camtool", *arguments], cwd=ROOT, check=True)
    for made in (name, *commands()):
        shrink(ROOT / "docs/images" / Path(made).name)


if __name__ == "__main__":
    main()
