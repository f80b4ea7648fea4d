"""What a command says to people: always on stderr, so that stdout stays for machines."""

from __future__ import annotations

import os
import re
import sys
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import click

from camtool.plain import one_line

if TYPE_CHECKING:
    from collections.abc import Iterable

    from camtool.errors import CamtoolError
    from camtool.findings import Finding


COLOURS = {"error": "red", "warning": "yellow", "info": "cyan"}
"""What a message is called, on a terminal."""


def say(text: str, *, quiet: bool) -> None:
    """One message, unless quiet: one line that can be seen, whatever names it holds."""
    if not quiet:
        _tell(tinted(one_line(text)))


def show_text(text: str, *, err: bool = False) -> None:
    """Lines for people on stdout, styled or not, whose names `one_line` has gone through."""
    if err:
        _tell(text)
    else:
        click.echo(text)


def _tell(text: str) -> None:
    """Text on stderr; where that is full nobody can be told so."""
    with suppress(OSError):
        click.echo(text, err=True)


def in_colour(stream: TextIO | None) -> bool:
    """Whether a stream is a terminal of somebody who has said neither NO_COLOR (no-color.org)
    nor CLICOLOR=0 (bixense.com/clicolors); one that was closed is None."""
    said = os.environ.get
    return (
        stream is not None
        and stream.isatty()
        and not said("NO_COLOR")
        and said("CLICOLOR") != "0"
        and said("TERM") != "dumb"
    )


def say_error(error: CamtoolError) -> None:
    """One line for what went wrong; how to mend it stands out on a terminal."""
    text, mend = one_line(f"camtool: error: {error}"), one_line(" ".join(error.mend.split()))
    if mend and text.endswith(mend) and in_colour(sys.stderr):
        text = text.removesuffix(mend) + click.style(mend, bold=True)
    _tell(tinted(text))


def tinted(text: str) -> str:
    """A message with the word that says how bad it is in colour, where stderr shows colours."""
    if not in_colour(sys.stderr):
        return text
    words = "|".join(COLOURS)
    return re.sub(
        rf"^(camtool: )({words})\b",
        lambda found: found[1] + click.style(found[2], fg=COLOURS[found[2]], bold=True),
        text,
    )


def say_findings(findings: Iterable[Finding], *, quiet: bool, verbose: bool) -> None:
    """Errors always, warnings unless quiet, remarks when verbose; one line each, and one for all
    that are like those before, unless verbose."""
    from camtool.findings import Severity, summed

    least = Severity.ERROR if quiet else Severity.INFO if verbose else Severity.WARNING
    told = [finding for finding in findings if finding.severity >= least]
    for finding, more in [(each, 0) for each in told] if verbose else summed(told):
        say(f"camtool: {finding}", quiet=False)
        if more:
            name = f"{finding.severity.name.lower()} {finding.code.name}"
            say(f"camtool: {name}: and {more} more (-v shows all)", quiet=False)


def say_first_run(*, quiet: bool, judging: bool = False) -> None:
    """A word before the long silence of the first run; `judging` as below."""
    if first_run(judging=judging):
        say("camtool: first run: compiling the kernels, once, for some 12 s", quiet=quiet)


def first_run(*, judging: bool = False) -> bool:
    """Whether no kernel has been compiled yet; with `judging`, none of the judge's: most of the
    time goes there, and reading a drawing compiles others.

    Their compiled form lies beside them or in NUMBA_CACHE_DIR; where their folder cannot be
    written numba keeps it elsewhere, and then we cannot tell: False.
    """
    import camtool.kernels

    folder = Path(str(camtool.kernels.__file__)).parent
    given = os.environ.get("NUMBA_CACHE_DIR")
    if given is None and not os.access(folder, os.W_OK):
        return False
    kept = Path(given) if given else folder / "__pycache__"
    return not any(kept.rglob("judge*.nbi" if judging else "*.nbi"))
