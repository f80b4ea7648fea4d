"""A made part on the grid of the first machine, and its judgement with a made motion."""

from camtool.findings import Code
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Toolpath
from camtool.verification.verify import Case, Verification, VerifyOptions, judge
from tests.oracles.dense_moves import circle, cut, follow, pic_mmh, square
from tests.targets import on

MACHINE = pic_mmh()
STEP = MACHINE.axes.x.coded_step_mm
UM = 1000.0


def grid(mm: float) -> float:
    """On the controller's grid, so that nothing is rounded away."""
    return round(mm / STEP) * STEP


def sample_part(*, shift: float = 0.0) -> ToolpathBuilder:
    """A square, a circle and an open stroke, all on the grid."""
    b = square(ToolpathBuilder(), grid(1.0 + shift), grid(1.0), grid(1.0))
    circle(b, grid(4.0 + shift), grid(2.0), grid(0.75))
    cut(b, grid(1.0 + shift), grid(3.0)).line(grid(2.0 + shift), grid(3.5), feed=1)
    return b.rapid(z=0.2)


def judged(
    decoded: Toolpath, wanted: Toolpath | None = None, bend=lambda points: points, **options
) -> Verification:
    case = Case(decoded, on(MACHINE), wanted, None, VerifyOptions(**options), written_from=wanted)
    return judge(case, follow(decoded, bend=bend))


def codes(found: Verification) -> list[Code]:
    return [finding.code for finding in found.findings]
