"""What a page about a program says, before it becomes Markdown, HTML or JSON.

A page is made of nothing but its inputs: no time, no place, no order of a hash, so that the same
job gives the same bytes.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from camtool.verify.records import FindingReport
    from camtool.verify.report import Report

NAME_SHOWN = 200
"""A cell or a finding's words are shortened to so many characters on a page; JSON has them all."""


@dataclass(frozen=True)
class Changed:
    """A value of the machine that is not its target's own: by `--machine` or `--set`."""

    key: str
    value: str
    was: str


@dataclass(frozen=True)
class Setup:
    """The machine and what was asked for: digests (SHA-256, hex) of all the machine's values and
    of the program, the values that differ from the target's own, and the flags that were given."""

    machine: str
    machine_sha256: str
    program_sha256: str | None = None
    changed: tuple[Changed, ...] = ()
    flags: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Page:
    """A page: `report` is None where nothing could be judged, and then `findings` say why.
    `pictures` are (caption, address): a file beside the page, or a data address."""

    title: str
    report: Report | None
    findings: tuple[FindingReport, ...]
    setup: Setup | None = None
    pictures: tuple[tuple[str, str], ...] = ()

    @property
    def verdict(self) -> str:
        """In one word whether the program may be cut."""
        grave = {finding.severity for finding in self.findings}
        return next((word for word in ("error", "warning") if word in grave), "fine")


def page_of(report: Report) -> Page:
    """The page of a report alone."""
    return Page(report.source or report.target, report, report.findings)


def setup_rows(setup: Setup) -> tuple[tuple[str, str], ...]:
    """(name, value) of the machine and the settings, in their order."""
    digests = [("machine", f"{setup.machine}, digest {setup.machine_sha256}")]
    if setup.program_sha256 is not None:
        digests.append(("program", f"digest {setup.program_sha256}"))
    changed = [
        (item.key, f"{item.value} (the target's own: {item.was})") for item in setup.changed
    ]
    return (*digests, *changed, *setup.flags)


def shortened(words: str) -> str:
    """Words that do not fill a page."""
    return words if len(words) <= NAME_SHOWN else words[: NAME_SHOWN - 1] + "…"


def to_json(page: Page) -> str:
    """The report's own keys, with `title`, `verdict` and `setup` before them; indented.

    Where nothing could be judged, `findings` are all that follows."""
    import msgspec

    from camtool.plain import to_json as json_text
    from camtool.verify.records import FindingReport

    body: dict[str, Any] = {"title": page.title, "verdict": page.verdict}
    body["setup"] = None if page.setup is None else asdict(page.setup)
    if page.report is not None:
        body |= msgspec.to_builtins(page.report)
    body["findings"] = msgspec.to_builtins(page.findings, builtin_types=(FindingReport,))
    return json_text(body)
