"""What a machine does by its file: spindle, coolant, plunges, where rapids end, where it parks."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from camtool.errors import CamtoolError, MachineError, OptionError
from camtool.geometry.polylines import Polyline
from camtool.planning.job import Job, Operation, Tool, job_of
from camtool.planning.plan import plan
from camtool.target.registry import load_target
from camtool.toolpath.moves import Kind, Toolpath
from tests.cli.conftest import ROOT, Run
from tests.drawings import drawing_of

SPINDLE = ("spindle.default_rpm=8000", "spindle.max_rpm=12000", "spindle.min_rpm=1000")
COOLED = ("coolant.mist=true", "coolant.flood=true")


SQUARE = Polyline(np.array([[0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0.0]]), closed=True)


def planned(settings: Sequence[str] = (), job: Job | None = None, name: str = "grbl") -> Toolpath:
    """The outline of a square, cut 2 mm deep in two passes."""
    job = job or job_of(depth_mm=2.0, step_down_mm=1.0)
    return plan(drawing_of([SQUARE]), job, load_target(name, settings=settings).machine)


def events(toolpath: Toolpath) -> list[tuple[str, float | None]]:
    """All events in order, each with its value."""
    return [(move.kind.name, move.value) for move in toolpath if move.kind > Kind.ARC_CCW]


def test_the_machines_speed_holds_where_the_job_says_none() -> None:
    assert events(planned(SPINDLE)) == [
        ("SPINDLE_CW", 8000.0),
        ("SPINDLE_OFF", None),
        ("END", None),
    ]
    said = job_of(spindle_rpm=3000.0)
    assert events(planned(SPINDLE, said))[0] == ("SPINDLE_CW", 3000.0)
    assert events(planned(SPINDLE, job_of(spindle_rpm=0.0))) == [("END", None)]
    assert events(planned()) == [("END", None)]


def test_it_turns_as_the_machine_says_and_is_waited_for() -> None:
    turned = planned((*SPINDLE, 'spindle.direction="ccw"', "spindle.spin_up_s=2.5"))
    assert events(turned)[:2] == [("SPINDLE_CCW", 8000.0), ("DWELL", 2.5)]
    # Nothing moves down before it is at speed.
    row = int((turned.kind == Kind.DWELL).argmax())
    assert (turned.end[:row, 2] > 0.0).all()


@pytest.mark.parametrize("switched", ["hand", "none"])
def test_a_spindle_that_no_program_switches(switched: str) -> None:
    assert events(planned((f'spindle.switched="{switched}"',))) == [("END", None)]
    job = job_of(spindle_rpm=5000.0)
    if switched == "none":
        with pytest.raises(OptionError, match="has no spindle"):
            planned(('spindle.switched="none"',), job)
    else:
        assert events(planned(('spindle.switched="hand"',), job)) == [("END", None)]


@pytest.mark.parametrize("speed", [999.0, 12001.0])
def test_a_speed_that_it_does_not_have_is_refused(speed: float) -> None:
    with pytest.raises(OptionError, match="not in the range of the spindle, 1000 to 12000"):
        planned(SPINDLE, job_of(spindle_rpm=speed))


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("spindle.default_rpm=20000", "default_rpm is outside"),
        ("spindle.min_rpm=13000", "min_rpm is above max_rpm"),
        ("spindle.default_rpm=-1", "is not between"),
        ('spindle.switched="foot"', "use one of"),
        ("defaults.plunge_share=2", "is not between"),
        ("defaults.feed_z_mm=0", "is not between"),
        ("defaults.park_mm=[1]", "park_mm"),
    ],
)
def test_what_no_machine_has_is_named(setting: str, words: str) -> None:
    with pytest.raises(MachineError, match=words):
        load_target("grbl", settings=[*SPINDLE, setting])


def test_coolant_runs_while_it_cuts() -> None:
    job = Job(
        operations=tuple(
            Operation(coolant=kind, tool=Tool(number=1))
            for kind in ("flood", "both", "mist", "off")
        )
    )
    switched = [name for name, _ in events(planned(COOLED, job)) if name.startswith("COOLANT")]
    assert switched == [
        "COOLANT_FLOOD",
        "COOLANT_MIST",
        "COOLANT_OFF",
        "COOLANT_MIST",
        "COOLANT_OFF",
    ]


def test_coolant_that_it_has_not_is_refused() -> None:
    with pytest.raises(OptionError, match="grbl has no mist coolant"):
        planned(("coolant.flood=true",), job_of(coolant="both"))
    with pytest.raises(MachineError, match="cannot switch coolant"):
        load_target("valcnc", settings=["coolant.flood=true"])


def test_plunges_are_a_share_of_the_feed() -> None:
    def plunges(settings: Sequence[str], **job: float) -> set[float]:
        path = planned(settings, job_of(feed_mm_min=200.0, **job))
        down = path.is_feed & (path.starts[:, 2] > path.end[:, 2])
        return set(path.feed[down].tolist())

    assert plunges(()) == {200.0}
    assert plunges(("defaults.plunge_share=0.33",)) == {66.0}
    assert plunges(("defaults.plunge_share=0.33",), plunge_feed_mm_min=50.0) == {50.0}


def test_rapids_go_down_to_the_feed_height() -> None:
    plain, low = planned(), planned(("defaults.feed_z_mm=0.8",))
    assert len(low) == len(plain) + 1
    row = int((low.is_feed).argmax())
    assert low.kind[row - 1] == Kind.RAPID
    assert low.end[row - 1, 2] == 0.8
    assert (low.end[row - 1, :2] == low.end[row, :2]).all()
    # Above the height of rapids it changes nothing.
    high = planned(("defaults.feed_z_mm=9",))
    assert (high.end == plain.end).all()


def test_it_parks_where_it_is_told() -> None:
    path = planned(("defaults.park_mm=[50, 80.5]",))
    assert path.end[-1].tolist() == [50.0, 80.5, 5.0]


# Through the bytes of programs.

POST = (
    "post",
    ROOT / "samples" / "logo.dxf",
    "-o",
    "a.nc",
    "--tool-diameter",
    "0.1",
    "--depth",
    "0.1",
)


@pytest.mark.parametrize("target", ["grbl", "linuxcnc"])
def test_a_program_says_it_all_and_is_read_back(camtool: Run, tmp_path: Path, target: str) -> None:
    (tmp_path / "mine.toml").write_text(
        f"""extends = "{target}"
[defaults]
feed_z_mm = 0.5
plunge_share = 0.25
park_mm = [1.0, 2.0]
[spindle]
default_rpm = 9000
spin_up_s = 3.0
[coolant]
flood = true
mist = true
[dialect]
start_blocks = ["G53 G0 Z0"]
end_blocks = ["G53 G0 Z0", "G53 G0 X0 Y0"]
"""
    )
    done = camtool(*POST, "--machine", "mine.toml", "--coolant", "both", "--feed", "100")
    assert done.returncode == 0, done.stderr
    assert b"CUT_DOUBTFUL" not in done.stderr
    assert b"spindle 9000" in done.stderr
    rows = [r for r in (tmp_path / "a.nc").read_text().splitlines() if not r.startswith("(")]
    assert rows.index("M3 S9000") < rows.index("G4 P3") < rows.index("M7") < rows.index("M8")
    assert rows.index("G53 G0 Z0") < rows.index("M3 S9000")
    ends = ["G0 Z5.000", "M9", "M5", "X1.000 Y2.000", "G53 G0 Z0", "G53 G0 X0 Y0", "M2"]
    assert [row for row in rows if row != "%"][-7:] == ends
    again = camtool("verify", "a.nc", "--machine", "mine.toml")
    assert again.returncode == 0, again.stderr
    assert b"coolant" not in again.stderr
    other = ("--to", "grbl", "--from-machine", "mine.toml", "-o", "b.nc")
    turned = camtool("convert", "a.nc", "--from", target, *other)
    assert b"3 words for coolant are left out" in turned.stderr


@pytest.mark.parametrize(
    ("blocks", "words"),
    [
        ('["G0 X9000"]', "they leave the travel of X"),
        ('["G1 X1 F100"]', "they cut"),
        ('["M2"]', "after the end of the program"),
        ('["M8", "Q5"]', "key end_blocks"),
        ('["M8\\nG0 X1"]', "block 1: 'M8\\\\nG0 X1' is no block"),
        ('[""]', "is no block"),
        ('["µ"]', "is no block"),
        ("3", "end_blocks"),
    ],
)
def test_end_blocks_are_read_by_the_reader(blocks: str, words: str) -> None:
    with pytest.raises(CamtoolError, match=words.replace("\\\\n", r"\\n")):
        load_target("grbl", settings=[f"dialect.end_blocks={blocks}"])


def test_m7_is_for_a_grbl_that_was_built_with_it(camtool: Run, tmp_path: Path) -> None:
    (tmp_path / "a.nc").write_text("G21 G90\nM7\nG0 X1\nM2\n")
    assert b"error:20" in camtool("verify", "a.nc", "-t", "grbl").stderr
    done = camtool("verify", "a.nc", "-t", "grbl", "--set", "coolant.mist=true")
    assert done.returncode == 0, done.stderr
