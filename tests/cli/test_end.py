"""How a process of the command line ends: at once, but not before all that waits for its end."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
RUN = "import sys; sys.argv = ['camtool', *sys.argv[1:]]; from camtool.__main__ import run"


def ended(code: str, *arguments: str, flags: tuple[str, ...] = ()) -> tuple[int, str, str]:
    """Return exit code, stdout and stderr of Python with this code, in a pipe."""
    command = [sys.executable, *flags, "-c", f"{RUN}; {code}", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)
    return done.returncode, done.stdout, done.stderr


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (("check", "samples/logo.dxf", "-q"), 0),
        (("check", "samples/none.dxf", "-q"), 2),
        (
            ("post", "samples/logo.dxf", "-t", "grbl", "--max-error", "0.001um", "-o", os.devnull),
            1,
        ),
    ],
)
def test_codes_and_output_are_those_of_main(arguments: tuple[str, ...], code: int) -> None:
    quick = ended("run()", *arguments)
    assert quick[0] == code
    assert quick == ended("from camtool.cli.main import main; main()", *arguments)


def test_what_is_registered_for_the_end_is_done_and_its_output_written() -> None:
    code = "import atexit; atexit.register(lambda: print('at the end')); run()"
    returned, stdout, _ = ended(code, "--version")
    assert returned == 0
    assert stdout.splitlines()[-1] == "at the end"


def test_modules_are_not_taken_apart() -> None:
    taken = "class Taken:\n    def __del__(self): print('taken apart')\nit = Taken()\n"
    code = f"exec({taken!r}); run()"
    assert "taken apart" not in ended(code, "--version")[1]
    assert "taken apart" in ended(code.replace("run()", "pass"))[1]


@pytest.mark.parametrize(
    "watcher",
    [
        "sys.setprofile(lambda *_: None)",
        "sys.settrace(lambda *_: None)",
        "import threading, time; threading.Thread(target=lambda: time.sleep(0.2)).start()",
    ],
)
def test_a_process_that_is_watched_ends_as_any_other(watcher: str) -> None:
    code = f"{watcher}\ntry:\n    run()\nexcept SystemExit as end:\n    print('ended', end.code)"
    returned, stdout, _ = ended(f"exec({code!r})", "--version")
    assert returned == 0
    assert stdout.splitlines()[-1] == "ended 0"


def test_python_that_stays_gets_its_prompt() -> None:
    command = [sys.executable, "-i", "-m", "camtool", "--version"]
    done = subprocess.run(
        command, input="print(6 * 7)\n", capture_output=True, text=True, cwd=ROOT, check=False
    )
    assert "42" in done.stdout
