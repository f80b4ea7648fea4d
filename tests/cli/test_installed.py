"""`uvx camtool` and `pipx run camtool`: from a folder of wheels alone, without an environment."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.conftest import ROOT, Run

# Everything that a wheel is built from; not what lies in a checkout beside it.
SOURCES = ("pyproject.toml", "setup.py", "MANIFEST.in", "README.md", "LICENSE")
FOLDERS = ("camtool", "postprocessors", "build_backend")
NOT_SOURCE = shutil.ignore_patterns("*.so", "*.pyd", "*.c", "__pycache__")
POST = ("post", "logo.dxf", "-t", "pic-mmh", "--no-verify", "-q")


def _program(name: str) -> str:
    """Return the program of this name, from the environment of the tests or the path."""
    found = shutil.which(name, path=str(Path(sys.executable).parent)) or shutil.which(name)
    if found is None:
        pytest.skip(f"{name} is not installed here")
    return found


def _run(
    *command: str, folder: Path, variables: dict[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    env = os.environ | (variables or {})
    return subprocess.run(
        command, cwd=folder, env=env, capture_output=True, text=True, timeout=900, check=False
    )


@pytest.fixture(scope="module")
def wheels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the wheel of this checkout, and those of all packages that it needs."""
    source = tmp_path_factory.mktemp("source")
    folder = tmp_path_factory.mktemp("wheels")
    for name in FOLDERS:
        shutil.copytree(ROOT / name, source / name, ignore=NOT_SOURCE)
    for name in SOURCES:
        shutil.copy(ROOT / name, source)
    pip = (sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check")
    # pipx, too, makes its environments of this folder: it takes pip from there.
    needed = _run(*pip, "download", "--dest", str(folder), "pip", "setuptools", folder=source)
    if needed.returncode:
        pytest.skip(f"no index of packages is at hand: {needed.stderr.strip().splitlines()[-1]}")
    built = _run(*pip, "wheel", "--no-deps", "--wheel-dir", str(folder), ".", folder=source)
    assert built.returncode == 0, built.stderr
    (wheel,) = folder.glob("camtool-*.whl")
    needed = _run(*pip, "download", "--dest", str(folder), str(wheel), folder=source)
    assert needed.returncode == 0, needed.stderr
    return folder


@pytest.fixture(scope="module")
def uvx() -> str:
    return _program("uvx")


@pytest.fixture(scope="module")
def pipx() -> str:
    return _program("pipx")


@pytest.fixture
def logo(tmp_path: Path) -> Path:
    """A folder with a drawing alone: no checkout is beside it."""
    shutil.copy(ROOT / "samples/logo.dxf", tmp_path)
    return tmp_path


def _is_of_post(folder: Path, camtool: Run) -> None:
    posted = camtool(*POST, "-o", "-")
    assert posted.returncode == 0, posted.stderr.decode()
    assert (folder / "logo.pic").read_bytes() == posted.stdout


@pytest.mark.slow
def test_uvx_runs_camtool_from_wheels(uvx: str, wheels: Path, logo: Path, camtool: Run) -> None:
    places = {"UV_CACHE_DIR": str(logo / "cache"), "UV_NO_CONFIG": "1"}
    index = ("--offline", "--no-index", "--find-links", str(wheels))
    run = (uvx, *index, "--python", sys.executable, "camtool")
    done = _run(*run, "--version", folder=logo, variables=places)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("camtool, version ")
    done = _run(*run, *POST, "-o", "logo.pic", folder=logo, variables=places)
    assert done.returncode == 0, done.stderr
    _is_of_post(logo, camtool)


@pytest.mark.slow
def test_pipx_runs_camtool_from_wheels(pipx: str, wheels: Path, logo: Path, camtool: Run) -> None:
    home = logo / "pipx"
    places = {
        "PIPX_HOME": str(home),
        "PIPX_BIN_DIR": str(home / "bin"),
        "PIPX_DEFAULT_BACKEND": "pip",
        "PIP_NO_INDEX": "1",
        "PIP_FIND_LINKS": str(wheels),
    }
    run = (pipx, "run", "--python", sys.executable, "camtool")
    done = _run(*run, *POST, "-o", "logo.pic", folder=logo, variables=places)
    assert done.returncode == 0, done.stderr
    _is_of_post(logo, camtool)
