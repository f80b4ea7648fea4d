"""Records and copies of them.

A record is a frozen `msgspec.Struct`, or a frozen dataclass where users of the Python API hold it
(docs/decisions/0077-one-way-to-copy-a-record.md). `replace` copies both.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    # mypy checks names and types of the changes by this function's name, for structs too.
    from dataclasses import replace as replace
else:
    import dataclasses

    def replace(record, /, **changes):
        """Return a copy of a struct or dataclass with these fields changed."""
        if hasattr(record, "__struct_fields__"):
            from msgspec import structs  # not for --help

            return structs.replace(record, **changes)
        return dataclasses.replace(record, **changes)
