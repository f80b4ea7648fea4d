"""The command `camtool`: the group, and the one place where errors become exit codes.

0 fine · 1 the job has findings of severity error · 2 wrong use or bad input · 3 a fault of ours.
"""

from __future__ import annotations

import atexit
import gc
import os
import signal
import sys
import traceback
from typing import NoReturn

import click

from camtool import __version__
from camtool.cli.batch import batch
from camtool.cli.calibrate import calibrate
from camtool.cli.check import check
from camtool.cli.completion import VARIABLE, completion, values_told
from camtool.cli.convert import convert
from camtool.cli.coupon import coupon
from camtool.cli.filter import filter_command
from camtool.cli.job import job
from camtool.cli.post import post
from camtool.cli.preview import preview
from camtool.cli.shells import take_over
from camtool.cli.stale import stale
from camtool.cli.talk import say_error
from camtool.cli.targets import targets
from camtool.cli.verify import verify
from camtool.errors import CamtoolError

EXIT_BAD_INPUT = 2
EXIT_FAULT = 3
EXIT_INTERRUPTED = 128 + signal.SIGINT

GARBAGE_AFTER = 50_000
"""So many more objects made than freed before Python looks for rings of garbage among them; its
own 700 is for programs that live long. Loading the libraries makes half a million that stay."""


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="camtool")
def cli() -> None:
    """Drawings in, the exact program of your machine out, its error known beforehand.

    \b
    camtool check   logo.dxf                    what is in the drawing
    camtool post    logo.dxf --target pic-mmh   drawing to verified program
    camtool verify  logo.pic --target pic-mmh   judge any program of a machine
    camtool batch   drawings/ -t pic-mmh -o build/   many, those that have changed
    camtool convert logo.pic --from pic-mmh --to grbl
    camtool preview logo.dxf -o logo.svg        picture of a drawing or program
    camtool filter  logo.dxf                    LinuxCNC opens the drawing
    camtool stale   drawings/ -t pic-mmh        programs that are not of their drawings now
    camtool job new logo.dxf                    a job file to fill in, from its layers
    camtool targets                             the machines it knows
    camtool coupon  lines -o coupon.dxf         a drawing to cut and measure
    camtool calibrate lengths.toml -t pic-mmh   the machine's numbers from what was measured

    Lengths take units: 0.2mm, 1/8in, 200um; bare numbers are mm. Every command has --help.
    """


for _command in (post, batch, verify, convert, preview, check, job, targets, coupon, calibrate):
    cli.add_command(_command)
cli.add_command(filter_command)
cli.add_command(stale)
cli.add_command(completion)


def main() -> NoReturn:
    """Run the command line; never returns. One line on stderr for every error."""
    _seldom_collected()
    debug = "--debug" in sys.argv[1:]
    if VARIABLE in os.environ:
        values_told(cli)
        take_over()
    try:
        code = cli.main(prog_name="camtool", standalone_mode=False)
        sys.exit(code if isinstance(code, int) else 0)
    except click.exceptions.Exit as stop:
        sys.exit(stop.exit_code)
    except click.ClickException as error:
        error.show()
        sys.exit(EXIT_BAD_INPUT)
    except (click.Abort, KeyboardInterrupt):
        click.echo("camtool: interrupted; nothing was written", err=True)
        sys.exit(EXIT_INTERRUPTED)
    except CamtoolError as error:
        if debug:
            traceback.print_exc()
        say_error(error)
        sys.exit(error.exit_code)
    except BrokenPipeError:
        # The reader of our stdout went away; say nothing when Python flushes at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)
    except Exception as error:
        if debug:
            traceback.print_exc()
        click.echo(
            f"camtool: fault in camtool itself ({type(error).__name__}: {error}); "
            "please report it with the output of the same command with --debug",
            err=True,
        )
        sys.exit(EXIT_FAULT)


def _seldom_collected() -> None:
    """Spare a short run the search for garbage: seldom in between, and not at all at its end."""
    gc.set_threshold(GARBAGE_AFTER)
    atexit.register(gc.freeze)
