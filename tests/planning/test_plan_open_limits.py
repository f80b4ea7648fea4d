"""Planning for machines of which little is known, and for those with a slow Z."""

import numpy as np
import pytest

from camtool.errors import OptionError
from camtool.findings import Severity
from camtool.geometry.polylines import Polyline
from camtool.planning.items import Feeds
from camtool.planning.job import Job, Operation, job_of
from camtool.planning.plan import plan
from camtool.planning.settings import feeds_of, lowered_feeds
from tests.drawings import drawing_of
from tests.oracles.path_machine import path_machine
from tests.targets import verify


def test_without_limits_every_feed_and_every_size_is_taken() -> None:
    machine = path_machine()
    assert feeds_of(Operation(), machine) == Feeds(100.0, 100.0)
    assert feeds_of(Operation(feed_mm_min=1e6), machine) == Feeds(1e6, 1e6)
    ring = Polyline(np.array([[0.0, 500.0, 1.0], [1000.0, 500.0, 1.0]]), closed=True)
    drawing = drawing_of([ring])
    toolpath = plan(drawing, job_of(feed_mm_min=1e6), machine)
    assert toolpath.findings == ()
    found = verify(toolpath, machine, wanted=toolpath, drawing=drawing)
    assert [f for f in found.findings if f.severity == Severity.ERROR] == []
    assert found.report.time_split_s.air == pytest.approx(1.1 / 1e6 * 60.0)  # the plunge alone


@pytest.mark.parametrize(
    ("setting", "highest"),
    [("limits.max_feed_mm_min=250.5", "250"), ("limits.max_feed_mm_min=500", "500")],
)
def test_the_limit_that_is_said_holds_and_the_mend_can_be_said(setting: str, highest: str) -> None:
    machine = path_machine(setting)
    with pytest.raises(OptionError, match=f"above {highest}") as caught:
        feeds_of(Operation(feed_mm_min=600.0), machine)
    assert f"--feed {highest} or less" in caught.value.mend
    assert feeds_of(Operation(feed_mm_min=float(highest)), machine).cut_mm_min == float(highest)


HARD = ("limits.max_feed_mm_min=35", "feed.default_mm_min=20")


def test_plunges_that_nobody_asked_for_are_no_faster_than_z() -> None:
    machine = path_machine("axes.z.max_rate_mm_min=30.5")
    assert feeds_of(Operation(), machine) == Feeds(100.0, 30.0)
    assert feeds_of(Operation(feed_mm_min=20.0), machine) == Feeds(20.0, 20.0)
    assert feeds_of(Operation(plunge_feed_mm_min=40.0), machine) == Feeds(100.0, 30.0)
    with pytest.raises(OptionError, match="plunge feed 40"):
        feeds_of(Operation(plunge_feed_mm_min=40.0), path_machine(*HARD))


def test_feeds_above_the_rates_of_the_axes_are_lowered_with_a_word() -> None:
    """Controllers hold a move to what its axes can do; the rates may be no one's in particular."""
    machine = path_machine("axes.y.max_rate_mm_min=80.2", "axes.z.max_rate_mm_min=30.5")
    slow = Operation(feed_mm_min=60.0, plunge_feed_mm_min=30.0)
    fast = Operation(feed_mm_min=600.0, plunge_feed_mm_min=40.0)
    assert feeds_of(slow, machine) == Feeds(60.0, 30.0)
    assert feeds_of(fast, machine) == Feeds(80.0, 30.0)
    assert list(lowered_feeds(Job(operations=(slow,)), machine)) == []
    cut, plunge = lowered_feeds(Job(operations=(fast, fast)), machine)
    assert {each.severity for each in (cut, plunge)} == {Severity.WARNING}
    assert (cut.measured, cut.limit) == (600.0, 80.2)
    assert "becomes 80" in cut.message
    assert "--set axes.y.max_rate_mm_min=600," in cut.message
    assert "--set axes.z.max_rate_mm_min=40," in plunge.message
    assert "in the machine file of made-up" in cut.message
    drawing = drawing_of([Polyline(np.array([[0.0, 0, 0], [4, 0, 0]]))])
    made = plan(drawing, Job(operations=(fast,)), machine)
    assert float(made.feed[made.is_feed].max()) == 80.0
