"""Jobs from Python: texts with units, one layer as one layer, and errors that name the field."""

from pathlib import Path
from typing import Any

import pytest

import camtool
from camtool.errors import CamtoolError, OptionError
from camtool.planning.job import Tabs

LOGO = Path(__file__).parents[2] / "samples" / "logo.dxf"


def test_texts_are_read_as_a_job_file_reads_them() -> None:
    job = camtool.job_of(
        tabs=4, layers="CUT", depth_mm="1/8in", tool_diameter_mm="3mm", feed_mm_min="2 in/min"
    )
    (operation,) = job.operations
    assert isinstance(operation.tabs, Tabs)
    assert operation.tabs.count == 4
    assert operation.layers == ("CUT",)
    assert (operation.depth_mm, operation.tool.diameter_mm) == (3.175, 3.0)
    assert operation.feed_mm_min == 50.8
    assert camtool.job_of(layers=("A", "B*")).operations[0].layers == ("A", "B*")
    assert camtool.job_of(tabs=Tabs(count=2)).operations[0].tabs == Tabs(count=2)
    assert camtool.job_of(origin=(1.0, 2.0)).placement.origin == (1.0, 2.0)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"depth_mm": "deep"}, "depth_mm: length 'deep' is no number"),
        ({"depth_mm": [1]}, "depth_mm: [1] is no number"),
        ({"side": "left"}, "side: unknown word 'left'; use one of on, outside, inside, auto"),
        ({"tabs": [1]}, "tabs: "),
        ({"tool_diameter_mm": "3,175"}, "write 3.175 with a point"),
        ({"layers": ()}, "layers: an empty list takes nothing"),
    ],
)
def test_what_cannot_be_meant_names_its_field(settings: dict[str, Any], words: str) -> None:
    with pytest.raises(OptionError) as refused:
        camtool.job_of(**settings)
    assert words in str(refused.value)


def test_one_layer_is_one_layer() -> None:
    read = camtool.read_drawing(LOGO, layers="CUT", tolerance_mm="0.5um")
    assert set(read.layers) == {"CUT"}
    with pytest.raises(CamtoolError, match="is no number"):
        camtool.read_drawing(LOGO, tolerance_mm="fine")
