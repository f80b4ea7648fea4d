"""Outputs about a program: its picture, its report as JSON, and a page.

A page (`--report`) is HTML, Markdown or JSON. HTML holds its picture. Markdown links to a picture
beside it: the one of `--preview`, or else an SVG of the page's own name, which never takes the
place of a file that the page did not bring along; Markdown on stdout has none."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

import click
from msgspec import Struct, field

from camtool.cli.checks import CheckOutputs
from camtool.cli.files import STDOUT, check_places, is_foreign, seal
from camtool.cli.picture_options import FLAGS as PICTURE_FLAGS
from camtool.cli.picture_options import Painter, is_viewer
from camtool.cli.plot_options import PlotFlags
from camtool.errors import OutputError
from camtool.plain import embedded_address

if TYPE_CHECKING:
    from camtool.run import Run
    from camtool.verification.report import ReportPage

PAGES = (".html", ".md", ".json")
EMBEDDED = "picture.svg"
"""The picture within a page of HTML."""

_CAPTION = "The predicted result"
_PLACES = ("target", "machine", "settings", "output", "preview", "report", "page", "plot")
_LOOKS = (*PICTURE_FLAGS, "second_program", "before_after", "plot_from", "plot_span")
_CHECKS = CheckOutputs.__struct_fields__
_NOT_LISTED = frozenset((*_PLACES, *_LOOKS, *_CHECKS, "quiet", "verbose", "watching"))
"""Flags that a page does not list: places, looks of pictures, verbosity; the machine has a row of
its own."""


def report_option(command: Any) -> Any:
    """Add `page: str | None`, the name of the page that `--report` requests."""
    text = "A page: summary, picture, tables, findings; .html, .md or .json; - is Markdown."
    add = click.option("--report", "page", metavar="FILE", callback=_page_name, help=text)
    return add(command)


def _page_name(ctx: click.Context, param: click.Parameter, value: str | None) -> str | None:
    """Return the name of a page if its extension is known; "-" is Markdown on stdout."""
    if value not in (None, STDOUT) and PurePath(str(value)).suffix.lower() not in PAGES:
        raise click.BadParameter(f"{value!r} ends in none of {', '.join(PAGES)}", ctx, param)
    return value


class ReportOutputs(Struct, frozen=True):
    """The requested outputs of a program: a picture, the report as JSON, a page (the values of
    `--preview`, `--json` and `--report`), None is not requested; findings for pipelines, and plots
    over time."""

    preview: str | None = None
    report: str | None = None
    page: str | None = None
    checks: CheckOutputs = field(default_factory=CheckOutputs)
    plots: PlotFlags = field(default_factory=PlotFlags)

    @property
    def linked(self) -> str | None:
        """Picture that the page links to: that of `--preview`, unless that is a viewer, or one of
        the page's own name. None if it links to none."""
        if self.page in (None, STDOUT) or PurePath(str(self.page)).suffix.lower() != ".md":
            return None
        if self.preview is not None and not is_viewer(self.preview):
            return self.preview
        return str(PurePath(str(self.page)).with_suffix(".svg"))

    @property
    def beside(self) -> str | None:
        """Name of the picture written beside the page when no --preview was given."""
        return None if self.linked == self.preview else self.linked

    @property
    def pictures(self) -> list[str]:
        """Pictures to draw, by names of their kind."""
        is_html = self.page is not None and self.page.lower().endswith(".html")
        names = (self.preview, self.beside, EMBEDDED if is_html else None)
        return [each for each in names if each is not None]

    def check(self, reads: Iterable[str | None], *other_names: str) -> None:
        """Raise OutputError, before any work is done, if one of these places or of `other_names`
        cannot be written, is one of `reads`, or holds a picture that the page did not write."""
        names = [*other_names, self.preview, self.report, self.page, self.beside]
        names += [*self.checks.names, *self.plots.names]
        check_places(reads, names)
        if self.beside is not None and is_foreign(self.beside, str(self.page)):
            raise OutputError(
                f"is there, and is not the picture that {self.page} brought along",
                file=self.beside,
                mend="give the page another name, or its picture a name with --preview",
            )

    def files(self, run: Run, picture: Painter) -> dict[str, bytes]:
        """Return all requested files by name; `picture` draws the pictures."""
        files: dict[str, bytes] = {}
        if self.preview is not None:
            files[self.preview] = picture(self.preview)
        if self.report is not None and run.report is not None:
            files[self.report] = run.report.to_json().encode()
        files |= self.plots.files(run, picture.flags.options())
        return {**files, **self.page_files(run, picture)}

    def check_files(self, runs: Iterable[tuple[Run, str | None]]) -> dict[str, bytes]:
        """Return the files with findings for other programs (SARIF, JUnit, annotations). `runs`:
        the programs of one source, each with the name of its file (None: it is not written)."""
        if not self.checks.names:
            return {}
        from camtool.cli.check_formats import checked_run

        every = list(runs)
        checked = [checked_run(run, program) for run, program in every]
        return self.checks.files(checked, every[0][0].target.target.codes)

    def page_files(self, run: Run, picture: Painter) -> dict[str, bytes]:
        """Return the page, and the picture beside it if it has one of its own."""
        from camtool.verification.report import page_html, page_json, page_markdown

        if self.page is None:
            return {}
        name, suffix = self.page, PurePath(self.page).suffix.lower()
        if name != STDOUT and suffix == ".json":
            return {name: page_json(_page(run, ())).encode()}
        if name != STDOUT and suffix == ".html":
            pictures = ((_CAPTION, picture(EMBEDDED)), *picture.closeups())
            shown = tuple((caption, embedded_address(data)) for caption, data in pictures)
            plan = None if run.report is None else run.report.planned
            stock = picture.stock(None if plan is None else plan.swept_mm)
            page = _page(run, shown, "" if stock is None else embedded_address(stock))
            return {name: page_html(page).encode()}
        links = () if self.linked is None else ((_CAPTION, _relative_address(name, self.linked)),)
        files = {name: page_markdown(_page(run, links)).encode()}
        if self.beside is None:
            return files
        return {**files, self.beside: seal(picture(self.beside), name)}


def _relative_address(page_name: str, picture_name: str) -> str:
    """Return the address of the picture relative to the page, with forward slashes."""
    folder = PurePath(page_name).parent
    return PurePath(os.path.relpath(picture_name, folder)).as_posix()


def _page(run: Run, pictures: tuple[tuple[str, str], ...], stock: str = "") -> ReportPage:
    return run.report_page(pictures, stock, _flags_given())


def _flags_given() -> tuple[tuple[str, str], ...]:
    """Return the given flags of the running command that affect how a program is made or
    judged."""
    context = click.get_current_context()
    from_line = click.core.ParameterSource.COMMANDLINE
    return tuple(
        (param.opts[0], _value(context, str(param.name)))
        for param in context.command.params
        if param.name not in _NOT_LISTED
        and context.get_parameter_source(str(param.name)) is from_line
        and isinstance(param, click.Option)
    )


def _value(context: click.Context, name: str) -> str:
    value = context.params.get(name)
    if isinstance(value, tuple):
        return ", ".join(map(str, value))
    return "yes" if value is True else str(value)
