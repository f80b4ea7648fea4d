"""Programs of grbl and linuxcnc byte for byte (`--bless` writes them anew)."""

import re
from pathlib import Path

import pytest

from camtool.target.registry import load_target
from tests.postprocessors.gcode.parts import part

ROOT = Path(__file__).parents[3]
GOLDEN = ROOT / "tests" / "golden"

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


def compare(file: Path, data: bytes, *, bless: bool) -> None:
    """`data` must be what the file holds; a missing file is a failure."""
    if bless:
        file.write_bytes(data)
    if not file.exists():
        pytest.fail(f"{file.name} is missing: look at the program, then run pytest with --bless")
    assert data.decode("ascii") == file.read_bytes().decode("ascii")


@pytest.mark.parametrize("case", CASES)
def test_program(case: str, bless: bool) -> None:
    compare(GOLDEN / case, program_of(case), bless=bless)


def test_a_changed_number_fails(tmp_path: Path) -> None:
    file = tmp_path / "program.nc"
    compare(file, b"G0 X1.000\n", bless=True)
    with pytest.raises(AssertionError):
        compare(file, b"G0 X1.001\n", bless=False)


@pytest.mark.parametrize(("name", "case"), [("grbl", "grbl.nc"), ("linuxcnc", "linuxcnc.ngc")])
def test_the_worked_example_of_the_page_is_what_is_sent(name: str, case: str) -> None:
    page = (ROOT / "docs" / "dialects" / f"{name}.md").read_text(encoding="utf-8")
    (example,) = re.findall(r"```gcode\n(.+?)```", page, re.DOTALL)
    assert example == (GOLDEN / case).read_text(encoding="ascii")


@pytest.mark.parametrize("name", ["grbl", "linuxcnc"])
def test_the_page_has_every_option(name: str) -> None:
    import importlib

    page = (ROOT / "docs" / "dialects" / f"{name}.md").read_text(encoding="utf-8")
    options = importlib.import_module(f"camtool_postprocessors.{name}.dialect").Dialect
    assert [field for field in options.__struct_fields__ if f"| `{field}` |" not in page] == []
