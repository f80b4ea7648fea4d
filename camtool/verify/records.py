"""The parts of a Report as records; their keys are stable (see `camtool.verify.report`).

Nothing here is NaN or infinite: what is not known is None.
"""

from __future__ import annotations

import msgspec


class MaxRms(msgspec.Struct, frozen=True):
    """Maximum and root of the mean square; None where nothing was measured."""

    max: float | None = None
    rms: float | None = None


class ErrorFigures(msgspec.Struct, frozen=True):
    """Maximum, root of the mean square, 95th percentile (within 0.5 %), and mean with sign: to
    the left of the way counts +."""

    max: float | None = None
    rms: float | None = None
    p95: float | None = None
    mean: float | None = None


class InterpolationFigures(msgspec.Struct, frozen=True):
    """µm; `lines_steps` and `arcs_steps` are the maxima over the finer coded step of X and Y."""

    max: float | None = None
    rms: float | None = None
    p95: float | None = None
    lines_max: float | None = None
    arcs_max: float | None = None
    lines_steps: float | None = None
    arcs_steps: float | None = None


class Errors(msgspec.Struct, frozen=True):
    """Predicted errors by source, µm.

    fit: what was drawn to the lines and arcs that stand for it, at the part's size: curves, and
    all that was joined, merged, recognised or left out on reading; None where no drawing is
    known. rounding: moves as the controller holds them (the dialect's digits and whole steps) to
    the wanted ones. interpolation: commanded positions to the moves as held. mechanics: slides to
    commanded positions. total: slides to the wanted moves and the fit there on top, so never less
    than their distance to what was drawn; to the moves as held where nothing was wanted. Its mean
    is without the fit. depth_max: heights of the slide to those of the moves as held, while
    cutting."""

    fit: MaxRms = MaxRms()
    rounding: MaxRms = MaxRms()
    interpolation: InterpolationFigures = InterpolationFigures()
    mechanics: MaxRms = MaxRms()
    total: ErrorFigures = ErrorFigures()
    depth_max: float | None = None


class ExtentsMm(msgspec.Struct, frozen=True):
    """[lowest, highest] of the programmed path, mm."""

    x: tuple[float, float]
    y: tuple[float, float]
    z: tuple[float, float]


class Steps(msgspec.Struct, frozen=True):
    """Steps of each axis, and iterations of the interpolator."""

    x: int
    y: int
    z: int
    iterations: int


class AxisCounts(msgspec.Struct, frozen=True):
    """One count per axis."""

    x: int
    y: int
    z: int


class Reversals(msgspec.Struct, frozen=True):
    """Reversals of each axis in all, and of these while cutting and otherwise."""

    x: int
    y: int
    z: int
    cutting: AxisCounts
    air: AxisCounts


class TimeSplit(msgspec.Struct, frozen=True):
    """Where the time goes, s. `compensation` is a part of `cutting` and `air`: what the controller
    issues at reversals; `link` is what the line that the program comes down adds."""

    cutting: float
    air: float
    dwell: float
    compensation: float = 0.0
    link: float = 0.0


class Dimension(msgspec.Struct, frozen=True):
    """A size of the cut edge, nominally as drawn; of the tool centre's path where no drawing is
    known (`of`: "edge", "centre"). error_percent > 0 when it comes out too large. Of a contour in
    several passes the deepest and last one counts, without leads and ramps."""

    name: str
    nominal_mm: float
    predicted_mm: float
    error_percent: float | None
    of: str = "centre"


class CircleReport(msgspec.Struct, frozen=True):
    """A full circle: G, F max and F min as ISO 230-4 defines them; D is the mean of r − R. A
    circle in several passes, or at the end of a helix, is reported once: its deepest level turn.
    `step_um` and `spike_um` at 0°, 90°, 180° and 270°, where X, Y, X, Y turn, and B the reversal
    values of X and Y: see `camtool.verify.ballbar`. All are about the programmed circle; `fit_um`:
    how far what was drawn lies from that at most.
    """

    centre_mm: tuple[float, float]
    radius_mm: float
    G_um: float | None
    Fmax_um: float | None
    Fmin_um: float | None
    D_um: float | None
    direction: str
    z_mm: float
    step_um: tuple[float | None, ...] = ()
    spike_um: tuple[float | None, ...] = ()
    B_um: tuple[float | None, ...] = ()
    fit_um: float | None = None


class BothWaysReport(msgspec.Struct, frozen=True):
    """A circle that is cut both ways round: bi-directional circular error G(b) and mean
    bi-directional radial error D (ISO 230-4)."""

    centre_mm: tuple[float, float]
    radius_mm: float
    Gb_um: float | None
    D_um: float | None


class ContourReport(msgspec.Struct, frozen=True):
    """The total error of one contour, µm, and where it is largest; its largest errors by source;
    `block` from 1, None when no program was read."""

    name: str
    max_um: float
    rms_um: float
    mean_um: float
    at_mm: tuple[float, float]
    block: int | None
    interpolation_um: float
    mechanics_um: float
    fit_um: float | None = None


class WorstReport(msgspec.Struct, frozen=True):
    """A move with a large error: `block` and `move` from 1, and its largest errors by source."""

    block: int | None
    move: int
    at_mm: tuple[float, float]
    total_um: float
    interpolation_um: float | None
    mechanics_um: float | None
    source: str
    fit_um: float | None = None


class UnreachedReport(msgspec.Struct, frozen=True):
    """How many moves the controller leaves beside their programmed ends, and how far at most."""

    moves: int
    max_um: float


class ShapeReport(msgspec.Struct, frozen=True):
    """What a round tool cuts away beside the wanted shape, and what stays of it, seen from above:
    areas, and how deep they reach."""

    tool_diameter_mm: float
    overcut_mm2: float
    overcut_um: float
    undercut_mm2: float
    undercut_um: float


class AskedReport(msgspec.Struct, frozen=True):
    """Moves as programmed against those that the job asks for: how many cut, how many of these
    are the very moves that camtool would write, how far the others are from what was asked at
    most, and how far they may be."""

    moves: int
    alike: int
    off_um: float
    limit_um: float


class FindingReport(msgspec.Struct, frozen=True):
    """A finding, by the names of its code and severity."""

    code: str
    severity: str
    message: str
    where: str
    measured: float | None = None
    limit: float | None = None
    unit: str = ""


class PlannedOperation(msgspec.Struct, frozen=True):
    """How an operation cuts; feeds in mm/min. `spindle_rpm` is None where nobody says a speed;
    `passes` and the depth of the deepest one are of those kinds that have any."""

    name: str
    kind: str
    tool_diameter_mm: float
    spindle_rpm: float | None
    feed_mm_min: float
    plunge_mm_min: float
    depth_mm: float
    passes: int | None = None
    deepest_pass_mm: float | None = None


class Planned(msgspec.Struct, frozen=True):
    """What planning gained: how far rapids go in XY, mm, with everything in the order and from
    the starts in which it was drawn, and as it was put into order; and how the operations cut."""

    rapid_drawn_mm: float
    rapid_mm: float
    operations: tuple[PlannedOperation, ...] = ()


class Before(msgspec.Struct, frozen=True):
    """The same job without `--minimise reversals`, `--approach` and `--compensate`: reversals of
    X and Y, the largest predicted error, the time. Null where that job could not be made."""

    reversals_cutting: int | None = None
    reversals_air: int | None = None
    total_max_um: float | None = None
    time_s: float | None = None
