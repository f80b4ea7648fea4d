"""The language of LinuxCNC: LinuxCNC's own interpreter makes the same moves of generated programs,
refuses what the reader refuses, and takes what it takes."""

import random
from pathlib import Path

import pytest

from camtool.errors import ProgramError
from camtool.target.registry import load_target
from tests.oracles.canonical import difference
from tests.oracles.rs274 import interpreted, needs_rs274
from tests.postprocessors.linuxcnc.programs import Maker

SOME, ALL = 150, 5000

# What the reader refuses although rs274 takes it, and why.
STRICTER = {
    "of inverse time (G93), which is not read": "a spline's feed then is that of its whole length",
    "polar coordinates at zero": "rs274 takes a direction that rounding makes",
    "which is too large": "round[] of a number that C cannot convert",
}


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
        return f"read, and LinuxCNC refuses it: {theirs}"
    return difference(path, calls)


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
    def test_many_programs(self, tmp_path: Path) -> None:
        agree(range(SOME, ALL), tmp_path)
