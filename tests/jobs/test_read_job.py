"""Job files from Python: the job that the command line would make of them."""

from pathlib import Path

import pytest

import camtool
from camtool.cli.options import DrawingFlags, JobFlags

SAMPLES = Path("samples")
DRAWINGS = {"logo.toml": "logo.dxf", "plate.toml": "plate.dxf"}


@pytest.mark.parametrize("name", DRAWINGS)
def test_it_is_the_commands_job(name: str) -> None:
    flags = JobFlags(str(SAMPLES / name))
    assert camtool.read_job(SAMPLES / name) == flags.job(DrawingFlags())
    # And the drawing has all that its operations take.
    camtool.read_job(SAMPLES / name, drawing=SAMPLES / DRAWINGS[name], target="grbl")


def test_operations_by_name_and_number() -> None:
    whole = camtool.read_job(SAMPLES / "logo.toml")
    names = [operation.name for operation in whole.operations]
    assert names == ["lines", "parts"]
    for chosen in ("parts", "2"):
        one = camtool.read_job(SAMPLES / "logo.toml", operations=[chosen])
        assert one.operations == whole.operations[1:]
    with pytest.raises(camtool.CamtoolError, match="did you mean 'parts'"):
        camtool.read_job(SAMPLES / "logo.toml", operations=["part"])


def test_mistakes_name_file_and_key(tmp_path: Path) -> None:
    file = tmp_path / "job.toml"
    file.write_text("dept = 1\n")
    with pytest.raises(camtool.CamtoolError, match=r"job\.toml: key dept: .*mean depth\?"):
        camtool.read_job(file)
    with pytest.raises(camtool.CamtoolError, match="cannot be read"):
        camtool.read_job(tmp_path / "none.toml")


def test_what_the_drawing_has_not_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "job.toml"
    file.write_text("layers = ['CTU']\n")
    job = camtool.read_job(file)
    drawing = camtool.read_drawing(SAMPLES / "logo.dxf")
    for given in (drawing, SAMPLES / "logo.dxf"):
        with pytest.raises(camtool.CamtoolError, match="'CTU'; did you mean CUT"):
            camtool.read_job(file, drawing=given)
    with pytest.raises(camtool.CamtoolError, match="key layers: no layer matches 'CTU'"):
        camtool.plan(SAMPLES / "logo.dxf", "grbl", job)


def test_layers_of_a_file_are_read_as_far_as_the_job_needs_them() -> None:
    job = camtool.job_of(layers=("CUT",))
    assert job.operations[0].layers == ("CUT",)
    path = camtool.plan(SAMPLES / "logo.dxf", "grbl", job)
    assert path.drawing is not None
    assert set(path.drawing.layers) == {"CUT"}


def test_a_breakthrough_of_others_leaves_a_carving_its_depth() -> None:
    job = JobFlags(str(SAMPLES / "sign.toml"), given={"breakthrough": "0.1mm"}).job(DrawingFlags())
    assert [each.depth_mm for each in job.operations] == [2.5, 2.5, 6.1]
