"""docs/write-a-post.md: what stands there is installed as a package of its own, and works."""

import json
import re
from pathlib import Path

import pytest

from tests.third_party import camtool
from tests.third_party import install as pip_install

pytestmark = pytest.mark.xdist_group("third party's targets")
"""One worker installs the package, once."""

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "write-a-post.md").read_text(encoding="utf-8")
MOST_LINES = {"target": 75, "controller": 35}


def listing(heading: str) -> str:
    """The block of code below a heading of the page."""
    section = PAGE.partition(f"## The {heading}")[2]
    found = re.search(r"```\w+\n(.*?)```", section, re.DOTALL)
    assert found, heading
    return found[1]


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that pip has installed the page's package to, from its files, offline."""
    source, place = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("place")
    package = source / "tiny_plotter"
    package.mkdir()
    (source / "pyproject.toml").write_text(listing("package"))
    (package / "machine.toml").write_text(listing("machine"))
    (package / "__init__.py").write_text(listing("target"))
    (package / "controller.py").write_text(listing("controller"))
    (package / "findings.py").write_text(listing("findings"))
    pip_install(source, place)
    return place


@pytest.mark.parametrize("part", MOST_LINES)
def test_it_is_short(part: str) -> None:
    assert len(listing(part).splitlines()) <= MOST_LINES[part]


def test_it_is_found_beside_our_own(installed: Path, tmp_path: Path) -> None:
    done = camtool(installed, tmp_path, "targets")
    assert done.returncode == 0, done.stderr
    names = [line.split()[0] for line in done.stdout.splitlines()]
    assert "tiny-plotter" in names
    assert "pic-mmh" in names
    shown = camtool(installed, tmp_path, "targets", "tiny-plotter")
    assert 'controller.model = "tiny-plotter"\ncontroller.down_hz = 1600.0' in shown.stdout
    assert "dialect.pen = 2" in shown.stdout


FLAGS = ("--target", "tiny-plotter")


def test_it_posts_verifies_and_converts(installed: Path, tmp_path: Path) -> None:
    logo = str(ROOT / "samples" / "logo.dxf")
    done = camtool(installed, tmp_path, "post", logo, *FLAGS, "-o", "a.plt", "--json", "a.json")
    assert done.returncode == 0, done.stderr
    text = (tmp_path / "a.plt").read_text()
    assert text.startswith("IN;SP2;PU0,0;")
    assert text.endswith(";PU;")
    report = json.loads((tmp_path / "a.json").read_text())
    assert report["error_um"]["total"]["max"] < 50.0  # two plotter units
    judged = camtool(installed, tmp_path, "verify", "a.plt", *FLAGS, "--against", logo)
    assert judged.returncode == 0, judged.stderr
    other = camtool(installed, tmp_path, *("convert", "a.plt", "--from", "tiny-plotter"),
                    *("--to", "linuxcnc", "--feed", "500", "-o", "-"))  # fmt: skip
    assert "G1" in other.stdout, other.stderr


def test_its_controller_is_simulated(installed: Path, tmp_path: Path) -> None:
    (tmp_path / "line.plt").write_text("IN;SP2;PD1600,800;PU0,0;PU;")

    def report(*settings: str) -> dict[str, object]:
        given = [part for each in settings for part in ("--set", each)]
        done = camtool(installed, tmp_path, "verify", "line.plt", *FLAGS, *given, "--json", "-")
        assert done.returncode == 0, done.stderr
        found: dict[str, object] = json.loads(done.stdout)
        return found

    own = report()
    assert own["interpolator"] == "steps"
    # The pen down by 40 steps and 1600 along X at 1600 Hz, up by 80 and back at 8000 Hz.
    assert own["time_s"] == pytest.approx(1640 / 1600 + 1680 / 8000)
    assert own["steps"] == {
        "x": 3200,
        "y": 1600,
        "z": 120,
        "iterations": 3320,
        "iterations_cutting": 1600,
    }
    assert report("controller.down_hz=800")["time_s"] == pytest.approx(1640 / 800 + 1680 / 8000)
    exact = report("controller.model=path")
    assert exact["interpolator"] == "path"
    assert exact["time_s"] != own["time_s"]


def test_it_finds_what_no_other_machine_knows(installed: Path, tmp_path: Path) -> None:
    (tmp_path / "far.plt").write_text("IN;SP2;" + "PD999999,0;PU0,0;" * 17 + "PU;")
    done = camtool(installed, tmp_path, "verify", "far.plt", *FLAGS, "--json", "-")
    found = [each for each in json.loads(done.stdout)["findings"] if each["code"][0].islower()]
    assert [(each["code"], each["severity"]) for each in found] == [
        ("tiny-plotter.DRY", "warning")
    ]
    assert "m, its ink lasts for 400 m" in found[0]["message"]
    assert "warning tiny-plotter.DRY: the pen draws 4" in done.stderr
    shown = camtool(installed, tmp_path, "targets", "tiny-plotter")
    assert "tiny-plotter.DRY (warning): the pen draws farther than its ink lasts" in shown.stderr


def test_its_records_check_the_machine_file(installed: Path, tmp_path: Path) -> None:
    for setting, said in (
        ("controller.down_hz=-1", "key down_hz: -1 is not between 0.001 and"),
        ("controller.model=grbl", "use one of tiny-plotter, path"),
        ("dialect.pen=7", "key pen: 7 is not between 1 and 6"),
        ("dialect.ink=1", "unknown key; known keys: pen"),
    ):
        done = camtool(installed, tmp_path, "targets", "tiny-plotter", "--set", setting)
        assert done.returncode == 2
        assert said in done.stderr


def test_its_reader_refuses_noise(installed: Path, tmp_path: Path) -> None:
    noises = ("", "PU;", "IN;SP2;PA1,2;PU;", "IN;SP2;PU1;PU;", "IN;SP2;PU1,2", "IN;SP1;PU1,2;PU;")
    for noise in noises:
        (tmp_path / "noise.plt").write_text(noise)
        done = camtool(installed, tmp_path, "verify", "noise.plt", *FLAGS)
        assert done.returncode == 2, noise
        assert "noise.plt" in done.stderr


def copied(installed: Path, folder: Path) -> Path:
    """The installed package in another folder, to break it there."""
    for file in installed.glob("tiny_plotter*/*"):
        if file.is_file():
            copy = folder / file.relative_to(installed)
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_bytes(file.read_bytes())
    return folder


def test_its_codes_bear_its_name(installed: Path, tmp_path: Path) -> None:
    faulty = copied(installed, tmp_path / "faulty")
    findings = faulty / "tiny_plotter" / "findings.py"
    findings.write_text(findings.read_text().replace("tiny-plotter.DRY", "DRY"))
    done = camtool(faulty, tmp_path, "targets", "tiny-plotter")
    assert done.returncode == 2, done.stderr
    assert "the code DRY does not begin with tiny-plotter." in done.stderr


def test_a_fault_of_its_model_is_its_own(installed: Path, tmp_path: Path) -> None:
    faulty = copied(installed, tmp_path / "faulty")
    model = faulty / "tiny_plotter" / "controller.py"
    model.write_text(model.read_text().replace("check_rows(toolpath, machine)", "1 / 0", 1))
    (tmp_path / "line.plt").write_text("IN;SP2;PD1600,800;PU;")
    done = camtool(faulty, tmp_path, "verify", "line.plt", *FLAGS)
    assert done.returncode == 2, done.stderr
    assert "plug-in tiny_plotter:POST: fails to run (ZeroDivisionError" in done.stderr
    model.unlink()
    done = camtool(faulty, tmp_path, "verify", "line.plt", *FLAGS)
    assert "plug-in tiny_plotter:POST: fails to model (ModuleNotFoundError" in done.stderr
