"""`camtool check`: what an importer sees in a drawing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from camtool.cli.files import STDOUT, check_places, write_all
from camtool.cli.messages import say_error, say_findings, show_facts
from camtool.cli.options import DrawingFlags, SectionedCommand, drawing_options, talk_options
from camtool.cli.picture_options import DRAWING, PictureFlags, picture_name, picture_options
from camtool.errors import CamtoolError
from camtool.findings import Severity, worst
from camtool.plain import one_line, to_json

if TYPE_CHECKING:
    pass


@click.command(cls=SectionedCommand, short_help="What is in a drawing.")
@click.argument("sources", metavar="DRAWING...", nargs=-1, required=True)
@click.option("--json", "report", metavar="FILE", help="The same as JSON; - is stdout.")
@click.option(
    "--preview",
    metavar="FILE",
    callback=picture_name,
    help="Picture of the drawing, .svg, .png or .html.",
)
@picture_options
@drawing_options
@talk_options
def check(
    sources: tuple[str, ...],
    report: str | None,
    preview: str | None,
    picture: PictureFlags,
    drawing: DrawingFlags,
    quiet: bool,
    verbose: bool,
) -> int:
    """Say what an importer sees in each DRAWING (- is stdin).

    Units and why, size, layers, entities used and not used, gaps, and the smallest features. Of
    several drawings all are looked at, whatever is wrong with one of them."""
    picture.check([preview], DRAWING)
    one = _Check(drawing, report, preview, picture, quiet, verbose)
    if len(sources) == 1:
        return one.check_file(sources[0])
    if report is not None or preview is not None:
        raise click.UsageError("--json and --preview are of one drawing")
    return max(one.check_one_of_many(source) for source in sources)


@dataclass(frozen=True)
class _Check:
    """Check drawings with the given options and outputs."""

    drawing: DrawingFlags
    report: str | None
    preview: str | None
    picture: PictureFlags
    quiet: bool
    verbose: bool

    def check_one_of_many(self, source: str) -> int:
        """Check one of several drawings and return the exit code; an error is shown and does not
        stop the others."""
        try:
            return self.check_file(source)
        except CamtoolError as error:
            say_error(error)
            return error.exit_code

    def check_file(self, source: str) -> int:
        """Show the facts of one drawing; return the exit code."""
        check_places([source], [self.report, self.preview])
        read = self.drawing.read(source)
        from camtool.geometry.facts import facts_of

        facts = facts_of(read)
        files: dict[str, bytes] = {}
        if self.report is not None:
            files[self.report] = to_json(facts).encode()
        if self.preview is not None:
            from camtool.pictures.scene import scene_of_drawing

            title = Path(read.file).name
            painted = self.picture.painter(
                lambda: [scene_of_drawing(read, title)], quiet=self.quiet
            )
            files[self.preview] = painted(self.preview)
        write_all(files)
        if self.report != STDOUT and not self.quiet:
            show_facts(_table(facts, verbose=self.verbose), NAME_WIDTH, MARKS)
        say_findings(read.findings, quiet=self.quiet, verbose=self.verbose)
        return 1 if worst(read.findings) >= Severity.ERROR else 0


# The facts as lines for people. Long lists show their first rows; the JSON has all of them.

SHOWN = 10

NAME_WIDTH = 10
"""Width, in columns, of the names."""

MARKS = dict.fromkeys(("not used", "gap", "branch", "crossing", "open"), "warning")
"""Facts of a drawing that are marked as needing attention."""


def _table(facts: dict[str, Any], *, verbose: bool) -> str:
    """Format the facts as lines of a name and a value; `verbose` shows long lists in full."""
    max_rows = None if verbose else SHOWN
    rows = [*_head(facts), *_layers(facts, max_rows), *_entities(facts), *_places(facts, max_rows)]
    return "\n".join(one_line(f"{name:<{NAME_WIDTH}}{value}".rstrip()) for name, value in rows)


_Rows = Iterator[tuple[str, str]]


def _head(facts: dict[str, Any]) -> _Rows:
    """Yield rows about the file: its units, its size and its counts."""
    units, size, extents = facts["units"], facts["size_mm"], facts["extents_mm"]
    yield "file", facts["file"]
    yield "units", f"{units['name']} ({units['why']})"
    yield "size", f"{size[0]:.4g} × {size[1]:.4g} mm"
    yield (
        "extents",
        f"x {extents['x'][0]:.4f} … {extents['x'][1]:.4f}   "
        f"y {extents['y'][0]:.4f} … {extents['y'][1]:.4f} mm",
    )
    yield (
        "contours",
        f"{facts['closed']} closed, {facts['open']} open, {facts['length_mm']:.4g} mm long, "
        f"{facts['lines']} lines, {facts['arcs']} arcs",
    )
    if facts["marks"]:
        yield "points", f"{facts['marks']} single"
    for finding in facts["findings"]:
        if finding["code"] == "SECTION_CHOSEN":
            yield "taken", finding["message"]
    if facts["fit_um"]["max"] > 0.0:
        yield "fitted", f"curves within {facts['fit_um']['max']:.3g} µm"
    for name, smallest in facts["smallest"].items():
        if smallest is not None:
            x, y = smallest["at_mm"]
            yield (
                "smallest",
                f"{_SIZE_WORDS[name]} {smallest['size_mm']:.4g} mm at {x:.4f}, {y:.4f}",
            )


_SIZE_WORDS = {
    "radius": "radius",
    "segment": "line or arc, length",
    "contour": "contour, width",
    "distance": "distance of contours",
}


def _layers(facts: dict[str, Any], max_rows: int | None) -> _Rows:
    """Yield rows about layers, colours and line types, for each of these of which there are
    several."""
    for name, layer in _first(list(facts["layers"].items()), max_rows):
        points = f", {layer['marks']} points" if layer["marks"] else ""
        yield "layer", f"{name}: {layer['closed']} closed, {layer['open']} open{points}"
    yield from _rows_left_out("layer", facts["layers"], max_rows)
    for key, name, no_word in (
        ("colours", "colour", "none"),
        ("line_types", "line type", "plain"),
    ):
        if len(facts[key]) > 1:
            counts = list(facts[key].items())
            listed = ", ".join(
                f"{count} {word or no_word}" for word, count in _first(counts, max_rows)
            )
            yield name, listed + (" …" if max_rows is not None and len(counts) > max_rows else "")


def _entities(facts: dict[str, Any]) -> _Rows:
    """Yield rows with the counts of entities used, not used and repaired."""
    used_text = ", ".join(f"{count} {kind}" for kind, count in facts["entities_used"].items())
    yield "entities", used_text or "none"
    for item in facts["entities_not_used"]:
        yield "not used", f"{item['count']} {item['kind']}: {item['reason']}"
    for key, reason in (("duplicates", "drawn twice"), ("overlaps", "parts lying on others")):
        if facts[key]["count"]:
            length = facts[key]["length_mm"]
            yield "left out", f"{facts[key]['count']} {reason}, {length:.4g} mm"
    if facts["tiny_merged"]:
        yield "merged", f"{facts['tiny_merged']} tiny segments"
    if facts["arcs_recognised"]:
        yield "arcs", f"{facts['arcs_recognised']} recognised in chords"


def _places(facts: dict[str, Any], max_rows: int | None) -> _Rows:
    """Yield rows about gaps, branches, crossings and open ends, with their positions."""
    for key, state in (("gaps", "stays open"), ("closed_gaps", "was closed")):
        for gap in _first(facts[key], max_rows):
            yield (
                "gap",
                f"{gap['size_mm']:.4g} mm at {_place_words(gap)} on {gap['layer']}, {state}",
            )
        yield from _rows_left_out("gap", facts[key], max_rows)
    for item in _first(facts["branches"], max_rows):
        yield "branch", f"{item['ends']} ends at {_place_words(item)} on {item['layer']}"
    yield from _rows_left_out("branch", facts["branches"], max_rows)
    for item in _first(facts["crossings"], max_rows):
        yield "crossing", f"of a contour with itself at {_place_words(item)} on {item['layer']}"
    yield from _rows_left_out("crossing", facts["crossings"], max_rows)
    ends = list(zip(facts["open_ends"][::2], facts["open_ends"][1::2], strict=True))
    for begin, end in _first(ends, max_rows):
        yield "open", f"from {_place_words(begin)} to {_place_words(end)} on {begin['layer']}"
    yield from _rows_left_out("open", ends, max_rows)


def _place_words(item: dict[str, Any]) -> str:
    x, y = item["at_mm"]
    return f"{x:.4f}, {y:.4f}"


def _first(items: list[Any], max_rows: int | None) -> list[Any]:
    return items if max_rows is None else items[:max_rows]


def _rows_left_out(name: str, items: Any, max_rows: int | None) -> _Rows:
    """Yield a row with the number of rows that are not shown, if any."""
    if max_rows is not None and len(items) > max_rows:
        yield name, f"and {len(items) - max_rows} more (-v shows all)"
