"""matlab-router's wire: jobs sent to the virtual machine number by number, with and without
faults."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from camtool.errors import MachineError, PostError
from camtool.sending.faults import Faults, WiredTwin
from camtool.sending.prepare import Consignment, consignment, rest_of
from camtool.target.registry import LoadedTarget, load_target
from camtool.target.wire import Conversation, Manner, WireState, Write
from tests.feeding import logo, same_motion
from tests.sending.talking import talked

STREAM = "dialect.format=stream"
JOBS = b"2\r14\r14\r4\r10\r2\r0\r240\r-480\r48\r0\r" + b"1\r30\r2\r8\r0\r480\r0\r"


@cache
def loaded(*settings: str) -> LoadedTarget:
    return load_target("matlab-router", settings=settings)


@cache
def consigned(program: bytes, *settings: str) -> Consignment:
    return consignment(program, loaded(*settings), source="logo.m")


def conversation(program: bytes, *settings: str, manner: Manner | None = None) -> Conversation:
    one = consigned(program, *settings)
    return one.wire.conversation(one.packets, loaded(*settings).machine, manner or Manner())


def going_on(talk: Conversation, now: float) -> None:
    """The user resets the master whenever he is asked."""
    if talk.state is WireState.WAITING:
        talk.resume(now)


def test_each_form_of_the_logo_arrives_and_moves_as_verify_says() -> None:
    stream = logo("matlab-router", STREAM)
    for settings in ((), (STREAM,)):
        target, program = loaded(*settings), logo("matlab-router", *settings)
        twin, talk = target.twin(), conversation(program, *settings)
        talked(talk, WiredTwin(twin), going_on, latest_s=2000.0, coarse=True)
        assert talk.state is WireState.FINISHED, talk.why
        assert b"".join(twin.decoded) == stream
        same_motion(twin, program, target)


@pytest.mark.parametrize("echo", ["none", "characters"])
@pytest.mark.parametrize("expected", ["detected", "echo", "none"])
@pytest.mark.parametrize("reset", ["hand", "opening", "none"])
def test_each_reading_of_what_is_open(echo: str, expected: str, reset: str) -> None:
    settings = (STREAM, f"link.echo={expected}", f"link.reset={reset}")
    itself = "reset=itself" if reset == "none" else "reset=opening"
    twin = loaded(*settings).twin([f"echo={echo}", itself])
    talk, asked = conversation(JOBS, *settings), list[str]()

    def wish(talk: Conversation, now: float) -> None:
        if talk.state is WireState.WAITING:
            asked.append(talk.why)
            assert not twin.is_moving
        going_on(talk, now)

    talked(talk, WiredTwin(twin), wish, latest_s=2000.0, coarse=True)
    if (echo, expected) in (("none", "echo"), ("characters", "none")):
        assert talk.state is WireState.FAILED
        assert twin.decoded == []
        assert not twin.is_moving
        return
    assert talk.state is WireState.FINISHED, talk.why
    assert "goes home on the last number" in asked[0]
    assert asked[1:] == (
        ["reset the master for job 2 of 2, which then begins"] * (reset == "hand")
    )
    same_motion(twin, JOBS, loaded(*settings))


def test_the_pauses_are_those_of_the_thesis() -> None:
    talk = conversation(JOBS, STREAM, "link.echo=none")
    talk.begin(0.0)
    talk.resume(0.0)
    due = [0.0]
    for _ in range(10):
        due.append(talk.next_s)
        talk.tick(talk.next_s)
    sent = b"".join(each.data for each in talk.actions() if isinstance(each, Write))
    assert sent == b"\r".join(JOBS.split(b"\r")[:10]) + b"\r"
    assert np.allclose(np.diff([*due[1:], talk.next_s]), [0.01] * 3 + [0.001] * 7)


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("fault", ["drop=0.02", "double=0.02", "garble=0.02", "unplug=9s"])
def test_with_an_echo_no_job_begins_that_came_back_otherwise(fault: str, seed: int) -> None:
    settings = (STREAM, "link.echo=echo")
    twin, talk = loaded(*settings).twin(["echo=characters"]), conversation(JOBS, *settings)
    line = WiredTwin(twin, faults_back=Faults.of(fault), seed=seed)
    now = talked(talk, line, going_on, latest_s=1000.0, coarse=True)
    assert now < 1000.0
    assert JOBS.startswith(b"".join(twin.decoded))
    assert talk.state in (WireState.FINISHED, WireState.FAILED)
    assert (talk.state is WireState.FINISHED) == (len(twin.decoded) == 2 and talk.block == 4)
    if "has not begun" in talk.why:
        assert not twin.is_moving


@pytest.mark.parametrize("seed", range(12))
def test_digits_that_are_garbled_on_the_way_never_begin_a_job(seed: int) -> None:
    settings = (STREAM, "link.echo=echo")
    twin, talk = loaded(*settings).twin(["echo=characters"]), conversation(JOBS, *settings)
    talked(
        talk, WiredTwin(twin, Faults(garble=0.05), seed=seed), going_on, latest_s=2e3, coarse=True
    )
    assert JOBS.startswith(b"".join(twin.decoded))


@pytest.mark.parametrize(("at_s", "jobs"), [(0.002, 0), (0.03, 0), (1.0, 1), (13.0, 2)])
def test_a_stop_never_begins_what_is_not_complete(at_s: float, jobs: int) -> None:
    settings = (STREAM, "link.echo=none", "link.margin_s=0.1")
    twin, talk = loaded(*settings).twin(), conversation(JOBS, *settings)

    def wish(talk: Conversation, now: float) -> None:
        going_on(talk, now)
        if now >= at_s:
            talk.stop(now)

    talked(talk, WiredTwin(twin), wish, latest_s=100.0, coarse=True)
    assert talk.state is WireState.STOPPED, talk.why
    assert not twin.is_moving
    assert len(twin.decoded) == talk.done == jobs


def test_pauses_are_between_jobs() -> None:
    twin, talk = loaded(STREAM).twin(), conversation(JOBS, STREAM, manner=Manner(single=True))
    rests = list[int]()

    def wish(talk: Conversation, now: float) -> None:
        going_on(talk, now)
        if talk.state is WireState.PAUSED:
            assert not twin.is_moving
            rests.append(talk.done)
            talk.resume(now)
            going_on(talk, now)

    talked(talk, WiredTwin(twin), wish, latest_s=1000.0, coarse=True)
    assert talk.state is WireState.FINISHED
    assert rests == [1]


@pytest.mark.parametrize("settings", [(), (STREAM,)])
def test_the_rest_of_a_program_is_its_arrays_from_there(settings: tuple[str, ...]) -> None:
    target, program = loaded(*settings), logo("matlab-router", *settings)
    whole = target.target.read(program, target.machine)
    for first in (1, 4, 5, 12, 300):
        rest = rest_of(whole, target, first, program)
        again = target.target.read(rest.data, target.machine)
        moves = (whole.block >= first) & whole.is_feed
        others = (again.block >= rest.entry) & again.is_feed
        np.testing.assert_array_equal(whole.end[moves], again.end[others])
        np.testing.assert_array_equal(whole.feed[moves], again.feed[others])
        blocks = again.block[others]
        assert (rest.done[blocks] == whole.block[moves]).all()
        assert (rest.done[: rest.entry] == -1).all()


def test_no_rest_where_the_master_begins_at_one_place() -> None:
    target = loaded(STREAM, "dialect.profile=listing")
    job = b"2\r14\rV\r4\r10\r2\r20\r240\r-480\r48\r48\r"
    whole = target.target.read(job, target.machine)
    with pytest.raises(PostError, match="begins each job at one Y"):
        rest_of(whole, target, 2, job)


def test_homing_is_each_jobs_own() -> None:
    with pytest.raises(MachineError, match="by itself"):
        conversation(JOBS, STREAM, manner=Manner(home=True))


def test_what_a_person_types() -> None:
    terminal = loaded().target.wire().terminal(loaded().machine)  # type: ignore[union-attr]
    assert (terminal.hello, terminal.encode("128")) == (b"", b"128\r")
