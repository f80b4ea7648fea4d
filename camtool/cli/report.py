"""`--report`: a page about a program, as HTML, Markdown or JSON, with its picture.

HTML holds its picture. Markdown links to a picture beside it: the one of `--preview`, or else an
SVG of the page's own name, which never takes the place of a file that the page did not bring
along; Markdown on stdout has none.
"""

from __future__ import annotations

import base64
import hashlib
import os
from dataclasses import dataclass
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

import click

from camtool.cli.files import STDOUT, is_foreign, sealed
from camtool.cli.picture_options import FLAGS as PICTURE_FLAGS
from camtool.cli.picture_options import Painter, is_viewer
from camtool.errors import OutputError
from camtool.findings import Finding
from camtool.plain import one_line

if TYPE_CHECKING:
    from camtool.machine.registry import LoadedTarget
    from camtool.verification.report import Page, Report, Setup

Flags = tuple[tuple[str, str], ...]
PAGES = (".html", ".md", ".json")
EMBEDDED = "picture.svg"
"""The picture within a page of HTML."""

_CAPTION = "The predicted result"
_PLACES = ("target", "machine", "settings", "output", "preview", "report", "page")
_LOOKS = (*PICTURE_FLAGS, "beside", "before_after")
_NOT_TOLD = frozenset((*_PLACES, *_LOOKS, "quiet", "verbose", "watching"))
"""What says where things are, how pictures look and how much is said; the machine tells of
itself."""


@dataclass(frozen=True)
class Subject:
    """What a page is about; `report` None where nothing could be judged."""

    title: str
    target: LoadedTarget
    report: Report | None
    findings: tuple[Finding, ...]
    program: bytes | None
    flags: Flags = ()


def report_option(command: Any) -> Any:
    """Adds `page: str | None`, the name of the page that `--report` asks for."""
    text = "A page: summary, picture, tables, findings; .html, .md or .json; - is Markdown."
    add = click.option("--report", "page", metavar="FILE", callback=_page_name, help=text)
    return add(command)


def _page_name(ctx: click.Context, param: click.Parameter, value: str | None) -> str | None:
    """The name of a page that we can make; - is Markdown on stdout."""
    if value not in (None, STDOUT) and PurePath(str(value)).suffix.lower() not in PAGES:
        raise click.BadParameter(f"{value!r} ends in none of {', '.join(PAGES)}", ctx, param)
    return value


def flags_given() -> Flags:
    """The flags of the running command that say how a program is made or judged, as given."""
    context = click.get_current_context()
    given = click.core.ParameterSource.COMMANDLINE
    return tuple(
        (param.opts[0], _said(context, str(param.name)))
        for param in context.command.params
        if param.name not in _NOT_TOLD
        and context.get_parameter_source(str(param.name)) is given
        and isinstance(param, click.Option)
    )


def _said(context: click.Context, name: str) -> str:
    value = context.params.get(name)
    if isinstance(value, tuple):
        return ", ".join(map(str, value))
    return "yes" if value is True else str(value)


def linked_picture(name: str | None, preview: str | None) -> str | None:
    """The picture that a page of this name links to: the one of `--preview`, unless that is a
    viewer, or one of the page's own name. None where it links to none."""
    if name is None or name == STDOUT or PurePath(name).suffix.lower() != ".md":
        return None
    if preview is not None and not is_viewer(preview):
        return preview
    return str(PurePath(name).with_suffix(".svg"))


def picture_beside(name: str | None, preview: str | None) -> str | None:
    """The same where nobody else writes it."""
    linked = linked_picture(name, preview)
    return None if linked == preview else linked


def refuse_foreign_picture(name: str | None, preview: str | None) -> None:
    """OutputError when the picture that a page of this name brings along, which nobody asked for
    by name, would take the place of a file that is no picture of that page."""
    beside = picture_beside(name, preview)
    if beside is not None and is_foreign(beside, str(name)):
        raise OutputError(
            f"is there, and is not the picture that {name} brought along",
            file=beside,
            mend="give the page another name, or its picture a name with --preview",
        )


def pictures_asked(name: str | None, preview: str | None) -> list[str]:
    """The pictures to be made for a page and a `--preview`, by names of their kind."""
    held = EMBEDDED if name is not None and name.lower().endswith(".html") else None
    return [each for each in (preview, picture_beside(name, preview), held) if each is not None]


def report_files(
    name: str, subject: Subject, picture: Painter, *, preview: str | None
) -> dict[str, bytes]:
    """The page of this name, and the picture beside it where it has one of its own."""
    from camtool.verification.report import html, markdown, page_json

    suffix = PurePath(name).suffix.lower()
    if name != STDOUT and suffix == ".json":
        return {name: page_json(_page(subject, ())).encode()}
    if name != STDOUT and suffix == ".html":
        pictures = ((_CAPTION, picture(EMBEDDED)), *picture.closeups())
        shown = tuple((caption, _held(data)) for caption, data in pictures)
        return {name: html(_page(subject, shown)).encode()}
    beside, linked = picture_beside(name, preview), linked_picture(name, preview)
    links = () if linked is None else ((_CAPTION, _from(name, linked)),)
    files = {name: markdown(_page(subject, links)).encode()}
    return files if beside is None else {**files, beside: sealed(picture(beside), name)}


def _held(svg: bytes) -> str:
    """The address of a picture that the page itself holds."""
    return f"data:image/svg+xml;base64,{base64.b64encode(svg).decode()}"


def _from(page_name: str, picture_name: str) -> str:
    """The picture's address as the page sees it, with forward slashes."""
    folder = PurePath(page_name).parent
    return PurePath(os.path.relpath(picture_name, folder)).as_posix()


def _page(subject: Subject, pictures: tuple[tuple[str, str], ...]) -> Page:
    from camtool.verification.report import Page, reported

    findings = reported(subject.findings)
    return Page(one_line(subject.title), subject.report, findings, _setup(subject), pictures)


def _setup(subject: Subject) -> Setup:
    from camtool.machine.registry import changed_values, machine_digest
    from camtool.verification.report import Changed, Setup

    machine, program = subject.target.machine, subject.program
    return Setup(
        machine=f"{machine.target.name}: {machine.target.title}",
        machine_sha256=machine_digest(machine),
        program_sha256=None if program is None else hashlib.sha256(program).hexdigest(),
        changed=tuple(Changed(*change) for change in changed_values(subject.target)),
        flags=subject.flags,
    )
