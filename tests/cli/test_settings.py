"""`camtool settings` and `camtool ports --ask`, on virtual machines and on a faulty one."""

from __future__ import annotations

import json
import os
import pty
import threading
import tty
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
from camtool_postprocessors.grbl.twin import GrblTwin

from camtool.sending.faults import Faults, WiredTwin
from camtool.sending.twin import Clock, PseudoTerminal, TcpPort, serve
from camtool.target.registry import load_target
from camtool.target.twin import Twin
from tests.commands import run_camtool
from tests.sending.test_ends import Over, hosted

SPEED = 20.0


def run(*words: str) -> tuple[int, str, str]:
    done = run_camtool(*words)
    return done.returncode, done.stdout, done.stderr


def grbl(*choices: str) -> GrblTwin:
    twin = load_target("grbl").twin(choices)
    assert isinstance(twin, GrblTwin)
    return twin


def at(port: str) -> list[str]:
    return ["-t", "grbl", "--port", port]


@pytest.mark.parametrize("homing", ["off", "on"])
def test_settings_are_read_with_their_meaning_though_it_is_locked(homing: str) -> None:
    with hosted(grbl(f"homing={homing}"), SPEED) as port:
        code, shown, said = run("settings", "read", *at(port))
        assert code == 0, said
        assert "$110=500.000  X: highest rate, mm/min" in shown
        code, shown, said = run("settings", "read", *at(port), "--json")
    assert code == 0, said
    rows = {row["setting"]: row for row in json.loads(shown)}
    assert len(rows) == 34
    assert rows["$22"] == {"setting": "$22", "value": str(int(homing == "on")), "means": "homing"}


def test_they_are_compared_backed_up_and_restored(tmp_path: Path) -> None:
    kept, wanted = tmp_path / "kept.txt", tmp_path / "wanted.txt"
    twin = grbl()
    with hosted(twin, SPEED) as port:
        assert run("settings", "compare", *at(port))[0] == 0
        assert run("settings", "backup", str(kept), *at(port))[0] == 0
        text = kept.read_text()
        assert text.splitlines()[0] == "$0=10"
        changed = text.replace("$110=500.000", "$110=800").replace("$20=0", "$20=1")
        wanted.write_text(changed.replace("$22=0", "$22=1"))
        # Without a yes nothing is written; with it homing comes before the soft limits.
        code, _, said = run("settings", "restore", str(wanted), *at(port))
        assert code != 0
        assert "$110: 500.000 becomes 800  X: highest rate, mm/min" in said
        assert twin._memory.settings[110] == 500.0
        code, _, said = run("settings", "restore", str(wanted), *at(port), "--yes")
        assert code == 0, said
        assert "3 written and read back" in said
        assert [twin._memory.settings[n] for n in (20, 22, 110)] == [1.0, 1.0, 800.0]
        code, _, said = run("settings", "compare", *at(port))
        assert code == 1
        assert "$110 is 800.000, but axes.x.max_rate_mm_min" in said
        assert run("settings", "restore", str(kept), *at(port), "--yes")[0] == 0
        code, _, said = run("settings", "restore", str(kept), *at(port), "--yes")
        assert (code, "nothing differs" in said) == (0, True)
    assert [twin._memory.settings[n] for n in (20, 22, 110)] == [0.0, 0.0, 500.0]
    code, _, said = run("settings", "compare", str(wanted), "-t", "grbl")
    assert code == 1
    assert "$110 is 800.000" in said


def test_the_ini_of_linuxcnc_is_compared(tmp_path: Path) -> None:
    ini = Path(__file__).parents[1] / "oracles" / "headless" / "machine.ini"
    code, _, said = run("settings", "compare", str(ini), "-t", "linuxcnc")
    assert code == 1
    assert "MAX_LIMIT of [AXIS_X] means 2000" in said
    same = tmp_path / "same.ini"
    text = ini.read_text()
    for low, high in (("-1000", "1000"),):
        text = text.replace(f"MIN_LIMIT = {low}", "MIN_LIMIT = 0").replace(
            f"MAX_LIMIT = {high}", "MAX_LIMIT = 508"
        )
    same.write_text(text)
    code, _, said = run("settings", "compare", str(same), "-t", "linuxcnc")
    assert "AXIS_X" not in said, said
    assert code == 1
    assert "axes.z.travel_mm" in said


CHANGES = "$110=800\n$111=700\n$121=20\n"


def restored(twin: Twin, tmp_path: Path, text: str = CHANGES) -> tuple[int, str]:
    file = tmp_path / "wanted.txt"
    file.write_text(text)
    with hosted(twin, SPEED) as port:
        code, _, said = run("settings", "restore", str(file), *at(port), "--yes")
    return code, said


def test_a_setting_that_is_refused_says_what_was_written(tmp_path: Path) -> None:
    loaded = load_target("grbl")

    class Refusing(GrblTwin):
        def _command(self, text: str) -> Any:
            if text.startswith("$111="):
                return self._refuse_setting()
            return super()._command(text)

        def _refuse_setting(self) -> Any:
            self._say("error:3\r\n")
            return
            yield

    twin = Refusing(loaded.machine, loaded.target.twin_kind().settings())
    code, said = restored(twin, tmp_path)
    assert code == 1, said
    assert "error:3 to $111=700" in said
    assert "taken: $110=800; not, or not for certain: $111=700, $121=20" in said
    assert [twin._memory.settings[n] for n in (110, 111, 121)] == [800.0, 500.0, 10.0]


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("$110=fast\n", "line 1"),
        ("$110=nan\n", "is no setting"),
        ("$110=800\n$110=700\n", "given twice"),
        ("G0 X1\n", "is no setting"),
        ("$999=1\n", "$999: the controller has no such setting"),
        ("ok\n", "has no settings"),
    ],
)
def test_files_that_are_no_settings_are_refused(text: str, named: str, tmp_path: Path) -> None:
    twin = grbl()
    code, said = restored(twin, tmp_path, text)
    assert code == 2
    assert named in said
    assert not any(line.startswith(b"$1") for line in twin.commands)


def test_a_port_that_vanishes_says_what_is_not_certain(tmp_path: Path) -> None:
    file = tmp_path / "wanted.txt"
    file.write_text("".join(f"${n}=123\n" for n in (110, 111, 112, 120, 121, 122, 130, 131, 132)))
    twin, port = grbl(), PseudoTerminal()
    over = threading.Event()

    def look() -> None:
        if over.is_set() or twin._memory.settings[120] == 123.0:
            raise Over

    def host() -> None:
        with suppress(Over):
            serve(WiredTwin(twin), port, Clock(SPEED), each=look)
        port.close()

    thread = threading.Thread(target=host)
    thread.start()
    code, _, said = run("settings", "restore", str(file), *at(port.name), "--yes")
    over.set()
    thread.join()
    assert code == 1, said
    assert "taken: $110=123, $111=123, $112=123" in said
    assert "not, or not for certain: $1" in said


def test_a_garbled_line_gives_no_settings() -> None:
    twin, port, over = grbl(), PseudoTerminal(), threading.Event()

    def look() -> None:
        if over.is_set():
            raise Over

    def host() -> None:
        with suppress(Over):
            wired = WiredTwin(twin, Faults(), Faults.of("garble=0.02"), seed=1)
            serve(wired, port, Clock(SPEED), each=look)
        port.close()

    thread = threading.Thread(target=host)
    thread.start()
    code, shown, said = run("settings", "read", *at(port.name))
    over.set()
    thread.join()
    assert code == 2, said
    assert not shown


def test_other_machines_say_that_they_have_none() -> None:
    code, _, said = run("settings", "read", "-t", "pic-mmh", "--port", "/dev/null")
    assert code == 2
    assert "no settings that can be read over its line" in said


# What is behind a port.


@contextmanager
def talking(answer: bytes) -> Iterator[tuple[str, list[bytes]]]:
    """A port at which something answers all that comes by this; what has come."""
    master, slave = pty.openpty()
    tty.setraw(slave)
    come: list[bytes] = []

    def talk() -> None:
        with suppress(OSError):
            while data := os.read(master, 100):
                come.append(data)
                os.write(master, answer)

    thread = threading.Thread(target=talk, daemon=True)
    thread.start()
    try:
        yield os.ttyname(slave), come
    finally:
        os.close(slave)
        thread.join(5.0)
        os.close(master)


def asked(port: str) -> dict[str, Any]:
    code, shown, said = run("ports", "--ask", port, "--json")
    assert code == 0, said
    [row] = [row for row in json.loads(shown) if row["name"] == port]
    return dict(row)


def test_a_grbl_is_recognised_and_nothing_moves() -> None:
    twin = grbl()
    with hosted(twin, SPEED) as port:
        row = asked(port)
        code, shown, _ = run("ports", "--ask", port)
    [answer] = row["answers"]
    assert answer["controller"] == "Grbl 1.1h: it stands, and nothing waits"
    assert set(answer["sent"].split()) == {"3f"}
    assert answer["baud"] == 115200
    assert code == 0
    assert f"at 115200 baud, sent {answer['sent'].split()[0]}" in shown
    assert not twin.decoded
    assert not twin.slides.drain().slide.any()


def test_a_linuxcnc_is_recognised_at_its_socket() -> None:
    twin, port, over = load_target("linuxcnc").twin(), TcpPort("127.0.0.1", 0), threading.Event()

    def look() -> None:
        if over.is_set():
            raise Over

    def host() -> None:
        with suppress(Over):
            serve(WiredTwin(twin), port, Clock(1.0), each=look)
        port.close()

    thread = threading.Thread(target=host)
    thread.start()
    try:
        answers = asked(port.name)["answers"]
    finally:
        over.set()
        thread.join()
    assert answers[-1]["controller"] == "LinuxCNC (linuxcncrsh)"
    assert not twin.commands


@pytest.mark.parametrize(
    ("answer", "controller", "words"),
    [
        (b"echo:Marlin 2.1\n", "", "it says 'echo:Marlin 2.1"),
        (b"", "", "nothing answers"),
        (b"\x80\x00\xff", "", "it says"),
    ],
)
def test_what_is_no_known_controller(answer: bytes, controller: str, words: str) -> None:
    with talking(answer) as (port, come):
        [row] = asked(port)["answers"]
        code, shown, _ = run("ports", "--ask", port)
    assert row["controller"] == controller
    assert b"".join(come).strip(b"?") == b""
    assert code == 0
    assert words in shown
    assert "\x00" not in shown


def test_a_port_that_is_not_there() -> None:
    code, shown, said = run("ports", "--ask", "/dev/no-such-port")
    assert code == 0, said
    assert "not asked: the port cannot be opened" in shown
    assert run("ports", "/dev/no-such-port")[0] == 2
