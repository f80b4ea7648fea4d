"""GNU Octave runs the .m files and finds the same arrays: a referee that is not ours."""

import shutil
import subprocess
from pathlib import Path

import pytest

from tests.postprocessors.matlab_router.parts import STAR, arrays, posted, router, strokes
from tests.postprocessors.matlab_router.test_golden import GOLDEN, part
from tests.waiting import HANG_S

OCTAVE = shutil.which("octave-cli")

pytestmark = [
    pytest.mark.referee,
    pytest.mark.skipif(OCTAVE is None, reason="octave-cli is not installed (Debian: octave)"),
]

SHOW = """
function show(name, values)
  printf("%s", name); printf(" %d", values); printf("\\n");
end
"""

"""Octave is stopped after so long."""

GUI = """
top = 480; way = diff(xy, 1, 2);
speed = top * sign(way); flat = way == 0;
for line = 1:columns(way)
  distance = abs(way(:, line));
  if distance(1) != distance(2)
    [longer, major] = max(distance);
    minor = 3 - major;
    speed(minor, line) = sign(way(minor, line)) * top / (longer / distance(minor));
  end
end
show("lxy", abs(way).'); show("velxy", round(speed).');
"""
"""The GUI's arithmetic (L4444-4515) in Octave's own words."""


def octave(script: str, folder: Path) -> dict[str, list[int]]:
    """Run the script in Octave and return the values that `show` printed, by name."""
    file = folder / "referee.m"
    file.write_text("1;\n" + SHOW + script, encoding="ascii")
    command = [str(OCTAVE), "--norc", "--quiet", "--no-history", str(file)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=HANG_S, check=False)
    assert done.returncode == 0, done.stderr
    lines = [line.split() for line in done.stdout.splitlines()]
    return {name: [int(value) for value in values] for name, *values in lines}


def row_by_row(table: list[list[int]]) -> list[int]:
    return [value for row in table for value in row]


PROGRAMS = {
    **{
        name: (GOLDEN / name).read_bytes
        for name in (
            "matlab-router-star.m",
            "matlab-router-star-thesis.m",
            "matlab-router-star-text.m",
            "matlab-router-part.m",
        )
    },
    "the logo": lambda: posted("logo.dxf", router()),
    "a long stroke": lambda: (
        router()
        .target.write(
            strokes([(1.0 + 0.4 * index, 5.0 + 0.4 * (index % 2)) for index in range(400)]),
            router().machine,
        )
        .data
    ),
    "the part as it is now": lambda: router().target.write(part(), router().machine).data,
}


@pytest.mark.parametrize("name", PROGRAMS)
def test_octave_finds_the_same_arrays(name: str, tmp_path: Path) -> None:
    data = PROGRAMS[name]()
    jobs = arrays(data)
    names = ("xy", "lxy", "velxy", "size_of_array", "first_pointx", "first_pointy")
    script = data.decode("ascii")
    for known in names:  # what is left when all has run: the last job's plain arrays
        script += f'show("{known}", {known}.\');\n'
    if len(jobs) > 1:
        script += "for j = 1:numel(jobs)\n"
        for index, known in enumerate(names, 1):
            script += f'  show(sprintf("{known}_%d", j), jobs{{j}}{{{index}}}.\');\n'
        script += "end\n"
    found = octave(script, tmp_path)
    for known in names:
        assert found[known] == row_by_row(jobs[-1][known])
        if len(jobs) > 1:
            for number, job in enumerate(jobs, 1):
                assert found[f"{known}_{number}"] == row_by_row(job[known])


@pytest.mark.parametrize("setting", ["grid_mm=0.1", "grid_mm=0.2"])
def test_octave_computes_the_same_speeds(setting: str, tmp_path: Path) -> None:
    """The GUI's own way from points to lengths and speeds, run by Octave on our points."""
    (job,) = arrays(posted("star.csv", router(setting)))
    x, y = job["xy"]
    found = octave(f"xy = [{' '.join(map(str, x))}; {' '.join(map(str, y))}];\n" + GUI, tmp_path)
    assert found["lxy"] == row_by_row(job["lxy"])
    assert found["velxy"] == row_by_row(job["velxy"])
    assert setting != "grid_mm=0.1" or list(zip(x, y, strict=True)) == STAR


def test_the_referee_can_fail(tmp_path: Path) -> None:
    with pytest.raises(AssertionError):
        octave("xy = [1 2; 3];\n", tmp_path)
