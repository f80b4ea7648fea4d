"""Set-ups: a part that is cut from both faces, program by program."""

from __future__ import annotations

import json
import math
from pathlib import Path

import ezdxf
import numpy as np
import pytest
import shapely
import shapely.affinity
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import OptionError
from camtool.geometry.polylines import Polyline
from camtool.geometry.turn import Turn
from camtool.planning.job import Job, JobSetup, Placement, Stock, job_of, operation_of
from camtool.planning.place import place
from camtool.records import replace
from tests.cli.conftest import Run
from tests.drawings import drawing_of
from tests.oracles.stock import Cutter, moves_of
from tests.oracles.stock import Stock as Needles

WIDE, HIGH, THICK = 60.0, 40.0, 6.0
POCKET, BACK, EDGE = (10, 10, 30, 25), (31, 12, 50, 20), (5, 5, 55, 35)
"""Low x, low y, high x, high y, as they are drawn: seen from the first face."""

JOB = """
tool_diameter = "3mm"
feed = "300mm/min"
plunge_feed = "100mm/min"
spindle = 10000
step_down = "1mm"
[stock]
corner = [0, 0]
size = "60x40mm"
thickness = "6mm"
[[operations]]
name = "pocket"
kind = "pocket"
layers = ["POCKET"]
depth = "3.5mm"
[[operations]]
name = "back"
kind = "pocket"
layers = ["BACK"]
depth = "3mm"
[[operations]]
name = "edge"
layers = ["CUT"]
depth = "6mm"
tabs = { count = 4, width = "5mm", height = "1mm" }
[[setups]]
name = "top"
operations = ["pocket"]
[[setups]]
name = "bottom"
flip = "FLIP"
operations = ["back", "edge"]
flip_error = "0.05mm"
"""


def write_part(folder: Path, flip: str = "y", back: tuple[int, ...] = BACK) -> None:
    document = ezdxf.new(units=4)
    for layer, (x, y, right, top) in (("POCKET", POCKET), ("BACK", back), ("CUT", EDGE)):
        corners = [(x, y), (right, y), (right, top), (x, top)]
        document.modelspace().add_lwpolyline(corners, close=True, dxfattribs={"layer": layer})
    document.saveas(folder / "part.dxf")
    (folder / "part.toml").write_text(JOB.replace("FLIP", flip), encoding="utf-8")


def cut_needles(program: Path, corner: tuple[float, float] = (0.0, 0.0)) -> Needles:
    needles = Needles(corner, (corner[0] + WIDE, corner[1] + HIGH))
    for move in moves_of(program.read_text(encoding="ascii")):
        needles.cut(move, Cutter(1.5))
    return needles


@pytest.mark.parametrize("flip", ["x", "y"])
def test_both_faces_are_cut_where_they_are_drawn(camtool: Run, tmp_path: Path, flip: str) -> None:
    """Two blocks of needles, one for each face, the second turned over by hand."""
    write_part(tmp_path, flip)
    done = camtool("post", "part.dxf", "-t", "grbl", "--job", "part.toml", "--json", "all.json")
    assert done.returncode == 0, done.stderr
    assert "turned over about" in done.stderr.decode()
    assert "0.05 mm beside those of the other face" in done.stderr.decode()
    said = json.loads((tmp_path / "all.json").read_text(encoding="utf-8"))["programs"]
    assert [(each["setup"], each["program"]) for each in said] == [
        ("top", "part-1-top.nc"),
        ("bottom", "part-2-bottom.nc"),
    ]
    top, bottom = (cut_needles(tmp_path / each["program"]) for each in said)
    across = (np.linspace(0.5, WIDE - 0.5, 83), np.linspace(0.5, HIGH - 0.5, 61))
    points = np.stack(np.meshgrid(*across), axis=-1).reshape(-1, 2)
    turned = points * (-1, 1) + (WIDE, 0) if flip == "y" else points * (1, -1) + (0, HIGH)

    def within(box: tuple[int, ...], by: float) -> np.ndarray:
        low, high = np.array(box[:2]) - by, np.array(box[2:]) + by
        return ((points >= low) & (points <= high)).all(axis=1)

    # Off the walls, where needles tell nothing, and off the corners that a round tool leaves.
    sure, may = within(POCKET, -2.0), within(POCKET, 0.5)
    heights = top.at(points)
    assert (heights[sure] == -3.5).all()
    assert (heights[~may] == 0.0).all()
    heights = bottom.at(turned)
    sure, may = within(BACK, -2.0), within(BACK, 0.5)
    corner = ((points < EDGE[:2]) | (points > EDGE[2:])).all(axis=1)
    ring = within(EDGE, 2.5) & ~within(EDGE, 0.5) & ~corner
    beside = within(EDGE, 3.5) & ~within(EDGE, -0.5)
    assert (heights[sure] == -3.0).all()
    assert (heights[~may & ~beside] == 0.0).all()
    assert set(np.round(heights[ring], 6).tolist()) == {-6.0, -5.0}


@pytest.mark.parametrize(
    ("back", "depth", "left"),
    [(BACK, 3.0, None), ((28, 12, 50, 20), 3.0, -0.5), ((28, 12, 50, 20), 2.2, 0.3)],
)
def test_what_pockets_leave_between_the_faces_is_told(
    camtool: Run, tmp_path: Path, back: tuple[int, ...], depth: float, left: float | None
) -> None:
    write_part(tmp_path, back=back)
    job = (tmp_path / "part.toml").read_text(encoding="utf-8")
    job = job.replace('depth = "3mm"', f'depth = "{depth}mm"')
    (tmp_path / "part.toml").write_text(job, encoding="utf-8")
    done = camtool("post", "part.dxf", "-t", "grbl", "--job", "part.toml", "--json", "all.json")
    assert done.returncode == 0, done.stderr
    said = json.loads((tmp_path / "all.json").read_text(encoding="utf-8"))["programs"]
    found = [
        finding
        for each in said
        for finding in each["report"]["findings"]
        if finding["code"] in ("FACES_MEET", "FLOOR_LEFT")
    ]
    assert len(found) == (left is not None)  # in the set-up that comes last
    for finding in found:
        assert finding["code"] == ("FACES_MEET" if left < 0.0 else "FLOOR_LEFT")
        assert finding["measured"] == pytest.approx(abs(left), abs=1e-6)
        words = finding["where"].split()
        assert WIDE - 30.0 < float(words[2]) < WIDE - 28.0
        assert 12.0 < float(words[4]) < 20.0


def test_one_program_is_written_and_verified_by_the_name_of_its_setup(
    camtool: Run, tmp_path: Path
) -> None:
    write_part(tmp_path)
    flags = ("-t", "grbl", "--job", "part.toml")
    assert camtool("post", "part.dxf", *flags).returncode == 0
    one = camtool("post", "part.dxf", *flags, "--setup", "bottom", "-o", "one.nc")
    assert one.returncode == 0, one.stderr
    whole = (tmp_path / "part-2-bottom.nc").read_bytes()
    assert (tmp_path / "one.nc").read_bytes() == whole
    against = ("--against", "part.dxf", *flags)
    assert camtool("verify", "one.nc", *against, "--setup", "bottom").returncode == 0
    wrong = camtool("verify", "one.nc", *against, "--setup", "top")
    assert wrong.returncode == 1
    assert "CONTOUR_MISSING" in (wrong.stderr + wrong.stdout).decode()
    unsaid = camtool("verify", "one.nc", *against)
    assert unsaid.returncode == 2
    assert "name one with --setup: top, bottom" in unsaid.stderr.decode()


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (("--setup", "botom"), "did you mean bottom?"),
        (("--split", "tool"), "name one of them with --setup: top, bottom"),
        (("-o", "-"), "name a file, or name one of them with --setup"),
    ],
)
def test_what_set_ups_cannot_have_is_refused(
    camtool: Run, tmp_path: Path, words: tuple[str, ...], error: str
) -> None:
    write_part(tmp_path)
    done = camtool("post", "part.dxf", "-t", "grbl", "--job", "part.toml", *words)
    assert done.returncode == 2
    assert error in done.stderr.decode()
    assert not list(tmp_path.glob("*.nc"))


@pytest.mark.parametrize(
    ("was", "now", "error"),
    [
        ('operations = ["pocket"]', 'operations = ["poket"]', "there is no operation 'poket'"),
        ('operations = ["pocket"]', "", "key operations is missing"),
        ('operations = ["pocket"]', 'operations = ["edge"]', "'pocket' is in no set-up"),
        ('name = "bottom"', 'name = "top"', "names of their own"),
        ('flip = "y"', 'line = "3mm"', "has no effect without flip"),
        ('flip = "y"', 'flip = "z"', "'z'"),
        ('flip = "y"', 'flip = "y"\nzero = "stock-left"', "stock-lower-left"),
        ('flip_error = "0.05mm"', 'flip_error = "-0.05mm"', "flip error"),
        ('flip_error = "0.05mm"', "pins = [[3, 20], [56, 20]]", "there is none at X57 Y20"),
        ('corner = [0, 0]\nsize = "60x40mm"\n', "", "line about which the part is turned"),
    ],
)
def test_wrong_set_ups_are_refused_with_their_place(
    camtool: Run, tmp_path: Path, was: str, now: str, error: str
) -> None:
    write_part(tmp_path)
    text = (tmp_path / "part.toml").read_text(encoding="utf-8")
    assert was in text
    (tmp_path / "part.toml").write_text(text.replace(was, now), encoding="utf-8")
    done = camtool("post", "part.dxf", "-t", "grbl", "--job", "part.toml")
    assert done.returncode == 2, done.stderr
    assert error in done.stderr.decode()
    assert "part.toml" in done.stderr.decode()
    assert "setups" in done.stderr.decode()


ZERO = {"stock-lower-left": (0.0, 0.0), "stock-upper-right": (WIDE, HIGH), "4, -3mm": (4.0, -3.0)}


def test_a_set_up_may_have_its_own_zero(camtool: Run, tmp_path: Path) -> None:
    """The same program, shifted; pins, stock and clamps move with it."""
    write_part(tmp_path)
    box = '[[keep_out]]\nname = "clamp"\nx = "59..80mm"\ny = "18..22mm"\n'
    pins = "pins = [[30, 2], [30, 37]]\n"
    text = (tmp_path / "part.toml").read_text(encoding="utf-8") + pins + box
    flags = ("part.dxf", "-t", "grbl", "--job", "part.toml", "--setup", "bottom")
    across = (np.linspace(0.53, WIDE - 0.53, 47), np.linspace(0.53, HIGH - 0.53, 33))
    points = np.stack(np.meshgrid(*across), axis=-1).reshape(-1, 2)
    plain = None
    for zero, (x, y) in {"": (0.0, 0.0), **ZERO}.items():
        more = f'zero = "{zero}"\n' if zero else ""
        (tmp_path / "part.toml").write_text(text.replace(pins, pins + more), encoding="utf-8")
        made = ("-o", "a.nc", "--json", "a.json", "--report", "sheet.md")
        done = camtool("post", *flags, *made)
        assert done.returncode == 0, (zero, done.stderr)
        assert camtool("verify", "a.nc", "--against", *flags).returncode == 0, zero
        found = cut_needles(tmp_path / "a.nc", (-x, -y)).at(points - (x, y))
        if plain is None:
            plain = found
            assert set(plain.tolist()) == {0.0, -3.0, -5.0, -6.0}
        # Tabs may stand elsewhere, and needles beside walls.
        is_same = np.where(plain < -4.0, -6.0, plain) == np.where(found < -4.0, -6.0, found)
        assert is_same.mean() > 0.99, zero
        said = json.loads((tmp_path / "a.json").read_text(encoding="utf-8"))["planned"]
        assert said["stock"]["corner_mm"] == pytest.approx([-x, -y])
        for px, py in ((30.0 - x, 2.0 - y), (30.0 - x, 37.0 - y)):
            assert f"X{px:g} Y{py:g}" in said["setup"]
        words = {
            "stock-lower-left": "X0 Y0 is the lower left corner of the stock",
            "stock-upper-right": "X0 Y0 is the upper right corner of the stock",
            "4, -3mm": "X0 Y0 is 4 mm right of and 3 mm below the lower left corner of the stock",
        }.get(zero, "X0 Y0 is")
        assert words in (tmp_path / "sheet.md").read_text(encoding="utf-8")


def test_a_clamp_moves_with_the_zero_of_its_set_up(camtool: Run, tmp_path: Path) -> None:
    """A box where the second set-up cuts, in the frame of the machine."""
    write_part(tmp_path)
    text = (tmp_path / "part.toml").read_text(encoding="utf-8") + 'zero = "stock-upper-right"\n'
    for x, inside in (("10..29mm", True), ("-50..-31mm", False)):
        box = f'[[keep_out]]\nname = "clamp"\nx = "{x}"\ny = "12..20mm"\nz = "..0mm"\n'
        (tmp_path / "part.toml").write_text(text + box, encoding="utf-8")
        flags = ("-t", "grbl", "--job", "part.toml", "--setup", "bottom")
        done = camtool("post", "part.dxf", *flags)
        assert ("KEEP_OUT_ENTERED" in done.stderr.decode()) == inside


I8751 = tuple(
    word
    for given in (
        *(f"axes.{axis}.coded_step_mm=0.01" for axis in "xyz"),
        "feed.default_mm_min=100",
    )
    for word in ("--set", given)
)


@pytest.mark.parametrize(
    ("target", "more", "begins"),
    [
        ("grbl", (), "("),
        ("linuxcnc", (), "("),
        ("i8751", (*I8751, "--set", "dialect.format=listing"), "; "),
        ("i8751", (*I8751, "--set", "dialect.format=hex"), "; "),
    ],
)
def test_programs_say_which_set_up_they_are(
    camtool: Run, tmp_path: Path, target: str, more: tuple[str, ...], begins: str
) -> None:
    write_part(tmp_path)
    slow = ("--feed", "60", "--plunge-feed", "60")
    text = (tmp_path / "part.toml").read_text(encoding="utf-8").replace("spindle = 10000\n", "")
    (tmp_path / "part.toml").write_text(text, encoding="utf-8")
    done = camtool(
        "post", "part.dxf", "-t", target, *more, "--job", "part.toml", *slow, "--no-verify"
    )
    assert done.returncode == 0, done.stderr
    (top,), (bottom,) = (
        [each.read_text(encoding="ascii") for each in tmp_path.glob(f"part-{k}-*.*")]
        for k in (1, 2)
    )
    lines = [line.split(begins, 1)[1] for line in top.splitlines() if begins in line]
    assert any("set-up top" in line for line in lines)
    assert any("the face that is drawn is up" in line for line in lines)
    lines = [line.split(begins, 1)[1] for line in bottom.splitlines() if begins in line]
    assert any("set-up bottom" in line for line in lines)
    assert any("the other face is up" in line for line in lines)
    assert any("turned over about X30" in line for line in lines)


SIZES = st.floats(-40.0, 40.0)


@given(
    x=SIZES,
    y=SIZES,
    mirror=st.sampled_from([None, "x", "y"]),
    turn=st.floats(0.0, 360.0),
    scale=st.floats(0.5, 2.0),
    origin=st.sampled_from(["drawing", "lower-left", "centre", (3.0, -2.0)]),
    copies=st.sampled_from([(1, 1), (2, 1), (2, 3)]),
    flip=st.sampled_from(["x", "y"]),
    line=SIZES,
)
def test_a_turned_part_is_the_mirror_image_of_the_part(
    x: float,
    y: float,
    mirror: str | None,
    turn: float,
    scale: float,
    origin: str | tuple[float, float],
    copies: tuple[int, int],
    flip: str,
    line: float,
) -> None:
    """By shapely's affine maps; the box that places the part is that of all its set-ups."""
    corners = [(x, y, 0.0), (x + 9.0, y, 0.3), (x + 7.0, y + 5.0, 0.0)]
    hole = [(x + 3.0, y + 1.0, -0.2), (x + 4.0, y + 1.0, 0.0), (x + 4.0, y + 2.0, 0.0)]
    drawing = drawing_of(
        [Polyline(np.array(each), True) for each in (corners, hole)], layers=["edge", "hole"]
    )
    pitch = tuple(20.0 if count > 1 else 0.0 for count in copies)
    job = Job(
        operations=(
            operation_of(name="edge", layers=("edge",)),
            operation_of(name="hole", layers=("hole",)),
        ),
        placement=Placement(
            origin=origin,
            mirror=mirror,
            rotate_rad=math.radians(turn),
            scale=scale,
            copies=copies,
            pitch_mm=(pitch[0], pitch[1]),
        ),
        setups=(
            JobSetup("first", ("edge",)),
            JobSetup("second", ("hole",), flip=flip, line_mm=line),
        ),
    )
    first, second = (place(drawing, job.setup(name)) for name in ("first", "second"))
    whole = place(drawing, replace(job, setups=()))
    assert np.array_equal(first.paths.vertices, whole.paths.vertices)
    signs = (-1.0, 1.0) if flip == "y" else (1.0, -1.0)
    shift = (2.0 * line, 0.0) if flip == "y" else (0.0, 2.0 * line)
    points = shapely.MultiPoint(first.paths.vertices[:, :2])
    wanted = shapely.affinity.affine_transform(points, [signs[0], 0, 0, signs[1], *shift])
    found = second.paths.vertices
    assert np.allclose(shapely.get_coordinates(wanted), found[:, :2], rtol=0.0, atol=1e-9)
    assert np.array_equal(found[:, 2], -first.paths.vertices[:, 2])
    assert second.sources == first.sources


def test_turned_twice_is_as_it_was() -> None:
    stock = Stock(3.0, (1.0, 2.0), (10.0, 20.0))
    for axis in ("x", "y"):
        turn = Turn.about(axis, 7.5)
        assert stock.turned(turn).turned(turn) == stock
        assert stock.turned(Turn.about(axis, 6.0 if axis == "y" else 12.0)) == stock


def test_a_window_of_one_set_up_is_cut_inside_the_edge_of_another(
    camtool: Run, tmp_path: Path
) -> None:
    write_part(tmp_path)
    text = (tmp_path / "part.toml").read_text(encoding="utf-8")
    text = text.replace('kind = "pocket"\nlayers = ["POCKET"]', 'layers = ["POCKET"]')
    (tmp_path / "part.toml").write_text(text, encoding="utf-8")
    flags = ("-t", "grbl", "--job", "part.toml", "--setup", "top", "-o", "top.nc")
    done = camtool("post", "part.dxf", *flags)
    assert done.returncode == 0, done.stderr
    assert "SIDE_BY_UNCUT" not in done.stderr.decode()
    cut = [move.b for move in moves_of((tmp_path / "top.nc").read_text()) if move.b[2] < 0.0]
    ends = np.array(cut)
    assert ends[:, 0].min() == pytest.approx(POCKET[0] + 1.5)
    assert ends[:, 0].max() == pytest.approx(POCKET[2] - 1.5)


def test_a_job_with_set_ups_is_no_program() -> None:
    job = replace(job_of(name="edge"), setups=(JobSetup("only", ("edge",)),))
    from camtool.planning.plan import planned
    from camtool.target.registry import load_target

    square = Polyline(np.array([[0.0, 0, 0], [9, 0, 0], [9, 9, 0]]), True)
    with pytest.raises(OptionError, match="several set-ups"):
        planned(drawing_of([square]), job, load_target("grbl").machine)


@pytest.mark.parametrize("error", ['flip_error = "0.05mm"', ""])
def test_a_dimension_between_two_faces_counts_how_far_they_lie_apart(
    camtool: Run, tmp_path: Path, error: str
) -> None:
    """The pocket is cut in the one set-up, the edge in the other."""
    write_part(tmp_path)
    text = (tmp_path / "part.toml").read_text(encoding="utf-8")
    text = text.replace('flip_error = "0.05mm"', f"{error}\npins = [[30, 2], [30, 37]]")
    (tmp_path / "part.toml").write_text(text, encoding="utf-8")
    (tmp_path / "tolerances.toml").write_text(
        '[[dimension]]\nname = "across"\nkind = "distance"\nfrom = [5, 20]\nto = [10, 20]\n'
        'direction = "x"\nlimits = "±0.1"\n'
        '[[dimension]]\nname = "wide"\nkind = "distance"\nfrom = [5, 20]\nto = [55, 20]\n'
        'direction = "x"\nlimits = "±0.1"\n',
        encoding="utf-8",
    )
    flags = ("-t", "grbl", "--job", "part.toml", "--setup", "bottom", "--json", "said.json")
    done = camtool("post", "part.dxf", *flags, "--tolerances", "tolerances.toml")
    assert done.returncode == 0, done.stderr
    said = json.loads((tmp_path / "said.json").read_text(encoding="utf-8"))
    across, wide = said["inspection"]
    assert (across["name"], wide["name"]) == ("across", "wide")
    assert across["fit_mm"] == pytest.approx(5.0, abs=0.01)
    own = [each["um"] for each in across["contributions"] if each["input"] == "flip_error.x"]
    assert own == ([pytest.approx(50.0 / 3.0**0.5)] if error else [None])
    assert ("flip_error" in across["unknown"]) == (not error)
    assert not any("flip" in each["input"] for each in wide["contributions"])
    assert said["planned"]["flip_error_mm"] == (0.05 if error else None)
    assert said["planned"]["pins_mm"] == [[30.0, 2.0], [30.0, 37.0]]


def test_a_preview_shows_each_setup(camtool: Run, tmp_path: Path) -> None:
    write_part(tmp_path)
    flags = ("-t", "grbl", "--job", "part.toml", "--view", "bottom", "--size", "300")
    done = camtool("preview", "part.dxf", *flags, "-o", "all.svg")
    assert done.returncode == 0, done.stderr
    for number, name in enumerate(("top", "bottom"), 1):
        whole = (tmp_path / f"all-{number}-{name}.svg").read_bytes()
        one = camtool("preview", "part.dxf", *flags, "-o", "one.svg", "--setup", name)
        assert one.returncode == 0, one.stderr
        assert (tmp_path / "one.svg").read_bytes() == whole
