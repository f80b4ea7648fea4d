"""grbl's wire, in memory: a small grbl that answers as its wiki says, and faults of the line."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from camtool_postprocessors.grbl.settings import differences
from camtool_postprocessors.grbl.wire import BUFFER_BYTES, GrblWire

from camtool.sending.prepare import consignment, forecast_of
from camtool.target.registry import load_target
from camtool.target.wire import Conversation, Manner, Packet, Tell, WireState, Write

PLAIN = Manner()
TARGET = load_target("grbl")
PROGRAM = b"(a part)\nG21 G90\nG0 Z5\nG0 X1 Y1 ; there\n" + b"".join(
    b"G1 X%d.125 Y%d.375 F200\n" % (k % 9, k % 7) for k in range(60)
)
LISTING = {
    **{100 + k: 250.0 for k in range(3)},
    **{110 + k: 500.0 for k in range(3)},
    **{120 + k: 10.0 for k in range(3)},
    **{130 + k: 200.0 for k in range(3)},
    11: 0.01,
    12: 0.002,
}


def _words(place: tuple[float, float, float]) -> str:
    return "{:.3f},{:.3f},{:.3f}".format(*place)


class Small:
    """A controller that takes a line every `line_s`, and has a buffer of 127 bytes. `begins`: what
    it says behind its banner; `modes`: what it has then; `locked`: until $X or $H; `closed`:
    switches."""

    def __init__(
        self,
        line_s: float = 0.05,
        settings: dict[int, float] | None = None,
        *,
        begins: Sequence[bytes] = (),
        modes: bytes = b"G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0",
        locked: bool = False,
        closed: str = "",
    ) -> None:
        self.buffer, self.lines = b"", list[bytes]()
        self.line_s, self.next, self.held, self.reset = line_s, 0.0, False, 0
        self.settings = LISTING if settings is None else settings
        self.begins, self.modes, self.locked, self.closed = begins, modes, locked, closed
        self.after_stop = self.fullest = 0
        self.place = self.zero = (0.0, 0.0, 0.0)
        self.told = False  # whether it has said its work zero since it began

    def write(self, data: bytes, now: float) -> list[bytes]:
        said = list[bytes]()
        for octet in data:
            one = bytes([octet])
            if one == b"?":
                moving = self.buffer and not self.held
                state = "Hold:0" if self.held else "Run" if moving else "Idle"
                state = "Alarm" if self.locked else state
                closed = f"|Pn:{self.closed}" if self.closed else ""
                zero = "" if self.told else f"|WCO:{_words(self.zero)}"
                self.told = True
                said.append(f"<{state}|MPos:{_words(self.place)}|FS:0,0{zero}{closed}>".encode())
            elif one == b"!":
                self.held = True
            elif one == b"~":
                self.held = False
            elif one == b"\x18":
                self.buffer, self.held, self.reset = b"", False, self.reset + 1
                self.told = False
                said += [b"Grbl 1.1h ['$' for help]", *self.begins]
            elif len(self.buffer) < BUFFER_BYTES:
                self.buffer += one
                self.fullest = max(self.fullest, len(self.buffer))
        return said

    def run(self, now: float) -> list[bytes]:
        if self.held or now < self.next or b"\n" not in self.buffer:
            return []
        self.next = now + self.line_s
        line, _, self.buffer = self.buffer.partition(b"\n")
        if line == b"$G":
            return [b"[GC:%s]" % self.modes, b"ok"]
        if line == b"$$":
            rows = [b"$%d=%.3f" % each for each in self.settings.items()]
            return [*rows, b"ok"]
        if self.locked and line not in (b"$X", b"$H"):
            return [b"error:9"]
        self.locked = False
        self.lines.append(line)
        return [b"ok"]


def packets(program: bytes = PROGRAM) -> list[Packet]:
    decoded = TARGET.target.read(program, TARGET.machine)
    return list(GrblWire().packets(program, TARGET.machine, forecast_of(decoded, TARGET)))


def held(
    fault: Callable[[int, bytes], list[bytes]] = lambda number, line: [line],
    wish: Callable[[Conversation, float], None] = lambda conversation, now: None,
    small: Small | None = None,
    manner: Manner = PLAIN,
    talk: Conversation | None = None,
    told: list[str] | None = None,
) -> tuple[Conversation, Small]:
    """A conversation to its end; `fault` makes of a line of the controller what arrives."""
    small = small or Small()
    talk = talk or GrblWire().conversation(packets(), TARGET.machine, manner)
    number, now = 0, 0.0
    talk.begin(now)
    while not talk.is_over or talk.has_actions:
        said = list[bytes]()
        for action in talk.actions():
            if isinstance(action, Write):
                said += small.write(action.data, now)
            elif isinstance(action, Tell) and told is not None:
                told.append(action.text)
        now += 0.01
        said += small.run(now)
        for line in said:
            for come in fault(number, line):
                talk.receive(come + b"\r\n", now)
            number += 1
        wish(talk, now)
        if now >= talk.next_s:
            talk.tick(now)
        assert now < 120.0, (talk.state, talk.why)
    return talk, small


def test_packets_are_the_blocks_without_comments_and_blanks() -> None:
    made = packets()
    assert [each.data for each in made[:3]] == [b"G21G90\n", b"G0Z5\n", b"G0X1Y1\n"]
    assert [each.block for each in made] == list(range(63))
    assert made[5].seconds > 0.0


def test_blocks_behind_the_last_move_are_packets_too() -> None:
    made = packets(b"G90\nG0X1\nG21\n")
    assert [each.data for each in made] == [b"G90\n", b"G0X1\n", b"G21\n"]
    assert made[2].seconds == 0.0


def test_every_line_arrives_once_and_in_order() -> None:
    talk, small = held()
    assert talk.state is WireState.FINISHED
    assert small.lines == [each.data.strip() for each in packets()]
    assert talk.done == len(packets())


def test_settings_that_differ_are_an_error_that_names_them() -> None:
    talk, small = held(small=Small(settings={**LISTING, 101: 80.0}))
    assert talk.state is WireState.FAILED
    assert "$101 is 80.000" in talk.why
    assert small.lines == []


def test_another_full_speed_than_the_machine_files_turns_at_another_speed() -> None:
    """S6000 is half power where $30 is 12000, and full power where it is 1000."""
    machine = load_target("grbl", settings=["spindle.max_rpm=12000"]).machine
    for full, count in ((12000.0, 0), (1000.0, 1)):
        text = "\n".join(
            f"${number}={value:.3f}" for number, value in (LISTING | {30: full}).items()
        )
        errors, _ = differences(text, machine)
        assert [each for each in errors if "spindle.max_rpm" in each] == errors
        assert len(errors) == count


@pytest.mark.parametrize("seed", range(30))
@pytest.mark.parametrize("kind", ["drop", "double", "garble"])
def test_no_fault_of_an_answer_loses_or_doubles_a_block(kind: str, seed: int) -> None:
    at = int(np.random.default_rng(seed).integers(18, 140))
    made = {"drop": [], "double": [b"", b""], "garble": [b""]}

    def fault(number: int, line: bytes) -> list[bytes]:
        if number != at:
            return [line]
        return [line if kind == "double" else b"\x01" + line[1:] for _ in made[kind]]

    talk, small = held(fault)
    assert talk.state in (WireState.FINISHED, WireState.FAILED)
    wanted = [each.data.strip() for each in packets()]
    assert small.lines == wanted[: len(small.lines)]
    assert talk.done <= len(small.lines)
    if talk.state is WireState.FAILED:
        assert small.reset == 2  # at the beginning, and to stop it


def test_many_doubled_answers_never_overflow_its_buffer() -> None:
    talk, small = held(lambda number, line: [line, line] if line == b"ok" else [line])
    assert talk.state is WireState.FAILED
    assert small.fullest < BUFFER_BYTES
    wanted = [each.data.strip() for each in packets()]
    assert small.lines == wanted[: len(small.lines)]


def test_a_stop_holds_resets_and_says_where_it_stands() -> None:
    def wish(talk: Conversation, now: float) -> None:
        if talk.acknowledged >= 30:
            talk.stop(now)

    talk, small = held(wish=wish)
    assert talk.state is WireState.STOPPED
    assert small.buffer == b""
    assert 30 <= len(small.lines) < 60
    assert talk.done <= len(small.lines)


def test_a_pause_is_one_only_when_it_stands_and_goes_on() -> None:
    seen = list[WireState]()

    def wish(talk: Conversation, now: float) -> None:
        seen.append(talk.state)
        if talk.acknowledged == 20 and WireState.PAUSED not in seen:
            talk.pause(now)
        elif talk.state is WireState.PAUSED:
            talk.resume(now)

    talk, small = held(wish=wish)
    assert WireState.PAUSED in seen
    assert talk.state is WireState.FINISHED
    assert len(small.lines) == len(packets())


def test_single_blocks_wait_each() -> None:
    waits = 0

    def wish(talk: Conversation, now: float) -> None:
        nonlocal waits
        if talk.state is WireState.PAUSED:
            waits += 1
            assert talk.sent == talk.done == waits
            talk.resume(now)

    talk, _ = held(wish=wish, manner=Manner(single=True))
    assert talk.state is WireState.FINISHED
    assert waits == len(packets()) - 1


def test_single_blocks_that_are_no_longer_wanted_go_on() -> None:
    def wish(talk: Conversation, now: float) -> None:
        if talk.sent and talk.state is WireState.SENDING:
            talk.single = False
            talk.resume(now)

    talk, small = held(wish=wish, manner=Manner(single=True))
    assert talk.state is WireState.FINISHED
    assert len(small.lines) == len(packets())


def test_silence_ends_within_bounds() -> None:
    talk, _ = held(lambda number, line: [] if number > 40 else [line])
    assert talk.state is WireState.FAILED
    assert "not" in talk.why


# The greeting: what it says of itself, and what is no grbl.


ORDERS = ("home", "zero", "jog", "unlock")


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (b">G54:ok", "it has run its startup line G54"),
        (b">G54G90:ok", "it has run its startup line G54G90"),
        (b">G99:error:20", "error:20, a word that it does not know, to its startup line G99"),
    ],
)
def test_answers_of_startup_lines_are_none_of_the_programs(line: bytes, words: str) -> None:
    """grbl runs $N0 and $N1 behind its banner and behind homing, and says so (report.c)."""
    told = list[str]()
    talk, small = held(small=Small(begins=[line]), told=told)
    assert talk.state is WireState.FINISHED, talk.why
    assert small.lines == [each.data.strip() for each in packets()]
    assert [each for each in told if "startup" in each] == [words]
    values = {"x": 1.0, "y": 0.0, "z": 0.0, "feed": 100.0}
    for order in ORDERS:
        talk = GrblWire().command(order, TARGET.machine, values, PLAIN)
        talk, small = held(small=Small(begins=[line]), talk=talk)
        assert talk.state is WireState.FINISHED, (order, talk.why)
        assert len(small.lines) == 1


@pytest.mark.parametrize(
    ("modes", "program", "why"),
    [
        (b"G0 G54 G17 G20 G90 G94 M5", b"G90\nG0X1\nG21\n", "leaves G20, and the program does"),
        (b"G0 G55 G17 G21 G90 G94 M5", PROGRAM, "does not say G54 before it moves"),
        (b"G0 G54 G17 G20 G91 G94 M5", PROGRAM, ""),
        (b"G1 G54 G18 G21 G90 G94 M3", b"G17G0X1\n", ""),
    ],
)
def test_startup_lines_that_change_what_a_program_means_are_refused(
    modes: bytes, program: bytes, why: str
) -> None:
    talk = GrblWire().conversation(packets(program), TARGET.machine, PLAIN)
    talk, small = held(small=Small(begins=[b">G0:ok"], modes=modes), talk=talk)
    assert talk.state is (WireState.FAILED if why else WireState.FINISHED), talk.why
    assert why in talk.why
    assert bool(small.lines) != bool(why)


@pytest.mark.parametrize(
    ("homing", "closed", "says", "words"),
    [
        (1.0, "", [], ["it is locked: home it (--home), or give --unlock"]),
        (0.0, "", [], ["homing is off ($22=0)", "--unlock"]),
        (
            0.0,
            "XP",
            [b"[MSG:Check Limits]", b"[MSG:'$H'|'$X' to unlock]"],
            ["it says 'Check Limits'; it reports closed switches: limit of X, probe", "--unlock"],
        ),
    ],
)
def test_a_locked_one_is_advised_by_its_own_settings(
    homing: float, closed: str, says: list[bytes], words: list[str]
) -> None:
    small = Small(settings={**LISTING, 22: homing}, closed=closed, locked=True)
    talk = GrblWire().conversation(packets(), TARGET.machine, PLAIN)
    talk.begin(0.0)
    talk.receive(b"".join(line + b"\r\n" for line in (b"Grbl 1.1h ['$' for help]", *says)), 0.0)
    talk, small = held(small=small, talk=talk)
    assert talk.state is WireState.FAILED
    assert all(each in talk.why for each in words), talk.why
    assert (homing == 0.0) or "$22" not in talk.why
    assert "--home" not in talk.why or homing
    assert small.lines == []


def test_one_that_a_reset_locks_is_seen_before_anything_is_sent() -> None:
    """With hard limits and a closed switch it is locked behind each reset (protocol.c)."""

    class Locking(Small):
        def write(self, data: bytes, now: float) -> list[bytes]:
            self.locked = self.locked or b"\x18" in data
            return super().write(data, now)

    begins = [b"[MSG:Check Limits]", b"[MSG:'$H'|'$X' to unlock]"]
    small = Locking(settings={**LISTING, 22: 0.0}, begins=begins, closed="Z")
    talk, small = held(small=small)
    assert talk.state is WireState.FAILED
    assert "Check Limits" in talk.why
    assert "limit of Z" in talk.why
    assert small.lines == []


def test_a_locked_one_is_unlocked_where_that_is_asked_for() -> None:
    talk, small = held(small=Small(locked=True), manner=Manner(unlock=True))
    assert talk.state is WireState.FINISHED, talk.why
    assert small.lines == [b"$X", *(each.data.strip() for each in packets())]


@pytest.mark.parametrize(
    ("heard", "words"),
    [
        (b"", ["nothing answers", "--baud"]),
        (b"\x00\xe6\x98\x06\x9e\xf8\x80\xe6" * 9, ["is no text", "00 e6 98", "--baud"]),
        (b"start\r\necho:Marlin 1.1.9\r\necho: Last Updated\r\n", ["Marlin", "another firmware"]),
        (b"\r\nGrbl 0.9j ['$' for help]\r\n", ["Grbl 0.9j", "grbl 1.1"]),
        (b"\r\nGrblHAL 1.1f ['$' or '$HELP' for help]\r\n", ["GrblHAL 1.1f", "grbl 1.1"]),
        (b"\r\nSmoothie\r\nok\r\n", ["it says 'Smoothie ok'", "--baud"]),
        (b"\r\nGrbl 1.1h ['$' for help]\r\n", ["it does not answer any more"]),
    ],
)
def test_what_is_no_grbl_is_named(heard: bytes, words: list[str]) -> None:
    talk = GrblWire().conversation(packets(), TARGET.machine, PLAIN)
    talk.begin(0.0)
    talk.receive(heard, 0.5)
    while not talk.is_over:
        talk.tick(talk.next_s)
    assert talk.state is WireState.FAILED
    assert all(each in talk.why for each in words), talk.why
    assert talk.sent == 0


def test_switches_that_close_while_it_works_are_told() -> None:
    small, told = Small(), list[str]()

    def wish(talk: Conversation, now: float) -> None:
        small.closed = "Z" if talk.acknowledged >= 30 else ""

    talk, _ = held(small=small, wish=wish, told=told)
    assert talk.state is WireState.FINISHED
    assert told.count("it reports closed switches: limit of Z") == 1


def test_a_stop_of_the_program_is_said_once_though_reports_are_late() -> None:
    """A report that was asked for before ~ may say Hold behind it."""

    class Stopping(Small):
        def run(self, now: float) -> list[bytes]:
            said = super().run(now)
            self.held = self.held or (self.lines[-1:] == [b"M0"] and bool(said))
            return said

    program = b"G1X1F200\n(swap)\nM0\nG1X2\nG1X3\n"
    talk = GrblWire().conversation(packets(program), TARGET.machine, PLAIN)
    late, waits = list[bytes](), list[str]()

    def fault(number: int, line: bytes) -> list[bytes]:
        if not line.startswith(b"<") or not talk.sent:
            return [line]
        late.append(line)  # each report comes when the next one is due
        return [late.pop(0)] if len(late) > 1 else []

    def wish(talk: Conversation, now: float) -> None:
        if talk.state is WireState.WAITING:
            waits.append(talk.why)
            talk.resume(now)

    talk, small = held(fault, wish, small=Stopping(), talk=talk)
    assert talk.state is WireState.FINISHED, talk.why
    assert small.lines == [b"G1X1F200", b"M0", b"G1X2", b"G1X3"]
    assert waits == ["the program waits: swap"]


class Limited(Small):
    """With soft limits; `build` is its answer to $I."""

    build = b"[OPT:V,15,128]"

    def __init__(self, zero: tuple[float, float, float]) -> None:
        super().__init__(settings={**LISTING, 20: 1.0, 22: 1.0})
        self.zero, self.locked = zero, True

    def run(self, now: float) -> list[bytes]:
        if self.buffer.startswith(b"$I\n") and now >= self.next and not self.held:
            self.buffer = self.buffer[3:]
            return [b"[VER:1.1h.20190830:]", self.build, b"ok"]
        return super().run(now)


@pytest.mark.parametrize(
    ("zero", "build", "why"),
    [
        # The program goes to X 8.125, Y 6.375 and Z 5 from part zero; the travel is 200 mm.
        ((-9.0, -9.0, -9.0), b"[OPT:V,15,128]", ""),
        ((-8.125, -7.0, -5.0), b"[OPT:V,15,128]", ""),
        ((-8.0, -9.0, -9.0), b"[OPT:V,15,128]", "X would go to 0.125 on the machine"),
        ((-9.0, -9.0, -3.0), b"[OPT:V,15,128]", "Z would go to 2.000"),
        ((-9.0, -201.0, -9.0), b"[OPT:V,15,128]", "Y would go to -200.625"),
        ((1.0, 1.0, 1.0), b"[OPT:VZ,15,128]", ""),
    ],
)
def test_soft_limits_that_are_certain_are_found_before_anything_moves(
    zero: tuple[float, float, float], build: bytes, why: str
) -> None:
    reach = (0.125, 0.375, 5.0), (8.125, 6.375, 5.0)
    talk = GrblWire().conversation(packets(), TARGET.machine, Manner(home=True, reach_mm=reach))
    small = Limited(zero)
    small.build = build
    talk, small = held(small=small, talk=talk)
    assert talk.state is (WireState.FAILED if why else WireState.FINISHED), talk.why
    assert why in talk.why
    assert (b"$H" in small.lines) is not bool(why)


def test_the_reach_of_a_program_is_that_of_its_moves() -> None:
    """The reach leaves out the start and counts the bulge of arcs."""
    program = b"G21G90\nM3S900\nG0X10Y10Z5\nG1Z-1F100\nG2X20Y10I5J0F200\nG0Z5\n"
    one = consignment(program, TARGET, source="a")
    low, high = one.reach_mm or ((), ())
    assert low == pytest.approx((10.0, 10.0, -1.0), abs=1e-9)
    assert high == pytest.approx((20.0, 15.0, 5.0), abs=1e-9)
