"""What the walk over an SVG document counts: used, left out, drawn otherwise than shown."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from camtool.errors import DrawingError
from camtool.findings import Code, Finding, Severity
from camtool.geometry.drawing import Skipped
from camtool.importers.svg.tree import Node
from camtool.importers.told import font_findings


@dataclass
class Notes:
    """Counts by kind and reason; of faults the first of each kind is told."""

    used: Counter[str] = field(default_factory=Counter)
    left_out: Counter[tuple[str, str]] = field(default_factory=Counter)
    changed: Counter[tuple[str, str]] = field(default_factory=Counter)
    fonts: Counter[str] = field(default_factory=Counter)
    _faults: Counter[tuple[str, str]] = field(default_factory=Counter)
    _first: dict[tuple[str, str], str] = field(default_factory=dict)

    def fault(self, kind: str, what: str, node: Node, fault: DrawingError | str) -> None:
        """A node whose numbers are wrong: `what` was done with it ("cannot be read")."""
        self._faults[kind, what] += 1
        if (kind, what) not in self._first:
            text = str(fault)
            self._first[kind, what] = f"{node.label}: {text}"

    def skipped(self) -> list[Skipped]:
        """What was left out, kind by kind."""
        faults = [
            Skipped(kind, count, f"{what} ({self._first[kind, what]})")
            for (kind, what), count in self._faults.items()
        ]
        return faults + [Skipped(kind, n, why) for (kind, why), n in self.left_out.items()]

    def findings(self) -> list[Finding]:
        """NOT_APPLIED for each thing that changes the look and was not done; what fonts lack."""
        applied = [
            Finding(Code.NOT_APPLIED, Severity.WARNING, f"{count} {what} {why}",
                    measured=float(count))
            for (what, why), count in self.changed.items()
        ]  # fmt: skip
        return applied + font_findings(self.fonts)
