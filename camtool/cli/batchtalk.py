"""What `camtool batch` says: a bar on a terminal, plain lines elsewhere, a table at the end."""

from __future__ import annotations

import json
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Protocol

import click

from camtool import __version__
from camtool.batch.records import Outcome, State
from camtool.cli.talk import one_line, say

if TYPE_CHECKING:
    from rich.progress import Progress

LISTED = 50
"""So many rows of the table are shown; the JSON summary has all."""


class Talk(Protocol):
    """Hears of every outcome as it comes."""

    def heard(self, outcome: Outcome) -> None:
        """Say so."""

    def noted(self, text: str) -> None:
        """Say something else, unless quiet."""


@dataclass(frozen=True)
class Loudness:
    """`--quiet`, `--verbose`."""

    quiet: bool
    verbose: bool


@contextmanager
def talking(total: int, loudness: Loudness) -> Iterator[Talk]:
    """The bar on a terminal, lines elsewhere."""
    if loudness.quiet or not sys.stderr.isatty():
        yield Lines(total, loudness)
        return
    with _progress() as progress:
        yield Bar(progress, total, loudness)


class Lines:
    """A line for each drawing."""

    def __init__(self, total: int, loudness: Loudness) -> None:
        self._total = total
        self._loudness = loudness
        self._done = 0

    def heard(self, outcome: Outcome) -> None:
        """One line, and those of its findings."""
        self._done += 1
        for line in said_of(outcome, self._loudness):
            click.echo(line, err=True)
        if outcome.state is not State.UP_TO_DATE or self._loudness.verbose:
            place = f"{self._done:>{len(str(self._total))}}/{self._total}"
            say(f"{place} {one_line(_line(outcome))}", quiet=self._loudness.quiet)

    def noted(self, text: str) -> None:
        """One line."""
        say(f"camtool: {one_line(text)}", quiet=self._loudness.quiet)


class Bar:
    """A bar with rate and time left; what goes wrong stands above it."""

    def __init__(self, progress: Progress, total: int, loudness: Loudness) -> None:
        self._progress = progress
        self._loudness = loudness
        self._failed = 0
        self._bar = progress.add_task("", total=total, failed="")

    def heard(self, outcome: Outcome) -> None:
        """One step further."""
        for line in said_of(outcome, self._loudness):
            self._progress.console.print(line, markup=False, highlight=False)
        self._failed += outcome.state is State.FAILED
        failed = f"{self._failed} failed" if self._failed else ""
        self._progress.update(self._bar, advance=1, failed=failed)

    def noted(self, text: str) -> None:
        """One line above the bar."""
        self._progress.console.print(f"camtool: {one_line(text)}", markup=False, highlight=False)


def said_of(outcome: Outcome, loudness: Loudness) -> list[str]:
    """The lines for one drawing: its error always, its findings unless quiet."""
    lines = [] if outcome.error is None else [f"camtool: error: {one_line(outcome.error)}"]
    if loudness.verbose:
        lines += [f"camtool: {one_line(remark)}" for remark in outcome.remarks]
    return lines


def say_summary(outcomes: Sequence[Outcome], seconds: float, *, quiet: bool) -> None:
    """The table of what failed, and a line of counts."""
    failed = [each for each in outcomes if each.state is State.FAILED]
    if failed:
        _table(failed[:LISTED])
        if len(failed) > LISTED:
            click.echo(f"… and {len(failed) - LISTED} more; --json FILE names all", err=True)
    counts = Counter(each.state for each in outcomes)
    parts = [f"{counts[state]} {state.value}" for state in State if counts[state]]
    made = counts[State.MADE]
    rate = f", {made / seconds:.1f} made a second" if made and seconds > 0.0 else ""
    warned = sum(each.warnings > 0 for each in outcomes)
    warnings = f"; {warned} with warnings (-v shows them)" if warned else ""
    say(
        f"{_counted(len(outcomes), 'drawing')}: {', '.join(parts)}; {seconds:.1f} s{rate}"
        f"{warnings}",
        quiet=quiet and not failed,
    )


def summary_json(outcomes: Sequence[Outcome], target: str, seconds: float) -> str:
    """The whole batch as JSON."""
    counts = Counter(each.state for each in outcomes)
    rows: list[dict[str, Any]] = []
    for outcome in outcomes:
        row = asdict(outcome)
        row["state"] = outcome.state.value
        del row["stem"]
        rows.append(row)
    whole = {
        "camtool": __version__,
        "target": target,
        "seconds": round(seconds, 3),
        **{state.name.lower(): counts[state] for state in State},
        "drawings": rows,
    }
    return json.dumps(whole, indent=2, ensure_ascii=False) + "\n"


def _line(outcome: Outcome) -> str:
    if outcome.state is not State.MADE:
        return f"{outcome.state.value}: {outcome.source}"
    error = outcome.figures.get("error_um")
    figure = "" if error is None else f", error {error:.3g} µm"
    warned = f", {_counted(outcome.warnings, 'warning')}" if outcome.warnings else ""
    return f"made: {outcome.source} → {', '.join(outcome.files)}{figure}{warned}"


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def _table(failed: Sequence[Outcome]) -> None:
    """Drawing and reason; as lines with a bar between where there is no terminal."""
    if not sys.stderr.isatty():
        width = max(len(one_line(each.source)) for each in failed)
        click.echo(f"{'failed':<{width}} | why", err=True)
        for each in failed:
            click.echo(f"{one_line(each.source):<{width}} | {_why(each)}", err=True)
        return
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table("failed", "why")
    for each in failed:
        table.add_row(Text(one_line(each.source)), Text(_why(each)))
    Console(stderr=True).print(table)


def _why(outcome: Outcome) -> str:
    """The error without the drawing's name, which stands before it."""
    why = one_line(outcome.error or "")
    return why.removeprefix(f"{one_line(outcome.source)}: ")


def _progress() -> Progress:
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        ProgressColumn,
        TextColumn,
        TimeRemainingColumn,
    )
    from rich.progress import Task as BarTask
    from rich.text import Text

    class Rate(ProgressColumn):
        """Drawings a second."""

        def render(self, task: BarTask) -> Text:
            return Text("" if task.speed is None else f"{task.speed:.1f}/s")

    return Progress(
        BarColumn(),
        MofNCompleteColumn(),
        Rate(),
        TextColumn("left"),
        TimeRemainingColumn(),
        TextColumn("{task.fields[failed]}"),
        console=Console(stderr=True),
    )
