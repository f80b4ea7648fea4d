"""Programs of grbl and linuxcnc byte for byte (`--bless` writes them anew)."""

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
