"""Names from drawings reach no program but as harmless comments, whatever they hold."""

from pathlib import Path

import numpy as np
import pytest

from camtool.importers.options import ReadOptions
from camtool.importers.read import read_bytes
from camtool.pipeline import post_drawing
from camtool.planning.job import job_of
from camtool.target.registry import load_target, target_names
from camtool.toolpath.moves import Toolpath

NASTY = (
    ")\nG0 X99 Y99 Z-9\n(",
    "; M3 S9999 ; G1 X50",
    "%\r\nM30\r\n%",
    "G01X09999.00Y09999.00F99;",
    "(((MSG,pwned)))$H!~?\x18",
    "];system('x');xy=[9",
    "Fräsen ± µ ⌀ \u2028G0Z-9",
    "\\n G91 \\u000aG0 X9" + "Z-9 " * 200,
)
ROUND = '<circle cx="4" cy="4" r="2"/><path d="M1 1 h2.5 v2"/>'


def svg(label: str) -> bytes:
    spoken = "".join(
        f"&#{ord(letter)};" if letter in "\t\n\r" or letter >= " " else "" for letter in label
    )
    return (
        '<svg xmlns="http://www.w3.org/2000/svg" width="8mm" height="7mm" viewBox="0 0 8 7" '
        'xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape">'
        f'<g inkscape:groupmode="layer" inkscape:label="{spoken}">{ROUND}</g></svg>'
    ).encode()


def moves(toolpath: Toolpath) -> list[object]:
    columns = (toolpath.kind, toolpath.end, toolpath.centre, toolpath.feed)
    return [np.nan_to_num(column, nan=-1.0).tolist() for column in columns]


@pytest.mark.parametrize("target", target_names())
def test_no_name_changes_a_program(target: str, samples: Path) -> None:
    sample = samples / f"{target}-sample.toml"
    settings = ["controller.machine_zero_mm=[0,0,9.0]"] if target == "matlab-router" else []
    loaded = load_target(
        target, machine_file=sample if sample.exists() else None, settings=settings
    )
    plain = post_drawing(read_bytes(svg("plain"), "plain.svg"), job_of(), loaded, check=False)
    assert plain.decoded is not None, plain.findings
    for name in NASTY:
        drawing = read_bytes(svg(name), f"{name}.svg", ReadOptions(format="svg"))
        made = post_drawing(drawing, job_of(), loaded, check=False)
        assert made.program is not None
        assert made.decoded is not None
        assert moves(made.decoded) == moves(plain.decoded), name
        assert made.program.data.count(b"\n") <= plain.program.data.count(b"\n") + 2  # type: ignore[union-attr]


@pytest.mark.parametrize("target", ["grbl", "linuxcnc"])
def test_the_header_names_drawing_and_settings(target: str) -> None:
    texts = []
    for settings in ([], ["axes.x.travel_mm=99.0"]):
        loaded = load_target(target, settings=settings)
        drawing = read_bytes(svg("CUT"), "some/folder/part 7.svg")
        made = post_drawing(drawing, job_of(), loaded, check=False)
        assert made.program is not None
        texts.append(made.program.data.decode())
    assert all("(part 7.svg)" in text for text in texts)
    one, other = (next(line for line in t.splitlines() if "settings" in line) for t in texts)
    assert one != other
