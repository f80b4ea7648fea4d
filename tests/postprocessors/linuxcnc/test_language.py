"""The language of LinuxCNC: LinuxCNC's own interpreter makes the same moves of generated programs
and of those that it brings, refuses what the reader refuses, and takes what it takes.

    NC_PROGRAMS=FOLDER pytest -m slow tests/postprocessors/linuxcnc/test_language.py -k brings

reads those of other folders too, and shows how many of all are read alike (with -s)."""

import os
import random
import re
from pathlib import Path

import pytest

from camtool.errors import ProgramError
from camtool.target.registry import load_target
from camtool.toolpath.moves import Toolpath
from tests.oracles.canonical import canonical, difference
from tests.oracles.rs274 import interpreted, needs_rs274
from tests.postprocessors.linuxcnc.programs import Maker

SOME, ALL = 70, 5000

# What the reader refuses although rs274 takes it, and why.
STRICTER = {
    "of inverse time (G93), which is not read": "a spline's feed then is that of its whole length",
    "polar coordinates at zero": "rs274 takes a direction that rounding makes",
    "which is too large": "round[] of a number that C cannot convert",
}


def has_no_end(path: Toolpath) -> bool:
    """True if it says that the file ends too early, which LinuxCNC says behind the last move."""
    return any(each.code.name == "linuxcnc.NO_END" for each in path.findings)


def disagreement(text: str, folder: Path) -> str:
    """In words; "" where both agree."""
    target = load_target("linuxcnc", settings=["dialect.linear_units=in"])
    try:
        calls = interpreted(text.encode(), folder)
        theirs = ""
    except ProgramError as error:
        theirs = str(error)
    try:
        path = target.target.read(text.encode(), target.machine)
    except ProgramError as error:
        stricter = any(words in str(error) for words in STRICTER)
        return "" if theirs or stricter else f"refused: {error}"
    if theirs:
        if has_no_end(path):
            return ""
        return f"read, and LinuxCNC refuses it: {theirs}"
    return difference(path, calls)


OTHERS = [folder for folder in os.environ.get("NC_PROGRAMS", "").split(":") if folder]
INSTALLED = sorted(
    file
    for folder in ("/usr/share/linuxcnc", "/usr/share/axis", "/usr/share/doc/linuxcnc", *OTHERS)
    for file in Path(folder).rglob("*.n*")
    if file.suffix in (".ngc", ".nc")
)
READ_PART = 0.95
"""Of the programs, other folders included, of which rs274 makes moves without probing or remapped
codes, at least this part is read alike."""
TABLE = Path("/usr/share/doc/linuxcnc/examples/sample-configs/common/tool.tbl")

NO_WAY_OUT = "a contour without a way out, to which LinuxCNC adds one since 2.9.3"

# Of the programs that LinuxCNC brings: what is not read, or otherwise than by rs274, and why.
OTHERWISE = {
    "base.ngc": "#<_task>, and so a tool that only the machine has",
    "g71-endless-loop.ngc": "a contour of a lathe cycle that rs274 cannot end before 2.9.3",
    "g71-endless-loop_2.ngc": "the same",
    "g72-iterations-missing.ngc": NO_WAY_OUT,
    "lathe_g7x_face_boring.ngc": NO_WAY_OUT,
    "lathe_g7x_quadrants.ngc": NO_WAY_OUT,
    "skeleton.ngc": "rs274 forgets the tool's length at a tool change",
    "useful-subroutines.ngc": "a lead-in that is exactly as long as the tool's radius",
}


def tools_of(table: Path) -> str:
    """rs274's own tool table, in inches, as a setting."""
    tools = []
    for line in table.read_text().splitlines():
        words = dict(re.findall(r"([TDZ])\+?([\d.]+)", line.partition(";")[0]))
        lengths = {"length_mm": "Z", "diameter_mm": "D"}
        given = [f"{k}={25.4 * float(words[v]):.6f}" for k, v in lengths.items() if v in words]
        if "T" in words:
            tools.append(f"{words['T']}={{{', '.join(given)}}}")
    return f"dialect.tools={{{', '.join(tools)}}}"


def agree(seeds: range, folder: Path) -> None:
    wrong = []
    for seed in seeds:
        text = Maker(random.Random(seed)).program()
        found = disagreement(text, folder)
        if found:
            wrong.append(f"seed {seed}: {found}")
    assert wrong == []


class TestReferee:
    pytestmark = needs_rs274

    def test_some_programs(self, tmp_path: Path) -> None:
        agree(range(SOME), tmp_path)

    @pytest.mark.slow
    def test_the_programs_that_it_brings(self, tmp_path: Path) -> None:
        """Those that probe or have remapped codes are refused by both, or by name."""
        settings = ["dialect.linear_units=in", tools_of(TABLE)]
        target = load_target("linuxcnc", settings=settings)
        assert len(INSTALLED) > 300
        wrong, alike, moving = [], 0, 0
        for file in INSTALLED:
            data = file.read_bytes()
            try:
                path = target.target.read_in(data, target.machine, file.parent)
            except ProgramError as error:
                found = f"refused: {error}"
            else:
                found = "refused: no end" if has_no_end(path) else ""
            try:
                calls = interpreted(data, tmp_path, file.parent)
            except ProgramError as error:
                if not found and file.name not in OTHERWISE:
                    wrong.append(f"{file}: read, and LinuxCNC refuses it: {error}")
                continue
            found = found or difference(path, calls)
            probing = "probes" in found or "result of probing" in found
            if canonical(calls) and not probing:
                moving += 1
                alike += not found
            known = file.name in OTHERWISE or probing
            if found and not known:
                wrong.append(f"{file}: {found}")
        print(f"{alike} of {moving} programs that move are read alike")
        assert wrong == []
        assert alike > 25
        if OTHERS:
            assert alike >= READ_PART * moving

    @pytest.mark.slow
    def test_many_programs(self, tmp_path: Path) -> None:
        agree(range(SOME, ALL), tmp_path)
