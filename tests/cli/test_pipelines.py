"""What docs/pipelines.md promises: the hooks, the Makefile and the action, run as they stand."""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from tests.cli.conftest import ROOT, Run

PAGE = (ROOT / "docs" / "pipelines.md").read_text(encoding="utf-8")
HOOKS = {
    hook["id"]: hook for hook in yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text())
}
ACTION = yaml.safe_load((ROOT / "action.yml").read_text(encoding="utf-8"))
RING = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="40mm" height="40mm" viewBox="0 0 40 40">'
    '<circle cx="20" cy="20" r="{radius}"/></svg>'
)
HOLE = "0\nSECTION\n2\nENTITIES\n0\nCIRCLE\n8\n0\n10\n9\n20\n9\n40\n5\n0\nENDSEC\n0\nEOF\n"
"""A circle as the smallest DXF; it has no unit."""

PATH = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"


def ring(file: Path, radius: float = 10.0) -> Path:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(RING.format(radius=radius))
    return file


def entry(hook: str) -> list[str]:
    """The hook's command, as pre-commit begins it."""
    name, *arguments = shlex.split(HOOKS[hook]["entry"])
    assert name == "camtool"
    return arguments


# camtool-check


def test_check_passes_good_drawings(camtool: Run, samples: Path) -> None:
    done = camtool(*entry("camtool-check"), samples / "logo.dxf", samples / "letter.svg")
    assert (done.returncode, done.stdout, done.stderr) == (0, b"", b"")


def test_check_looks_at_all_whatever_is_wrong_with_one(
    camtool: Run, samples: Path, tmp_path: Path
) -> None:
    for name in ("a.dxf", "b.svg"):
        (tmp_path / name).write_text("no drawing")
    done = camtool(*entry("camtool-check"), "a.dxf", samples / "logo.dxf", "b.svg")
    assert done.returncode == 2
    lines = done.stderr.decode().splitlines()
    assert [line.split(": ")[2] for line in lines] == ["a.dxf", "b.svg"]


def test_check_says_each_drawing(camtool: Run, samples: Path) -> None:
    done = camtool("check", samples / "logo.dxf", samples / "letter.svg")
    assert done.stdout.count(b"file      ") == 2
    done = camtool("check", samples / "logo.dxf", samples / "letter.svg", "--json", "-")
    assert done.returncode == 2


# camtool-stale


@pytest.fixture
def posted(camtool: Run, tmp_path: Path) -> Path:
    """A drawing and its program beside it."""
    drawing = ring(tmp_path / "ring.svg")
    assert camtool("post", drawing, "-t", "grbl", "-o", "ring.nc").returncode == 0
    return drawing


def stale(camtool: Run, *arguments: str | Path) -> tuple[int, str]:
    done = camtool(*entry("camtool-stale"), "--target", "grbl", *arguments)
    assert done.stdout == b""
    return done.returncode, done.stderr.decode()


@pytest.mark.parametrize("given", ["ring.svg", "ring.nc", "."])
def test_a_program_of_its_drawing_is_fine(camtool: Run, posted: Path, given: str) -> None:
    assert stale(camtool, given) == (0, "")


@pytest.mark.parametrize("given", ["ring.svg", "ring.nc"])
def test_a_changed_drawing_is_seen(camtool: Run, posted: Path, given: str) -> None:
    ring(posted, 9.0)
    code, said = stale(camtool, given)
    assert code == 1
    assert said == (
        "camtool: error: ring.nc: is not what camtool writes of ring.svg now; post it again\n"
    )


def test_a_program_that_somebody_touched_is_seen(camtool: Run, posted: Path) -> None:
    with posted.with_suffix(".nc").open("ab") as stream:
        stream.write(b"\n")
    assert stale(camtool, "ring.nc", "ring.svg")[0] == 1


def test_other_flags_give_another_program(camtool: Run, posted: Path) -> None:
    assert stale(camtool, "ring.svg", "--depth", "0.7mm")[0] == 1


def test_the_job_beside_it_counts(camtool: Run, posted: Path, tmp_path: Path) -> None:
    (tmp_path / "ring.toml").write_text('depth = "0.7mm"\n')
    assert stale(camtool, "ring.toml")[0] == 1
    camtool("post", posted, "-t", "grbl", "-o", "ring.nc", "--job", "ring.toml")
    assert stale(camtool, "ring.toml") == (0, "")


def test_no_program_is_an_error_only_when_asked(camtool: Run, tmp_path: Path) -> None:
    ring(tmp_path / "alone.svg")
    (tmp_path / "alone.toml").write_text("")
    assert stale(camtool, "alone.svg") == (0, "")
    code, said = stale(camtool, "--missing", "alone.svg")
    assert code == 1
    assert "alone.nc: is not there" in said


def test_a_picture_beside_a_drawing_is_no_second_drawing(camtool: Run, tmp_path: Path) -> None:
    (tmp_path / "hole.dxf").write_text(HOLE)
    camtool("post", "hole.dxf", "-t", "grbl", "--report", "hole.md")
    assert (tmp_path / "hole.svg").exists()
    assert stale(camtool, ".", "--units", "mm") == (0, "")
    assert stale(camtool, "hole.svg") == (0, "")


def test_what_is_not_there_or_unreadable_is_said(camtool: Run, posted: Path) -> None:
    assert stale(camtool, "none.dxf")[0] == 2
    posted.write_text("no drawing")
    code, said = stale(camtool, "ring.nc")
    assert code == 2
    assert said.startswith("camtool: error: ring.svg")


def test_files_of_others_are_nothing_to_it(camtool: Run, tmp_path: Path) -> None:
    (tmp_path / "readme.txt").write_text("no program")
    (tmp_path / "pyproject.toml").write_text("")
    assert stale(camtool, "readme.txt", "pyproject.toml") == (0, "")


@pytest.fixture
def batched(camtool: Run, tmp_path: Path) -> Path:
    """Drawings in folders, and their programs in folders of the same names, as of a batch."""
    (tmp_path / "build" / "deep").mkdir(parents=True)
    for name, radius in (("a", 10.0), ("deep/two words.v2", 8.0)):
        drawing = ring(tmp_path / "drawings" / f"{name}.svg", radius)
        flags = ("--no-verify", "--preview", f"build/{name}.svg")
        camtool("post", drawing, "-t", "grbl", "-o", f"build/{name}.nc", *flags)
    return tmp_path / "drawings"


def test_programs_in_a_folder_of_their_own_are_fine(camtool: Run, batched: Path) -> None:
    for given in ("drawings", "drawings/**/*.svg", "."):
        asked = (given, "--programs", "build", "--missing")
        assert stale(camtool, *asked)[0] == (given == ".")  # as of `batch .`: build/drawings/a.nc


@pytest.mark.slow
def test_programs_of_a_batch_are_fine(camtool: Run, batched: Path, tmp_path: Path) -> None:
    asked = ("batch", "drawings", "-t", "grbl", "-o", "out", "--preview", "svg", "-q")
    assert camtool(*asked).returncode == 0
    assert stale(camtool, "drawings", "--programs", "out", "--missing") == (0, "")


def test_programs_of_a_batch_that_are_stale_or_missing(camtool: Run, batched: Path) -> None:
    ring(batched / "deep" / "two words.v2.svg", 7.0)
    ring(batched / "new" / "c.svg")
    asked = ("drawings", "--programs", "build")
    code, said = stale(camtool, *asked)
    changed = (
        "camtool: error: build/deep/two words.v2.nc: is not what camtool writes of "
        "drawings/deep/two words.v2.svg now; post it again\n"
    )
    assert (code, said) == (1, changed)
    code, said = stale(camtool, *asked, "--missing")
    assert (code, said) == (
        1, changed + "camtool: error: build/new/c.nc: is not there; post drawings/new/c.svg\n"
    )  # fmt: skip
    assert stale(camtool, "drawings/a.svg", "--programs", "build") == (0, "")


def test_programs_must_be_somewhere(camtool: Run, batched: Path) -> None:
    code, said = stale(camtool, "drawings", "--programs", "none")
    assert code == 2
    assert "none: is no folder; give the --out of the batch" in said


def taken(hook: str, name: str, **said: str) -> bool:
    """True if pre-commit gives this file to the hook, whose configuration names no files."""
    chosen = HOOKS[hook] | said
    return bool(re.search(chosen["files"], name)) and not re.search(chosen["exclude"], name)


@pytest.mark.parametrize("said", [{}, {"files": "^parts/"}, {"exclude": "^x/"}])
def test_hooks_take_the_files_that_they_are_for(said: dict[str, str]) -> None:
    """A configuration's own `files` or `exclude` takes the place of the hook's, not of both."""
    drawings = ("parts/a.dxf", "parts/b/c.svg", "parts/d.STEP")
    assert all(taken("camtool-check", name, **said) for name in drawings)
    assert not any(taken("camtool-check", f"parts/a{e}", **said) for e in (".nc", ".toml", ""))
    from camtool.target.registry import list_target, target_names

    endings = {list_target(name).target.extension for name in target_names()} | {".toml", ".dxf"}
    assert [e for e in endings if not taken("camtool-stale", f"parts/a{e}", **said)] == []
    assert not taken("camtool-stale", "parts/readme.md", **said)
    assert {hook["language"] for hook in HOOKS.values()} == {"python"}


# the Makefile


def test_the_makefile_posts_what_has_changed(tmp_path: Path) -> None:
    if shutil.which("make") is None:
        pytest.skip("make is missing")
    (recipe,) = re.findall(r"```make\n(.*?)```", PAGE, re.DOTALL)
    (tmp_path / "Makefile").write_text(recipe)
    (tmp_path / "my-mill.toml").write_text('extends = "grbl"\n')
    (tmp_path / "drawings").mkdir()
    (tmp_path / "drawings" / "one.dxf").write_text(HOLE)

    def make() -> str:
        done = subprocess.run(
            ["make"], cwd=tmp_path, capture_output=True, text=True,
            env={**os.environ, "PATH": PATH}, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        return done.stdout

    assert "camtool post drawings/one.dxf" in make()
    assert (tmp_path / "build" / "one.nc").stat().st_size > 100
    assert (tmp_path / "build" / "one.html").exists()
    assert "camtool" not in make()
    newer = (tmp_path / "build" / "one.nc").stat().st_mtime + 10
    os.utime(tmp_path / "my-mill.toml", (newer, newer))
    assert "camtool post" in make()


# the page


def test_the_page_names_every_input_of_the_action_and_every_hook() -> None:
    for name in (*ACTION["inputs"], *HOOKS):
        assert f"`{name}`" in PAGE, name
    for block in re.findall(r"```yaml\n(.*?)```", PAGE, re.DOTALL):
        assert yaml.safe_load(block)


def test_stale_lists_each_program_with_its_state(camtool: Run, tmp_path: Path) -> None:
    flags = ("-t", "grbl", "--tool-diameter", "1", "--depth", "1")
    for name in ("a", "b", "c", "d"):
        ring(tmp_path / "parts" / f"{name}.svg")
        if name != "c":
            program = ("-o", f"parts/{name}.nc")
            assert camtool("post", f"parts/{name}.svg", *flags, *program).returncode == 0
    ring(tmp_path / "parts" / "b.svg", radius=9.0)
    ring(tmp_path / "parts" / "d.svg", radius=9000.0)
    done = camtool("stale", "parts", *flags, "--missing", "--json", "-")
    assert done.returncode == 1
    rows = json.loads(done.stdout)
    assert [(row["state"], row["program"], row["code"]) for row in rows] == [
        ("current", "parts/a.nc", 0),
        ("stale", "parts/b.nc", 1),
        ("missing", None, 1),
        ("unknown", None, 1),
    ]
    errors = [f"camtool: error: {row['why']}" for row in rows if row["code"]]
    assert done.stderr.decode().splitlines() == errors
    rows = json.loads(camtool("stale", "parts", *flags, "--json", "-").stdout)
    assert rows[2]["code"] == 0, "nobody asked for a program of every drawing"
