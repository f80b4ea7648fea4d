"""Programs of grbl and linuxcnc byte for byte (`--bless` writes them anew)."""

import re
from pathlib import Path

import pytest

from camtool.target.registry import load_target
from tests.postprocessors.gcode.parts import part
from tests.postprocessors.golden import GOLDEN, compare_golden

ROOT = Path(__file__).parents[3]

CASES = {
    "grbl.nc": ("grbl", []),
    "grbl-options.nc": (
        "grbl",
        [
            "dialect.strip_zeros=true",
            "dialect.block_numbers=true",
            "dialect.comments=none",
            "dialect.full_circles=halves",
            "dialect.program_end=M30",
            "dialect.tool_change=pause",
            "dialect.decimals=4",
        ],
    ),
    "linuxcnc.ngc": ("linuxcnc", []),
    "linuxcnc-options.ngc": (
        "linuxcnc",
        ["dialect.percent=true", "dialect.path=exact-stop", "dialect.comments=header"],
    ),
}


def program_of(case: str) -> bytes:
    name, settings = CASES[case]
    target = load_target(name, settings=settings)
    data: bytes = target.target.write(part(tools=case != "grbl.nc"), target.machine).data
    return data


@pytest.mark.parametrize("case", CASES)
def test_program(case: str, bless: bool) -> None:
    compare_golden(GOLDEN / case, program_of(case), bless=bless)


@pytest.mark.parametrize(("name", "case"), [("grbl", "grbl.nc"), ("linuxcnc", "linuxcnc.ngc")])
def test_the_worked_example_of_the_page_is_what_is_sent(name: str, case: str) -> None:
    page = (ROOT / "docs" / "dialects" / f"{name}.md").read_text(encoding="utf-8")
    (example,) = re.findall(r"```gcode\n(.+?)```", page, re.DOTALL)
    assert example == (GOLDEN / case).read_text(encoding="ascii")


@pytest.mark.parametrize("name", ["grbl", "linuxcnc"])
def test_the_page_has_every_option(name: str) -> None:
    page = (ROOT / "docs" / "dialects" / f"{name}.md").read_text(encoding="utf-8")
    options = load_target(name).target.dialect
    assert [field for field in options.__struct_fields__ if f"| `{field}` |" not in page] == []
