"""Slanted lines in pieces that the machine's timers do exactly."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import PostError
from camtool.target.registry import LoadedTarget, load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.findings import ProgramCode
from camtool.toolpath.moves import Kind, Toolpath
from tests.targets import simulate

SPLIT = "dialect.slants=split"


def target(*settings: str) -> LoadedTarget:
    return load_target("flashcut", settings=settings)


def decoded(path: Toolpath, machine: LoadedTarget) -> Toolpath:
    program = machine.target.write(path, machine.machine)
    back: Toolpath = machine.target.read(program.data, machine.machine)
    assert (program.row_of_block[back.block] >= 0).all() or back.kind[-1] == Kind.END
    return back


def misses_um(path: Toolpath, machine: LoadedTarget) -> float:
    """Largest distance of the controller from the end of any row, in X or Y, µm."""
    worst = 0.0
    for chunk in simulate(path, machine.machine):
        for k in np.flatnonzero(np.diff(chunk.row, append=-1)).tolist():
            off = chunk.commanded[k] - path.end[chunk.row[k]]
            if k + 1 < len(chunk.row):  # otherwise the row may go on in the next chunk
                worst = max(worst, float(np.abs(off[:2]).max()) * 1000.0)
    return worst


def star() -> Toolpath:
    path = ToolpathBuilder().rapid(z=0.5).rapid(1.0, 1.0).line(z=-0.02, feed=3.0)
    for x, y in ((11, 6), (11, 1), (1, 6), (2.3, 1.7), (9.1, 4.123), (1, 1)):
        path.line(x, y, feed=3.0)
    return path.finish()


@pytest.mark.parametrize("clock", ["whole-ms", "late-longer"])
@pytest.mark.parametrize("half_period", [1, 3, 20, 40])
def test_pieces_are_made_exactly(half_period: int, clock: str) -> None:
    fast = (f"controller.half_period_ms={half_period}", f"controller.clock={clock}")
    whole, split = target(*fast), target(*fast, SPLIT)
    back = decoded(star(), split)
    assert misses_um(back, split) < 7.0  # what is left is the rounding of whole rows
    assert ProgramCode.EXECUTED_OTHERWISE not in {one.code for one in back.findings}
    if half_period == 20:
        assert misses_um(decoded(star(), whole), whole) > 500.0
    fine = target(*fast, SPLIT, "dialect.decimals=4")
    assert misses_um(decoded(star(), fine), fine) <= 2.0


def test_pieces_end_on_whole_steps_beside_the_line() -> None:
    path = ToolpathBuilder().line(1.0, 0.5, feed=3.0).finish()
    machine = target(SPLIT)
    back = decoded(path, machine)
    lines = back.end[back.kind == Kind.LINE]
    assert len(lines) == 14  # 263 steps of Y, 19 at a time
    assert lines[-1].tolist() == [1.0, 0.5, 0.0]
    steps = lines[:-1, :2] / 0.0019
    assert np.abs(steps - np.rint(steps)).max() < 0.5 / 1.9 + 1e-9  # as far as the decimals allow
    off = np.abs(lines[:, 0] - 2.0 * lines[:, 1]) / np.sqrt(5.0)
    assert off.max() < 0.0019 + 0.0005
    assert (np.diff(lines[:, 0]) > 0.0).all()


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.sampled_from([0.5, 2.0, 3.0, 14.1]))
def test_only_lines_that_need_it_are_split(x: float, y: float, feed: float) -> None:
    path = ToolpathBuilder().rapid(0.5, 0.5).line(0.5 + x, 0.5 + y, feed=feed).finish()
    whole, split = decoded(path, target()), decoded(path, target(SPLIT))
    assert ProgramCode.EXECUTED_OTHERWISE not in {one.code for one in split.findings}
    too_long = ProgramCode.EXECUTED_OTHERWISE in {one.code for one in whole.findings}
    if not too_long and min(abs(x), abs(y)) < 0.019:
        assert split.end.tolist() == whole.end.tolist()
    assert split.end[-1].tolist() == whole.end[-1].tolist()
    assert set(split.feed[split.is_feed]) == set(whole.feed[whole.is_feed])


def test_other_rows_stay() -> None:
    path = ToolpathBuilder().line(1.0, 0.0, feed=3.0).line(1.0, -2.0, feed=3.0).rapid(0.0, 1.0)
    path.arc(2.0, 1.0, centre=(1.0, 1.0), ccw=True, feed=3.0).line(z=-0.1, feed=3.0)
    wanted = path.event(Kind.END).finish()
    machine, plain = target(SPLIT), target()
    assert machine.target.write(wanted, machine.machine).data == (
        plain.target.write(wanted, plain.machine).data
    )


def test_too_many_pieces_are_refused() -> None:
    path = ToolpathBuilder()
    for _ in range(10):
        path.line(9999.0, 9000.0, feed=14.1).line(-9999.0, -9000.0, feed=14.1)
    machine = target(SPLIT, "controller.half_period_ms=1")
    with pytest.raises(PostError, match="more than 10000000 blocks"):
        machine.target.write(path.finish(), machine.machine)


def test_without_its_timers_nothing_is_split() -> None:
    machine = target(SPLIT, "controller.model=path")
    assert len(decoded(ToolpathBuilder().line(1.0, 0.5, feed=3.0).finish(), machine)) == 2
