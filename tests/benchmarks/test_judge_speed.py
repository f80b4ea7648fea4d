"""How fast steps are judged, beside C.

Run it by `pytest -m benchmark -s tests/benchmarks/test_judge_speed.py`.

The C twin (reference.c) runs and judges the same circles in the same process, one after the other
in turns; the ratio of the two is the answer, whatever else the machine is doing.
"""

import ctypes
import shutil
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

from camtool.kernels.judging import BEFORE_FIRST, BINS, bin_directions
from camtool.simulation.motion import Options
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Toolpath
from camtool.verification.case import Case, VerifyOptions
from camtool.verification.verify import Verification, verify
from tests.oracles.dense_moves import pic_mmh
from tests.targets import on, simulate

pytestmark = pytest.mark.benchmark
RADIUS, TURNS, STEP = 142_857, 12, 0.00014
PLAY, COMPENSATION = 0.1925, 1457 * STEP
LEAST_RATIO = 0.8
ROUNDS = 5


class Sums(ctypes.Structure):
    """Sums that the C twin fills."""

    _fields_ = [
        *[(f"number{k}", ctypes.c_double) for k in range(13)],
        *[(f"count{k}", ctypes.c_int64) for k in range(5)],
        ("histogram", ctypes.c_int64 * (2 * BINS)),
        ("bin", ctypes.c_double * (720 * 9)),
    ]


def twin(folder: Path) -> ctypes.CDLL:
    """The twin, compiled with all that the compiler can do."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler")
    library = folder / "reference.so"
    source = Path(__file__).with_name("reference.c")
    flags = ["-O3", "-march=native", "-shared", "-fPIC", "-o", str(library)]
    subprocess.run([compiler, *flags, str(source), "-lm"], check=True)
    assert f"BINS = {BINS}" in source.read_text()
    return ctypes.CDLL(str(library))


def circles() -> Toolpath:
    """The circles that the twin runs."""
    r = RADIUS * STEP
    b = ToolpathBuilder((-r, 0.0, 0.0))
    for _ in range(TURNS):
        b.arc(-r, 0.0, centre=(0.0, 0.0), ccw=False, feed=0.8)
    return b.finish()


def judged() -> tuple[Verification, float]:
    """The verdict, and the seconds that it took."""
    machine = pic_mmh(
        "axes.x.travel_mm=100",
        "axes.y.travel_mm=100",
        *(f"axes.{axis}.backlash_mm={PLAY}" for axis in "xy"),
        *(f"axes.{axis}.compensation_mm={COMPENSATION}" for axis in "xy"),
    )
    toolpath, target = circles(), on(machine)
    begun = time.perf_counter()
    found = verify(Case(toolpath, target))
    return found, time.perf_counter() - begun


def test_judging_is_as_fast_as_c(tmp_path: Path) -> None:
    library, directions = twin(tmp_path), bin_directions()
    where = directions.ctypes.data_as(ctypes.c_void_p)
    judged()
    ours, theirs = [], []
    for _ in range(ROUNDS):
        sums = Sums()
        numbers = (ctypes.c_double(STEP), ctypes.c_double(PLAY), ctypes.c_double(COMPENSATION))
        begun = time.perf_counter()
        library.run(
            ctypes.c_int64(RADIUS),
            ctypes.c_int64(TURNS),
            *numbers,
            ctypes.c_int64(BEFORE_FIRST),
            where,
            ctypes.byref(sums),
        )
        theirs.append(time.perf_counter() - begun)
        found, seconds = judged()
        ours.append(seconds)
    steps = sums.count0
    assert found.report.steps.iterations == steps
    assert found.report.error_um.interpolation.max == pytest.approx(sums.number0 * 1e3, abs=1e-6)
    assert found.report.error_um.mechanics.max == pytest.approx(
        np.sqrt(sums.number2) * 1e3, abs=1e-6
    )
    assert found.report.error_um.total.max == pytest.approx(sums.number4 * 1e3, abs=1e-6)
    assert found.report.reversals.x == sums.count3
    ratio = min(theirs) / min(ours)
    speed = steps / min(ours) / 1e6
    print(f"\njudged {speed:.0f} M steps/s, C {steps / min(theirs) / 1e6:.0f}, ratio {ratio:.2f}")
    assert ratio >= LEAST_RATIO


def test_chunks_are_judged_too() -> None:
    """Time the judging of samples as other controllers give them, without making them."""
    from camtool.verification.verify import judge

    machine, toolpath = pic_mmh(), circles()
    chunks = list(simulate(toolpath, machine, Options()))
    case = Case(toolpath, on(machine), None, None, VerifyOptions())
    judge(case, chunks[:1])
    begun = time.perf_counter()
    found = judge(case, chunks)
    seconds = time.perf_counter() - begun
    print(f"\n{found.report.steps.iterations / seconds / 1e6:.0f} M samples/s")
