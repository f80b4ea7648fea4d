"""Programs whose signals are tested, and what the controller's model says of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from camtool_postprocessors.pic_mmh.controller import compensations
from hypothesis import strategies as st

from camtool.arrays import Ints
from camtool.records import replace
from camtool.simulation.pulses import OUTPUTS
from camtool.target.registry import LoadedTarget, load_target
from camtool.target.signals import NoSignals
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from camtool.waveforms.signals import Signals


@dataclass(frozen=True)
class Bench:
    """A machine whose signals are tested: its settings, the unit of coordinates, mm, a feed, and
    whether it has arcs and dwells."""

    name: str
    settings: tuple[str, ...]
    unit_mm: float
    feed: float
    arcs: bool = True
    dwells: bool = True

    def target(self, *settings: str) -> LoadedTarget:
        return load_target(self.name, settings=(*self.settings, *settings))


STEP_I8751 = tuple(f"axes.{axis}.coded_step_mm=0.005" for axis in "xyz")

BENCHES = {
    bench.name: bench
    for bench in (
        Bench("pic-mmh", (), 0.00014, 0.8),
        Bench("valcnc", (), 0.04, 14400.0, dwells=False),
        Bench("i8751", (*STEP_I8751, "feed.default_mm_min=20"), 0.005, 20.0, arcs=False),
        Bench("flashcut", (), 0.0019, 3.0),
        Bench("grbl", (), 0.004, 300.0),
    )
}


@st.composite
def paths(draw: st.DrawFn, bench: Bench, reach: int = 150) -> Toolpath:
    """A few moves of some steps each: lines, half circles, Z alone, dwells."""
    builder = ToolpathBuilder()
    steps = st.integers(-reach, reach)
    x = y = z = 0
    for block in range(draw(st.integers(1, 8))):
        builder.block = block
        kinds = ["line", "rapid", "z", *["arc"] * bench.arcs, *["dwell"] * bench.dwells]
        kind = draw(st.sampled_from(kinds))
        if kind == "dwell":
            builder.event(Kind.DWELL, draw(st.integers(0, 3)))
        elif kind == "arc":
            radius = draw(st.integers(1, reach // 2))
            centre = ((x + radius) * bench.unit_mm, y * bench.unit_mm)
            x += 2 * radius
            builder.arc(
                x * bench.unit_mm,
                y * bench.unit_mm,
                centre=centre,
                ccw=draw(st.booleans()),
                feed=bench.feed,
            )
        elif kind == "z":
            z = draw(steps)
            builder.line(z=z * bench.unit_mm, feed=bench.feed)
        else:
            x, y = draw(steps), draw(steps)
            place = x * bench.unit_mm, y * bench.unit_mm
            if kind == "rapid":
                builder.rapid(*place)
            else:
                builder.line(*place, feed=bench.feed)
    builder.block += 1
    return builder.event(Kind.END).finish()


@dataclass(frozen=True, eq=False)
class Totals:
    """Sums of all ledgers of a run: steps (3,), compensation steps (3,), seconds."""

    steps: Ints
    added: Ints
    seconds: float


def totals(path: Toolpath, target: LoadedTarget) -> Totals:
    steps, added, seconds = np.zeros(3, np.int64), np.zeros(3, np.int64), 0.0
    each = np.zeros((len(path), 3), dtype=np.int64)
    each[:] = [round(axis.compensation_mm / axis.coded_step_mm) for axis in target.machine.axes]
    if getattr(target.machine.controller, "compensates_by_region", False):
        # NaN until an axis turns away for the first time: nothing is added until then.
        each[:, :2] = np.rint(np.nan_to_num(compensations(path, target.machine)) / 0.00014)
    for chunk in target.simulate(path, replace(OUTPUTS, chunk_steps=97)):
        steps += chunk.ledger.steps.sum(axis=0)
        added += (chunk.ledger.reversals * each[chunk.ledger.row]).sum(axis=0)
        seconds += float(chunk.ledger.duration_s.sum())
    return Totals(steps, added, seconds)


def signals(path: Toolpath, target: LoadedTarget) -> Signals:
    model = target.target.signals()
    assert not isinstance(model, NoSignals)
    return Signals(target, path, model, "a program")


def of_text(name: str, text: str, settings: Sequence[str] = ()) -> Signals:
    return Signals.of(text.encode(), load_target(name, settings=settings), "a program")
