"""The command `camtool`: the group, and the one place where errors become exit codes.

0 fine · 1 the job has findings of severity error · 2 wrong use or bad input · 3 a fault of ours ·
130 interrupted · 141 the reader of stdout has gone."""

from __future__ import annotations

import atexit
import errno
import gc
import io
import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from typing import NoReturn, TextIO

import click

from camtool.cli import COMPLETE
from camtool.cli.life_signs import life_signs
from camtool.cli.messages import say, say_error
from camtool.errors import CamtoolError, InputError, OutputError
from camtool.version import __version__

EXIT_BAD_INPUT = 2
EXIT_FAULT = 3
EXIT_INTERRUPTED = 128 + signal.SIGINT
EXIT_PIPE = 128 + 13
"""The exit code that a shell gives for SIGPIPE, by which other tools end; not all systems have
it."""

AGAIN_S = 0.01
"""Time after which a lost interruption is repeated."""

_FULL = (errno.ENOSPC, errno.EBADF, errno.EIO, errno.EFBIG)
"""Errors of a full or closed stream, which name no file."""

BLAS_THREADS = "OPENBLAS_NUM_THREADS"
"""The environment variable with the number of threads that numpy's linear algebra starts when it
is loaded. Waiting threads take 20 to 40 ms of every command on two cores, and our matrices are
small, so one is enough. With one, sums have the same order on every machine."""

GARBAGE_AFTER = 150_000
"""Number of objects made and not freed after which Python looks for cycles of garbage. Its default
of 700 suits programs that run long; loading the libraries and reading a small DXF, which need no
search, make fewer than this."""


COMMANDS = {
    "batch": "Many drawings to verified programs.",
    "calibrate": "A machine's numbers from measured coupons.",
    "check": "What is in a drawing.",
    "completion": "Completion for bash, zsh or fish.",
    "console": "Type to a controller.",
    "convert": "A program of one machine as that of another.",
    "coupon": "Drawings to cut and measure.",
    "draw": "A page to draw a figure on.",
    "diff": "What two programs or jobs cut differently.",
    "explain": "Each block of a program in words.",
    "filter": "LinuxCNC opens a drawing.",
    "home": "Home a machine.",
    "init": "A machine file of your own.",
    "inkscape": "Save and check programs from Inkscape.",
    "job": "Job files: begin one, or see what one says.",
    "jog": "Move a machine by so much.",
    "lint": "Faults of programs, without simulating them.",
    "measure": "Depths of the stock after a program.",
    "meet": "What would make its dimensions hold.",
    "panel": "A page that moves the machine.",
    "ports": "List the serial ports.",
    "post": "Drawing to verified program.",
    "preview": "Picture of a drawing, toolpath or program.",
    "probe": "Measure the top of the blank.",
    "send": "Send a program to its machine.",
    "servo": "Servo axes: their motors, and the gains of their loops.",
    "settings": "A controller's own settings: read, compare, restore.",
    "signals": "Step lines, coils and port bytes over time.",
    "stale": "Programs that are out of date.",
    "targets": "The machines, and everything about one.",
    "tolerances": "Dimensions and their limits: begin a file, or see what one says.",
    "tools": "The tools that jobs may name.",
    "touch": "Touch off an edge, a corner, a bore or a plate.",
    "twin": "A virtual machine at a port.",
    "unlock": "Unlock a controller.",
    "verify": "Simulate and judge a program.",
    "zero": "Make this place part zero.",
}
"""The commands with their lines in the help, which is shown without importing them. Each is a
function of the same name in a module of the same name, and the line is its short help."""


class _Commands(click.Group):
    """The group of `COMMANDS`, each of which is imported when it is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of all commands."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return the command of this name. For an unknown name return None and load all commands,
        from which click suggests a similar one."""
        for name in [cmd_name] if cmd_name in COMMANDS else COMMANDS:
            if name not in self.commands:
                self.add_command(getattr(import_module(f"camtool.cli.{name}"), name))
        return super().get_command(ctx, cmd_name)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of the commands."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@click.group(
    cls=_Commands,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
@click.version_option(__version__, prog_name="camtool")
def cli() -> None:
    """Drawings in, the exact program of your machine out, its error known beforehand.

    \b
    camtool check   logo.dxf                    what is in the drawing
    camtool post    logo.dxf --target pic-mmh   drawing to verified program
    camtool verify  logo.pic --target pic-mmh   judge any program of a machine
    camtool explain logo.pic -t pic-mmh         each block in words
    camtool lint    parts/*.nc -t grbl          faults of programs, without simulating
    camtool batch   drawings/ -t pic-mmh -o build/   many, those that have changed
    camtool convert logo.pic --from pic-mmh --to grbl
    camtool preview logo.dxf -o logo.svg        picture of a drawing or program
    camtool signals logo.pic -t pic-mmh -o logo.vcd   its coils over time, for GTKWave
    camtool send    logo.pic -t pic-mmh --port /dev/ttyUSB0
    camtool panel   logo.pic -t pic-mmh --port /dev/ttyUSB0   the same, from a page
    camtool ports                               where machines may be
    camtool touch   corner -t grbl …            part zero, by a probe
    camtool settings read -t grbl …             what a controller keeps
    camtool probe   logo.nc -t grbl --port /dev/ttyUSB0   the top of the blank, for --surface
    camtool home, jog, zero, unlock             a machine moved by hand
    camtool console grbl /dev/ttyUSB0           type to a controller
    camtool filter  logo.dxf                    LinuxCNC opens the drawing
    camtool stale   drawings/ -t pic-mmh        programs that are out of date
    camtool job new logo.dxf                    a job file to fill in, from its layers
    camtool targets                             the machines it knows
    camtool tolerances new logo.dxf             its dimensions, to give limits to
    camtool meet logo.dxf --tolerances FILE     what would make them hold
    camtool tools                               the tools that jobs may name
    camtool init                                a machine file of your own, by questions
    camtool coupon  lines -o coupon.dxf         a drawing to cut and measure
    camtool calibrate lengths.toml -t pic-mmh   the machine's numbers from what was measured

    Lengths take units: 0.2mm, 1/8in, 200um; bare numbers are mm. Every command has --help."""


def main() -> NoReturn:
    """Run the command line; never returns. Every error is one line on stderr."""
    _keep_streams()
    _collect_seldom()
    os.environ.setdefault(BLAS_THREADS, "1")
    sys.unraisablehook = _repeat_interrupt
    if COMPLETE in os.environ:
        from camtool.cli.completion import answer_shells

        answer_shells(cli)
    code = _exit_code(debug="--debug" in sys.argv[1:])
    # All is done: an interruption now would only show a traceback while Python ends.
    with suppress(ValueError):  # not in the main thread
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    _flush(sys.stdout)
    _flush(sys.stderr)
    sys.exit(code)


def _exit_code(*, debug: bool) -> int:
    """Run the command line and return its exit code."""
    try:
        with life_signs(sys.stderr, sys.argv[1:]) as signs, _system_errors():
            code = cli.main(prog_name="camtool", standalone_mode=False, obj=signs)
            if sys.stdout is not None:
                sys.stdout.flush()
        return code if isinstance(code, int) else 0
    except SystemExit:
        if COMPLETE in os.environ:  # the shell has its answer
            raise
        return EXIT_PIPE  # what click makes of EPIPE
    except click.ClickException as error:
        text = io.StringIO()
        error.show(text)
        for line in text.getvalue().splitlines():
            say(line)
        return EXIT_BAD_INPUT
    except (click.Abort, KeyboardInterrupt):
        say("camtool: interrupted; written files are complete")
        return EXIT_INTERRUPTED
    except CamtoolError as error:
        _trace(debug)
        say_error(error)
        return error.exit_code
    except BrokenPipeError:  # the reader of our stdout has gone: no message, as with other tools
        return EXIT_PIPE
    except Exception as error:
        _trace(debug)
        say(
            f"camtool: fault in camtool itself ({type(error).__name__}: {error}); "
            "please report it with the output of the same command with --debug"
        )
        return EXIT_FAULT


@contextmanager
def _system_errors() -> Iterator[None]:
    """Convert exceptions of the operating system in the block to camtool's errors, which name the
    file."""
    try:
        yield
    except OSError as error:
        if error.filename is None and error.errno in _FULL:
            raise OutputError(f"cannot be written ({error.strerror})", file="<stdout>") from error
        if error.filename is None or isinstance(error, CamtoolError):
            raise
        # A file name that the system refuses anywhere: too long, a loop of links.
        name = os.fsdecode(error.filename)
        raise InputError(f"cannot be used ({error.strerror})", file=name) from error


def _trace(debug: bool) -> None:
    if debug:
        import traceback

        for line in traceback.format_exc().splitlines():
            say(line)


def _keep_streams() -> None:
    """Open /dev/null in place of closed standard streams, so that no file gets their descriptors
    and with them the messages. Show characters that the terminal lacks as escapes."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # gets the lowest free number, which is this one
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")


def _flush(stream: TextIO | None) -> None:
    """Flush a stream; drop data that it does not accept, so that Python does not try again."""
    if stream is None:
        return
    try:
        stream.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _repeat_interrupt(hook_args: sys.UnraisableHookArgs) -> None:
    """Repeat a Ctrl-C that came where Python cannot raise it (while an object is deleted)."""
    if issubclass(hook_args.exc_type, KeyboardInterrupt):
        # Not in here: it would be lost as well.
        threading.Timer(AGAIN_S, os.kill, (os.getpid(), signal.SIGINT)).start()
    else:
        sys.__unraisablehook__(hook_args)


def _collect_seldom() -> None:
    """Set the garbage collector to run seldom, and never at exit: most commands are short."""
    gc.set_threshold(GARBAGE_AFTER)
    atexit.register(gc.freeze)
