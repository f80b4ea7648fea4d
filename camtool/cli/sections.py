"""Help in sections: a command of many options shows them under headings."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

GENERAL = "Options"


class SectionOption(click.Option):
    """An option that stands under the heading `section`."""

    def __init__(self, *args: Any, section: str = GENERAL, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.section = section


class SectionedCommand(click.Command):
    """A command that shows its options section by section, in the order of the first of each."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options into the help."""
        sections: dict[str, list[tuple[str, str]]] = {GENERAL: []}
        for param in self.get_params(ctx):
            record = param.get_help_record(ctx)
            if record is not None and isinstance(param, click.Option):
                sections.setdefault(getattr(param, "section", GENERAL), []).append(record)
        for heading, rows in sections.items():
            with formatter.section(heading):
                formatter.write_dl(rows)


def option(section: str, *names: str, **settings: Any) -> Callable[..., Any]:
    """`click.option` under a heading."""
    return click.option(*names, cls=SectionOption, section=section, **settings)
