"""What was found out by comparing, and by measuring."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import PurePath
from typing import TYPE_CHECKING

from camtool.calibration.calibrate import Calibration as CalibrationRecord
from camtool.results.picture import Shown
from camtool.verification.contrast import ContrastRow, row_of, table

if TYPE_CHECKING:
    from collections.abc import Mapping

    from camtool.calibration.measurements import Measurements
    from camtool.machine.model import Machine
    from camtool.pipeline import Way
    from camtool.preview.overlay import Overlay
    from camtool.verification.contrast import Variant
    from camtool.verification.verify import Verification as VerificationRecord


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Shown):
    """One program, run several ways: `ways` says which, `variants` what came of each, in the
    same order. Its picture shows the paths about the place of the largest error."""

    data: bytes
    source: str
    ways: tuple[Way, ...]
    variants: tuple[Variant, ...]

    @property
    def rows(self) -> tuple[ContrastRow, ...]:
        """A line for each way: errors µm, time s, counts."""
        return tuple(row_of(each.name, each.verification.report) for each in self.variants)

    @property
    def verdicts(self) -> Mapping[str, VerificationRecord]:
        """The verdict on each way, by its name."""
        return {each.name: each.verification for each in self.variants}

    def __str__(self) -> str:
        return table(self.rows)

    def __repr__(self) -> str:
        names = ", ".join(each.name for each in self.variants)
        return f"<Comparison of {self.source}: {names}>"

    def _scene(self) -> Overlay:
        from camtool.pipeline import compare_picture

        title = PurePath(self.source).name
        return compare_picture(self.data, self.ways, self.variants, title=title)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Calibration(CalibrationRecord):
    """The numbers of `machine` that `measurements` say
    (`camtool.calibration.calibrate.Calibration`): estimates with uncertainties, mm and rad.
    `extends` is the user's machine file, as a table, that `machine_file` carries on."""

    measurements: Measurements
    machine: Machine
    extends: Mapping[str, object]

    @property
    def machine_file(self) -> str:
        """TOML text that `load_target(..., machine=FILE)` reads: the numbers that were found over
        what was known, each with its uncertainty and its source behind it."""
        from camtool.calibration.machine_file import machine_file

        return machine_file(self, self.measurements, self.machine, dict(self.extends))

    def __str__(self) -> str:
        from camtool.calibration.calibrate import to_text

        return to_text(self, self.machine)

    def __repr__(self) -> str:
        found = ", ".join(each.name for each in self.estimates if not each.region)
        return f"<Calibration of {self.target} from {self.file}: {found or 'nothing'}>"
