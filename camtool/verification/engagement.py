"""The engagement of the tools of a program, for its report and its limits: judged on the simulated
slides where an operation has a limit, or `--max-engagement` gives one."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING

from msgspec import Struct

from camtool.errors import OptionError
from camtool.findings import Finding
from camtool.planning.job import Job, Operation
from camtool.stock.findings import StockCode
from camtool.stock.slides import ToolsOfRows, slide_moves, tools_of_rows
from camtool.toolpath.moves import Toolpath
from camtool.verification.case import Case
from camtool.verification.report import (
    EngagementReport,
    Gates,
    engagement_gate_findings,
    rounded,
    rounded_or_none,
)

if TYPE_CHECKING:
    from camtool.stock.checks import StockRequest
    from camtool.stock.engagement import OperationEngagement
    from camtool.stock.moves import StockMoves


class ProgramSlides(Struct, frozen=True, eq=False, dict=True):
    """A program and its job (None: not known): the cutters of its rows, and the moves of its
    simulated slides, which are computed once."""

    case: Case
    job: Job | None

    @cached_property
    def tools(self) -> ToolsOfRows:
        """The cutters of the rows; OptionError where they are not known."""
        return tools_of_rows(self.case.decoded, self.job or Job())

    @property
    def not_known(self) -> str:
        """Why no tool can be followed through the stock; "" where they can."""
        if self.case.machine.spindle.turns == "work":
            return "the work turns, and not the tool"
        try:
            has_tools = bool(self.tools.cutters)
        except OptionError as error:
            return f"the shape of a tool is not known: {error.mend}"
        return "" if has_tools else "there is no tool"

    @cached_property
    def moves(self) -> StockMoves:
        """The moves of the tips; OptionError where the cutters are not known."""
        case = self.case
        return slide_moves(case.decoded, case.target, self.tools, case.simulation)


class EngagementJudged(Struct, frozen=True, eq=False):
    """The greatest engagement of each operation (None if nothing limits it), and the findings
    about its limits."""

    rows: tuple[OperationEngagement, ...] | None = None
    findings: tuple[Finding, ...] = ()

    def reports(
        self, decoded: Toolpath, request: StockRequest | None, in_stock: tuple[Finding, ...]
    ) -> tuple[EngagementReport, ...] | None:
        """Return the rows of the report, None if no engagement was judged; `in_stock`: the
        findings about the stock."""
        if self.rows is None:
            return None
        lefts = [each.measured or 0.0 for each in in_stock if each.code is StockCode.MATERIAL_LEFT]
        is_whole = request is not None and request.is_whole
        left_mm = rounded(max(lefts, default=0.0)) if is_whole else None
        return tuple(
            EngagementReport(
                each.name,
                rounded_or_none(each.greatest_rad, math.degrees(1.0)),
                each.at_mm and (rounded(each.at_mm[0]), rounded(each.at_mm[1])),
                None
                if each.row is None or decoded.block[each.row] < 0
                else int(decoded.block[each.row]) + 1,
                rounded_or_none(each.limit_rad, math.degrees(1.0)),
                None if each.limit_rad is None else left_mm,
            )
            for each in self.rows
        )


def judge_engagement(
    slides: ProgramSlides, request: StockRequest | None, gates: Gates | None
) -> EngagementJudged:
    """Bound the engagement of each operation, if at least one of them or a gate has a limit."""
    case, job = slides.case, slides.job
    decoded, gate_rad = case.decoded, None if gates is None else gates.engagement_rad
    own: list[tuple[int, str, float | None]] = [(0, "", None)]
    if decoded.operations is not None and request is not None:
        begin = decoded.operations.begin.tolist()
        own = [
            (row, *_limit_of(each)) for row, each in zip(begin, request.operations, strict=True)
        ]
    elif request is not None and len(request.operations) == 1:
        own = [(0, *_limit_of(request.operations[0]))]
    if gate_rad is None and all(limit is None for _, _, limit in own):
        return EngagementJudged()
    from camtool.stock.engagement import engagement_by_operation, engagement_findings

    rows, reason = None, slides.not_known
    if not reason:
        stock = None if job is None else job.stock
        box = None if stock is None else stock.box_mm
        rows = engagement_by_operation(slides.moves, decoded, own, box, gate_rad)
    findings = tuple(engagement_findings(rows or ()))
    if gate_rad is not None:
        findings = (*engagement_gate_findings(gate_rad, rows or (), reason), *findings)
    return EngagementJudged(rows, findings)


def _limit_of(operation: Operation) -> tuple[str, float | None]:
    """Return the name of an operation, and the limit of engagement that it sets, rad (None: no
    limit)."""
    return operation.name or operation.kind, operation.engagement_rad
