"""Every machine that comes as a file goes through the commands a user meets first: what is posted
is verified, explained, linted, drawn, and converted to another dialect."""

from pathlib import Path

import pytest

from camtool.target.registry import shipped_files
from tests.cli.conftest import Run

LOGO = Path("samples/logo.dxf").absolute()
PLATE, JOB = Path("samples/plate.dxf").absolute(), Path("samples/plate.toml").absolute()

HIGH = ("--set", "axes.z.travel_mm=400")
"""Some programs end at the top of their machine's Z, which is higher than linuxcnc's."""


def tour(camtool: Run, name: str, post: list[str | Path]) -> None:
    done = camtool("post", *post, "-t", name, "-o", "a.nc", "-q")
    assert done.returncode == 0, done.stderr
    for command in (
        ["verify", "a.nc", "-t", name],
        ["explain", "a.nc", "-t", name],
        ["lint", "a.nc", "-t", name],
        ["preview", "a.nc", "-t", name, "-o", "a.svg"],
        ["convert", "a.nc", "--from", name, "--to", "linuxcnc", "-o", "b.nc", *HIGH],
        ["verify", "b.nc", "-t", "linuxcnc", *HIGH],
    ):
        done = camtool(*command)
        assert done.returncode == 0, (command, done.stderr)
        assert b"fault" not in done.stderr


@pytest.mark.parametrize("name", sorted(shipped_files()))
def test_one_drawing(name: str, camtool: Run) -> None:
    tour(camtool, name, [LOGO])


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(shipped_files()))
def test_a_job_of_several_tools(name: str, camtool: Run) -> None:
    tour(camtool, name, [PLATE, "--job", JOB, "--set", "spindle.max_rpm=24000"])


def test_what_it_cannot_do_points_to_its_own_file(camtool: Run) -> None:
    """A file of the bare dialect would not speak as the machine does."""
    done = camtool("post", LOGO, "-t", "haas", "--spindle", "9000", "-o", "a.nc")
    assert done.returncode != 0
    assert b"machine file of haas" in done.stderr
    assert b"-t iso" not in done.stderr
