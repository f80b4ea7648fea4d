"""The hooks run by pre-commit itself, in a repository with drawings.

The hooks are those of `.pre-commit-hooks.yaml`, but for their environment: they take the camtool
that is here, for installing it anew takes minutes.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.cli.conftest import ROOT, Run

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(shutil.which("pre-commit") is None, reason="pre-commit is not installed"),
]
RING = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="40mm" height="40mm" viewBox="0 0 40 40">'
    '<circle cx="20" cy="20" r="{radius}"/></svg>'
)
CHECK, STALE = "drawings are readable", "programs are those of their drawings"
WRONG_WITH = {
    "a drawing that has changed": (STALE, "drawings/two words.nc: is not what camtool writes"),
    "a drawing that is none": (CHECK, "drawings/broken.dxf: is no DXF"),
    "a program that somebody touched": (STALE, "drawings/two words.nc: is not what"),
    "a job file": (STALE, "drawings/two words.nc: is not what camtool writes"),
}


class Repository:
    """A repository with these hooks for its drawings; its files are committed by git."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        hooks: list[dict[str, Any]] = yaml.safe_load(
            (ROOT / ".pre-commit-hooks.yaml").read_text(encoding="utf-8")
        )
        for hook in hooks:
            hook |= {"language": "system", "files": "^drawings/"}
            if hook["id"] == "camtool-stale":
                hook["args"] = ["--target", "grbl"]
        text = yaml.safe_dump({"repos": [{"repo": "local", "hooks": hooks}]})
        (folder / "drawings").mkdir(parents=True)
        (folder / ".pre-commit-config.yaml").write_text(text)
        self.ran("git", "init", "-q")
        self.ran("pre-commit", "install")

    def ran(self, *command: str) -> tuple[int, str]:
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        kept = {key: text for key, text in os.environ.items() if not key.startswith("GIT_")}
        done = subprocess.run(
            command, cwd=self.folder, capture_output=True, text=True, check=False,
            env=kept | {"PATH": path, "PRE_COMMIT_HOME": str(self.folder.parent / "home")},
        )  # fmt: skip
        return done.returncode, done.stdout + done.stderr

    def commit(self) -> tuple[int, str]:
        self.ran("git", "add", "-A")
        who = ("-c", "user.name=t", "-c", "user.email=t@example.org")
        return self.ran("git", *who, "commit", "-m", "more")


@pytest.fixture
def repository(camtool: Run, tmp_path: Path) -> Repository:
    """A repository with a drawing and its program in it."""
    made = Repository(tmp_path / "repository")
    drawing = made.folder / "drawings" / "two words.svg"
    drawing.write_text(RING.format(radius=10))
    camtool("post", drawing, "-t", "grbl", "-o", drawing.with_suffix(".nc"))
    code, said = made.commit()
    assert code == 0, said
    assert said.count("Passed") == 2
    return made


@pytest.mark.parametrize("wrong", WRONG_WITH)
def test_what_is_wrong_is_not_committed(repository: Repository, wrong: str) -> None:
    drawings = repository.folder / "drawings"
    if wrong == "a drawing that has changed":
        (drawings / "two words.svg").write_text(RING.format(radius=9))
    elif wrong == "a drawing that is none":
        (drawings / "broken.dxf").write_text("no drawing")
    elif wrong == "a job file":
        (drawings / "two words.toml").write_text('depth = "0.7mm"\n')
    else:
        (drawings / "two words.nc").write_text("M2\n")
    hook, words = WRONG_WITH[wrong]
    code, said = repository.commit()
    assert code == 1
    failed = [line for line in said.splitlines() if line.endswith("Failed")]
    assert [line.partition("..")[0] for line in failed] == [hook]
    assert words in said


def test_what_is_posted_again_is_committed(repository: Repository, camtool: Run) -> None:
    drawing = repository.folder / "drawings" / "two words.svg"
    drawing.write_text(RING.format(radius=9))
    camtool("post", drawing, "-t", "grbl", "-o", drawing.with_suffix(".nc"))
    code, said = repository.commit()
    assert code == 0, said


def test_what_is_no_drawing_is_nothing_to_them(repository: Repository) -> None:
    (repository.folder / "readme.md").write_text("x")
    (repository.folder / "drawings" / "readme.md").write_text("x")
    (repository.folder / "part.dxf").write_text("no drawing, but of another folder")
    code, said = repository.commit()
    assert code == 0, said
    assert said.count("no files to check") == 2
