"""The panel's session with virtual machines: by hand, programs, stops and ends."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from camtool.errors import MachineError, OptionError
from camtool.panel.program import LoadedProgram
from camtool.panel.session import Session
from camtool.records import replace
from camtool.sending.drive import Request
from camtool.sending.journal import read_journal
from camtool.sending.line import Port, opened_line
from camtool.target.registry import load_target
from camtool.toolpath.probing import Touch, plate
from tests.sending.test_ends import hosted
from tests.waiting import HANG_S

SPEED = 10.0
SPEEDS = {"pic-mmh": 40.0}
PROGRAM = b"G21 G90 G17 G94\nG1 X2 Y0 F300\nG1 X2 Y3\nG2 X4 Y5 I2 J0\nG1 X0 Y5\nG0 X0 Y0\n"


CHANGE = (
    b"G21 G90 G17 G94\nG0 Z1\nG1 X2 Y0 F300\n(T2: end mill 3 mm, sticks out 18 mm)\nM0\n"
    b"G0 X0 Y0\nG1 Z0 F300\nG1 X1 Y1\nG0 Z1\n"
)


class AtPanel:
    """A session, its machine, and a way to wait for what it says."""

    def __init__(self, name: str, twin: Any, port: str, settings: tuple[str, ...] = ()) -> None:
        self.twin = twin
        self.changed = threading.Condition()
        self.history: list[str] = []
        """All states, in order: a busy computer may see some of them only afterwards."""
        self._seen = 0
        target = load_target(name, settings=settings)
        speed = SPEEDS.get(name, SPEED)
        self.session = Session(target, Port(port), opened_line, speed=speed, watch=self._changed)

    def _changed(self) -> None:
        with self.changed:
            self.history.append(self.session.state.state)
            self.changed.notify_all()

    def until(self, true: Callable[[], bool]) -> None:
        with self.changed:
            assert self.changed.wait_for(true, HANG_S), self.session.state

    def until_state(self, state: str) -> None:
        """Wait until the machine is, or has been, in a state since the last one waited for."""
        self.until(lambda: state in self.history[self._seen :])
        self._seen = self.history.index(state, self._seen) + 1

    def until_ready(self) -> None:
        self.until_state("sending")
        self.until_state("ready")

    def until_told(self, words: str) -> None:
        self.until(lambda: any(words in each for each in self.told))

    @property
    def at_mm(self) -> tuple[float, float, float]:
        place = self.session.state.place_mm
        assert place is not None
        return place

    @property
    def told(self) -> list[str]:
        return [each.text for each in self.session.messages]


@contextmanager
def at_panel(name: str, *choices: str, settings: tuple[str, ...] = ()) -> Iterator[AtPanel]:
    twin = load_target(name, settings=settings).twin(list(choices))
    with hosted(twin, SPEEDS.get(name, SPEED)) as port:
        at = AtPanel(name, twin, port, settings)
        at.session.start()
        try:
            yield at
        finally:
            at.session.close()


def program(folder: Path, data: bytes = PROGRAM, name: str = "grbl") -> LoadedProgram:
    file = folder / "part.nc"
    file.write_bytes(data)
    return LoadedProgram.read(str(file), load_target(name))


def start(at: AtPanel, loaded: LoadedProgram, **how: Any) -> None:
    options = {"single": False, "first": 0, "resumes": False, "despite_errors": False, **how}
    at.session.run_program(*loaded.prepared(speed=at.session.speed, **options))


def test_a_machine_is_moved_by_hand_and_then_runs_a_program(tmp_path: Path) -> None:
    loaded = program(tmp_path)
    with at_panel("grbl") as at:
        at.until_state("ready")
        at.session.order("jog", {"x": 1.5, "feed": 300.0})
        at.until_state("sending")
        at.until_state("ready")
        assert at.twin.slides.commanded_mm[0] == pytest.approx(1.5, abs=0.01)
        at.session.order("zero", {"x": 0.0, "y": 0.0, "z": 0.0})
        at.until_state("sending")
        at.until_state("ready")
        start(at, loaded)
        at.until(lambda: any("finished" in each for each in at.told))
        at.until_state("ready")
    # Beside the program its own queries count, which stand in the order of the lines.
    assert at.twin.slides.commanded_mm[:2] == pytest.approx([1.5, 0.0], abs=0.01)
    assert read_journal(loaded.journal).finished


def test_a_program_is_paused_stopped_and_resumed(tmp_path: Path) -> None:
    loaded = program(tmp_path)
    with at_panel("grbl") as at:
        at.until_state("ready")
        start(at, loaded)
        at.until(lambda: at.session.state.runs and at.session.state.acknowledged > 2)
        with pytest.raises(MachineError, match="not ready"):
            start(at, loaded)
        at.session.order("jog", {"x": 1.0, "feed": 300.0})
        at.until(lambda: any("stop it first" in each for each in at.told))
        at.session.request(Request.PAUSE)
        at.until_state("paused")
        assert not at.twin.is_moving
        at.session.request(Request.RESUME)
        at.until_state("sending")
        at.session.stop()
        at.until(lambda: any("can be resumed" in each for each in at.told))
        at.until_state("ready")
        assert not at.twin.is_moving
        state = read_journal(loaded.journal)
        assert not state.finished
        assert state.is_still
        start(at, loaded, resumes=True)
        at.until(lambda: any("finished" in each for each in at.told))
    assert read_journal(loaded.journal).finished
    assert at.twin.slides.commanded_mm[:2] == pytest.approx([0.0, 0.0], abs=0.01)


def test_a_key_that_nobody_confirms_is_let_go() -> None:
    """A page that is gone, or whose network is: the machine stands."""
    with at_panel("grbl") as at:
        at.until_state("ready")
        at.session.hold({"x": 1.0, "feed": 300.0})
        at.until(lambda: any("not confirmed" in each for each in at.told))
        at.until_state("ready")
        assert not at.twin.is_moving
        assert at.twin.slides.commanded_mm[0] < 30.0


def test_a_key_that_is_confirmed_moves_on_until_it_is_let_go() -> None:
    with at_panel("pic-mmh") as at:
        at.until_state("ready")
        at.session.hold({"x": 1.0, "feed": 300.0})
        while at.twin.slides.commanded_mm[0] < 0.05:
            at.session.keep()
            time.sleep(0.002)
            if at.session.state.state == "ready":  # a busy computer did not come to confirm it
                at.session.hold({"x": 1.0, "feed": 300.0})
        at.session.release()
        at.until_state("ready")
        place = at.twin.slides.commanded_mm[0]
        assert not at.twin.is_moving
        assert at.twin.slides.commanded_mm[0] == place


def test_the_end_of_the_panel_stops_the_machine() -> None:
    with at_panel("grbl") as at:
        at.until_state("ready")
        at.session.order("jog", {"x": 80.0, "feed": 500.0})
        at.until(lambda: at.session.state.says == "Jog")
        at.session.close()
        assert at.session.state.state == "closed"
    assert not at.twin.is_moving
    assert at.twin.slides.commanded_mm[0] < 79.0


def test_a_port_that_is_gone_is_said_and_opened_again(tmp_path: Path) -> None:
    twin = load_target("grbl").twin([])
    with hosted(twin, SPEED) as port:
        link = tmp_path / "port"
        at = AtPanel("grbl", twin, str(link))
        at.session.start()
        at.until(lambda: any("cannot be opened" in each for each in at.told))
        at.until_state("closed")
        link.symlink_to(port)
        at.session.reopen()
        at.until_state("ready")
        at.session.close()


def test_a_program_with_errors_needs_an_explicit_yes(tmp_path: Path) -> None:
    loaded = program(tmp_path, b"G21 G90\nG1 X500 F300\nG1 X0\n")
    assert loaded.one.run.failed
    with pytest.raises(OptionError, match="spoil the part"):
        loaded.prepared(single=False, first=0, resumes=False, despite_errors=False, speed=1.0)
    one, _ = loaded.prepared(single=False, first=0, resumes=False, despite_errors=True, speed=1.0)
    assert len(one.packets) == 3


def test_an_override_is_what_the_controller_reports(tmp_path: Path) -> None:
    """Each step goes out when grbl has reported the one before: it counts no flags twice."""
    loaded = program(tmp_path, b"G21 G90\nG1 X150 F50\nG1 X0\n")
    with at_panel("grbl") as at:
        at.until_state("ready")
        start(at, loaded)
        at.until_state("sending")
        for percent in (57, 200, 100):
            at.session.override("feed", percent)
            at.until(lambda percent=percent: at.session.state.overrides.get("feed") == percent)  # type: ignore[misc]
            assert at.twin._feed_percent == percent
        at.session.override("rapid", 30)
        at.until(lambda: at.session.state.overrides.get("rapid") == 25)
        at.session.stop()
        at.until(lambda: any("can be resumed" in each for each in at.told))


def test_what_leaves_the_travel_is_refused_once_it_is_homed() -> None:
    """By jogs, by held jogs and on the way to a place; grbl homes to the upper ends."""
    with at_panel("grbl", "homing=on") as at:
        at.until_state("ready")
        assert at.session.state.travel_mm is None
        at.session.order("home", {})
        at.until_ready()
        assert at.session.state.is_homed
        assert at.session.state.machine_mm == pytest.approx((-1.0, -1.0, -1.0), abs=0.01)
        at.session.order("zero", {"x": 0.0, "y": 0.0, "z": 0.0})
        at.until_ready()
        ends = at.session.state.travel_mm
        assert ends is not None
        assert ends == (
            pytest.approx((-199.0,) * 3, abs=0.01),
            pytest.approx((1.0,) * 3, abs=0.01),
        )
        at.session.order("jog", {"x": 3.5, "feed": 500.0})
        at.until_told("leaves the travel by 2.500 mm: it ends at X1.000")
        with pytest.raises(MachineError, match=r"Y-200\.000 mm leaves the travel by 1\.000 mm"):
            at.session.go({"y": -200.0}, 500.0)
        begun = at.twin.slides.commanded_mm.copy()
        at.session.hold({"x": 1.0, "feed": 500.0})
        while at.session.state.state != "ready" or at.at_mm[0] < 0.5:
            at.session.keep()
            time.sleep(0.005)
        assert at.at_mm[0] == pytest.approx(1.0, abs=0.03)
        at.session.release()
        at.session.hold({"x": 1.0, "feed": 500.0})
        at.until_told("it stands at the end of its travel")
        at.until_state("ready")
        at.session.go_home(500.0)
        at.until(lambda: at.at_mm == pytest.approx((0.0, 0.0, 0.0), abs=0.003))
        assert at.twin.slides.commanded_mm == pytest.approx(begun, abs=0.01)


def test_it_goes_to_a_place_up_first_and_down_last() -> None:
    with at_panel("grbl") as at:
        at.until_state("ready")
        at.session.go({"x": 3.0, "y": 2.0, "z": 1.0}, 500.0)
        at.until(lambda: at.at_mm == pytest.approx((3.0, 2.0, 1.0), abs=0.003))
        at.until(lambda: at.session.state.state == "ready")
        at.session.go({"x": 0.0, "z": 0.0}, 500.0)
        at.until(lambda: at.at_mm == pytest.approx((0.0, 2.0, 0.0), abs=0.003))
    moved = at.twin.slides.trace.commanded
    assert not ((moved[:, 0] > 0.0) & (moved[:, 2] < 0.99)).any()


def test_steps_that_are_reported_are_counted() -> None:
    """By jogs, a held jog that is stopped, homing, and zeroing; the PIC reports no place."""
    with at_panel("pic-mmh") as at:
        at.until_state("ready")
        assert at.at_mm == (0.0, 0.0, 0.0)
        at.session.order("jog", {"x": 0.014, "y": -0.007, "feed": 1.0})
        at.until_ready()
        assert at.at_mm == pytest.approx((0.014, -0.007, 0.0))
        at.session.hold({"x": 1.0, "feed": 1.0})
        while at.at_mm[0] < 0.1:
            at.session.keep()
            time.sleep(0.002)
        assert (
            80.0 < (at.session.state.step_hz or 0.0) < 330.0
        )  # 166 Hz, as a busy computer sees it
        at.session.release()
        at.until_ready()
        assert at.at_mm == pytest.approx(at.twin.slides.commanded_mm)
        assert at.session.state.machine_mm is None
        at.session.order("home", {})
        at.until_ready()
        assert at.session.state.machine_mm == (0.0, 0.0, 0.0)
        assert at.at_mm == pytest.approx(at.twin.slides.commanded_mm)
        ends = at.session.state.travel_mm
        assert ends is not None
        assert (ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]) == pytest.approx((10.0, 7.0))
        at.session.order("jog", {"y": 7.5, "feed": 1.0})
        at.until_told("leaves the travel by 0.500 mm")
        at.session.order("zero", dict.fromkeys("xyz", 0.0))
        at.until_ready()
        assert at.at_mm == (0.0, 0.0, 0.0)


def test_a_program_of_a_machine_that_reports_steps_shows_its_place(tmp_path: Path) -> None:
    text = b"G54;G90;G00X00003.00Y00002.00;G01X00006.00Y00002.00F08;G01X00000.00Y00000.00F08;M30;"
    loaded = program(tmp_path, text, "pic-mmh")
    with at_panel("pic-mmh") as at:
        at.until_state("ready")
        at.session.order("jog", {"x": 0.07, "feed": 1.0})
        at.until_ready()
        with pytest.raises(MachineError, match=r"the tool stands at X0\.070"):
            start(at, loaded)
        at.session.go({"x": 0.0, "y": 0.0}, 1.0)
        at.until(lambda: at.at_mm == pytest.approx((0.0, 0.0, 0.0), abs=1e-9))
        at.until(lambda: at.session.state.state == "ready")
        places = []
        at.session.watch = lambda: (places.append(at.session.state), at._changed())[1]
        start(at, loaded)
        at.until_told("finished")
        within = [each for each in places if each.runs and each.place_mm]
        assert max(each.place_mm[0] for each in within if each.place_mm) > 0.005
        assert {each.programmed_mm for each in within} >= {(0.006, 0.002, 0.0)}
        assert at.at_mm == pytest.approx(at.twin.slides.commanded_mm, abs=1e-9)


def test_a_jog_that_nothing_reports_is_reckoned() -> None:
    settings = (*(f"axes.{axis}.coded_step_mm=0.0125" for axis in "xyz"), "feed.default_mm_min=78")
    with at_panel("i8751", settings=settings) as at:
        at.until_state("ready")
        at.session.order("jog", {"x": 0.125, "feed": 78.0})
        at.until_ready()
        assert at.at_mm == pytest.approx((0.125, 0.0, 0.0))


def test_at_a_stop_the_tool_is_touched_off_and_the_program_goes_on(tmp_path: Path) -> None:
    """The new part zero holds behind the stop, and nothing in front of it is cut again."""
    loaded = program(tmp_path, CHANGE)
    with at_panel("grbl") as at:
        at.until_state("ready")
        start(at, loaded)
        at.until(lambda: at.session.state.stops)
        assert "T2: end mill 3 mm, sticks out 18 mm" in at.session.state.why
        at.session.leave_stop()
        at.until_told("touch off; it goes on with block 5")
        at.until(lambda: at.session.state.state == "ready")
        assert at.session.state.change_first == 5
        at.session.order("jog", {"z": -0.5, "feed": 300.0})
        at.until(lambda: at.at_mm[2] == pytest.approx(0.5, abs=0.01))
        at.until(lambda: at.session.state.state == "ready")
        at.session.order("zero", {"z": 0.0})
        at.until(lambda: at.at_mm[2] == pytest.approx(0.0, abs=0.01))
        at.until(lambda: at.session.state.state == "ready")
        cut = len(at.twin.slides.trace)
        start(at, loaded, first=4, more=True)
        at.until_told("finished")
    behind = at.twin.slides.trace.commanded[cut:]
    assert behind[:, 2].min() == pytest.approx(0.5, abs=0.01)
    between = (behind[:, 0] > 1.01) & (behind[:, 0] < 1.99)
    assert behind[between][:, 2].min() == pytest.approx(1.5, abs=0.01)
    assert read_journal(loaded.journal).finished


LINUXCNC_CHANGE = (
    b"G21 G90 G61\nT1 M6\nG43 H1\nG0 Z1\nM3 S900\nG1 X2 F300\nM5\n"
    b"(T2: end mill 3 mm, sticks out 18 mm)\nT2 M6\nG43 H2\nM3 S900\n"
    b"G0 X0 Y0\nG1 Z0 F300\nG1 X1 Y1\nG0 Z1\nM2\n"
)


def test_linuxcnc_stops_at_m6_for_the_tool_to_be_touched_off(tmp_path: Path) -> None:
    loaded = program(tmp_path, LINUXCNC_CHANGE, "linuxcnc")
    with at_panel("linuxcnc") as at:
        at.until_state("ready")
        start(at, loaded)
        at.until(lambda: at.session.state.stops)
        assert "T2: end mill 3 mm, sticks out 18 mm" in at.session.state.why
        assert at.at_mm == pytest.approx((2.0, 0.0, 1.0), abs=0.01)
        at.session.leave_stop()
        at.until_told("touch off; it goes on with block 10")
        at.until(lambda: at.session.state.state == "ready")
        at.session.order("zero", {"z": 1.5})
        at.until(lambda: at.at_mm[2] == pytest.approx(1.5, abs=0.01))
        at.until(lambda: at.session.state.state == "ready")
        cut = len(at.twin.slides.trace)
        start(at, loaded, first=9, more=True)
        at.until_told("finished")
    behind = at.twin.slides.trace.commanded[cut:]
    assert behind[:, 2].min() == pytest.approx(-0.5, abs=0.01)
    assert behind[:, 0].max() == pytest.approx(2.0, abs=0.01)
    assert read_journal(loaded.journal).finished


def test_pic_mmh_is_asked_for_before_m06(tmp_path: Path) -> None:
    """Nothing says that this controller waits at M06: the sender does, before the block."""
    data = b"G54;G90;M06T01;G01X00010.00Y00000.00F08;M06T04;G01X00000.00Y00000.00F08;M30;"
    loaded = program(tmp_path, data, "pic-mmh")
    with at_panel("pic-mmh") as at:
        at.until_state("ready")
        start(at, loaded)
        at.until(lambda: at.session.state.stops)
        assert at.session.state.why == "mount tool 4 and touch it off"
        assert b"M06T04;" not in b"".join(at.twin.decoded)
        assert b"M06T01;" in b"".join(at.twin.decoded)
        at.session.request(Request.RESUME)
        at.until_told("finished")
        assert b"M06T04;" in b"".join(at.twin.decoded)


def test_a_plate_is_touched_and_its_lower_side_is_zero() -> None:
    how = Touch(reach_mm=10.0, fast=400.0, slow=100.0)
    with at_panel("grbl", "probe_mm=-9") as at:
        at.until_state("ready")
        at.session.touch("plate", lambda start: plate(start, how, 1.5))
        at.until_told("plate: top_z -9.0")
        at.until(lambda: at.session.state.state == "ready" and at.at_mm[2] > 1.0)
        assert at.at_mm[2] == pytest.approx(10.5, abs=0.01)
        at.session.touch("plate", lambda start: plate(start, replace(how, reach_mm=5.0), 0.0))
        at.until_told("nothing was touched")
        at.until(lambda: at.session.state.state == "ready")
        assert not at.twin.is_moving
    with at_panel("pic-mmh") as at:
        at.until_state("ready")
        at.session.touch("plate", lambda start: plate(start, how, 0.0))
        at.until_told("no command to probe")
