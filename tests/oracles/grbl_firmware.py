"""grbl's own firmware on this computer: its sources, compiled for the board of `grbl_board`.

GRBL_SOURCE names a checkout of github.com/gnea/grbl (1.1h), or its folder `grbl`.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from camtool.arrays import Floats, Ints
from camtool.target.twin import TwinTrace

BOARD = Path(__file__).parent / "grbl_board"
HEADERS = ("avr/io.h", "avr/pgmspace.h", "avr/interrupt.h", "avr/wdt.h", "util/delay.h")
OURS = {"eeprom.c"}
"""Files of grbl whose part the board plays."""

TICK_S = 1.0 / 16e6
FLAGS = ("-O1", "-Dmain=grbl_main", "-fcommon", "-w", "-fsingle-precision-constant", "-std=gnu99")
TICK = np.dtype([("at", "<u8"), ("steps", "<i4", 3), ("pwm", "<i4"), ("on", "<i4")])
TICK_OF_SESSION = np.dtype([*TICK.descr, ("slides", "<i4", 3)])

CHANGES: dict[str, tuple[tuple[str, str], ...]] = {
    "motion_control.c": (
        (
            r"(if \( plan_check_full_buffer\(\) \) \{ protocol_auto_cycle_start\(\);)",
            r"\1 board_wait();",
        ),
        (r"(if \(sys.abort\) \{ return\(GC_PROBE_ABORT\); \} // Check)", r"board_wait(); \1"),
    ),
    "protocol.c": (
        (
            r"(protocol_execute_realtime\(\);   // Check and execute run-time commands)",
            r"\1\n    if (plan_get_current_block() || sys.state == STATE_CYCLE) { board_wait(); }",
        ),
        (r"(\} while \(bit_isfalse\(sys_rt_exec_state,EXEC_RESET\)\))", r"board_wait(); \1"),
        (r"(while \(!\(sys.abort\)\) \{ protocol_exec_rt_system\(\);)", r"\1 board_wait();"),
        (r"while \(sys\.suspend\) \{", r"\g<0> board_resume();"),
        (r"(protocol_exec_rt_system\(\);)(\s*\}\s*\}\s*)$", r"\1 board_suspended();\2"),
    ),
    "limits.c": (
        (r"(st_prep_buffer\(\); // Check and prep)", r"board_wait(); \1"),
        (r"(\} while \( sys.state != STATE_IDLE \))", r"board_wait(); \1"),
    ),
    "serial.c": (
        (r"uint8_t serial_read\(\)", "uint8_t serial_read_ring()"),
        (r"(UCSR0B \|=  \(1 << UDRIE0\);)", r"\1 board_sent();"),
    ),
}
"""Where the main program waits, time goes on; elsewhere it takes none. Its answers are sent at
once."""


def source() -> Path | None:
    """The folder of its sources, None where nobody names it."""
    named = os.environ.get("GRBL_SOURCE")
    if named is None:
        return None
    folder = Path(named)
    return folder if (folder / "gcode.c").exists() else folder / "grbl"


@dataclass(frozen=True, eq=False)
class Ran:
    """The motion of a run: positions (N, 3) steps after each tick with a step, times (N,) s, the
    PWM of the spindle (N,), 0 while it is off; the time until it stood still, s; for each
    line the number of its error or 0, and where the parser stood after it, (L, 3) mm."""

    steps: Ints
    at_s: Floats
    pwm: Ints
    seconds: float
    errors: list[int]
    places: Floats


def built(folder: Path, *, smoothing: bool = True) -> Path:
    """The program, made in a folder."""
    origin = source()
    assert origin is not None
    work = folder / ("smooth" if smoothing else "plain")
    work.mkdir(parents=True)
    for header in HEADERS:
        (work / header).parent.mkdir(exist_ok=True)
        (work / header).touch()
    for file in origin.glob("*.[ch]"):
        text = file.read_text(encoding="utf-8")
        for pattern, instead in CHANGES.get(file.name, ()):
            text, count = re.subn(pattern, instead, text)
            assert count == 1, (file.name, pattern)
        if file.name == "config.h" and not smoothing:
            text = text.replace("#define ADAPTIVE_MULTI_AXIS_STEP_SMOOTHING", "//")
        if file.name not in OURS:
            (work / file.name).write_text(text, encoding="utf-8")
    for name in ("board.c", "board.h"):
        shutil.copyfile(BOARD / name, work / name)
    program = work / "grbl"
    files = sorted(each.name for each in work.glob("*.c"))
    command = ["gcc", *FLAGS, "-I.", "-include", "board.h", *files, "-lm", "-o", str(program)]
    subprocess.run(command, cwd=work, check=True)
    return program


def run(program: Path, data: bytes, settings: dict[str, float], folder: Path) -> Ran:
    """Run lines in the firmware, after settings such as {"$32": 1}, and return its events."""
    before = "".join(f"{name}={value:g}\n" for name, value in settings.items()).encode()
    (folder / "lines").write_bytes(before + data)
    done = subprocess.run(
        [program, folder / "lines", folder / "steps"], capture_output=True, check=True, timeout=600
    )
    errors, places, seconds, skip = list[int](), list[list[float]](), 0.0, len(settings)
    for line in done.stdout.decode("ascii").splitlines():
        if line.startswith("at "):
            places.append([float(word) for word in line.split()[2:]])
        elif line.startswith("end "):
            seconds = int(line.split()[1]) * TICK_S
        elif line.startswith("Grbl "):
            errors.clear()  # what it says of its empty memory
        elif line == "ok" or line.startswith("error:"):
            errors.append(0 if line == "ok" else int(line[6:]))
    ticks = np.fromfile(folder / "steps", dtype=TICK)
    return Ran(
        ticks["steps"].astype(np.int64),
        ticks["at"] * TICK_S,
        np.where(ticks["on"] > 0, ticks["pwm"], 0),
        seconds,
        errors[skip:],
        np.array(places[skip + 1 :]),
    )


# Sessions: bytes that come at their times, switches, and what grbl answers.


@dataclass(frozen=True)
class Sent:
    """Bytes that come so long after those before them, or (None) when grbl stands and nothing
    more would happen by itself."""

    data: bytes
    after_s: float | None = None


@dataclass(frozen=True)
class Switch:
    """A switch at X, Y, Z or P (the probe): closed while the true position of `axis` is not
    strictly between these, in steps from where the slides stand when the power comes on."""

    pin: str
    axis: int
    least: int = -(2**30)
    most: int = 2**30


@dataclass(frozen=True, eq=False)
class Played:
    """The results of a session: for what was sent before the first entry and for each entry, what
    grbl said until the next one and when that line began, s; positions (N, 3) steps after each
    tick that changed them, as grbl has them and as the slides truly are, when (N,) s; and the
    time at the end."""

    said: list[list[tuple[float, str]]]
    steps: Ints
    slides: Ints
    at_s: Floats
    seconds: float

    def text(self, entry: int) -> str:
        """All that was said after an entry; −1: before the first."""
        return "".join(text for _, text in self.said[entry + 1])


def factory(program: Path, folder: Path) -> Path:
    """An image of the memory as it is after the power came on for the first time."""
    image = folder / "factory"
    image.unlink(missing_ok=True)
    (folder / "script").write_text("", encoding="ascii")
    _run_session(program, image, folder)
    return image


def played(
    program: Path, image: Path, sent: Sequence[Sent], folder: Path, switches: Sequence[Switch] = ()
) -> Played:
    """Play a session from the power's coming on; the image stays as it is."""
    rows = [f"switch {each.pin} {each.axis} {each.least} {each.most}" for each in switches]
    for each in sent:
        when = "w" if each.after_s is None else f"t {round(each.after_s / TICK_S)}"
        rows.append(f"{when} {each.data.hex()}")
    (folder / "script").write_text("\n".join(rows) + "\n", encoding="ascii")
    copy = folder / "image"
    shutil.copyfile(image, copy)
    _run_session(program, copy, folder)
    said: list[list[tuple[float, str]]] = [[] for _ in range(len(sent) + 1)]
    seconds = 0.0
    for row in (folder / "answers").read_text(encoding="ascii").splitlines():
        words = row.split()
        if words[0] == "end":
            seconds = int(words[1]) * TICK_S
        else:
            text = bytes.fromhex(words[2]).decode("latin-1")
            said[int(words[0]) + 1].append((int(words[1]) * TICK_S, text))
    ticks = np.fromfile(folder / "steps", dtype=TICK_OF_SESSION)
    return Played(
        said,
        ticks["steps"].astype(np.int64),
        ticks["slides"].astype(np.int64),
        ticks["at"] * TICK_S,
        seconds,
    )


def _run_session(program: Path, image: Path, folder: Path) -> None:
    names = [image, folder / "script", folder / "answers", folder / "steps"]
    subprocess.run([program, *names], check=True, timeout=600)


class FirmwareLine:
    """The firmware at the other end of a line, as `camtool.sending.faults.WiredTwin` is a twin:
    with each write its session is played anew from the beginning, so that its answers come at its
    own times. `before`: lines that it has executed already; None: the power has just come on."""

    def __init__(
        self,
        program: Path,
        image: Path,
        folder: Path,
        switches: Sequence[Switch] = (),
        before: Sequence[str] | None = None,
    ) -> None:
        self._made = program, image, folder, switches
        self._writes: list[tuple[float, bytes]] = []
        self._answers: list[tuple[float, bytes]] = []
        self._read = self._skipped = 0
        self._begun_s, self._late_s = 0.0, 0.0
        self._ready_s: float | None = 0.0
        self._first = [Sent(b"", 0.0)]
        if before is not None:
            self._first = [Sent(b"\n"), *(Sent(f"{line}\n".encode()) for line in before)]
            self._ready_s, self._late_s = None, LATE_S
        self._play()
        if before is not None:
            self._begun_s = self.played.seconds - LATE_S  # bytes come later than they are told
            self._skipped, self._answers = len(self._answers), []

    def _play(self) -> None:
        program, image, folder, switches = self._made
        entries, last = list(self._first), self._ready_s
        for at, data in self._writes:
            entries.append(Sent(data, None if last is None else max(at - last, 0.0)))
            last = max(at, at if last is None else last) + (len(data) - 1) * BYTE_S
        self.played = played(program, image, entries, folder, switches)
        self._answers = [
            (at + self._late_s - self._begun_s, text.encode("latin-1"))
            for entry in self.played.said
            for at, text in entry
        ][self._skipped :]

    def connect(self, now: float) -> None:
        """The port resets nothing."""

    def unplugged(self, now: float) -> bool:
        """Never."""
        return False

    def write(self, data: bytes, now: float) -> None:
        """Send bytes to it."""
        self._writes.append((self._begun_s + now, data))
        self._play()

    def read(self, now: float) -> bytes:
        """Return the bytes that have come from it by now, since the last call."""
        come = [text for at, text in self._answers[self._read :] if at <= now]
        self._read += len(come)
        return b"".join(come)

    def next_s(self) -> float | None:
        """Time at which it says something next by itself."""
        return self._answers[self._read][0] if self._read < len(self._answers) else None

    wake_s = next_s

    def has_written(self, data: bytes) -> bool:
        """True if these bytes were sent to it in one piece."""
        return any(data == each for _, each in self._writes)

    def has_read(self, start: bytes) -> bool:
        """True if an answer that begins like this has been read."""
        return any(text.startswith(start) for _, text in self._answers[: self._read])

    def way_mm(self, since: float) -> float:
        """Return the longest way of a slide from then on."""
        at, slides = self.played.at_s, self.played.slides
        begin = int(np.searchsorted(at, since, side="right"))
        before = slides[begin - 1] if begin else np.zeros(3, dtype=np.int64)
        steps = np.abs(np.diff(slides[begin:], axis=0, prepend=before[None, :]))
        return float(steps.sum(axis=0).max(initial=0.0)) / STEPS_PER_MM

    def stood_s(self) -> float:
        """Return the time of its last step."""
        return float(self.played.at_s[-1]) if len(self.played.at_s) else 0.0


STEPS_PER_MM = 250
BYTE_S = 1389 / 16e6
"""What a byte takes on the line, in ticks of the board."""
LATE_S = 0.001
"""What it says is heard so much later."""


# The firmware as a virtual controller, on a line with faults, a pseudo-terminal or none.


class FirmwareSlides:
    """The slides of the firmware's machine, as `camtool.target.twin.Slides` shows those of a
    twin."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self.commanded_mm: Floats = np.zeros(3)

    @property
    def trace(self) -> TwinTrace:
        """All that they have done, by the pulses of the step pins."""
        ticks = np.fromfile(self._file, dtype=TICK_OF_SESSION)
        places = ticks["slides"].astype(np.float64) / STEPS_PER_MM
        block = np.full(len(places), -1, dtype=np.int64)
        return TwinTrace(ticks["at"] * TICK_S, block, places, places)


class FirmwareTwin:
    """The firmware in the place of a `camtool.target.twin.Twin`: its caller moves its clock. Its
    board is not reset when the port is opened. `settings` are sent to it first."""

    wire = "115200 8N1"
    byte_s = BYTE_S

    def __init__(
        self,
        program: Path,
        folder: Path,
        settings: Sequence[str] = (),
        switches: Sequence[Switch] = (),
    ) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        rows = [f"switch {each.pin} {each.axis} {each.least} {each.most}\n" for each in switches]
        (folder / "switches").write_text("".join(rows), encoding="ascii")
        names = [folder / "memory", folder / "switches", folder / "live-steps"]
        self.process = subprocess.Popen(
            [program, *names], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        self.slides = FirmwareSlides(folder / "live-steps")
        self.received = bytearray()
        """All bytes that it was sent."""
        self.now, self._busy = 0.0, False
        self._answer()
        for line in settings:
            self.receive(f"{line}\n".encode(), self.now)
            self.advance(self.now + 0.05)

    @property
    def is_moving(self) -> bool:
        """True while the timer of its steps runs, or it is not idle."""
        return self._busy

    def connect(self, now: float) -> bytes:
        """Open the line, which resets nothing."""
        return self.advance(now)

    def receive(self, data: bytes, now: float) -> bytes:
        """Receive bytes at a time; return what it says until then and at once."""
        self.received += data
        self.now = max(now, self.now)
        assert self.process.stdin is not None
        self.process.stdin.write(b"%d %s\n" % (round(self.now / TICK_S), data.hex().encode()))
        self.process.stdin.flush()
        return self._answer()

    def advance(self, now: float) -> bytes:
        """Let time pass."""
        return self.receive(b"", now)

    def wake_s(self) -> float | None:
        """It may say something at any time while it is busy: it is asked every millisecond."""
        return self.now + 0.001 if self._busy else None

    next_s = wake_s

    def _answer(self) -> bytes:
        assert self.process.stdout is not None
        x, y, z, busy, said = self.process.stdout.readline().split()
        self.slides.commanded_mm = np.array([int(x), int(y), int(z)]) / STEPS_PER_MM
        self._busy = bool(int(busy))
        return b"" if said == b"-" else bytes.fromhex(said.decode())

    def close(self) -> None:
        """End the process."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.close()
        self.process.wait()
        self.process.stdout.close()
