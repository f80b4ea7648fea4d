"""The virtual master and its slaves, fed by hand: what they take, drop, send back and do."""

from __future__ import annotations

import numpy as np
import pytest
from camtool_postprocessors.matlab_router.twin import MatlabRouterTwin
from hypothesis import given
from hypothesis import strategies as st

from tests.feeding import at_rest, at_rest_quickly, logo, made, motion, same_motion

JOBS = (b"2\r14\r14\r4\r10\r2\r0\r240\r-480\r48\r0\r", b"1\r30\r2\r8\r0\r480\r0\r")


def router(*choices: str, settings: tuple[str, ...] = ()) -> MatlabRouterTwin:
    twin, _ = made("matlab-router", choices, ["dialect.format=stream", *settings])
    assert isinstance(twin, MatlabRouterTwin)
    return twin


def fed(twin: MatlabRouterTwin, *jobs: bytes) -> bytes:
    """Jobs, each behind a reset when the one before is done: what it says."""
    said = b""
    for job in jobs:
        said += twin.connect(twin.now)
        said += twin.receive(job, twin.now)
        said += at_rest_quickly(twin, twin.now)[0]
    return said


def test_jobs_run_as_verify_says_one_a_reset() -> None:
    twin, loaded = made("matlab-router", (), ["dialect.format=stream"])
    assert fed(twin, *JOBS) == b""
    assert twin.decoded == list(JOBS)
    same_motion(twin, b"".join(JOBS), loaded)
    wanted = motion(b"".join(JOBS), loaded)
    pauses = 2 * 0.03 + 12 * 0.001  # what the numbers take on their way: here nothing
    assert twin.now == pytest.approx(wanted.time_s[-1] - pauses, rel=1e-9)


@pytest.mark.parametrize(
    "setting",
    [
        "dialect.profile=listing",
        "dialect.profile=text",
        "controller.slaves=text",
        "controller.friction_percent=[10,10,10]",
        "controller.home_phase_counts=[100,200,300]",
    ],
)
def test_each_reading_of_the_thesis(setting: str) -> None:
    settings = ("dialect.format=stream", setting)
    jobs = [job.replace(b"\r14\r4", b"\r7\r4") for job in JOBS] if "listing" in setting else JOBS
    twin, loaded = made("matlab-router", (), settings)
    fed(twin, *jobs)
    same_motion(twin, b"".join(jobs), loaded)


def test_homing_begins_on_the_last_number() -> None:
    twin = router()
    twin.receive(JOBS[0][:-1], 0.0)
    assert not twin.is_moving
    twin.advance(1000.0)
    assert not twin.is_moving
    twin.receive(b"\r", 1000.0)
    assert twin.is_moving
    twin.advance(1002.0)
    assert twin.slides.trace.commanded[-1, 2] > 1.0
    assert not twin.slides.trace.commanded[:, :2].any()


def test_the_master_takes_one_job() -> None:
    twin = router()
    twin.receive(JOBS[0], 0.0)
    twin.receive(JOBS[1], 1.0)
    twin.connect(2.0)  # somebody opens the port while it moves
    at_rest(twin, 2.0)
    twin.receive(JOBS[1], twin.now)
    assert twin.decoded == [JOBS[0]]
    assert fed(twin, JOBS[1]) == b""
    assert twin.decoded == list(JOBS)


def test_a_mended_master_takes_one_job_after_the_other() -> None:
    twin, loaded = made("matlab-router", ["reset=itself"], ["dialect.format=stream"])
    twin.receive(b"".join(JOBS), 0.0)
    at_rest(twin, 0.0)
    assert twin.decoded == list(JOBS)
    same_motion(twin, b"".join(JOBS), loaded)


def test_an_echo_is_a_choice() -> None:
    twin = router("echo=characters")
    assert twin.receive(b"00000178\r\n-7\r", 0.0) == b"000001-7"


@pytest.mark.parametrize(
    "words",
    [b"0\r", b"-1\r", b"129\r", b"V\r", b"1\r1\r2\r8\r0\r480\r0\r", b"1\r30\r2\r8\r0\r0\r0\r"],
)
def test_what_would_hang_it_or_run_away_hangs_it_until_a_reset(words: bytes) -> None:
    twin = router()
    twin.receive(words + b"\r" * 20, 0.0)
    assert (twin.decoded, twin.is_moving) == ([], False)
    assert fed(twin, JOBS[1]) == b""
    assert twin.decoded == [JOBS[1]]


def test_a_character_in_place_of_a_number_is_what_atol_makes_of_it() -> None:
    settings = ("dialect.profile=listing",)
    job = JOBS[0].replace(b"\r14\r4", b"\rV\r4")
    twin, loaded = made("matlab-router", (), ["dialect.format=stream", *settings])
    fed(twin, job)
    assert twin.decoded == [job]
    same_motion(twin, job, loaded)


@given(st.lists(st.binary(max_size=12) | st.sampled_from([*JOBS, b"\r", b"1\r"]), max_size=8))
def test_no_bytes_make_it_fall(pieces: list[bytes]) -> None:
    twin = router("echo=characters")
    now = 0.0
    for piece in pieces:
        now = max(now, twin.now)
        twin.receive(piece, now)
        twin.connect(now)
    at_rest_quickly(twin, twin.now)
    assert np.isfinite(twin.slides.commanded_mm).all()


def test_the_logo_is_the_stream_of_its_jobs() -> None:
    """Its jobs begin as they would in the stream that camtool writes."""
    words = logo("matlab-router", "dialect.format=stream").split(b"\r")
    first = b"\r".join(words[: 3 + 4 * int(words[0])]) + b"\r"
    twin = router()
    fed(twin, first)
    assert twin.decoded == [first]
