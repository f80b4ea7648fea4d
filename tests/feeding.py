"""Feeding twins in memory, and what their slides should have done."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import camtool
from camtool.simulation.motion import Options
from camtool.target.registry import LoadedTarget, load_target
from camtool.target.twin import Twin, TwinTrace

ROOT = Path(__file__).parents[1]


@cache
def logo(name: str, *settings: str) -> bytes:
    """The program that camtool writes for the sample logo."""
    run = camtool.post(
        ROOT / "samples" / "logo.dxf", load_target(name, settings=settings), check=False
    )
    assert run.program is not None
    return run.program.data


def motion(program: bytes, loaded: LoadedTarget) -> TwinTrace:
    """Simulate a program as `verify` does: its samples, and the time at the end of each row."""
    chunks = list(loaded.simulate(loaded.target.read(program, loaded.machine), Options()))
    assert chunks
    rows = np.concatenate([chunk.row for chunk in chunks])
    total = np.zeros(1 + max(int(chunk.ledger.row.max(initial=-1)) for chunk in chunks))
    for chunk in chunks:
        np.add.at(total, chunk.ledger.row, chunk.ledger.duration_s)
    return TwinTrace(
        np.cumsum(total)[rows],
        rows,
        np.concatenate([chunk.commanded for chunk in chunks]),
        np.concatenate([chunk.slide for chunk in chunks]),
    )


def same_motion(twin: Twin, program: bytes, loaded: LoadedTarget) -> None:
    """The twin's slides did, to the last step, what `verify` says of the program."""
    wanted, trace = motion(program, loaded), twin.slides.trace
    assert len(trace) == len(wanted) > 0
    np.testing.assert_array_equal(trace.commanded, wanted.commanded)
    np.testing.assert_array_equal(trace.slide, wanted.slide)
    assert (np.diff(trace.time_s) >= 0.0).all()


def at_rest(twin: Twin, now: float) -> tuple[bytes, float]:
    """Let it work until it does nothing more by itself: what it sends, and when that is."""
    sent = twin.advance(now)
    while (at := twin.next_s()) is not None:
        now = max(now, at)
        sent += twin.advance(now)
    return sent, now


def at_rest_quickly(twin: Twin, now: float) -> tuple[bytes, float]:
    """As `at_rest`, a block at a time."""
    sent = b""
    while twin.slides.ends_s is not None:
        now = twin.slides.ends_s
        sent += twin.advance(now)
    return sent, now


def made(name: str, choices: Sequence[str] = (), settings: Sequence[str] = ()) -> tuple[Any, Any]:
    """A twin, and its target."""
    loaded = load_target(name, settings=settings)
    return loaded.twin(choices), loaded
