"""Every flag with what is no number, too large, too small or too long: never exit 3, never a hang.

The small run is the default one; the wide one tries every flag of every command, and the ends of
the range of every number of every machine.
"""

import signal
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner

from camtool.cli.main import cli
from tests.cli import sweeping
from tests.cli.sweeping import BAD, DRAWING, WIDE, Ran, flags_of, ran, set_up
from tests.machine.numbers import DIALECTS, FILES, machine_numbers
from tests.machine.test_ranges import setting_of
from tests.waiting import HANG_S

FLAGS = list(flags_of())
SMALL = ("1e308", "9" * 5000)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The files that the commands work on; what all runs load is loaded once, by a first run."""
    made = tmp_path_factory.mktemp("sweep")
    set_up(made)
    words = ["post", str(made / DRAWING), "-t", "linuxcnc", "-o", str(made / "first.ngc")]
    for more in ([], ["--kind", "pocket", "--tool-diameter", "1", "--preview", f"{made}/p.svg"]):
        CliRunner().invoke(cli, [*words, *more], catch_exceptions=False)
    return made


def refuse_bad(runs: Iterator[Ran]) -> None:
    bad = [str(one) for one in runs if not one.fine]
    assert not bad, "\n".join(bad)


def test_the_flags_are_those_of_the_commands() -> None:
    commands = {flag.command for flag in FLAGS}
    assert commands == set(sweeping.BASES)
    assert len(FLAGS) > 400
    assert {"--peck", "--overlap", "--set", "--size"} <= {flag.name for flag in FLAGS}


POST = [flag for flag in FLAGS if flag.command == "post"]


@pytest.mark.parametrize("place", range(len(POST)), ids=[flag.name for flag in POST])
def test_numbers_too_large_are_refused_or_taken_by_post(place: int, folder: Path) -> None:
    """Thousands of digits are refused where numbers are read, which flags share: each fourth."""
    values = SMALL if place % 4 == 0 else SMALL[:1]
    refuse_bad(ran(POST[place].call(value), folder) for value in values)


@pytest.mark.parametrize(
    ("words", "named"),
    [
        ("--overlap 1e9", "overlap"),
        ("--overlap 1e4", "overlap"),
        ("--tool-diameter 1e9", "tool diameter"),
        ("--tool-diameter 1e9 --side outside", "tool diameter"),
        ("--kind drill --peck 1e-9mm --max-hole 9", "peck"),
        ("--kind drill --peck 1e-6mm --max-hole 9", "peck"),
        ("--scale 1e9", "scale"),
        ("--scale 1e5", "scale"),
        ("--fit 1e9x1e9", "fit"),
        ("--copies 2x2 --pitch 1e9x1e9", "pitch"),
        ("--copies 999999999x999999999 --pitch 1x1", "copies"),
        ("--allowance 1e9", "allowance"),
        ("--side outside --tabs 1e-300mm", "tab spacing"),
        ("--side outside --tabs 1e-6mm", "tabs"),
        ("--start 1e308,0", "start"),
        ("--origin 1e308,0", "origin"),
        ("--dwell 1e308 --kind drill", "dwell"),
        ("--spindle 1e308", "spindle"),
        ("--depth 1 --step-down 1e-5", "step"),
        ("--depth 1e-300", "depth"),
        (f"--colour {'9' * 5000}", "colour"),
        (f"--tool {'9' * 5000}", "tool"),
    ],
)
def test_what_would_never_end_is_refused_with_the_number_that_asks_for_it(
    words: str, named: str, folder: Path
) -> None:
    run = ran(["post", DRAWING, "-t", "linuxcnc", "-o", "never.ngc", *words.split()], folder)
    assert run.code == 2, str(run)
    assert named in run.said.partition("camtool: error: ")[2], str(run)
    assert not (folder / "never.ngc").exists()


def test_a_fault_and_a_hang_would_be_seen(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sweeping, "main", lambda: time.sleep(600.0))
    monkeypatch.setattr(sweeping, "HANG_S", 0.5)
    assert ran([], folder).code is None
    monkeypatch.setattr(sweeping, "CHEWED_S", 1)
    monkeypatch.setattr(sweeping, "main", lambda: sum(iter(int, 1)))
    monkeypatch.setattr(sweeping, "HANG_S", HANG_S)
    assert ran([], folder).code in (-signal.SIGXCPU, -signal.SIGKILL)
    monkeypatch.setattr(sweeping, "main", lambda: exit(3))
    assert not ran([], folder).fine
    monkeypatch.setattr(sweeping, "main", lambda: print("\x1b[31m"))
    assert "\x1b" in ran([], folder).said
    assert not ran([], folder).fine


@pytest.mark.slow
@pytest.mark.parametrize("flag", FLAGS, ids=lambda flag: f"{flag.command} {flag.name}")
def test_every_flag_of_every_command(flag: sweeping.Flag, folder: Path) -> None:
    values = WIDE if flag.command in ("post", "verify", "check") else BAD
    refuse_bad(ran(flag.call(value), folder) for value in values)


@pytest.mark.slow
@pytest.mark.parametrize("target", sorted(DIALECTS))
def test_every_number_of_a_machine_at_the_ends_of_its_range(target: str, folder: Path) -> None:
    base = ["post", DRAWING, "-t", target, "-o", "end.x", "--fit", "4x4mm", "--origin", "centre"]
    if target in FILES:
        base += ["--machine", str(FILES[target])]
    refuse_bad(
        ran([*base, "--set", setting_of(path, about, value)], folder)
        for path, about in machine_numbers(target).items()
        for value in (about.ge, about.le)
    )
