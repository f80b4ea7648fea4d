"""LinuxCNC's interpreter as the referee on the subset that all dialects of ISO 6983 share. Skipped
where LinuxCNC is not installed."""

from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given
from hypothesis import strategies as st

from camtool.target.registry import load_target
from camtool.toolpath.moves import Kind, Toolpath
from tests.oracles.rs274 import compare, needs_rs274
from tests.postprocessors.gcode.parts import part, toolpaths
from tests.postprocessors.iso.tables import machine_with
from tests.strategies import examples

pytestmark = needs_rs274

NAMES = ("fanuc", "haas", "mach3", "mach4")
COMMON = (
    'dialect.program.head=["G17 {units} G40 G49 G80 G90 {feeds}"]',
    "dialect.program.foot=[]",
    'dialect.events.dwell=["G4 P{s}"]',
    'dialect.events.tool_change=["T{tool} M6"]',
)
"""Names of programs and stored places are each controller's own, and so is what a dwell counts."""


@pytest.mark.parametrize(
    ("name", "units"),
    # The referee prints four decimals, those of Mach3 in inches are five.
    [*((name, "mm") for name in NAMES), ("fanuc", "in"), ("haas", "in")],
)
def test_every_kind_of_row(name: str, units: str, tmp_path: Path) -> None:
    target = load_target(name, settings=[*COMMON, f"dialect.program.units={units}"])
    wanted = part(tools=True)
    wanted = wanted.first(next(m.index for m in wanted if m.kind == Kind.HOME_Z))
    program = target.target.write(wanted, target.machine)
    compare(target.target.read(program.data, target.machine), program.data, tmp_path)


@examples(20, 1000, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(name=st.sampled_from(NAMES), path=toolpaths())
def test_random_paths(name: str, path: Toolpath, tmp_path: Path) -> None:
    target = load_target(name, settings=COMMON)
    program = target.target.write(path, target.machine)
    compare(target.target.read(program.data, target.machine), program.data, tmp_path)


FORMS: dict[str, dict[str, Any]] = {
    "centre": {"arcs": {"form": "centre"}, "program": {"head": ("{units} G90 G90.1 {feeds}",)}},
    "radius": {"arcs": {"form": "radius", "full_circles": "halves"}},
    "inverse": {"feeds": {"mode": "inverse-time"}},
    "terse": {"words": {"blanks": False, "leading_zero": False, "trailing_zeros": False}},
    "crlf": {"lines": {"end": "crlf", "numbers": True, "digits": 4, "highest": 9999}},
}


@pytest.mark.parametrize("name", FORMS)
@examples(8, 300, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(path=toolpaths())
def test_forms_of_arcs_feeds_and_words(name: str, path: Toolpath, tmp_path: Path) -> None:
    target = machine_with(FORMS[name])
    program = target.target.write(path, target.machine)
    decoded = target.target.read(program.data, target.machine)
    compare(decoded, program.data, tmp_path)
