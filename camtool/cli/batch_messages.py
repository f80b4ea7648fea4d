"""The display of `camtool batch`: a bar on a terminal, plain lines elsewhere, a table at the
end."""

from __future__ import annotations

import os
import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import PurePath
from typing import TYPE_CHECKING, Any, Protocol

from camtool.batches.run import Outcome, OutcomeState
from camtool.cli.messages import say
from camtool.plain import one_line, to_json
from camtool.version import __version__

if TYPE_CHECKING:
    from rich.progress import Progress

LISTED = 50
"""Largest number of rows of the table; the JSON summary has all."""

CODES = 3
"""Largest number of codes of findings that the last line counts."""

COLOUR = {
    OutcomeState.FAILED: "red",
    OutcomeState.MADE: "yellow",
    OutcomeState.UP_TO_DATE: "yellow",
}
"""The colour of a row of the table; drawings that were made have a row for their warnings."""


class Display(Protocol):
    """A display of the outcomes of a batch."""

    def begin(self) -> None:
        """Begin the display; called when the first drawing that is not up to date is begun."""

    def add(self, outcome: Outcome) -> None:
        """Show the outcome of one drawing."""

    def note(self, text: str) -> None:
        """Show another message, unless quiet."""


@dataclass(frozen=True)
class Verbosity:
    """`--quiet`, `--verbose`."""

    quiet: bool
    verbose: bool


@contextmanager
def display(total: int, verbosity: Verbosity) -> Iterator[Display]:
    """Yield the display of a batch: a progress bar on a terminal, plain lines elsewhere."""
    if verbosity.quiet or not sys.stderr.isatty():
        yield LineDisplay(total, verbosity)
        return
    bar = BarDisplay(total, verbosity)
    try:
        yield bar
    finally:
        bar.close()


class LineDisplay:
    """A display with one line for each drawing."""

    def __init__(self, total: int, verbosity: Verbosity) -> None:
        self._total = total
        self._verbosity = verbosity
        self._done = 0

    def begin(self) -> None:
        """Do nothing: the line of the first drawing shows that the batch has begun."""

    def add(self, outcome: Outcome) -> None:
        """Show the line of a drawing, and the lines of its findings."""
        self._done += 1
        for line in outcome_lines(outcome, self._verbosity):
            say(line)
        if outcome.state is not OutcomeState.UP_TO_DATE or self._verbosity.verbose:
            place = f"{self._done:>{len(str(self._total))}}/{self._total}"
            say(f"{place} {_line(outcome)}", quiet=self._verbosity.quiet)

    def note(self, text: str) -> None:
        """Show one line."""
        say(f"camtool: {text}", quiet=self._verbosity.quiet)


class BarDisplay:
    """A progress bar with rate and remaining time, which appears with the first drawing that is
    not up to date. Errors are printed above it on one line each, and in full in the table at the
    end."""

    def __init__(self, total: int, verbosity: Verbosity) -> None:
        self._total = total
        self._verbosity = verbosity
        self._done = 0
        self._failed = 0
        self._progress: Progress | None = None

    def begin(self) -> None:
        """Show the bar."""
        self._shown()

    def add(self, outcome: Outcome) -> None:
        """Advance by one drawing."""
        self._done += 1
        self._failed += outcome.state is OutcomeState.FAILED
        if outcome.state is OutcomeState.UP_TO_DATE and self._progress is None:
            return
        progress = self._shown()
        if outcome.error is not None:
            line = f"failed: {one_line(outcome.source)}: {_reason(outcome)}"
            progress.console.print(line, style="red", no_wrap=True, overflow="ellipsis", **_PLAIN)
        for remark in outcome.remarks if self._verbosity.verbose else ():
            progress.console.print(one_line(remark), **_PLAIN)
        failed = f"{self._failed} failed" if self._failed else ""
        progress.update(progress.task_ids[0], completed=self._done, failed=failed)

    def note(self, text: str) -> None:
        """Show one line above the bar."""
        self._shown().console.print(f"camtool: {one_line(text)}", **_PLAIN)

    def close(self) -> None:
        """Restore the terminal."""
        if self._progress is not None:
            self._progress.stop()

    def _shown(self) -> Progress:
        if self._progress is None:
            self._progress = _progress()
            self._progress.add_task("", total=self._total, completed=self._done, failed="")
            self._progress.start()
        return self._progress


_PLAIN: dict[str, Any] = {"markup": False, "highlight": False, "emoji": False}
"""Options of rich that print text from files as it is, not as markup."""


def outcome_lines(outcome: Outcome, verbosity: Verbosity) -> list[str]:
    """Return the lines for one drawing: its error always, its findings unless quiet."""
    lines = [] if outcome.error is None else [f"camtool: error: {outcome.error}"]
    if verbosity.verbose:
        lines += [f"camtool: {remark}" for remark in outcome.remarks]
    return lines


def say_summary(outcomes: Sequence[Outcome], seconds: float, *, quiet: bool) -> None:
    """Show the table of failed drawings (on a terminal also of warnings), and a line of counts."""
    failed = [each for each in outcomes if each.state is OutcomeState.FAILED]
    warned = [each for each in outcomes if each.warnings and each.state is not OutcomeState.FAILED]
    if sys.stderr.isatty():
        _table(failed if quiet else [*failed, *warned], outcomes)
    else:
        _lines(failed)
    counts = Counter(each.state for each in outcomes)
    parts = [f"{counts[state]} {state.value}" for state in OutcomeState if counts[state]]
    codes = Counter(each.code for each in failed if each.code).most_common(CODES)
    if codes:
        reasons = ", ".join(f"{number} {code}" for code, number in codes)
        parts = [f"{part} ({reasons})" if part.endswith(" failed") else part for part in parts]
    remembered = sum(each.remembered for each in outcomes)
    failed_words = (
        f"; {remembered} failed before and did not change (--again)" if remembered else ""
    )
    made_count = counts[OutcomeState.MADE]
    rate = f", {made_count / seconds:.1f} made a second" if made_count and seconds > 0.0 else ""
    warnings = f"; {len(warned)} with warnings (-v shows them)" if warned else ""
    verdicts = _verdict_words(verdicts_of(outcomes))
    say(
        f"{_count_words(len(outcomes), 'drawing')}: {', '.join(parts)}; {seconds:.1f} s{rate}"
        f"{failed_words}{warnings}{'; dimensions: ' if verdicts else ''}{verdicts}",
        quiet=quiet and not failed,
    )


def summary_json(outcomes: Sequence[Outcome], target: str, seconds: float) -> bytes:
    """Return the whole batch as JSON; names that are no text keep their bytes as \\udcXX."""
    counts = Counter(each.state for each in outcomes)
    rows: list[dict[str, Any]] = []
    for outcome in outcomes:
        row = {"source": "", "state": "", "files": (), **asdict(outcome)}  # the drawing first
        row["state"] = outcome.state.value
        del row["stem"]
        rows.append(row)
    content = {
        "camtool": __version__,
        "target": target,
        "seconds": round(seconds, 3),
        **{state.name.lower(): counts[state] for state in OutcomeState},
        "verdicts": dict(verdicts_of(outcomes)),
        "drawings": rows,
    }
    return to_json(content).encode()


def _line(outcome: Outcome) -> str:
    if outcome.state is not OutcomeState.MADE:
        return f"{outcome.state.value}: {outcome.source}"
    error = outcome.figures.get("error_um")
    figure = "" if error is None else f", error {error:.3g} µm"
    warned = f", {_count_words(outcome.warnings, 'warning')}" if outcome.warnings else ""
    verdicts = _verdict_words(outcome.verdicts)
    verdict_text = f", dimensions: {verdicts}" if verdicts else ""
    return f"made: {outcome.source} → {', '.join(outcome.files)}{figure}{warned}{verdict_text}"


def verdicts_of(outcomes: Sequence[Outcome]) -> Counter[str]:
    """Count the verdicts on all dimensions of all drawings."""
    counts: Counter[str] = Counter()
    for each in outcomes:
        counts.update(each.verdicts)
    return counts


def _verdict_words(counts: Mapping[str, int]) -> str:
    """Return counts of verdicts as text, such as "3 in, 1 out", the usual verdicts first."""
    order = ("in", "out", "undecided", "predicted")
    return ", ".join(f"{counts[each]} {each}" for each in order if counts.get(each))


def _count_words(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def _lines(failed: Sequence[Outcome]) -> None:
    """Print the failed drawings and their reasons as plain lines, for output that is no
    terminal."""
    if not failed:
        return
    listed = failed[:LISTED]
    width = max(len(one_line(each.source)) for each in listed)
    say(f"{'failed':<{width}} | why")
    for each in listed:
        say(f"{one_line(each.source):<{width}} | {_reason(each)}")
    _say_more(len(failed))


def _table(rows: Sequence[Outcome], outcomes: Sequence[Outcome]) -> None:
    """Print a coloured table of drawings and reasons; the folder that all drawings share stands in
    the title and is left out of the rows."""
    if not rows:
        return
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    base = _common_folder(outcomes)
    table = Table(title=Text(one_line(base)) if base else None, title_justify="left")
    table.add_column("drawing", ratio=1, overflow="fold")
    table.add_column("")
    table.add_column("why", ratio=2, overflow="fold")
    for each in rows[:LISTED]:
        failed = each.state is OutcomeState.FAILED
        status = "failed" if failed else _count_words(each.warnings, "warning")
        name = PurePath(each.source).relative_to(base) if base else each.source
        # Errors are shown in full, warnings on one line each: there may be many alike.
        reason = (
            Text(_reason(each))
            if failed
            else Text(_reason(each), no_wrap=True, overflow="ellipsis")
        )
        table.add_row(Text(one_line(str(name))), status, reason, style=COLOUR[each.state])
    Console(stderr=True).print(table)
    _say_more(len(rows))


def _common_folder(outcomes: Sequence[Outcome]) -> str:
    """Return the folder that all drawings share, "" if there is none."""
    try:
        return os.path.commonpath([PurePath(each.source).parent for each in outcomes])
    except ValueError:  # some paths are absolute, some relative
        return ""


def _say_more(rows: int) -> None:
    if rows > LISTED:
        say(f"… and {rows - LISTED} more; --json FILE names all")


def _reason(outcome: Outcome) -> str:
    """Return the error of a drawing, or its first finding, without the drawing's name in front."""
    reason = one_line(outcome.error or next(iter(outcome.remarks), ""))
    reason = reason.removeprefix(f"{one_line(outcome.source)}: ")
    return reason.removeprefix("error " if outcome.code else "warning ")


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
        """A column of the progress bar: drawings per second."""

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
