"""`camtool init`: a machine of one's own, found by its name, and what is refused."""

import json
import re
import tomllib
from pathlib import Path

import ezdxf
import pytest

from camtool.cli.init import AXES
from camtool.target.registry import load_target
from tests.cli.conftest import Run
from tests.sending.test_ends import hosted

LISTING = """Grbl 1.1h ['$' for help]
>>> $$
$0=10
$1=25
$3=2 (dir port invert mask:00000010)
$11=0.010
$12=0.002
$100=800.000
$101=800.000
$102=800.000
$110=1000.000
$111=1000.000
$112=600.000
$30=12000
$31=0
$120=30.000
$121=30.000
$122=10.000
$130=300.000
$131=180.000
$132=45.000
ok
"""


@pytest.fixture(autouse=True)
def config(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The user's configuration folder, empty."""
    folder = tmp_path_factory.mktemp("config")
    monkeypatch.setenv("XDG_CONFIG_HOME", str(folder))
    return folder / "camtool"


def said(file: Path) -> dict[str, object]:
    """The values of X in a machine file."""
    axis = tomllib.loads(file.read_text(encoding="utf-8"))["axes"]["x"]
    assert isinstance(axis, dict)
    return axis


def test_from_a_listing_to_a_program_with_three_commands(
    camtool: Run, tmp_path: Path, config: Path, samples: Path
) -> None:
    (tmp_path / "grbl.txt").write_text(LISTING)
    done = camtool("init", "my-3018", "--settings", "grbl.txt")
    assert done.returncode == 0, done.stderr
    assert b"camtool post drawing.dxf\n" in done.stderr
    whole = tomllib.loads((config / "machines" / "my-3018.toml").read_text())
    assert whole["spindle"] == {"max_rpm": 12000, "min_rpm": 0, "spin_up_s": 2.0}
    assert whole["defaults"] == {"feed_z_mm": 2.0, "plunge_share": 0.3}
    file = config / "machines" / "my-3018.toml"
    assert said(file) == {
        "coded_step_mm": 0.00125,
        "travel_mm": 300,
        "max_rate_mm_min": 1000,
        "acceleration_mm_s2": 30,
    }
    done = camtool("post", samples / "logo.dxf", "--json", "r.json")
    assert done.returncode == 0, done.stderr
    assert b"placeholders" not in done.stderr
    assert json.loads((tmp_path / "r.json").read_text())["target"] == "my-3018"
    by_name = camtool("post", samples / "logo.dxf", "--machine", "my-3018", "-o", "-").stdout
    assert by_name == (tmp_path / "logo.nc").read_bytes()
    assert camtool("post", samples / "logo.dxf", "-t", "my-3018", "-o", "-").stdout == by_name
    plain = camtool("post", samples / "logo.dxf", "-t", "grbl", "-o", "logo.nc")
    assert b"placeholders: camtool init" in plain.stderr


def test_it_is_listed_shown_and_calibrated(camtool: Run, tmp_path: Path, config: Path) -> None:
    camtool("init", "one", "-t", "grbl", "--travel", "300x180x45")
    done = camtool("init", "two", "-t", "linuxcnc", "--travel", "1/2in")
    assert b"drawing.dxf --machine two" in done.stderr
    lines = camtool("targets").stdout.decode().splitlines()[-2:]
    assert lines[0].startswith("one ")
    assert "yours, the default, on grbl" in lines[0]
    assert "yours, on linuxcnc" in lines[1]
    rows = json.loads(camtool("targets", "--json").stdout)["machines"]
    assert [(row["name"], row["extends"], row["default"]) for row in rows] == [
        ("one", "grbl", True),
        ("two", "linuxcnc", False),
    ]
    shown = json.loads(camtool("targets", "two", "--json").stdout)
    assert shown["axes"]["z"]["travel_mm"] == pytest.approx(12.7)
    camtool("coupon", "lines", "-o", "c.dxf", "--measurements", "m.toml", "--machine", "one")
    assert (tmp_path / "m.toml").exists()


def test_with_project_it_is_kept_here_and_holds_below(
    camtool: Run, tmp_path: Path, config: Path, samples: Path
) -> None:
    (tmp_path / "camtool.toml").write_text('# ours\ntarget = "linuxcnc"\n')
    done = camtool("init", "mill", "-t", "grbl", "--travel", "200", "--project")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "camtool.toml").read_text() == 'machine = "mill"\n# ours\n'
    assert not config.exists()
    assert camtool("post", samples / "logo.dxf").returncode == 0
    assert (tmp_path / "logo.nc").exists()
    assert b"mill" in camtool("targets").stdout


def test_a_job_of_the_project_holds(camtool: Run, tmp_path: Path, samples: Path) -> None:
    (tmp_path / "camtool.toml").write_text('target = "linuxcnc"\njob = "deep.toml"\n')
    (tmp_path / "deep.toml").write_text("[[operations]]\ndepth = 3.0\n")
    assert camtool("post", samples / "logo.dxf").returncode == 0
    assert b"Z-3" in (tmp_path / "logo.ngc").read_bytes()


def test_a_filter_is_for_its_own_controller(camtool: Run, samples: Path) -> None:
    camtool("init", "mine", "-t", "grbl", "--travel", "200")
    assert b"G64" in camtool("filter", samples / "logo.dxf").stdout


@pytest.mark.parametrize("flag", sorted(AXES))
def test_each_number_may_be_one_or_three(camtool: Run, config: Path, flag: str) -> None:
    for name, text in (("one", "50"), ("three", "50x60x70")):
        done = camtool("init", name, "-t", "grbl", f"--{flag}", text)
        assert done.returncode == 0, done.stderr
    one, three = (said(config / "machines" / f"{name}.toml") for name in ("one", "three"))
    assert one == three
    assert len(one) == 1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("mine", "-t", "gbrl", "--travel", "9"), "did you mean grbl"),
        (("mine",), "--target or --settings is missing"),
        ((), "NAME is missing"),
        (("My Mill", "-t", "grbl"), "is no name for a machine"),
        (("../mill", "-t", "grbl"), "is no name for a machine"),
        (("camtool", "-t", "grbl"), "is no name for a machine"),
        (("mine", "-t", "grbl", "--travel", "3x4"), "neither one value nor three"),
        (("mine", "-t", "grbl", "--travel", "-3"), "neither one value nor three"),
        (("mine", "-t", "grbl", "--travel", "nan"), "is no number"),
        (("mine", "-t", "grbl", "--acceleration", "nan"), "'nan' is no number"),
        (("mine", "-t", "grbl", "--acceleration", "9" * 5000), "is no number"),
        (("mine", "-t", "grbl", "--spindle", "inf"), "'inf' is no number"),
        (("mine", "-t", "grbl", "--steps", "inf"), "'inf' is no number"),
        (("mine", "-t", "grbl", "--steps", "0"), "steps per mm are none"),
        (("mine", "-t", "grbl", "--travel", "1e9"), "--travel 1e9: "),
        (("mine", "-t", "grbl", "--settings", "missing.txt"), "cannot be read"),
        (("mine", "--port", "/nonexistent"), "--port needs --target"),
        (("mine", "-t", "grbl", "--port", "/dev/no-port"), "the port cannot be opened"),
        (("mine", "-t", "valcnc", "--port", "/nonexistent"), "no settings that can be read"),
        (("mine", "-t", "grbl", "--port", "a", "--settings", "b"), "contradict"),
        (("mine", "-t", "grbl", "--project", "-o", "b"), "contradict"),
    ],
)
def test_wrong_use_says_what_to_do(
    camtool: Run, tmp_path: Path, config: Path, arguments: tuple[str, ...], words: str
) -> None:
    done = camtool("init", *arguments)
    assert done.returncode == 2, done.stderr
    assert words in done.stderr.decode()
    assert not list(tmp_path.iterdir())
    assert not config.exists()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("$110=1000.000\n", "", "the listing is not whole: $110 is missing"),
        ("$110=1000.000\n", "$110=1000.000\n$110=900\n", "line 12, $110: is given twice"),
        ("$110=1000.000", "$110=fast", "line 11, $110: 'fast' is no number"),
        ("$100=800.000", "$100=0", "line 8, $100: 0 steps/mm are none"),
        ("$130=300.000", "$130=-300.000", "line 19, $130: -300 is not between"),
        ("$", "?", "says nothing of a machine; give what it answers to $$ for grbl or its INI"),
    ],
)
def test_bad_listings_are_refused_by_line(
    camtool: Run, tmp_path: Path, config: Path, old: str, new: str, words: str
) -> None:
    (tmp_path / "g.txt").write_text(LISTING.replace(old, new))
    done = camtool("init", "mine", "--settings", "g.txt")
    assert done.returncode == 2, done.stderr
    assert done.stderr.decode().startswith(f"camtool: error: g.txt: {words}"), done.stderr
    assert not config.exists()


def test_what_is_there_is_not_overwritten(camtool: Run, config: Path) -> None:
    assert camtool("init", "mine", "-t", "grbl").returncode == 0
    before = (config / "machines" / "mine.toml").read_bytes()
    done = camtool("init", "mine", "-t", "linuxcnc")
    assert done.returncode == 2
    assert b"exists already" in done.stderr
    assert (config / "machines" / "mine.toml").read_bytes() == before


def test_flags_hold_against_the_listing(camtool: Run, config: Path) -> None:
    done = camtool(
        "init", "mine", "--settings", "-", "--travel", "290x170x40", stdin=LISTING.encode()
    )
    assert done.returncode == 0, done.stderr
    assert said(config / "machines" / "mine.toml")["travel_mm"] == 290.0


def test_an_unknown_machine_is_named_with_those_that_there_are(
    camtool: Run, samples: Path
) -> None:
    camtool("init", "my-3018", "-t", "grbl")
    done = camtool("post", samples / "logo.dxf", "--machine", "my-3019")
    assert done.returncode == 2
    assert b"did you mean my-3018? known are my-3018; make it with camtool init" in done.stderr


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('machin = "a"\n', b"did you mean machine"),
        ('machine = "a"\ntarget = "grbl"\n', b"contradict each other"),
        ("machine = 3\n", b"camtool.toml"),
        ("[[", b"is no TOML"),
        ('machine = "nobody"\n', b"there is no machine 'nobody'"),
    ],
)
def test_a_wrong_camtool_toml_is_an_error(
    camtool: Run, tmp_path: Path, samples: Path, text: str, words: bytes
) -> None:
    (tmp_path / "camtool.toml").write_text(text)
    done = camtool("post", samples / "logo.dxf")
    assert done.returncode == 2
    assert words in done.stderr
    assert camtool("post", samples / "logo.dxf", "-t", "grbl").returncode in (0, 2)


ANSWERS = "my-mill\ngrbl\n\n80\n300x180x45\nfast\n1000\n\n0.02x0.03x0\n9000\n"


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("9000", {"default_rpm": 9000.0, "spin_up_s": 2.0}),
        ("hand", {"switched": "hand"}),
        ("none", {"switched": "none"}),
    ],
)
def test_the_spindle(camtool: Run, config: Path, text: str, values: dict[str, object]) -> None:
    assert camtool("init", "mine", "-t", "grbl", "--spindle", text).returncode == 0
    whole = tomllib.loads((config / "machines" / "mine.toml").read_text())
    assert whole["spindle"] == values
    done = camtool("init", "not", "-t", "grbl", "--spindle", "fast")
    assert b"'fast' is no number" in done.stderr


def test_questions(camtool: Run, config: Path) -> None:
    done = camtool("init", "--ask", stdin=ANSWERS.encode())
    assert done.returncode == 0, done.stderr
    assert b"'fast' is no number" in done.stderr
    assert said(config / "machines" / "my-mill.toml") == {
        "coded_step_mm": 0.0125,
        "travel_mm": 300.0,
        "max_rate_mm_min": 1000.0,
        "backlash_mm": 0.02,
    }


def test_a_listing_may_be_pasted(camtool: Run, config: Path) -> None:
    answers = f"my-mill\ngrbl\n{LISTING}\n0.02\n\n"
    done = camtool("init", "--ask", stdin=answers.encode())
    assert done.returncode == 0, done.stderr
    values = said(config / "machines" / "my-mill.toml")
    assert (values["travel_mm"], values["backlash_mm"]) == (300, 0.02)


def test_a_controller_is_asked_at_its_port(camtool: Run, config: Path) -> None:
    board = load_target("grbl").with_settings(["axes.x.travel_mm=300"]).twin()
    with hosted(board, 20.0) as port:
        done = camtool("init", "mine", "-t", "grbl", "--port", port)
    assert done.returncode == 0, done.stderr
    assert said(config / "machines" / "mine.toml")["travel_mm"] == 300


@pytest.mark.parametrize("format", ["dxf", "svg"])
def test_three_commands_to_the_program_of_a_plate(
    camtool: Run, tmp_path: Path, format: str
) -> None:
    """A sheet of 3 mm with outline, window, slot and four holes, all on one layer."""
    _plate(tmp_path / f"part.{format}")
    (tmp_path / "grbl.txt").write_text(LISTING)
    for arguments in (
        ("init", "my-3018", "--settings", "grbl.txt", "--spindle", "10000"),
        ("job", "new", f"part.{format}", "--tool-diameter", "3.175", "--thickness", "3"),
        ("post", f"part.{format}", "--job", "job.toml"),
    ):
        done = camtool(*arguments)
        assert done.returncode == 0, done.stderr
        assert re.findall(r"warning (\w+)", done.stderr.decode()) == [], done.stderr
    rows = (tmp_path / "part.nc").read_text().splitlines()
    assert "M3 S10000" in rows
    # The holes come first, then the slot, which is cleared, the window, and the outline.
    assert done.stderr.decode().count("\ncut        ") == 4
    text = "\n".join(row for row in rows if not row.startswith("("))
    assert min(map(float, re.findall(r"Z(\S+)", text))) == -3.3
    # Window and outline have four tabs each, of a third of the sheet: at the fourth corner of each
    # the tool goes down again.
    assert len(re.findall(r"Z-2\.000 F60\n[XY].*\n(?:G1 )?Z-3\.300", text)) == 8, text


def _plate(file: Path) -> None:
    if file.suffix == ".svg":
        holes = "".join(f'<circle cx="{x}" cy="{y}" r="2"/>' for x in (8, 112) for y in (8, 72))
        file.write_text(
            '<svg xmlns="http://www.w3.org/2000/svg" width="120mm" height="80mm" '
            'viewBox="0 0 120 80"><g fill="none" stroke="black">'
            '<rect width="120" height="80"/><rect x="40" y="30" width="40" height="30"/>'
            '<path d="M50 12H70A3 3 0 0 1 70 18H50A3 3 0 0 1 50 12Z"/>'
            f"{holes}</g></svg>"
        )
        return
    document = ezdxf.new(units=4)
    space = document.modelspace()
    space.add_lwpolyline([(0, 0), (120, 0), (120, 80), (0, 80)], close=True)
    space.add_lwpolyline([(40, 30), (80, 30), (80, 60), (40, 60)], close=True)
    for x in (8, 112):
        for y in (8, 72):
            space.add_circle((x, y), 2.0)
    space.add_line((50, 12), (70, 12))
    space.add_arc((70, 15), 3, 270, 90)
    space.add_line((70, 18), (50, 18))
    space.add_arc((50, 15), 3, 90, 270)
    document.saveas(file)


def test_a_speed_that_nobody_set_is_no_limit_of_the_spindle(
    camtool: Run, tmp_path: Path, config: Path, samples: Path
) -> None:
    """grbl 1.1's defaults.h has $30=1000: a board where nobody set it says so of any spindle. Of a
    laser ($32=1) 1000 is what its senders take for full power."""
    (tmp_path / "grbl.txt").write_text(LISTING.replace("$30=12000", "$30=1000"))
    done = camtool("init", "mine", "--settings", "grbl.txt")
    assert done.returncode == 0, done.stderr
    assert b"spindle.max_rpm = 1000 ($30) is not taken" in done.stderr
    text = (config / "machines" / "mine.toml").read_text()
    assert "max_rpm" not in tomllib.loads(text)["spindle"]
    assert re.search(r"^# max_rpm = 1000 ", text, re.MULTILINE)
    post = ("post", samples / "logo.dxf", "--machine", "mine", "--spindle", "10000", "-o", "-")
    done = camtool(*post)
    assert done.returncode == 0, done.stderr
    assert re.search(rb"^M3 S10000$|^S10000 M3$", done.stdout, re.MULTILINE), done.stdout[:400]
    laser = LISTING.replace("$30=12000", "$30=1000\n$32=1")
    assert camtool("init", "laser", "--settings", "-", stdin=laser.encode()).returncode == 0
    whole = tomllib.loads((config / "machines" / "laser.toml").read_text())
    assert whole["spindle"]["max_rpm"] == 1000


def test_a_machine_is_replaced_when_that_is_asked(camtool: Run, config: Path) -> None:
    file = config / "machines" / "mine.toml"
    camtool("init", "mine", "-t", "grbl", "--travel", "100", "--backlash", "0.031")
    measured = file.read_bytes()
    done = camtool("init", "mine", "-t", "grbl", "--travel", "200")
    assert done.returncode == 2
    assert b"--replace, which replaces it" in done.stderr
    assert file.read_bytes() == measured
    done = camtool("init", "mine", "-t", "grbl", "--travel", "200", "--replace")
    assert done.returncode == 0, done.stderr
    assert said(file)["travel_mm"] == 200.0
    # What was measured on the old one is not lost.
    assert (config / "machines" / "mine.toml.old").read_bytes() == measured
    assert b"mine.toml.old" in done.stderr
    # A machine that is new needs no old one.
    assert camtool("init", "other", "-t", "grbl", "--replace").returncode == 0
    assert not (config / "machines" / "other.toml.old").exists()
