"""What a job may say."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import OptionError
from camtool.planning.job import Entry, Job, Lead, Operation, Placement, Stock, Tabs, Tool, job_of

NO_NUMBERS = (math.nan, math.inf)
ABOVE_ZERO = (0.0, -1.0, *NO_NUMBERS)
AT_LEAST_ZERO = (-0.1, *NO_NUMBERS)

BAD = [
    *[
        (Operation, {name: value})
        for name in (
            "feed_mm_min",
            "plunge_feed_mm_min",
            "depth_mm",
            "step_down_mm",
            "last_pass_mm",
            "mitre_limit",
            "peck_mm",
            "max_hole_mm",
        )
        for value in ABOVE_ZERO
    ],
    *[
        (Operation, {n: v})
        for n in ("overlap_mm", "dwell_s", "spindle_rpm")
        for v in AT_LEAST_ZERO
    ],
    *[(Operation, {"step_over": value}) for value in (0.0, -0.4, 1.01, *NO_NUMBERS)],
    *[(Operation, {n: value}) for n in ("angle_rad", "allowance_mm") for value in NO_NUMBERS],
    (Operation, {"kind": "mill"}),
    (Operation, {"side": "left"}),
    (Operation, {"side": ""}),
    (Operation, {"direction": "up"}),
    (Operation, {"pattern": "spiral"}),
    (Operation, {"joins": "bevel"}),
    (Operation, {"corners": "t-bone"}),
    (Operation, {"start": "longest"}),
    (Operation, {"depth_mm": 1.0, "last_pass_mm": 1.5}),
    (Operation, {"entry": Entry("helix")}),
    *[(Tool, {name: v}) for name in ("diameter_mm", "tip_diameter_mm") for v in AT_LEAST_ZERO],
    *[(Tool, {"kind": "v", "tip_angle_rad": v}) for v in (0.0, -1.0, math.pi, *NO_NUMBERS)],
    (Tool, {"kind": "cone"}),
    (Tool, {"kind": "v", "diameter_mm": 1.0, "tip_diameter_mm": 1.0}),
    *[(Entry, {"kind": "ramp", "angle_rad": v}) for v in (*ABOVE_ZERO, 0.5 * math.pi)],
    *[(Entry, {"kind": "helix", "radius_mm": value}) for value in ABOVE_ZERO],
    (Entry, {"kind": "spiral"}),
    *[(Lead, {"kind": "arc", "length_mm": value}) for value in ABOVE_ZERO],
    (Lead, {"kind": "spiral"}),
    (Tabs, {}),
    (Tabs, {"count": 2, "spacing_mm": 3.0}),
    (Tabs, {"count": 0}),
    *[(Tabs, {"spacing_mm": value}) for value in ABOVE_ZERO],
    *[(Tabs, {"count": 2, n: v}) for n in ("width_mm", "height_mm") for v in ABOVE_ZERO],
    (Placement, {"origin": "upper-right"}),
    (Placement, {"mirror": "z"}),
    *[(Placement, {"rotate_rad": value}) for value in NO_NUMBERS],
    *[(Placement, {"scale": value}) for value in ABOVE_ZERO],
    (Placement, {"copies": (0, 1), "pitch_mm": (1.0, 1.0)}),
    (Stock, {"corner_mm": (0.0, 0.0), "size_mm": (1.0, 0.0), "thickness_mm": 1.0}),
    (Stock, {"corner_mm": (0.0, 0.0), "size_mm": (1.0, 1.0), "thickness_mm": 0.0}),
    (Stock, {"corner_mm": (0.0, 0.0), "thickness_mm": 1.0}),
    (Stock, {"size_mm": (1.0, 1.0), "thickness_mm": 1.0}),
    *[(Job, {"safe_z_mm": value}) for value in ABOVE_ZERO],
    (Job, {"minimise": "time"}),
    (Job, {"operations": ()}),
]


@pytest.mark.parametrize(("record", "settings"), BAD)
def test_what_no_job_can_be_is_refused_with_a_mend(record: type, settings: dict[str, Any]) -> None:
    with pytest.raises(OptionError) as caught:
        record(**settings)
    assert caught.value.mend
    assert "\n" not in str(caught.value)


def test_a_job_says_nothing_unless_told() -> None:
    job = job_of()
    assert job == Job()
    (operation,) = job.operations
    assert (operation.kind, operation.side, operation.layers) == ("profile", "auto", ())
    assert operation.tool.radius_mm == 0.0
    assert operation.feed_mm_min is operation.depth_mm is operation.spindle_rpm is None
    assert job.safe_z_mm is job.stock is None
    assert job.placement == Placement("drawing")


def test_flat_settings_go_where_they_belong() -> None:
    job = job_of(
        tool_diameter_mm=0.2,
        tool_kind="flat",
        side="on",
        origin="centre",
        safe_z_mm=3.0,
        scale=2.0,
    )
    assert job == Job(
        operations=(Operation(tool=Tool(0.2), side="on"),),
        placement=Placement("centre", scale=2.0),
        safe_z_mm=3.0,
    )
    with pytest.raises(TypeError, match="no_such_field"):
        job_of(no_such_field=1)


def test_the_known_words_are_told() -> None:
    with pytest.raises(OptionError, match="on, outside, inside, auto"):
        job_of(side="left")


def test_a_contradiction_names_its_operation_and_key() -> None:
    with pytest.raises(OptionError) as caught:
        Operation(name="outline", depth_mm=1.0, last_pass_mm=2.0)
    assert caught.value.where == "operation 'outline', key last_pass"
    Operation(depth_mm=2.0, last_pass_mm=2.0)
    Operation(last_pass_mm=2.0)  # the machine knows the depth
    Operation(kind="pocket", entry=Entry("helix"))


@pytest.mark.parametrize(
    ("patterns", "layer", "taken"),
    [
        ((), "anything", True),
        (("CUT",), "CUT", True),
        (("CUT",), "cut", True),
        (("CUT",), "CUTS", False),
        (("ENG*", "CUT"), "ENGRAVE 2", True),
        (("?",), "0", True),
    ],
)
def test_layers_are_chosen_by_pattern(patterns: tuple[str, ...], layer: str, taken: bool) -> None:
    assert job_of(layers=patterns).takes(layer, "") is taken
    assert (
        Job((Operation(layers=("OTHER",)), Operation(layers=patterns))).takes(layer, "") is taken
    )


@pytest.mark.parametrize(
    ("layers", "colours", "taken"),
    [
        (("CUT",), ("#ff0000",), True),
        (("CUT",), ("#FF*",), True),
        (("CUT",), ("#00ff00",), False),
        (("ENG",), ("#ff0000",), False),
        ((), ("",), False),
    ],
)
def test_layer_and_colour_must_both_fit(
    layers: tuple[str, ...], colours: tuple[str, ...], taken: bool
) -> None:
    assert Operation(layers=layers, colours=colours).takes("CUT", "#ff0000") is taken


NOSES = [
    Tool(6.0),
    Tool(6.0, "ball"),
    Tool(6.0, "bull", corner_radius_mm=1.0),
    Tool(6.0, "v", math.radians(60.0)),
    Tool(6.0, "v", math.radians(90.0), tip_diameter_mm=0.4),
]


@pytest.mark.parametrize("tool", NOSES, ids=lambda tool: tool.kind)
@given(above=st.floats(0.0, 8.0), across=st.floats(0.0, 2.0))
def test_a_tool_is_as_wide_as_its_outline(tool: Tool, above: float, across: float) -> None:
    # Its outline as a solid of revolution: a point off the axis is in it, or is not.
    within = {
        "flat": across <= 3.0,
        "ball": math.hypot(across, 3.0 - above) <= 3.0 or above >= 3.0,
        "bull": across <= 2.0 or math.hypot(across - 2.0, 1.0 - above) <= 1.0 or above >= 1.0,
        "v": (across - 0.5 * tool.tip_diameter_mm)
        <= above * math.tan(0.5 * (tool.tip_angle_rad or 0.0)),
    }[tool.kind]
    radius = tool.radius_at(above)
    assert radius <= 3.0
    assert within == (across <= radius) or across == pytest.approx(radius, abs=1e-6)


def test_a_bit_whose_width_is_not_known_grows_with_its_depth() -> None:
    assert Tool(kind="v", tip_angle_rad=0.5 * math.pi).radius_at(7.0) == pytest.approx(7.0)


@pytest.mark.parametrize(
    "settings",
    [
        {"kind": "bull", "diameter_mm": 3.0, "corner_radius_mm": 1.6},
        {"flutes": 0},
        {"cutting_length_mm": -1.0},
        {"chip_load_mm": (0.2, 0.1)},
        {"surface_speed_m_min": (-1.0, 10.0)},
    ],
)
def test_what_no_tool_can_be_is_refused(settings: dict[str, Any]) -> None:
    with pytest.raises(OptionError) as caught:
        Tool(**settings)
    assert caught.value.mend
