"""Bad job files and flags: one line that names file, table, key and mend; nothing is written."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.cli.options import DrawingFlags, JobFlags
from camtool.errors import OptionError
from camtool.jobs.keys import OPERATION, PLACE, TOOL_KEYS, WHOLE
from camtool.planning.job import Job
from tests.cli.conftest import Run

SQUARE = (
    b'<svg xmlns="http://www.w3.org/2000/svg" width="8mm" height="7mm" viewBox="0 0 8 7" '
    b'xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape">'
    b'<g inkscape:groupmode="layer" inkscape:label="CUT" stroke="#ff0000" fill="none">'
    b'<path d="M1 1 h3 v3 h-3 z"/></g>'
    b'<g inkscape:groupmode="layer" inkscape:label="LINES" stroke="#0000ff" fill="none">'
    b'<path d="M1 5 h3"/></g></svg>'
)
TOOLS = "[tools.mill]\ndiameter = 1\n[tools.vee]\nkind = 'v'\ndiameter = 3\ntip_angle = 60\n"

# content of job.toml, words that the one line holds
FILES = [
    # unknown and misspelt keys, by table
    ("dept = 1", ["key dept", "unknown key", "did you mean depth?", "step_down"]),
    ("[place]\nrotation = 3", ["table [place], key rotation", "did you mean rotate?"]),
    ("[stock]\ndepth = 3", ["table [stock], key depth", "known keys: corner, size, thickness"]),
    ("[tools.fine]\ndiametre = 1", ["table [tools.fine], key diametre", "mean diameter?"]),
    (
        "[[operations]]\nname = 'a'\n[[operations]]\nname = 'b'\nstepover = 0.4",
        ["table [[operations]] 2 'b', key stepover", "mean step_over?"],
    ),
    ("entry = {kind = 'ramp', slope = 3}", ["key entry.slope", "known keys: kind, angle, radius"]),
    ("lead_in = {kind = 'arc', radius = 3}", ["key lead_in.radius", "known keys: kind, length"]),
    ("[tabs]\nnumber = 3", ["key tabs.number", "known keys: count"]),
    ("[tooling]\na = 1", ["key tooling", "mean tool"]),
    # wrong types
    ("depth = true", ["key depth", "True is no number"]),
    ("depth = [1]", ["key depth", "no number"]),
    ("depth = 'deep'", ["key depth", "'deep' is no number", '"0.2mm"']),
    ("depth = '3 parsec'", ["key depth", "parsec", "mm"]),
    ("depth = nan", ["key depth", "'nan'"]),
    ("depth = inf", ["key depth", "'inf'"]),
    ("feed = '3mm'", ["key feed", "mm/min"]),
    ("dwell = '3mm'\nkind = 'drill'", ["key dwell", "ms"]),
    ("entry = 'ramp:3mm'", ["key entry", "deg"]),
    ("spindle = 'fast'", ["key spindle", "'fast' is no number"]),
    ("approach = 1", ["key approach", "neither true nor false"]),
    ("approach = 'yes'", ["key approach", "write true or false"]),
    ("layers = 'CUT'", ["key layers", '["CUT"]']),
    ("layers = [1]", ["key layers", "1 is no text"]),
    ("layers = []", ["key layers", "takes nothing"]),
    ("colours = ['redd']", ["key colours", "unknown colour 'redd'"]),
    ("colours = [300]", ["key colours", "300"]),
    ("colours = 3", ["key colours", "is no list"]),
    ("name = 3\nkind = 'drill'", ["key name", "3 is no text"]),
    ("place = 3", ["table [place]", "3 is no table"]),
    ("stock = 3", ["table [stock]", "3 is no table"]),
    ("tools = 3", ["key tools", "[tools.NAME]"]),
    ("[tools]\ndiameter = 1", ["table [tools.diameter]", "1 is no table"]),
    ("[operations]\nkind = 'drill'", ["key operations", "[[operations]]"]),
    ("operations = []", ["key operations", "[[operations]]"]),
    ("operations = [3]", ["table [[operations]] 1", "3 is no table"]),
    ("[place]\norigin = [1]", ["table [place], key origin", "no list of two"]),
    ("origin = 'center'", ["key origin", "did you mean centre?"]),
    ("origin = '1,2,3'", ["key origin", "no place"]),
    ("[place]\nfit = 8", ["table [place], key fit", "no list of two"]),
    ("[place]\nfit = '8mm'", ["table [place], key fit", '"12x9mm"']),
    ("[place]\ncopies = [2.5, 1]", ["table [place], key copies", "2.5", "no whole number"]),
    ("[place]\ncopies = '3'", ["table [place], key copies", '"3x2"']),
    ("[tools.a]\nnumber = 1.5", ["table [tools.a], key number", "no whole number"]),
    ("start = 3", ["key start", "3 is no text"]),
    ("start = 'longest'", ["key start", "did you mean longest-line?"]),
    ("lead_in = 'arc:1mm:2'", ["key lead_in", "too many parts", "kind:length"]),
    ("lead_in = ['arc']", ["key lead_in", "no number"]),
    ("tabs = 'x'", ["key tabs", "'x'"]),
    # words that nobody knows
    ("kind = 'proffile'", ["key kind", "unknown word 'proffile'", "did you mean profile?"]),
    ("side = 'left'", ["key side", "use one of on, outside, inside, auto"]),
    ("minimise = 'time'", ["key minimise", "rapids, reversals"]),
    ("[place]\nmirror = 'z'", ["table [place], key mirror", "x, y"]),
    ("[tools.a]\nkind = 'cone'", ["table [tools.a], key kind", "flat, ball, bull, v, drill"]),
    ("entry = 'spiral'", ["key entry", "plunge, ramp, helix"]),
    ("tool_table_units = 'inch'\ntool_table = 'tool.tbl'", ["key tool_table_units", "mm, in"]),
    # out of range
    ("depth = -1", ["key depth", "depth -1 mm is not above 0"]),
    ("depth = 0", ["key depth", "not above 0"]),
    ("step_down = -0.1", ["key step_down", "not above 0"]),
    ("last_pass = 0", ["key last_pass", "not above 0"]),
    ("kind = 'pocket'\nstep_over = 0", ["key step_over", "not above 0 and at most 1"]),
    ("kind = 'pocket'\nstep_over = 1.01", ["key step_over", "1.01"]),
    ("kind = 'pocket'\nstep_over = '120%'", ["key step_over", "1.2"]),
    ("feed = -3", ["key feed", "not above 0"]),
    ("safe_z = 0", ["key safe_z", "not above 0"]),
    ("tool_diameter = -1", ["key tool_diameter", "not 0 or more"]),
    ("tool_tip_angle = 0", ["key tool_tip_angle", "between 0.1 and 180"]),
    ("tool_tip_angle = 180", ["key tool_tip_angle", "between 0.1 and 180"]),
    ("allowance = -1", ["key allowance", "cannot cut 1 mm beyond the line"]),
    ("allowance = -1\ntool_diameter = 3\nside = 'on'", ["key allowance", "on both sides"]),
    ("kind = 'drill'\npeck = 0", ["key peck", "not above 0"]),
    ("entry = {kind = 'ramp', angle = -3}", ["key entry.angle", "not above 0"]),
    ("entry = {kind = 'ramp', angle = '90deg'}", ["key entry.angle", "below 90"]),
    ("lead_in = {kind = 'arc', length = 0}", ["key lead_in.length", "not above 0"]),
    ("tabs = 0", ["key tabs", "not above 0"]),
    ("tabs = {count = -1}", ["key tabs.count", "not above 0"]),
    ("tabs = {count = 2, height = 0}", ["key tabs.height", "not above 0"]),
    ("tabs = {spacing = 2, width = -1}", ["key tabs.width", "not above 0"]),
    ("[place]\nscale = 0", ["table [place], key scale", "not above 0"]),
    ("[place]\nfit = [0, 0]", ["table [place], key fit", "fit 0 by 0 mm gives neither"]),
    ("[place]\ncopies = [0, 1]", ["table [place], key copies", "not above 0"]),
    ("[stock]\ncorner = [0, 0]\nsize = [9, -9]\nthickness = 1", ["table [stock], key size"]),
    ("[stock]\ncorner = [0, 0]\nsize = [9, 9]", ["table [stock]", "key thickness is missing"]),
    ("[stock]\ncorner = [0, 0]\nthickness = 1", ["table [stock]", "both corner and size"]),
    # contradictions
    ("depth = 1\nlast_pass = 2", ["key last_pass", "deeper than the whole cut of 1 mm"]),
    ("depth = 1\nbreakthrough = 2", ["key breakthrough", "a depth is given too", "one of"]),
    ("kind = 'pocket'\nrest = 'a'", ["key rest", "there is no operation 'a'"]),
    ("rest = 'a'", ["key rest", "means nothing to the kind profile"]),
    (
        f"{TOOLS}[[operations]]\nname = 'a'\nkind = 'vcarve'\ntool = 'vee'\n[[operations]]\n"
        "kind = 'pocket'\nrest = 'a'\ndepth = 1",
        ["[[operations]] 2, key depth", "the floor of 'a' has a depth already"],
    ),
    ("finish_feed = 9", ["key finish_feed", "no effect without finish"]),
    ("finish_tool = 'fine'\nfinish = 0.1", ["key finish_tool", "there is no tool 'fine'"]),
    ("finish = 0.3\ntool_diameter = 1", ["key finish", "more than a quarter", "0.25 mm or less"]),
    (
        "finish = 0.1\ntool_diameter = 1\nfinish_tool = 'wide'\n[tools.wide]\ndiameter = 2",
        ["key finish_tool", "does not fit where one of 1 mm cleared", "no wider"],
    ),
    ("breakthrough = 0.3", ["key breakthrough", "thickness of the stock is not known", "[stock]"]),
    ("breakthrough = 0\n[stock]\nthickness = 3", ["key breakthrough", "not above 0"]),
    ("kind = 'engrave'\nbreakthrough = 1", ["key breakthrough", "nothing to the kind engrave"]),
    (
        "breakthrough = 1.1\n[stock]\nthickness = 3",
        ["key breakthrough", "1.1 mm is deeper than the 1 mm that", 'spoilboard = "1.1mm"'],
    ),
    (
        "[stock]\nthickness = 3\nspoilboard = 0.2\n"
        "[[operations]]\nname = 'a'\n[[operations]]\nname = 'b'\nbreakthrough = '0.3mm'",
        ["[[operations]] 2 'b', key breakthrough", "0.3 mm is deeper than the 0.2 mm"],
    ),
    (
        "[[operations]]\nkind = 'drill'\nbreakthrough = 0.5\n"
        "tool_diameter = 4\ntool_tip_angle = 90\n[stock]\nthickness = 3",
        ["key breakthrough", "the tool's point of 2 mm are deeper", 'spoilboard = "2.5mm"'],
    ),
    (
        "breakthrough = 0.3\nlast_pass = 4\n[stock]\nthickness = 3",
        ["key last_pass", "deeper than the whole cut of 3.3 mm"],
    ),
    ("tabs = {count = 2, spacing = 3}", ["key tabs", "a count or a spacing"]),
    ("tabs = {count = 2, at = [[1, 2]]}", ["key tabs", "or places", "one of the three"]),
    ("tabs = {at = []}", ["key tabs", "an empty list gives no tab"]),
    ("tabs = {at = [1, 2]}", ["key tabs.at", "no list of two"]),
    ("tabs = {at = [['1mm', '9kg']]}", ["key tabs.at", "kg"]),
    ("tabs = {at = [[1, 1], [50, 2]]}", ["key tabs", "tab at X 50 Y 2 is 46", "on a contour"]),
    ("tabs = {width = 2}", ["key tabs", "a count or a spacing"]),
    ("[place]\nscale = 2\nfit = [3, 3]", ["table [place], key scale", "one of the two"]),
    ("[place]\ncopies = [2, 1]", ["table [place], key copies", "give the pitch"]),
    ("[place]\npitch = [2, 1]", ["table [place], key pitch", "without copies"]),
    ("origin = 'centre'\n[place]\norigin = [0, 0]", ["key origin", "stands in [place] too"]),
    ("peck = 1", ["key peck", "means nothing to the kind profile", "it has: name, kind"]),
    ("kind = 'drill'\nside = 'inside'", ["key side", "means nothing to the kind drill"]),
    ("kind = 'pocket'\nlead_in = 'arc'", ["key lead_in", "means nothing to the kind pocket"]),
    ("mitre_limit = 3", ["key mitre_limit", 'no effect without joins = "mitre"']),
    ("kind = 'pocket'\nangle = 3", ["key angle", 'no effect without pattern = "zigzag"']),
    ("entry = {kind = 'ramp', radius = 1}", ["key entry.radius", 'without kind = "helix"']),
    ("entry = {angle = 3}", ["key entry.angle", 'without kind = "ramp" or "helix"']),
    ("lead_out = {length = 3}", ["key lead_out.length", 'without kind = "line" or "arc"']),
    ("entry = 'helix'", ["key entry", "helix", "pocket"]),
    ("tool_kind = 'flat'\ntool_tip_angle = 60", ["key tool_tip_angle", 'without kind = "v"']),
    ("[tools.a]\ntip_diameter = 1", ["table [tools.a], key tip_diameter", 'kind = "v"']),
    (
        "[tools.a]\nkind = 'v'\ndiameter = 1\ntip_diameter = 1",
        ["table [tools.a], key tip_diameter", "is not smaller than the tool"],
    ),
    ("tool_table_units = 'in'", ["key tool_table_units", "no effect without tool_table"]),
    (
        "peck = 1\n[[operations]]\nkind = 'profile'\n[[operations]]\nkind = 'pocket'",
        ["key peck", "means nothing to the kind profile"],
    ),
    ("name = 'a'\n[[operations]]\nlayers = ['CUT']", ["key name", "move it into [[operations]]"]),
    (
        "[[operations]]\nname = 'a'\n[[operations]]\nname = 'a'",
        ["table [[operations]] 2 'a', key name", "operation 1 has the name 'a' already"],
    ),
    # tools
    ("tool = 'mill'", ["key tool", "there is no tool 'mill'", "write [tools.mill]"]),
    (TOOLS + "[[operations]]\ntool = 'mil'", ["table [[operations]] 1, key tool", "mean mill?"]),
    ("tool = 3", ["key tool", "there is no tool 3", 'tool_table = "tool.tbl"']),
    ("tool = 3\ntool_table = 'tool.tbl'", ["key tool", "there is no tool 3", "has: 1, 2"]),
    (
        "tool = 2\ntool_table = 'tool.tbl'",
        ["tool.tbl", "line 2", "tool 2 has no diameter", "give it a D"],
    ),
    ("tool = 1.5", ["key tool", "1.5 is no tool"]),
    ("tool_table = 'none.tbl'", ["none.tbl", "cannot be read"]),
    ("tool_table = 'bad.tbl'", ["bad.tbl", "line 1", "'nonsense'"]),
    ("tool = 'a'\ntool_diameter = 1\n[tools.a]\n", ["key tool_diameter", "one of the two"]),
    (
        "[tools.a]\nnumber = 1\n[tools.b]\nnumber = 1",
        ["table [tools.b], key number", "tool 1 is 'a' already"],
    ),
    ("kind = 'vcarve'", ["vcarve needs a V bit", "tip_angle"]),
    (
        TOOLS + "[[operations]]\nkind = 'vcarve'\ntool = 'mill'",
        ["table [[operations]] 1, key tool", "vcarve needs a V bit"],
    ),
    ("kind = 'vcarve'\ntool_kind = 'v'", ["needs the angle of its V bit"]),
    # layers and colours that the drawing has not
    ("layers = ['CUTT']", ["part.svg", "key layers", "'CUTT'", "CUT, LINES"]),
    (
        "[[operations]]\nlayers = ['CUT']\n[[operations]]\nname = 'b'\nlayers = ['X*']",
        ["part.svg", "operation 2 'b', key layers", "'X*'", "CUT, LINES"],
    ),
    (
        "[[operations]]\nname = 'a'\n[[operations]]\nname = 'b'\nlayers = ['X*']",
        ["part.svg", "operation 2 'b', key layers", "'X*'", "CUT, LINES"],
    ),
    ("colours = ['red', 'green']", ["part.svg", "key colours", "'#008000'", "#0000ff, #ff0000"]),
    ("layers = ['LINES']\ncolours = ['red']", ["part.svg", "#0000ff"]),
    # no TOML at all
    ("depth =\nfeed = 3", ["is no TOML", "line 1"]),
    ("depth = 1\ndepth = 2\n", ["is no TOML", "line 2"]),
]
"""Content of the job file; words of the message. job.toml is named unless the part is."""


@pytest.mark.parametrize(("content", "words"), FILES)
def test_bad_files(camtool: Run, tmp_path: Path, content: str, words: list[str]) -> None:
    (tmp_path / "job.toml").write_text(content)
    (tmp_path / "tool.tbl").write_text("T1 P1 D2\nT2 P2\n")
    (tmp_path / "bad.tbl").write_text("nonsense\n")
    named = (
        [] if "part.svg" in words or any(".tbl" in word for word in words[:1]) else ["job.toml"]
    )
    _refused(camtool, tmp_path, ["--job", "job.toml"], [*named, *words])


# flags, words that the one line holds
FLAGS = [
    (["--depth", "-1"], ["--depth", "not above 0"]),
    (["--depth", "deep"], ["--depth", "no number"]),
    (["--step-over", "2", "--kind", "pocket"], ["--step-over", "at most 1"]),
    (["--step-over", "0.4"], ["--step-over", "means nothing to the kind profile"]),
    (["--peck", "1"], ["--peck", "means nothing to the kind profile"]),
    (["--lead-in", "spiral:1"], ["--lead-in", "none, line, arc"]),
    (["--lead-in", "arc:0"], ["--lead-in", "not above 0"]),
    (["--tabs", "0"], ["--tabs", "not above 0"]),
    (["--tabs", "4:wide"], ["--tabs", "'wide'"]),
    (["--rotate", "3mm"], ["--rotate", "deg"]),
    (["--scale", "big"], ["--scale", "'big' is no number"]),
    (["--scale", "2", "--fit", "3x3"], ["--scale", "one of the two"]),
    (["--fit", "3"], ["--fit", "12x9mm"]),
    (["--copies", "2x2"], ["--copies", "give the pitch"]),
    (["--pitch", "2x2"], ["--pitch", "without copies"]),
    (["--origin", "middle"], ["--origin", "x,y"]),
    (["--origin", "1,y"], ["--origin", "'y' is no number"]),
    (["--mitre-limit", "3"], ["--mitre-limit", "joins"]),
    (["--kind", "vcarve"], ["vcarve needs a V bit"]),
    (["--tool", "mill"], ["--tool", "no tool 'mill'"]),
    (["--tool", "3"], ["--tool", "tool table"]),
    (["--tool-angle", "200"], ["--tool-angle", "between 0.1 and 180"]),
    (["--operation", "a"], ["--operation", "no operation 'a'"]),
    (["--layer", "NONE"], ["part.svg", "NONE", "CUT, LINES"]),
    (["--mirror", "z"], ["--mirror"]),
    (["--kind", "mill"], ["--kind"]),
    (["--job", "none.toml"], ["none.toml"]),
]


@pytest.mark.parametrize(("flags", "words"), FLAGS)
def test_bad_flags(camtool: Run, tmp_path: Path, flags: list[str], words: list[str]) -> None:
    _refused(camtool, tmp_path, flags, words)


TWO = "[[operations]]\nname = 'a'\n[[operations]]\nname = 'b'\nkind = 'drill'\n"


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["--operation", "c"], ["--operation", "known: a, b"]),
        (["--operation", "3"], ["--operation", "no operation '3'"]),
        (["--operation", "0"], ["--operation", "no operation '0'"]),
        (["--step-over", "0.3"], ["--step-over", "means nothing"]),
        (["--operation", "a", "--peck", "1"], ["--peck", "means nothing to the kind profile"]),
        (["--depth", "0"], ["--depth", "not above 0"]),
        (["--kind", "pocket", "--side", "inside"], ["--side", "means nothing to the kind pocket"]),
    ],
)
def test_bad_flags_over_a_file(
    camtool: Run, tmp_path: Path, flags: list[str], words: list[str]
) -> None:
    (tmp_path / "job.toml").write_text(TWO)
    _refused(camtool, tmp_path, ["--job", "job.toml", *flags], words)


def test_a_job_file_that_is_no_text(camtool: Run, tmp_path: Path) -> None:
    (tmp_path / "job.toml").write_bytes(b"name = '\xff'")
    _refused(camtool, tmp_path, ["--job", "job.toml"], ["job.toml", "UTF-8"])


def _refused(camtool: Run, folder: Path, flags: list[str], words: list[str]) -> None:
    """Exit code 2, all the words in one line of stderr, and nothing written."""
    (folder / "part.svg").write_bytes(SQUARE)
    (folder / "old.pic").write_bytes(b"old")
    before = sorted(path.name for path in folder.iterdir())
    done = camtool("post", "part.svg", "-t", "pic-mmh", "-o", "old.pic", *flags)
    message = done.stderr.decode()
    assert done.returncode == 2, message
    last = message.splitlines()[-1]
    for word in words:
        assert word in last, message
    assert "Traceback" not in message
    assert len([line for line in message.splitlines() if "rror:" in line]) == 1, message
    assert done.stdout == b""
    assert (folder / "old.pic").read_bytes() == b"old"
    assert sorted(path.name for path in folder.iterdir()) == before


_flags = sorted({*WHOLE, *PLACE, "tool", *TOOL_KEYS, *(n for n in OPERATION if OPERATION[n].help)})


@given(st.sampled_from([n for n in _flags if not n.startswith("tool_table")]), st.text(max_size=8))
def test_whatever_a_flag_says_it_is_a_job_or_one_line(name: str, text: str) -> None:
    flag = "--tool-angle" if name == "tool_tip_angle" else f"--{name.replace('_', '-')}"
    try:
        made: object = JobFlags(None, (), {name: text}).job(DrawingFlags())
    except OptionError as error:
        made = str(error)
    assert isinstance(made, Job) or made.startswith((flag, "vcarve"))


def test_what_a_flag_hides_must_be_right_too(camtool: Run, tmp_path: Path) -> None:
    (tmp_path / "job.toml").write_text("[[operations]]\ndepth = -1\n")
    words = ["job.toml", "table [[operations]] 1, key depth", "not above 0"]
    _refused(camtool, tmp_path, ["--job", "job.toml", "--depth", "1"], words)
