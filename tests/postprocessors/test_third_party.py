"""docs/write-a-post.md: what stands there is installed as a package of its own, and works."""

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from tests.waiting import HANG_S

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "write-a-post.md").read_text(encoding="utf-8")
MOST_LINES = 60


def listing(heading: str) -> str:
    """The block of code below a heading of the page."""
    section = PAGE.partition(f"## The {heading}")[2]
    found = re.search(r"```\w+\n(.*?)```", section, re.DOTALL)
    assert found, heading
    return found[1]


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of installed packages that holds the page's one, laid out as an installer does:
    the package, and beside it what its pyproject.toml says of it."""
    place = tmp_path_factory.mktemp("place")
    said = tomllib.loads(listing("package"))
    for name in said["tool"]["setuptools"]["packages"]:
        (place / name).mkdir()
        (place / name / "__init__.py").write_text("")
        (place / name / "post.py").write_text(listing("dialect"))
        (place / name / "post.toml").write_text(listing("machine"))
    project = said["project"]
    info = place / "tiny_plotter-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
    )
    points = "".join(
        f"[{group}]\n" + "".join(f"{name} = {value}\n" for name, value in rows.items())
        for group, rows in project["entry-points"].items()
    )
    (info / "entry_points.txt").write_text(points)
    return place


def camtool(installed: Path, folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    code = "import sys; from camtool.cli.main import main; sys.argv[0] = 'camtool'; main()"
    return subprocess.run(
        [sys.executable, "-c", code, *arguments],
        cwd=folder,
        env={"PYTHONPATH": str(installed), "PATH": "/usr/bin:/bin", "HOME": str(folder)},
        capture_output=True,
        text=True,
        check=False,
        timeout=HANG_S,
    )


def test_the_dialect_is_short() -> None:
    assert len(listing("dialect").splitlines()) <= MOST_LINES


def test_it_is_found_beside_our_own(installed: Path, tmp_path: Path) -> None:
    done = camtool(installed, tmp_path, "targets")
    assert done.returncode == 0, done.stderr
    names = [line.split()[0] for line in done.stdout.splitlines()]
    assert "tiny-plotter" in names
    assert "pic-mmh" in names


def test_it_posts_verifies_and_converts(installed: Path, tmp_path: Path) -> None:
    logo = str(ROOT / "samples" / "logo.dxf")
    flags = ("--target", "tiny-plotter")
    done = camtool(installed, tmp_path, "post", logo, *flags, "-o", "a.plt", "--json", "a.json")
    assert done.returncode == 0, done.stderr
    text = (tmp_path / "a.plt").read_text()
    assert text.startswith("IN;PU0,0;")
    assert text.endswith(";PU;")
    report = json.loads((tmp_path / "a.json").read_text())
    assert report["error_um"]["total"]["max"] < 40.0  # a plotter unit is 25 µm
    judged = camtool(installed, tmp_path, "verify", "a.plt", *flags, "--against", logo)
    assert judged.returncode == 0, judged.stderr
    other = camtool(installed, tmp_path, *("convert", "a.plt", "--from", "tiny-plotter"),
                    *("--to", "linuxcnc", "--feed", "500", "-o", "-"))  # fmt: skip
    assert "G1" in other.stdout, other.stderr


def test_its_reader_refuses_noise(installed: Path, tmp_path: Path) -> None:
    for noise in ("", "PU;", "IN;PA1,2;PU;", "IN;PU1;PU;", "IN;PU1,2", "IN;PU1,2;PD1.5,2;PU;"):
        (tmp_path / "noise.plt").write_text(noise)
        done = camtool(installed, tmp_path, "verify", "noise.plt", "--target", "tiny-plotter")
        assert done.returncode == 2, noise
        assert "noise.plt" in done.stderr
