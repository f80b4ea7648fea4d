"""docs/write-an-operation.md: what stands there is installed as a package, and works."""

import json
import re
from pathlib import Path

import ezdxf
import pytest

from tests.third_party import camtool
from tests.third_party import install as pip_install

pytestmark = pytest.mark.xdist_group("third party's operations")
"""One worker installs the packages, once."""

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "write-an-operation.md").read_text(encoding="utf-8")
PARTS = {"package": "pyproject.toml", "record": "__init__.py", "functions": "work.py"}
TARGET = ("--target", "grbl", "--tool-diameter", "1", "--spindle", "9000")


def listing(heading: str) -> str:
    """The first block of code below a heading of the page."""
    section = PAGE.partition(f"## {heading}")[2]
    found = re.search(r"```\w+\n(.*?)```", section, re.DOTALL)
    assert found, heading
    return found[1]


def install(source: Path, place: Path, texts: dict[str, str]) -> None:
    """Install the page's package, of these texts, from its files, offline."""
    package = source / "camtool_perforate"
    package.mkdir()
    for name, text in texts.items():
        folder = source if name.endswith(".toml") else package
        (folder / name).write_text(text, encoding="utf-8")
    pip_install(source, place)


SPOT_RECORD = """
from camtool.planning.kinds import COMMON_KEYS, SELECTING_KEYS, OperationKind

PERFORATE = OperationKind(
    name="perforate",
    work="camtool_perforate.work:spot",
    keys=(*COMMON_KEYS, *SELECTING_KEYS, "depth"),
    takes="holes",
    cuts="at",
    descent="pecks",
    needs_v_bit=True,
    cut_name="hole",
)
"""
SPOT_WORK = """
import numpy as np
from camtool.planning.holes import drilled_holes, pecks
from camtool.planning.items import CutRun, Fixed, Work


def spot(chosen, setting):
    items = []
    for hole in drilled_holes(chosen, setting.operation)[0]:
        vertices, feeds = pecks(hole.at_mm, [-setting.levels_mm[-1]], setting)
        run = CutRun(vertices, np.array(feeds), setting.feeds.plunge_mm_min, hole.name)
        items.append(Fixed((run,), setting, hole.name, hole.source, hole.outline))
    return Work(tuple(items))
"""
"""A kind that marks holes of any size with a V bit."""

TEXTS = {name: listing(f"The {part}") for part, name in PARTS.items()}


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that has the page's package."""
    place = tmp_path_factory.mktemp("place")
    install(tmp_path_factory.mktemp("source"), place, TEXTS)
    return place


@pytest.fixture(scope="module")
def faulty(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same, with a function that raises what is no error of camtool."""
    place = tmp_path_factory.mktemp("place")
    work = TEXTS["work.py"].replace("    items = []\n", "    items = {}['none']\n")
    install(tmp_path_factory.mktemp("source"), place, {**TEXTS, "work.py": work})
    return place


@pytest.fixture(scope="module")
def broken(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same, with a record that cannot be made."""
    place = tmp_path_factory.mktemp("place")
    record = TEXTS["__init__.py"].replace('cuts="at"', 'cuts="up"')
    install(tmp_path_factory.mktemp("source"), place, {**TEXTS, "__init__.py": record})
    return place


@pytest.fixture(scope="module")
def spotting(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same, with a kind that marks holes with a V bit."""
    place = tmp_path_factory.mktemp("place")
    texts = {**TEXTS, "__init__.py": SPOT_RECORD, "work.py": SPOT_WORK}
    install(tmp_path_factory.mktemp("source"), place, texts)
    return place


@pytest.fixture
def drawing(tmp_path: Path) -> str:
    """A straight line of 10 mm."""
    document = ezdxf.new(units=ezdxf.units.MM)
    document.modelspace().add_line((0.0, 0.0), (10.0, 0.0), dxfattribs={"layer": "FOLD"})
    document.saveas(tmp_path / "line.dxf")
    return "line.dxf"


def holes(program: Path) -> list[float]:
    """X (mm) of each hole of a program: the last X before a move down into the stock."""
    x, found = 0.0, []
    for block in program.read_text(encoding="utf-8").splitlines():
        if at := re.search(r"X(-?[\d.]+)", block):
            x = float(at[1])
        if re.search(r"G1.*Z-", block):
            found.append(x)
    return found


def test_it_posts_by_flags_and_is_verified(installed: Path, drawing: str, tmp_path: Path) -> None:
    flags = ("--kind", "perforate", "--spacing", "2.5mm", "--depth", "0.4", "--plunge-feed", "30")
    done = camtool(
        installed, tmp_path, "post", drawing, *TARGET, *flags, "-o", "a.nc", "--json", "a.json"
    )
    assert done.returncode == 0, done.stderr
    assert sorted(holes(tmp_path / "a.nc")) == [0.0, 2.5, 5.0, 7.5, 10.0]
    report = json.loads((tmp_path / "a.json").read_text(encoding="utf-8"))
    assert [each["kind"] for each in report["planned"]["operations"]] == ["perforate"]
    assert "perforate: tool 1 mm" in done.stderr + done.stdout
    assert not [each for each in report["findings"] if each["severity"] == "error"]


def test_it_posts_by_a_job_file_with_its_default(
    installed: Path, drawing: str, tmp_path: Path
) -> None:
    job = '[[operations]]\nname = "tear"\nkind = "perforate"\nlayers = ["FOLD"]\ndepth = 0.4\n'
    (tmp_path / "job.toml").write_text(job, encoding="utf-8")
    done = camtool(
        installed, tmp_path, "post", drawing, *TARGET, "--job", "job.toml", "-o", "a.nc"
    )
    assert done.returncode == 0, done.stderr
    assert len(holes(tmp_path / "a.nc")) == 6


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (("--spacing", "0"), "holes must be some distance apart"),
        (("--step-down", "1"), "means nothing to the kind perforate"),
    ],
)
def test_what_it_refuses_is_said(
    installed: Path, drawing: str, tmp_path: Path, given: tuple[str, str], words: str
) -> None:
    flags = ("--kind", "perforate", *given)
    done = camtool(installed, tmp_path, "post", drawing, *TARGET, *flags, "-o", "a.nc")
    assert done.returncode == 2
    assert words in done.stderr


def test_its_own_faults_are_not_camtool_s(faulty: Path, drawing: str, tmp_path: Path) -> None:
    done = camtool(faulty, tmp_path, "post", drawing, *TARGET, "--kind", "perforate", "-o", "a.nc")
    assert done.returncode == 2
    assert "plug-in camtool_perforate.work:perforate" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_broken_one_harms_no_other(broken: Path, drawing: str, tmp_path: Path) -> None:
    (tmp_path / "job.toml").write_text('kind = "perforate"\n', encoding="utf-8")
    flags = (*TARGET, "-o", "a.nc")
    done = camtool(broken, tmp_path, "post", drawing, *flags, "--job", "job.toml")
    assert done.returncode == 2
    assert "'up' is none of beside, within, along, at, over" in done.stderr
    assert camtool(broken, tmp_path, "post", drawing, *flags, "--kind", "engrave").returncode == 0


def test_a_v_bit_marks_circles_wider_than_itself(spotting: Path, tmp_path: Path) -> None:
    """The kind has no key `max_hole`, and its tool with a tip angle is a V bit, not a drill."""
    document = ezdxf.new(units=ezdxf.units.MM)
    for x in (0.0, 10.0):
        document.modelspace().add_circle((x, 0.0), 1.5)
    document.saveas(tmp_path / "holes.dxf")
    job = (
        '[tools.bit]\ndiameter = "1.2mm"\ntip_angle = 90\n'
        '[stock]\nthickness = "6mm"\nsize = ["30mm", "20mm"]\ncorner = ["-10mm", "-10mm"]\n'
        '[[operations]]\nname = "marks"\nkind = "perforate"\ntool = "bit"\ndepth = "0.5mm"\n'
    )
    (tmp_path / "job.toml").write_text(job, encoding="utf-8")
    flags = ("--target", "grbl", "--spindle", "9000", "--job", "job.toml", "-o", "a.nc")
    done = camtool(spotting, tmp_path, "post", "holes.dxf", *flags)
    assert done.returncode == 0, done.stderr
    assert sorted(holes(tmp_path / "a.nc")) == [0.0, 10.0]
    assert "CUT_TOO_DEEP" not in done.stderr
