"""Turning: what remains of the section, by a raster that knows nothing of offsets; LinuxCNC's own
interpreter reads the lathe's words; what cannot be turned is refused with its place."""

import math
from pathlib import Path

import numpy as np
import pytest

import camtool
from camtool.errors import CamtoolError
from camtool.geometry.measure import extents, sample
from camtool.geometry.polylines import Polyline
from camtool.pictures.scene import scene_of
from camtool.planning.job import Job
from camtool.records import replace
from camtool.target.registry import load_target
from camtool.toolpath.moves import Kind, Toolpath
from tests.drawings import drawing_of
from tests.oracles.rs274 import interpreted, needs_rs274

SAMPLES = Path(__file__).parents[2] / "samples"
LATHE_FILE = SAMPLES / "machines" / "linuxcnc-lathe.toml"
LATHE = load_target("linuxcnc", machine_file=LATHE_FILE)
CYCLES = load_target("linuxcnc", machine_file=LATHE_FILE, settings=["dialect.canned_cycles=true"])

JOB = """
feed = 20
spindle = 2000
[place]
origin = "drawing"
[tools.insert]
number = 1
diameter = "{nose}mm"
[[operations]]
kind = "turn"
tool = "insert"
bar = "6mm"
face = "0.2mm"
step_down = "0.3mm"
allowance = "0.05mm"
"""

STEPS = [(0, 0, 0), (0, 0.8, 0), (-0.2, 1, 0), (-2, 1, 0), (-2, 1.5, 0), (-3, 1.5, 0.2)]
VALLEY = [(0, 0.5, 0), (-1, 1.5, 0), (-2, 1.5, 0), (-4, 0.8, 0), (-5, 0.8, 0), (-5.5, 1.6, 0)]
ROUND = [(0, 0, math.tan(math.pi / 8)), (-1, 1, 0), (-2, 1, 0), (-3, 2, 0), (-4, 2, 0)]
ROUNDED_FOOT = [(0, 0.5, 0), (-1, 0.5, -math.tan(math.pi / 8)), (-2, 1.5, 0), (-3, 1.5, 0)]
SECTIONS = {"steps": STEPS, "valley": VALLEY, "round": ROUND, "foot": ROUNDED_FOOT}


def job_of(folder: Path, text: str) -> Job:
    file = folder / "job.toml"
    file.write_text(text, encoding="utf-8")
    return camtool.read_job(file)


def post(
    section: list[tuple[float, float, float]], folder: Path, nose: float = 0.2
) -> camtool.Run:
    drawing = drawing_of([Polyline(np.array(section, dtype=float))])
    return camtool.post(drawing, LATHE, job_of(folder, JOB.format(nose=nose)))


def chords(path: Toolpath) -> np.ndarray:
    """(K, 4) the feed moves as chords: x, y of start and end."""
    parts = []
    for row in np.flatnonzero(path.is_feed).tolist():
        start, end = path.starts_of(np.array([row]))[0, :2], path.end[row, :2]
        points = np.array([start, end])
        if path.kind[row] != Kind.LINE:
            centre = path.centre[row]
            a, b = (math.atan2(*(p - centre)[::-1]) for p in (start, end))
            sign = 1.0 if path.kind[row] == Kind.ARC_CCW else -1.0
            sweep = sign * ((sign * (b - a)) % (2.0 * math.pi))
            angle = a + np.linspace(0.0, 1.0, 60) * sweep
            radius = math.dist(start, centre)
            points = centre + radius * np.column_stack([np.cos(angle), np.sin(angle)])
        parts.append(np.column_stack([points[:-1], points[1:]]))
    return np.concatenate(parts)


def distances(points: np.ndarray, lines: np.ndarray) -> np.ndarray:
    """(P,) to the nearest of the chords, by brute force."""
    best = np.full(len(points), np.inf)
    for x0, y0, x1, y1 in lines.tolist():
        way = np.array([x1 - x0, y1 - y0])
        t = np.clip((points - (x0, y0)) @ way / max(way @ way, 1e-30), 0.0, 1.0)
        best = np.minimum(best, np.hypot(*(points - (x0, y0) - t[:, None] * way).T))
    return best


def inside(points: np.ndarray, section: list[tuple[float, float, float]]) -> np.ndarray:
    """True for points of the drawn section: below its line, which is sampled."""
    line = sample(Polyline(np.array(section, dtype=float)), 1e-3)
    order = np.argsort(line[:, 0], kind="stable")
    x, y = line[order, 0], line[order, 1]
    top = np.array([y[np.abs(x - px) <= 1.5e-3].max(initial=-1.0) for px in points[:, 0]])
    return points[:, 1] <= top


@pytest.mark.parametrize("name", SECTIONS)
def test_what_remains_is_the_section(name: str, tmp_path: Path) -> None:
    """No point of a raster within the section is cut, and all points above it are, but for those
    which no nose reaches."""
    section, nose = SECTIONS[name], 0.2
    run = post(section, tmp_path, 2 * nose)
    assert run.decoded is not None
    last = min(x for x, _, _ in section)
    x, y = np.meshgrid(np.arange(last + 0.01, 0.15, 0.02), np.arange(0.01, 2.9, 0.02))
    points = np.column_stack([x.ravel(), y.ravel()])
    off = distances(points, chords(run.decoded))
    cut, wanted = off < nose, inside(points, section)
    deep = off[wanted].min(initial=math.inf)
    assert deep > nose - 2e-3  # half a thousandth of the program, and the chords
    line = sample(Polyline(np.array(section, dtype=float)), 5e-3)
    gap = np.array([np.hypot(*(line - point).T).min() for point in points])
    begins = section[0]
    in_front = (points[:, 0] > begins[0] - 0.01) & (points[:, 1] < begins[1])
    in_reach = (
        ~wanted & ~in_front & (gap > 0.45 * nose)
    )  # a square corner keeps 0.41 of the radius
    assert cut[in_reach].all()


def test_the_finding_says_what_the_nose_leaves(tmp_path: Path) -> None:
    """In a square corner, (√2 − 1) of its radius."""
    run = post(STEPS, tmp_path, 0.2)
    left = {each.code.name: each.measured for each in run.findings}
    assert left["NOSE_LEAVES"] == pytest.approx(0.1 * (math.sqrt(2) - 1), abs=1e-3)
    assert left["SECTION_CUT"] == pytest.approx(41.4, abs=11.0)  # blends of 10 µm


def test_a_nose_larger_than_an_inner_radius_leaves_some(tmp_path: Path) -> None:
    small, large = (post(ROUNDED_FOOT, tmp_path, nose) for nose in (0.4, 3.0))
    assert "NOSE_LEAVES" not in [each.code.name for each in small.findings]
    assert "NOSE_LEAVES" in [each.code.name for each in large.findings]


@pytest.mark.parametrize(
    ("section", "message"),
    [
        ([(0, -0.5, 0), (-1, 1, 0)], "crosses the axis"),
        ([(0, 0, 0), (0, 1, 0), (-2, 1, 0), (-1, 1.5, 0), (-3, 2, 0)], "undercut"),
        ([(0, 1, 0), (-2, 1, 0), (-2.1, 0.5, 0), (-3, 0.5, 0)], "trailing flank, at 32°"),
        ([(0, 1, 0), (-2, 1, 0), (-3, 3.5, 0)], "the bar one of 3 mm"),
    ],
)
def test_sections_that_cannot_be_turned(
    section: list[tuple[float, float, float]], message: str, tmp_path: Path
) -> None:
    with pytest.raises(CamtoolError, match=message):
        post(section, tmp_path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('thread_pitch = "0.2mm"', 'thread_pitch = "0.9mm"', "cuts through its radius of 0.4 mm"),
        ('thread_pitch = "0.2mm"', 'thread_pitch = "nan"', "thread_pitch"),
        ("feed = 80", "feed = 70", "is a feed of 80 mm/min"),
        ('bar = "3.2mm"', 'bar = "0mm"', "needs bar above 0"),
        ('part_at = "-2.6mm"', "", "the place of the part's end"),
        ('step_down = "0.03mm"', 'step_down = "0.0001mm"', "passes"),
    ],
)
def test_jobs_that_cannot_be(old: str, new: str, message: str, tmp_path: Path) -> None:
    text = (SAMPLES / "screw.toml").read_text(encoding="utf-8")
    assert old in text
    with pytest.raises(CamtoolError, match=message):
        camtool.post(SAMPLES / "screw.dxf", LATHE, job_of(tmp_path, text.replace(old, new)))


def test_which_machines_turn(tmp_path: Path) -> None:
    job = camtool.read_job(SAMPLES / "screw.toml")
    with pytest.raises(CamtoolError, match="spindle of grbl turns the tool"):
        camtool.post(SAMPLES / "screw.dxf", "grbl", job)
    with pytest.raises(CamtoolError, match="spindle of linuxcnc-lathe turns the work"):
        camtool.post(SAMPLES / "screw.dxf", LATHE)
    flashcut = load_target("flashcut", settings=["spindle.turns=work", "defaults.park_mm=[3,3]"])
    job = replace(
        job,
        operations=tuple(
            replace(each, spindle_rpm=None, feed_mm_min=3.0) for each in job.operations
        ),
    )
    with pytest.raises(CamtoolError, match=r"count the turns of its spindle"):
        camtool.post(SAMPLES / "screw.dxf", flashcut, job)


def test_the_picture_shows_both_sides_of_the_axis() -> None:
    run = camtool.post(
        SAMPLES / "screw.dxf", LATHE, camtool.read_job(SAMPLES / "screw.toml"), check=False
    )
    scene = scene_of(
        title="", drawing=run.drawing, job=run.job, toolpath=run.decoded, machine=LATHE.machine
    )
    assert scene.drawing is not None
    assert extents(scene.drawing.paths).ravel().tolist() == [-2.6, 0.0, -0.6, 0.6]
    assert scene.is_turned


class TestScrew:
    def test_thread(self) -> None:
        """Pitch, depth and diameters of the program that the machine reads."""
        run = camtool.post(SAMPLES / "screw.dxf", LATHE, camtool.read_job(SAMPLES / "screw.toml"))
        assert run.program is not None
        assert run.decoded is not None
        lines = run.program.data.decode().splitlines()
        passes = [line for line in lines if line.startswith("G33")]
        assert set(passes) == {"G33 Z-1.900 K0.2"}
        path = run.decoded
        threads = path.is_feed & (path.end[:, 0] == -1.9)
        assert path.feed[threads].tolist() == [80.0] * len(passes)  # 0.2 mm at 400 rev/min
        bottom = path.end[threads, 1]
        assert (np.diff(bottom) <= 0.0).all()
        assert bottom.min() == pytest.approx(0.4 - 0.6134 * 0.2, abs=5e-4)
        form = next(each for each in run.findings if each.code.name == "THREAD_FORM")
        assert "minor 0.5546 mm, flanks at 60°" in form.message
        assert form.measured == len(passes)

    @pytest.mark.parametrize("units", ["mm", "in"])
    def test_the_cycle_makes_the_same_moves(self, units: str) -> None:
        """G76 cuts all passes in one block; in inches coordinates are rounded otherwise."""
        job = camtool.read_job(SAMPLES / "screw.toml")
        paths = []
        for cycles in ("false", "true"):
            settings = [f"dialect.canned_cycles={cycles}", f"dialect.units={units}"]
            target = load_target("linuxcnc", machine_file=LATHE_FILE, settings=settings)
            run = camtool.post(SAMPLES / "screw.dxf", target, job)
            assert run.program is not None
            assert run.decoded is not None
            assert run.verification is not None
            assert (b"G76" in run.program.data) == (cycles == "true")
            assert (b"G33" in run.program.data) == (cycles == "false")
            assert run.verification.report.error_um.total.max < 4.5
            path = run.decoded
            paths.append(path.end[(path.end != path.starts_of(np.arange(len(path)))).any(axis=1)])
        np.testing.assert_allclose(*paths, atol=6e-4)

    def test_a_thread_of_other_passes_is_no_cycle(self) -> None:
        """G76 does not say the depth of a single pass."""
        job = camtool.read_job(SAMPLES / "screw.toml")
        thread = replace(job.operations[1], step_down_mm=0.2)
        job = replace(job, operations=(job.operations[0], thread, job.operations[2]))
        run = camtool.post(SAMPLES / "screw.dxf", CYCLES, job)
        assert run.program is not None
        assert run.program.data.count(b"G33") == 2
        assert b"G76" not in run.program.data

    def test_tools_are_called_what_they_are(self) -> None:
        run = camtool.post(SAMPLES / "screw.dxf", LATHE, camtool.read_job(SAMPLES / "screw.toml"))
        assert run.program is not None
        text = run.program.data.decode()
        assert "(tool 1 turning insert with a nose of 0.1 mm - 2000 rev/min)" in text
        assert "(tool 2 threader: threading insert 1 mm 60 deg - 400 rev/min)" in text
        assert "(tool 3 parting blade 0.4 mm - 2000 rev/min)" in text

    @pytest.mark.referee
    @pytest.mark.skipif(needs_rs274[1].args[0], reason="rs274 is missing")
    def test_linuxcnc_reads_it_so(self, tmp_path: Path) -> None:
        """Each motion is LinuxCNC's own: Z is our X, X our Y; threads are synchronised."""
        job = job_of(tmp_path, JOB.format(nose=0.2))
        drawing = drawing_of([Polyline(np.array(ROUND, dtype=float))])
        for run in (
            camtool.post(drawing, LATHE, job),
            camtool.post(SAMPLES / "screw.dxf", LATHE, camtool.read_job(SAMPLES / "screw.toml")),
            camtool.post(SAMPLES / "screw.dxf", CYCLES, camtool.read_job(SAMPLES / "screw.toml")),
        ):
            assert run.program is not None
            assert run.decoded is not None
            text = "\n".join(
                line for line in run.program.data.decode().splitlines() if "G43" not in line
            )
            table = Path(__file__).parents[1] / "oracles" / "headless" / "tools.tbl"
            calls = interpreted(text.encode(), tmp_path, table=table)
            moves = [
                each
                for each in calls
                if each[0] in ("STRAIGHT_TRAVERSE", "STRAIGHT_FEED", "ARC_FEED")
            ]
            path = run.decoded
            ours = path.end[path.is_motion]
            theirs = np.array(
                [
                    (each[2][0], each[2][1]) if each[0] == "ARC_FEED" else (each[2][2], each[2][0])
                    for each in moves
                ]
            )
            np.testing.assert_allclose(ours[:, :2], theirs, atol=1e-4)
            synchronised = [each for each in calls if each[0] == "START_SPEED_FEED_SYNC"]
            assert len(synchronised) == text.count("G33") + 18 * text.count("G76")
