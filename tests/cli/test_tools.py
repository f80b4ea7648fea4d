"""Libraries of tools: found by name, with presets by material; and what is refused."""

import json
import tomllib
from pathlib import Path

import pytest

from camtool.jobs.keys import PRESET, TOOL
from camtool.jobs.tools import read_library
from tests.cli.conftest import Run

LIBRARY = """
[tools.mill]
diameter = "0.2mm"
flutes = 2
number = 4

[tools.mill.presets.brass]
feed = "0.4mm/min"
plunge_feed = "0.2mm/min"
step_down = "0.02mm"
step_over = "30%"
chip_load = "..0.05mm"
"""


@pytest.fixture(autouse=True)
def config(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The user's configuration folder, empty."""
    folder = tmp_path_factory.mktemp("config")
    monkeypatch.setenv("XDG_CONFIG_HOME", str(folder))
    return folder / "camtool"


def posted(camtool: Run, samples: Path, *flags: str) -> tuple[int, str, str]:
    """The code, the summary and the messages of the logo, its last layer."""
    args = ("post", str(samples / "logo.dxf"), "-t", "pic-mmh", "-o", "a.pic", "--no-verify")
    result = camtool(*args, "--layer", "CUT", *flags)
    return result.returncode, result.stdout.decode(), result.stderr.decode()


def test_the_first_library_is_one_that_jobs_find(
    camtool: Run, tmp_path: Path, config: Path
) -> None:
    assert camtool("tools").returncode == 0
    assert camtool("tools", "new").returncode == 0
    made = config / "tools.toml"
    known = read_library(made)
    assert {"mill", "bit-60", "ball"} <= set(known)
    assert "mill " in camtool("tools").stdout.decode()
    told = camtool("tools", "mill").stdout.decode()
    # 800 mm/min over 10,000 rev/min of two flutes; an edge of 3.175 mm at that speed.
    assert "plywood: spindle 10000 (99.7 m/min), feed 800 mm/min (0.04 mm per tooth)" in told
    again = camtool("tools", "new")
    assert again.returncode == 2
    assert "exists already" in again.stderr.decode()


def test_the_first_library_drills_and_engraves(camtool: Run, tmp_path: Path, config: Path) -> None:
    """Without naming a tool: the first end mill of the library, its drills and its bits."""
    assert camtool("tools", "new").returncode == 0
    holes = "".join(f'<circle cx="{x}" cy="10" r="{d / 2}"/>' for x, d in ((10, 3), (20, 4)))
    (tmp_path / "a.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="60mm" height="20mm" viewBox="0 0 60 20">'
        '<g fill="none" stroke="#000"><rect width="60" height="20"/><path d="M30 10H50"/>'
        f"{holes}</g></svg>"
    )

    def chosen(*flags: str) -> list[tuple[str, str]]:
        done = camtool("job", "new", "a.svg", "-o", "-", *flags)
        assert done.returncode == 0
        rows = tomllib.loads(done.stdout.decode())
        return sorted((each["kind"], each["tool"]) for each in rows["operations"])

    for material in ((), ("--material", "plywood")):
        flags = ("--thickness", "3mm", "--tool", "mill", *material) if material else ()
        assert chosen(*flags) == [
            ("drill", "drill-3"),
            ("drill", "drill-4"),
            ("engrave", "bit-90"),
            ("profile", "mill"),
        ]


def test_every_chip_load_of_the_sample_is_within_its_limits(camtool: Run) -> None:
    camtool("tools", "new")
    (rows,) = json.loads(camtool("tools", "--json").stdout).values()
    checked = 0
    for row in rows:
        for preset in row["presets"].values():
            if "chip_load_mm" in preset:
                least, most = preset["chip_load_mm"]
                assert least <= preset["feed_per_tooth_mm"] <= most
                checked += 1
            if "surface_speed_m_min" in preset:
                assert preset["edge_m_min"] <= preset["surface_speed_m_min"][1]
            assert preset["plunge_feed_mm_min"] <= preset["feed_mm_min"]
            if row["kind"] != "drill" and "step_down_mm" in preset:
                assert preset["step_down_mm"] <= 0.5 * row["diameter_mm"]
    assert checked >= 8


def test_every_drill_of_the_sample_turns(camtool: Run) -> None:
    """Holes are drilled in every material that the mill cuts, but for wide ones in aluminium, for
    which a small router is too weak."""
    camtool("tools", "new")
    (rows,) = json.loads(camtool("tools", "--json").stdout).values()
    tools = {row["name"]: row for row in rows}
    drills = [row for row in rows if row["kind"] == "drill" and row["name"] != "drill-08"]
    assert len(drills) == 5
    for row in drills:
        lacking = set(tools["mill"]["presets"]) - set(row["presets"])
        assert lacking == ({"aluminium"} if row["diameter_mm"] > 3.0 else set())
        for preset in row["presets"].values():
            assert preset["spindle_rpm"] <= 10000
            assert preset["peck_mm"] <= row["diameter_mm"]


def test_a_preset_counts_for_what_the_job_does_not_say(
    camtool: Run, tmp_path: Path, samples: Path, config: Path
) -> None:
    config.mkdir()
    (config / "tools.toml").write_text(LIBRARY, encoding="utf-8")
    flags = ("--tool", "mill", "--material", "brass", "--depth", "0.04mm", "--json", "-")
    args = ("post", str(samples / "logo.dxf"), "-t", "pic-mmh", "-o", "a.pic", "--layer", "CUT")
    told = json.loads(camtool(*args, *flags).stdout)["planned"]["operations"][0]
    assert told["tool_name"] == "mill"
    assert told["material"] == "brass"
    assert (told["feed_mm_min"], told["plunge_mm_min"], told["passes"]) == (0.4, 0.2, 2)
    (tmp_path / "job.toml").write_text(
        'feed = "0.3mm/min"\ntool = 4\ndepth = 0.04\n', encoding="utf-8"
    )
    flags = ("--job", "job.toml", "--material", "brass", "--step-down", "0.04mm", "--json", "-")
    told = json.loads(camtool(*args, *flags).stdout)["planned"]["operations"][0]
    assert (told["feed_mm_min"], told["plunge_mm_min"], told["passes"]) == (0.3, 0.2, 1)


def test_the_folder_says_tool_and_material(camtool: Run, tmp_path: Path, samples: Path) -> None:
    (tmp_path / "camtool.toml").write_text('tool = "mill"\nmaterial = "brass"\n', encoding="utf-8")
    (tmp_path / "tools.toml").write_text(LIBRARY, encoding="utf-8")
    args = ("post", str(samples / "logo.dxf"), "-t", "pic-mmh", "-o", "a.pic", "--layer", "CUT")
    told = json.loads(camtool(*args, "--json", "-").stdout)["planned"]["operations"][0]
    assert (told["tool_name"], told["material"], told["feed_mm_min"]) == ("mill", "brass", 0.4)
    flags = ("--tool-diameter", "0.1mm", "--json", "-")
    told = json.loads(camtool(*args, *flags).stdout)["planned"]["operations"][0]
    assert (told["tool_name"], told["material"]) == ("", "")


def test_the_nearest_library_counts(
    camtool: Run, tmp_path: Path, samples: Path, config: Path
) -> None:
    config.mkdir()
    (config / "tools.toml").write_text(LIBRARY, encoding="utf-8")
    (tmp_path / "camtool.toml").write_text("", encoding="utf-8")
    (tmp_path / "tools.toml").write_text(LIBRARY.replace("0.2mm", "0.3mm", 1), encoding="utf-8")
    (tmp_path / "other.toml").write_text(LIBRARY.replace("0.2mm", "0.1mm", 1), encoding="utf-8")
    args = ("post", str(samples / "logo.dxf"), "-t", "pic-mmh", "-o", "a.pic", "--layer", "CUT")
    sizes = []
    for more in ((), ("--tool-library", "other.toml")):
        told = json.loads(camtool(*args, "--tool", "mill", *more, "--json", "-").stdout)
        sizes.append(told["planned"]["operations"][0]["tool_diameter_mm"])
    assert sizes == [0.3, 0.1]
    assert "0.3 mm" in camtool("tools").stdout.decode()


@pytest.mark.parametrize(
    ("library", "flags", "words"),
    [
        (LIBRARY, ("--tool", "mil"), "did you mean mill?"),
        (LIBRARY, ("--tool", "5"), "there is no tool 5"),
        (LIBRARY, ("--tool", "mill", "--material", "bras"), "did you mean brass?"),
        (LIBRARY, ("--tool-diameter", "1", "--material", "brass"), "no tool of the job has"),
        (LIBRARY + "feeds = 3", ("--tool", "mill"), "presets.brass], key feeds: unknown key"),
        (LIBRARY.replace("0.4mm/min", "-1"), ("--tool", "mill"), "key feed: feed -1 mm/min"),
        (LIBRARY.replace('"..0.05mm"', '["2mm", "1mm"]'), ("--tool", "mill"), "is no range"),
        (LIBRARY.replace("flutes = 2", "flutes = 0"), ("--tool", "mill"), "key flutes"),
        (LIBRARY + "[tools.b]\nnumber = 4", ("--tool", "mill"), "tool 4 is 'mill' already"),
        (LIBRARY + "[tool.b]", ("--tool", "mill"), "key tool: unknown key"),
        ("[tools.b]\npresets = 3", ("--tool", "b"), "is no table of presets"),
        ("[tools", ("--tool", "b"), "is no TOML"),
    ],
)
def test_one_line_with_place_and_mend(
    camtool: Run, tmp_path: Path, samples: Path, config: Path,
    library: str, flags: tuple[str, ...], words: str,
) -> None:  # fmt: skip
    config.mkdir()
    (config / "tools.toml").write_text(library, encoding="utf-8")
    code, _, err = posted(camtool, samples, *flags)
    assert code == 2
    assert words in err
    assert err.count("\n") == 1
    assert not (tmp_path / "a.pic").exists()


def test_a_broken_library_stops_only_those_who_need_it(
    camtool: Run, samples: Path, config: Path
) -> None:
    config.mkdir()
    (config / "tools.toml").write_text("[tools", encoding="utf-8")
    assert posted(camtool, samples)[0] == 0
    assert camtool("tools").returncode == 2


def test_a_proposal_for_a_tool_of_the_library(
    camtool: Run, tmp_path: Path, samples: Path, config: Path
) -> None:
    camtool("tools", "new")
    plate = str(samples / "plate.dxf")
    flags = ("--tool", "mill", "--thickness", "3mm", "--layer", "OUTLINE", "-o", "job.toml")
    made = camtool("job", "new", plate, *flags)
    assert made.returncode == 0
    job = tomllib.loads((tmp_path / "job.toml").read_text(encoding="utf-8"))
    assert "tools" not in job
    assert {each["tool"] for each in job["operations"]} == {"mill"}
    assert "step_down" not in str(job)
    flags = ("--job", "job.toml", "--material", "plywood", "-o", "a.nc", "--json", "-")
    posted = camtool("post", plate, "-t", "linuxcnc", *flags)
    told = json.loads(posted.stdout)["planned"]["operations"]
    assert all(each["deepest_pass_mm"] <= 1.5 for each in told if each["passes"])
    assert "CUT_DOUBTFUL" not in posted.stderr.decode()


def test_the_page_says_what_presets_have() -> None:
    page = Path("docs/jobs.md").read_text(encoding="utf-8")
    (told,) = (line for line in page.splitlines() if "may have presets by material" in line)
    (more,) = (line for line in page.splitlines() if line.startswith("`surface_speed`."))
    assert {key for key in PRESET if f"`{key}`" in told + more} == set(PRESET)
    assert set(PRESET) & set(TOOL) == {"chip_load", "surface_speed"}


def test_a_new_job_says_the_material(camtool: Run, tmp_path: Path, samples: Path) -> None:
    assert camtool("tools", "new", "--project").returncode == 0
    new = ("job", "new", samples / "plate.dxf", "--tool", "mill", "--thickness", "3mm")
    assert camtool(*new, "--material", "plywood").returncode == 0
    text = (tmp_path / "job.toml").read_text(encoding="utf-8")
    assert '\nmaterial = "plywood"' in text
    assert '\n# material = "mdf"' in text
    done = camtool(*new, "--material", "oak", "-o", "other.toml")
    assert done.returncode == 2
    assert b"no preset for 'oak'" in done.stderr
    done = camtool("job", "new", samples / "plate.dxf", "--material", "oak", "-o", "other.toml")
    assert done.returncode == 2
    assert b"give --tool too" in done.stderr
    assert not (tmp_path / "other.toml").exists()


def test_a_number_of_a_preset_that_the_machine_lacks_is_named_with_it(
    camtool: Run, samples: Path, tmp_path: Path
) -> None:
    """The key is in no job: whoever looks for it there does not find it."""
    (tmp_path / "camtool.toml").write_text("")
    (tmp_path / "tools.toml").write_text(LIBRARY + "spindle = 9000\n")
    post = ("post", samples / "logo.dxf", "-t", "grbl", "--set", "spindle.max_rpm=5000")
    asked = (*post, "--tool", "mill", "--material", "brass", "-o", "-")
    done = camtool(*asked)
    assert done.returncode == 2
    told = done.stderr.decode()
    assert "key spindle of the tool's preset for 'brass': 9000 rev/min" in told
    assert "--set spindle.max_rpm=9000" in told
    # One that stands nearer takes its place, and is named as the job's.
    done = camtool(*asked, "--spindle", "7000")
    assert "operation 'profile', key spindle: 7000 rev/min" in done.stderr.decode()
