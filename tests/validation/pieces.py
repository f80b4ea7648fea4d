"""The pieces of samples/pieces, posted and judged as a user would do it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from camtool.geometry.drawing import Drawing
from camtool.importers.options import ReadOptions
from camtool.importers.read import read_drawing
from camtool.jobs.build import job_of_file
from camtool.machine.model import Machine
from camtool.pipeline import post_drawing
from camtool.planning.job import Job, job_of
from camtool.target.registry import load_target
from camtool.toolpath.moves import Toolpath
from camtool.verification.report import Report
from tests.oracles.motion_rows import RowMotion, rows_of
from tests.targets import simulate

ROOT = Path(__file__).parents[2]
PIECES = ROOT / "samples" / "pieces"
UM = 1000.0
"""µm in a mm."""


@dataclass(frozen=True, eq=False)
class Piece:
    """A piece that was posted: what the verifier says of it, and what its machine decodes."""

    report: Report
    decoded: Toolpath
    machine: Machine

    @property
    def motion(self) -> list[RowMotion]:
        """Simulate the program and return its motion, row by row."""
        return rows_of(simulate(self.decoded, self.machine))

    @property
    def size(self) -> tuple[float, float]:
        """Predicted width and height of the part, mm."""
        width, height = self.report.dimensions[:2]
        return width.predicted_mm, height.predicted_mm

    @property
    def cuts(self) -> list[np.ndarray]:
        """(K, 2) mm: the slides in each row that cuts, with where the row began."""
        found, at = [], self.decoded.start[:2]
        for move, row in zip(self.decoded, self.motion, strict=True):
            if len(row.slide) == 0:
                continue
            if self.decoded.is_feed[move.index] and move.start[2] == move.end[2]:
                found.append(np.concatenate([[at], row.slide[:, :2]]))
            at = row.slide[-1, :2]
        return found


@cache
def drawing(name: str) -> Drawing:
    return read_drawing(PIECES / f"{name}.dxf", options=ReadOptions())


def own_job(name: str) -> Job:
    """Return the job file of a piece, or the job without any settings."""
    files = {"halves": "puma-halves", "puma": "puma", "gmm": "emblem", "lmm": "emblem"}
    file = next((files[word] for word in files if word in name), "")
    return job_of_file(PIECES / f"{file}.toml") if file else job_of()


@cache
def piece(name: str, *settings: str, job: Job | None = None, at: Any = None) -> Piece:
    """Post `samples/pieces/NAME.dxf` for the target that its name begins with, by its own job if
    it has one; `at` mm: where its zero lies on the table."""
    target_name = next(each for each in ("pic-mmh", "flashcut") if name.startswith(each))
    zero = () if at is None else (f"controller.machine_zero_mm=[{-at[0]}, {-at[1]}, 0.0]",)
    target = load_target(target_name, settings=[*settings, *zero])
    posted = post_drawing(drawing(name), job or own_job(name), target)
    assert posted.verification is not None
    assert posted.decoded is not None
    return Piece(posted.verification.report, posted.decoded, target.machine)
