"""What a stage noticed: enumerated, collected, never raised at the first.

Every code is explained in docs/findings.md (a test keeps the two equal). Numbers are stable:
add, never renumber. Hundreds: 1xx drawing, 2xx planning, 3xx program, 4xx motion and result.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum
from typing import Protocol, TypeVar

from camtool.plain import one_line


class Severity(IntEnum):
    """How grave: an ERROR makes a command exit with 1 and write nothing."""

    INFO = 0
    WARNING = 1
    ERROR = 2


class Code(IntEnum):
    """What was noticed; see docs/findings.md."""

    UNITLESS = 101
    IMPLAUSIBLE_SIZE = 102
    ENTITY_SKIPPED = 103
    GAP_OPEN = 104
    FILE_REPAIRED = 105
    GAP_CLOSED = 106
    NOTHING_DRAWN = 107
    SELF_CROSSING = 108
    BRANCHED = 109
    DRAWN_TWICE = 110
    TINY_MERGED = 111
    ARCS_RECOGNISED = 112
    FONT_SUBSTITUTED = 113
    SECTION_CHOSEN = 114
    NOT_APPLIED = 115
    UNIT_GUESSED = 116
    POINTS_MERGED = 117

    CONTOUR_TOO_SMALL = 201
    OPEN_CONTOUR_ON_LINE = 202
    GOUGE = 203
    OUT_OF_TRAVEL = 204
    UNREACHED = 205
    OUT_OF_STOCK = 206
    RAPID_IN_STOCK = 207
    SLOT_AS_WIDE = 208
    TAB_LEFT_OUT = 209
    LEAD_LEFT_OUT = 210
    ENTRY_CHANGED = 211
    DEPTH_LIMITED = 212
    REVERSALS_IN_AIR = 213
    NOT_RELIEVED = 214
    MARKS_NOT_CUT = 215
    NOT_DRILLED = 216
    HOLE_SIZE = 217
    TOOL_NOT_SAID = 218
    SIDE_BY_UNCUT = 219
    CUT_DOUBTFUL = 220
    TAB_SHARED = 225
    CORNER_FAR = 226

    BLOCK_TOO_LONG = 301
    FEED_ROUNDED = 302
    ARC_MENDED = 303
    MOVE_COLLAPSED = 304
    MOVE_SPLIT = 305
    FEED_ABOVE_LIMIT = 306
    VALUE_ROUNDED = 307
    EVENT_LEFT_OUT = 308
    COORDINATES_SCALED = 309
    PLACES_SNAPPED = 310
    EXECUTED_OTHERWISE = 311
    WORDS_PASSED_OVER = 312
    ARC_END_UNSURE = 316
    SPINDLE_SPEED_NOT_SAID = 319
    NEVER_READ = 320
    FEED_TOO_SLOW = 321
    FEED_HELD = 322
    READ_TWO_WAYS = 323

    ARC_MISSES_END = 401
    CONTOUR_MISSING = 402
    EXTRA_CUT = 403
    MANY_REVERSALS = 404
    PLAY_NOT_KNOWN = 405
    NO_MOTION = 406
    RETURN_TO_MACHINE_ZERO = 407
    ABOVE_GATE = 408
    END_NOT_REACHED = 409
    FIT_COARSE = 410
    OVERCUT = 412
    FEED_DIFFERS = 414
    SPINDLE_DIFFERS = 415
    CUT_OTHER_WAY = 416
    CLEARANCE_LOW = 417
    END_DIFFERS = 418
    SETTING_DIFFERS = 419


@dataclass(frozen=True)
class Finding:
    """One thing noticed, with its place, the measured value and the limit where there are any.

    `unit` belongs to both `measured` and `limit` ("mm", "um", "chars", "mm_min", ...).
    """

    code: Code
    severity: Severity
    message: str
    where: str = ""
    measured: float | None = None
    limit: float | None = None
    unit: str = ""

    def __str__(self) -> str:
        place = f" [{self.where}]" if self.where else ""
        return one_line(f"{self.severity.name.lower()} {self.code.name}{place}: {self.message}")


MOST_ALIKE = 3
"""So many findings of one code and severity are told one by one where people read them."""


class Noticed(Protocol):
    """What a finding is, here or in a report."""

    @property
    def code(self) -> Code | str:
        """What was noticed."""

    @property
    def severity(self) -> Severity | str:
        """How grave it is."""


_N = TypeVar("_N", bound=Noticed)


def summed(findings: Iterable[_N]) -> list[tuple[_N, int]]:
    """The first findings of each code and severity, in their order; the last of them with the
    number of those that are left out behind it, the others with 0."""
    alike: dict[tuple[object, object], list[_N]] = {}
    order = list(findings)
    for each in order:
        alike.setdefault((each.code, each.severity), []).append(each)
    shown = []
    for group in alike.values():
        shown += [(each, 0) for each in group[:MOST_ALIKE]]
        shown[-1] = (shown[-1][0], max(len(group) - MOST_ALIKE, 0))
    places = {id(each): place for place, each in enumerate(order)}
    return sorted(shown, key=lambda row: places[id(row[0])])


def worst(findings: tuple[Finding, ...] | list[Finding]) -> Severity:
    """The gravest severity present; INFO when there is no finding."""
    return max((f.severity for f in findings), default=Severity.INFO)
