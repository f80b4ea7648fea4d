"""What an INI file of LinuxCNC says of a machine; LinuxCNC's own samples as referee."""

from pathlib import Path

import pytest

from camtool.errors import MachineError
from camtool.tables import parse_table
from camtool.target.registry import find_target, load_target, loaded_target
from camtool.target.template import machine_template

SAMPLES = Path("/usr/share/doc/linuxcnc/examples/sample-configs")

INI = """[EMC]
MACHINE = tried
[EMCMOT]
SERVO_PERIOD = 500000
[KINS]
KINEMATICS = trivkins coordinates=XYYZ kinstype=BOTH
[TRAJ]
COORDINATES = X Y Y Z ; two motors for Y
LINEAR_UNITS = inch
MAX_LINEAR_VELOCITY = 1.5
ARC_BLEND_OPTIMIZATION_DEPTH = 80
[AXIS_X]
MIN_LIMIT = -0.5
MAX_LIMIT = 10
MAX_VELOCITY = 2 # in/s
MAX_ACCELERATION = 20
[AXIS_Y]
MIN_LIMIT = 0
MAX_LIMIT = 8
MAX_VELOCITY = 1
MAX_ACCELERATION = 20
[AXIS_Z]
MIN_LIMIT = -2
MAX_LIMIT = 0.001
MAX_VELOCITY = 1
MAX_ACCELERATION = 10
[JOINT_0]
SCALE = -4000
MAX_VELOCITY = 2.5
BACKLASH = 0.001
[JOINT_1]
SCALE = 2000
MAX_VELOCITY = 0.5
[JOINT_2]
SCALE = 2001
[JOINT_3]
INPUT_SCALE = 8000 0
"""


def values(text: str) -> dict[str, float | int | str]:
    said = find_target("linuxcnc")[0].settings_from(text)
    assert said is not None
    return {each.key: each.value for each in said}


def test_axes_have_the_values_of_their_joints_in_mm() -> None:
    assert values(INI) == pytest.approx(
        {
            "axes.x.coded_step_mm": 25.4 / 4000,
            "axes.x.travel_mm": 266.7,
            "axes.x.max_rate_mm_min": 1.5 * 25.4 * 60,
            "axes.x.acceleration_mm_s2": 508.0,
            "axes.x.compensation_mm": 0.0254,
            "axes.x.backlash_mm": 0.0254,
            "axes.y.coded_step_mm": 0.0127,
            "axes.y.travel_mm": 203.2,
            "axes.y.max_rate_mm_min": 0.5 * 25.4 * 60,
            "axes.y.acceleration_mm_s2": 508.0,
            "axes.z.coded_step_mm": 25.4 / 8000,
            "axes.z.travel_mm": 50.8254,
            "axes.z.max_rate_mm_min": 25.4 * 60,
            "axes.z.acceleration_mm_s2": 254.0,
            "controller.servo_period_s": 0.0005,
            "controller.lookahead_moves": 80,
        }
    )


def test_the_machine_that_our_own_numbers_are_from() -> None:
    """machine.toml has the numbers of axis_mm.ini but for the step."""
    said = values((SAMPLES / "sim/axis/axis_mm.ini").read_text()) if SAMPLES.is_dir() else {}
    if not said:
        pytest.skip("LinuxCNC's samples are not installed")
    own = load_target("linuxcnc").machine
    for axis in "xyz":
        for key in ("travel_mm", "max_rate_mm_min", "acceleration_mm_s2"):
            assert said[f"axes.{axis}.{key}"] == pytest.approx(
                getattr(getattr(own.axes, axis), key)
            )


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("LINEAR_UNITS = inch", "", r"\[TRAJ\] LINEAR_UNITS: says no unit; give the whole"),
        ("LINEAR_UNITS = inch", "#INCLUDE a.inc", "put the files of #INCLUDE in their places"),
        ("= inch", "= furlong", "line 9, .TRAJ. LINEAR_UNITS: 'furlong' is no number"),
        ("= trivkins", "= scarakins", "the kinematics are scarakins"),
        ("coordinates=XYYZ", "coordinates=XZ", "there is no axis Y"),
        ("MAX_LIMIT = 10", "MAX_LIMIT = -10", "line 13, .AXIS_X. MIN_LIMIT: -0.5 is not below"),
        ("MAX_ACCELERATION = 10", "", r"\[AXIS_Z\] MAX_ACCELERATION: is missing"),
        ("SCALE = 2000", "SCALE = many", "line 32, .JOINT_1. SCALE: 'many' is no number"),
    ],
)
def test_what_cannot_be_used_is_named_by_its_line(old: str, new: str, words: str) -> None:
    with pytest.raises(MachineError, match=words):
        values(INI.replace(old, new, 1))


def test_old_files_say_units_per_mm() -> None:
    metric = values(INI.replace("= inch", "= 1.0"))
    assert metric["axes.y.travel_mm"] == 8.0


def test_other_texts_are_none_of_its_settings() -> None:
    assert find_target("linuxcnc")[0].settings_from("$100=250\nok\n") is None
    assert find_target("grbl")[0].settings_from(INI) is None


@pytest.mark.referee
def test_linuxcncs_own_samples() -> None:
    """Every sample is a machine that loads, or is refused for what it is."""
    files = sorted(SAMPLES.rglob("*.ini"))
    if not files:
        pytest.skip("LinuxCNC's samples are not installed")
    target, file = find_target("linuxcnc")
    whole, refused, loaded = file.read_text(), list[str](), 0
    for each in files:
        try:
            said = target.settings_from(each.read_text(errors="replace"))
        except MachineError as error:
            refused.append(str(error))
            continue
        if said is None:  # the settings of a screen
            assert "TRAJ" not in each.read_text(errors="replace"), each
            continue
        text = machine_template("tried", "linuxcnc", whole, (), said)
        axes = loaded_target("linuxcnc", (parse_table(text), str(each))).machine.axes
        assert all(axis.max_rate_mm_min for axis in axes)
        loaded += 1
    reasons = ("there is no axis", "the kinematics are", "#INCLUDE", "is missing")
    assert all(any(reason in error for reason in reasons) for error in refused)
    assert loaded > 200
