"""The page in Chromium at each virtual machine: what a hand at the machine does, and what happens
when the page, the browser or the focus is lost."""

from __future__ import annotations

import os
import re
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
from msgspec import Struct

from camtool.sending.journal import read_journal
from tests.panel.test_server import served
from tests.panel.test_session import CHANGE, PROGRAM
from tests.pictures.viewer_browser import CHROMIUM, FLAGS, NEEDS_BROWSER, browser, playwright
from tests.sending.test_any_order import CHOICES, PROGRAMS, SETTINGS
from tests.waiting import HANG_S

__all__ = ["browser"]

pytestmark = NEEDS_BROWSER

PIC = (
    b"G54;G90;G00X00003.00Y00002.00;G01X00100.00Y00002.00F08;G01X00003.00Y00050.00F08;"
    b"G00X00000.00Y00000.00;M30;"
)
LINUXCNC = (
    b"G21 G90 G17\nG64 P0.01\nG0 Z5\nG0 X2 Y1\nM3 S1000\nG1 Z-1 F300\nG1 X14 F900\n"
    b"G2 X18 Y5 I0 J4\nG1 Y9\nG1 X2\nG1 X2 Y1\nG0 Z5\nG0 X0 Y0\nM5\nM2\n"
)


class Machine(Struct, frozen=True):
    """A virtual machine of these tests, and the words of the page on what it cannot."""

    name: str
    program: bytes
    suffix: str
    choices: tuple[str, ...] = ()
    settings: tuple[str, ...] = ()
    speed: float = 1.0
    homes: bool = False
    jogs: bool = False
    holds: bool = False
    zeroes: bool = False
    overrides: tuple[str, ...] = ()
    after_release_mm: float = 0.0
    """How far it may move after a key was let go: braking, and 0.3 s of a busy computer."""


MACHINES = {
    each.name: each
    for each in (
        Machine(
            "grbl",
            PROGRAM * 2,
            ".nc",
            choices=("homing=on",),
            homes=True,
            jogs=True,
            holds=True,
            zeroes=True,
            overrides=("feed", "rapid", "spindle"),
            after_release_mm=0.4 + 0.75,
        ),
        Machine(
            "pic-mmh",
            PIC,
            ".pic",
            speed=5.0,
            homes=True,
            jogs=True,
            holds=True,
            zeroes=True,
            after_release_mm=0.05,
        ),
        Machine(
            "linuxcnc",
            LINUXCNC,
            ".ngc",
            choices=("power=on",),
            homes=True,
            jogs=True,
            holds=True,
            zeroes=True,
            overrides=("feed", "spindle"),
            after_release_mm=6.0,
        ),
        Machine(
            "i8751", PROGRAMS["i8751"], ".bin", settings=SETTINGS["i8751"], speed=5.0, jogs=True
        ),
        Machine(
            "valcnc",
            PROGRAMS["valcnc"],
            ".nc",
            choices=tuple(CHOICES["valcnc"]),
            settings=SETTINGS["valcnc"],
            speed=5.0,
            jogs=True,
            zeroes=True,
        ),
    )
}


class At:
    """A page, its server and its machine."""

    def __init__(self, browser: Any, server: Any, twin: Any, **more: Any) -> None:
        self.server, self.twin, self.session = server, twin, server.session
        self.complaints: list[str] = []
        self.page = self.opened(browser, **more)

    def opened(self, browser: Any, **more: Any) -> Any:
        page = browser.new_page(**{"viewport": {"width": 1280, "height": 900}, **more})
        page.set_default_timeout(HANG_S * 1000)
        page.on("console", self._said)
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.goto(self.server.address)
        page.wait_for_function("() => first !== null")
        return page

    def _said(self, message: Any) -> None:
        if "GPU stall due to ReadPixels" not in message.text:
            self.complaints.append(message.text)

    def until(self, true: Callable[[], bool]) -> None:
        end = time.monotonic() + HANG_S
        while not true():
            assert time.monotonic() < end, self.session.state
            self.page.wait_for_timeout(5)

    def until_state(self, *words: str) -> None:
        self.until(lambda: self.session.state.state in words)
        shown = [{"sending": "runs"}.get(word, word) for word in words]
        self.page.wait_for_function(
            "words => words.some((word) => find('state-word').textContent.startsWith(word))"
            " || words.includes(state.state)",
            arg=[*words, *shown],
        )

    def until_told(self, words: str) -> None:
        messages, end = self.session.messages, time.monotonic() + HANG_S
        while not any(words in each.text for each in messages):
            assert time.monotonic() < end, [each.text for each in messages]
            self.page.wait_for_timeout(20)
        self.page.locator("#messages li", has_text=words).first.wait_for()

    def press(self, name: str) -> None:
        """Press a button by its name."""
        self.page.get_by_role("button", name=name, exact=True).click()

    def at(self, axis: int = 0) -> float:
        place = self.session.state.place_mm
        return 0.0 if place is None else float(place[axis])

    def commanded(self, axis: int = 0) -> float:
        return float(self.twin.slides.commanded_mm[axis])

    def until_still(self) -> None:
        """Wait until it is ready and stands, several times in a row: orders take a moment."""
        count = 0
        while count < 8:
            self.page.wait_for_timeout(30)
            still = self.session.state.state == "ready" and not self.twin.is_moving
            count = count + 1 if still else 0


@contextmanager
def opened(
    machine: Machine, browser: Any, folder: Path, program: bytes = b"", **more: Any
) -> Iterator[At]:
    (folder / f"part{machine.suffix}").write_bytes(program or machine.program)
    how = {"choices": machine.choices, "settings": machine.settings, "speed": machine.speed}
    with served(machine.name, None, folder=folder, **how) as (server, twin):
        at = At(browser, server, twin, **more)
        at.until(lambda: at.session.state.state == "ready")
        yield at
        assert not at.complaints
        at.page.close()


@pytest.fixture(params=MACHINES)
def at(request: pytest.FixtureRequest, browser: Any, tmp_path: Path) -> Iterator[At]:
    with opened(MACHINES[request.param], browser, tmp_path) as each:
        yield each


@pytest.fixture
def grbl(browser: Any, tmp_path: Path) -> Iterator[At]:
    with opened(
        Machine("grbl", PROGRAM * 2, ".nc", jogs=True, holds=True), browser, tmp_path
    ) as each:
        yield each


def load(at: At) -> None:
    at.press("Load")
    at.until_told("is loaded")
    at.page.wait_for_function("() => first.program !== null")
    assert at.page.locator("#program-name").inner_text().startswith("part")


def hold_key(at: At, page: Any, axis: int = 0) -> None:
    """Hold a key of a page until the machine moves, and still does a moment later. Where a busy
    computer does not come to confirm it, the machine stops, and the key is pressed again."""
    while True:
        before = at.commanded(axis)
        page.keyboard.down("ArrowRight")
        at.until(lambda before=before: at.commanded(axis) > before)
        at.page.wait_for_timeout(200)
        if at.session.state.state == "sending":
            return
        page.keyboard.up("ArrowRight")
        at.until_still()


def moved_after(at: At, end: Callable[[], object], axis: int = 0) -> float:
    """Hold a key until it moves, end that, and return how far it has moved after that."""
    hold_key(at, at.page, axis)
    let_go_at = at.commanded(axis)
    end()
    at.until_still()
    return at.commanded(axis) - let_go_at


@pytest.mark.slow
def test_a_hand_at_each_machine(at: At) -> None:
    """Connect, home, jog by steps and by holding, zero, load, run, hold, override, stop, go on."""
    name = at.session.target.machine.target.name
    machine, page = MACHINES[name], at.page
    cannot = page.locator("#cannot").inner_text()
    assert ("home" in cannot) == (not page.locator("#home").is_visible())
    assert ("as long as a key is held" in cannot) == (not machine.holds)
    assert ("override" in cannot) == (not machine.overrides)
    if machine.homes:
        at.press("Home")
        at.until(lambda: at.session.state.is_homed)
        at.until_still()
    if machine.zeroes:
        at.press("All axes zero here")
        at.until(lambda: at.session.state.place_mm == pytest.approx((0.0, 0.0, 0.0), abs=1e-6))
        at.until_still()
    page.locator("#step-size").select_option("100 steps" if name == "pic-mmh" else "1")
    step_mm = at.session.target.machine.axes.x.coded_step_mm
    way_mm = 100 * step_mm if name == "pic-mmh" else 1.0
    before = at.commanded()
    if name == "grbl":  # it stands at the upper end of its travel
        at.press("X minus")
        at.until_still()
        at.until(lambda: at.commanded() < before - 0.5)
        before = at.commanded()
    at.press("X plus")
    at.until(lambda: at.commanded() > before + 0.5 * way_mm)
    at.until_still()
    assert at.commanded() - before == pytest.approx(way_mm, abs=1.5 * step_mm)
    at.press("Part zero, X and Y")
    at.until(lambda: abs(at.at()) < 0.003)
    at.until_still()
    if machine.holds:
        page.locator("#step-size").select_option("held")
        page.locator("#machine").click()
        if name == "grbl":
            page.locator("#go-x").fill("-20")
            at.press("Go")
            at.until(lambda: abs(at.at() + 20.0) < 0.01)
            at.until_still()
            page.locator("#machine").click()
        on_mm = moved_after(at, lambda: page.keyboard.up("ArrowRight"))
        show_figure("moved after the release, mm", round(on_mm, 6))
        assert on_mm <= machine.after_release_mm
        at.press("Part zero, X and Y")
        at.until(lambda: abs(at.at()) < 0.003)
        at.until_still()
    load(at)
    at.press("Start")
    at.until(lambda: at.session.state.runs)
    at.press("Hold")
    at.until_state("paused")
    for override in machine.overrides:
        slider = page.locator(f"#override-{override}")
        slider.focus()
        page.keyboard.press("ArrowLeft")
    if machine.overrides:
        page.locator("#go-on").click()
        at.until(lambda: at.session.state.overrides.get("feed") == 99)
    else:
        page.locator("#go-on").click()
    at.until_state("sending")
    page.keyboard.press("Escape")
    at.until(lambda: not at.session.state.runs)
    at.until_still()
    left = read_journal(Path(at.server.program.journal))
    assert not left.finished
    if machine.name in ("pic-mmh", "valcnc") and at.session.state.place_mm is not None:
        at.press("Part zero, X and Y")
        at.until(lambda: abs(at.at()) < 1e-4 and abs(at.at(1)) < 1e-4)
        at.until_still()
        page.locator("#go-z").fill("0")
        at.press("Go")
        at.until_still()
    page.locator("#resume-left").click()
    if name == "i8751":  # it still waits for the rest of the data
        at.until_told("must be reset")
        return
    at.until_told("finished")
    assert read_journal(Path(at.server.program.journal)).finished


def test_a_router_says_that_it_only_takes_jobs(browser: Any, tmp_path: Path) -> None:
    machine = Machine("matlab-router", b"", ".txt")
    with opened(machine, browser, tmp_path, b"x") as at:
        cannot = at.page.locator("#cannot").inner_text()
        for words in ("home", "zero", "jog", "take a typed line", "override"):
            assert words in cannot
        for place in ("#home", "#jog", "#go", "#typed", "#zero-all", "#overrides"):
            assert not at.page.locator(place).is_visible(), place


BUSY_S = 1.5
"""What a busy computer may add to the 0.1 s in which a jog ends."""


def show_figure(name: str, value: float) -> None:
    """Print a figure: pytest -rP shows it."""
    print(f"{name}: {value}")


class TestStops:
    """A held jog of grbl ends by 0x85, however it is let go; at 150 mm/min and 10 mm/s² braking
    takes 0.31 mm."""

    ENDS = ("release", "blur", "hidden", "frozen", "busy", "closed")

    @pytest.mark.parametrize("end", ENDS)
    def test_it_brakes(self, grbl: At, end: str) -> None:
        page = grbl.page
        page.locator("#step-size").select_option("held")
        page.locator("#machine").click()
        ends: dict[str, Callable[[], object]] = {
            "release": lambda: page.keyboard.up("ArrowRight"),
            "blur": lambda: page.evaluate("window.dispatchEvent(new Event('blur'))"),
            "hidden": lambda: page.evaluate("window.dispatchEvent(new Event('pagehide'))"),
            "frozen": lambda: page.evaluate("clearInterval(keeping)"),
            "busy": lambda: page.evaluate("for (const at = Date.now(); Date.now() < at + 400;);"),
            "closed": lambda: page.evaluate("socket.close()"),
        }
        cancels, begun = cancels_of(grbl.twin), [0.0]

        def let_go() -> None:
            cancels.clear()
            begun[0] = time.monotonic()
            ends[end]()

        on_mm = moved_after(grbl, let_go)
        late_s = (cancels or begun)[0] - begun[0]  # none, if it has let go before that
        show_figure(f"0x85 after {end}, ms", round(1e3 * late_s))
        show_figure(f"moved after {end}, mm", round(on_mm, 3))
        assert late_s < 0.1 + BUSY_S
        assert on_mm < 0.31 + 2.5 * (0.1 + BUSY_S)
        page.keyboard.up("ArrowRight")

    def test_the_pic_stops_at_the_next_step(self, browser: Any, tmp_path: Path) -> None:
        """At 170 steps a second; the busy computer is what makes it more than one or two."""
        machine = Machine("pic-mmh", PIC, ".pic")
        with opened(machine, browser, tmp_path) as at:
            at.page.locator("#step-size").select_option("held")
            at.page.locator("#machine").click()
            on_mm = moved_after(at, lambda: at.page.keyboard.up("ArrowRight"))
            steps = round(on_mm / at.session.target.machine.axes.x.coded_step_mm)
            show_figure("steps after the release", steps)
            assert steps <= 2 + 170 * BUSY_S
            assert at.at() == pytest.approx(at.commanded(), abs=1e-9)


def cancels_of(twin: Any) -> list[float]:
    """The times at which 0x85 comes to a grbl, from now on."""
    times: list[float] = []
    receive = twin.receive

    def heard(data: bytes, now: float) -> bytes:
        if b"\x85" in data:
            times.append(time.monotonic())
        answer: bytes = receive(data, now)
        return answer

    twin.receive = heard
    return times


def kill_marked(argument: str) -> None:
    """Kill the browser that has this argument, but not the processes that it has begun."""
    found = 0
    for file in Path("/proc").glob("[0-9]*/cmdline"):
        with suppress(OSError):
            words = file.read_bytes().split(b"\0")
            if argument.encode() in words and not any(w.startswith(b"--type=") for w in words):
                os.kill(int(file.parent.name), signal.SIGKILL)
                found += 1
    assert found == 1


class TestLost:
    def test_a_browser_that_is_killed_stops_a_jog_and_no_program(
        self, grbl: At, browser: Any
    ) -> None:
        mark = f"--marked-by-test={time.monotonic_ns()}"
        arguments = [*FLAGS, mark]
        at, killed = grbl, browser.browser_type.launch(executable_path=CHROMIUM, args=arguments)
        page = killed.new_page()
        page.goto(at.server.address)
        page.get_by_role("button", name="Command from this page").click()
        page.wait_for_function("() => commands && state.state === 'ready'")
        page.locator("#step-size").select_option("held")
        page.locator("#machine").click()
        hold_key(at, page)
        cancels = cancels_of(at.twin)
        # A page that a busy computer keeps from confirming has let go before it is killed.
        begun, place = time.monotonic(), at.commanded()
        kill_marked(mark)
        at.until_still()
        for cancelled in cancels[:1]:
            show_figure("0x85 after the kill, ms", round(1e3 * (cancelled - begun)))
        show_figure("moved after the kill, mm", round(at.commanded() - place, 3))
        assert at.commanded() - place < 0.31 + 2.5 * (0.1 + BUSY_S) + 2.0  # Chromium dies slowly
        with suppress(playwright.Error):
            killed.close()

    def test_a_program_goes_on_when_its_page_is_closed(self, grbl: At, browser: Any) -> None:
        at = grbl
        load(at)
        at.press("Start")
        at.until(lambda: at.session.state.acknowledged > 1)
        at.page.close()
        at.page = at.opened(browser)
        at.page.wait_for_function("() => state.runs")
        at.until_told("finished")
        assert read_journal(Path(at.server.program.journal)).finished

    def test_one_page_commands_and_the_other_watches(self, grbl: At, browser: Any) -> None:
        at = grbl
        other = at.opened(browser)
        other.wait_for_function("() => state.state === 'ready'")
        assert other.locator("#role").inner_text() == "this page watches"
        assert other.locator("#pad .e").is_disabled()
        assert other.locator("#stop").is_enabled()
        other.get_by_role("button", name="Command from this page").click()
        other.wait_for_function("() => commands")
        at.page.wait_for_function("() => !commands")
        other.locator("#step-size").select_option("1")
        other.get_by_role("button", name="X plus", exact=True).click()
        at.until(lambda: at.at() == pytest.approx(1.0, abs=0.01))
        at.page.wait_for_function("() => find('at-x').textContent === '1.000'")
        other.close()


def test_another_tool_at_a_stop(browser: Any, tmp_path: Path) -> None:
    """M0: its message, touching off, and on behind the stop."""
    with opened(Machine("grbl", CHANGE, ".nc"), browser, tmp_path) as at:
        load(at)
        at.press("Start")
        at.page.locator("#halt").wait_for()
        assert "T2: end mill 3 mm, sticks out 18 mm" in at.page.locator("#halt-text").inner_text()
        at.press("Touch off the tool")
        at.page.get_by_role("button", name="Go on with block 5").wait_for()
        at.until(lambda: at.session.state.state == "ready")
        at.page.locator("#step-size").select_option("0.1")
        at.press("Z minus")
        at.until(lambda: at.at(2) == pytest.approx(0.9, abs=0.01))
        at.until_still()
        at.press("Z zero here")
        at.until(lambda: at.at(2) == pytest.approx(0.0, abs=0.003))
        at.until_still()
        at.page.locator("#halt-on").click()
        at.until_told("finished")
        assert at.commanded(2) == pytest.approx(1.9, abs=0.01)


def test_the_whole_page_by_the_keyboard_alone(grbl: At) -> None:
    """Tab reaches every control that is enabled; Enter, Space, arrows and Escape do the rest."""
    at, page = grbl, grbl.page
    load(at)
    page.evaluate("document.activeElement.blur()")
    reached, wanted_ids = set(), {"stop", "start", "single", "first", "load", "home", "zero-all"}
    wanted_ids |= {"step-size", "speed", "feed", "go-x", "go-y", "go-z", "line", "override-feed"}
    for _ in range(120):
        page.keyboard.press("Tab")
        reached.add(page.evaluate("document.activeElement.id"))
    assert wanted_ids <= reached
    page.evaluate("document.activeElement.blur()")
    while page.evaluate("document.activeElement.id") != "start":
        page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    at.until(lambda: at.session.state.acknowledged > 1)
    page.locator("#machine").click()
    page.keyboard.press("Space")
    at.until_state("paused")
    page.keyboard.press("Escape")
    at.until(lambda: not at.session.state.runs)
    at.until_still()
    page.locator("#line").focus()
    page.keyboard.type("$I")
    page.keyboard.press("Enter")
    at.until_told("[VER:1.1")


def test_the_loaded_program_is_the_chosen_one(grbl: At, tmp_path: Path) -> None:
    """A page that comes later offers to load it again, and not the first of the folder."""
    load(grbl)
    (tmp_path / "another.nc").write_bytes(PROGRAM)
    grbl.page.reload()
    grbl.page.wait_for_function("() => first && first.program !== null")
    assert grbl.page.locator("#load-name option").all_inner_texts() == ["another.nc", "part.nc"]
    assert grbl.page.locator("#load-name").input_value() == "part.nc"


def test_a_screen_reader_hears_a_name_of_each_control(grbl: At) -> None:
    """By the accessibility tree of Chromium."""
    load(grbl)
    tree = grbl.page.locator("body").aria_snapshot()
    roles = "button|textbox|combobox|spinbutton|slider|checkbox|progressbar|table|group|region"
    nameless = re.findall(rf"^ *- (?:{roles})(?: \[.*)?:?$", tree, re.MULTILINE)
    assert not [each for each in nameless if "region" not in each and "group" not in each]
    for name in ("Stop", "X zero here", "X minus, Y plus", "Part zero, Z", "Hold", "Load"):
        assert f'button "{name}"' in tree, tree
    for name in ("X", "Y", "Z"):
        assert f'spinbutton "{name}"' in tree
    assert "status" in tree


def test_a_plate_is_touched_from_the_page(browser: Any, tmp_path: Path) -> None:
    machine = Machine("grbl", CHANGE, ".nc", choices=("probe_mm=-3",))
    with opened(machine, browser, tmp_path) as at:
        at.page.locator("#touch-thickness").fill("1.5")
        at.page.locator("#touch-feed").fill("400")
        at.press("Touch")
        at.until_told("plate: top_z -3.0")
        at.until(lambda: at.at(2) == pytest.approx(4.5, abs=0.01))
        at.page.locator("#touch-what").select_option("corner")
        at.press("Touch")
        at.until_told("is no way towards a corner")
    with opened(Machine("valcnc", b"", ".nc"), browser, tmp_path, b"G00X1Y1Z1\n") as at:
        assert not at.page.locator("#touch").is_visible()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("size", [(1280, 900), (390, 844)])
def test_nothing_is_wider_than_the_screen(
    scheme: str, size: tuple[int, int], browser: Any, tmp_path: Path
) -> None:
    view = {"viewport": {"width": size[0], "height": size[1]}, "color_scheme": scheme}
    with opened(Machine("grbl", CHANGE, ".nc"), browser, tmp_path, **view) as at:
        load(at)
        assert at.page.evaluate("document.documentElement.scrollWidth") <= size[0]
        paper = at.page.evaluate("getComputedStyle(document.body).backgroundColor")
        assert (int(re.findall(r"\d+", paper)[0]) > 200) == (scheme == "light")


def test_the_picture_shows_travel_and_tool(browser: Any, tmp_path: Path) -> None:
    machine = Machine("grbl", CHANGE, ".nc", choices=("homing=on",))
    with opened(machine, browser, tmp_path) as at:
        at.server.tool_mm = 3.0
        load(at)
        frame = at.page.frame_locator("#view")
        frame.locator("body[data-painted]").wait_for()
        at.press("Home")
        at.until(lambda: at.session.state.is_homed)
        assert "X -200.0 to 0.0" in at.page.locator("#now-travel").inner_text()
        assert '"cutters":[[' in at.server.program.page().decode()
        frame.locator("#stage").click()
        at.page.keyboard.press("Escape")
        at.until_told("stopped")
