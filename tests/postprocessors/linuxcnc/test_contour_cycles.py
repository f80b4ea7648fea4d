"""G70, G71 and G72 of a lathe: our reader makes the moves that LinuxCNC's interpreter makes."""

import math
import random
from pathlib import Path

import numpy as np
import pytest

from camtool.errors import ProgramError
from camtool.target.registry import load_target
from camtool.toolpath.moves import Toolpath
from tests.oracles.canonical import difference
from tests.oracles.rs274 import interpreted, needs_rs274

HEAD = "G18 G21 G90 G94 G8 F100\nG64 P0.01\n"
STEPS = "O1 SUB\nG0 X2 Z1\nG1 Z-2\nX4 Z-4\nZ-6\nO1 ENDSUB\n"

CORNERS = """G18 G21 F400
O100 SUB
G0 X0.202 Z3.041
G2 X1.081 Z0.919 I3.0 K0.0
G1 X3.0 Z-1.0
Z-4.0
X2.268 Z-5.268
G2 X2.0 Z-6.268 I1.73205 K-1.0
G1 Z-6.732
G2 X4.0 Z-8.732 I2.0 K0.0
G1 X4.5
G3 X6.285 Z-12.982 I0 K-2.5
G2 Z-19.982 I3.57071 K-3.5
G1 X10 A0.2
X8.5 Z-22.58
X10.0 Z-25.178 C0.1
Z-27.178
G2 X11.014 Z-35.1 I5.70735 K-3.29514
G1 X12.0 Z-36.1
Z-38.1
G0 X15.0
O100 ENDSUB
"""


def read(text: str) -> Toolpath:
    target = load_target("linuxcnc")
    path: Toolpath = target.target.read(text.encode(), target.machine)
    return path


def moves(text: str) -> list[tuple[str, float, float]]:
    path = read(HEAD + text + "M2\n")
    return [
        (each.kind.name, round(each.end[0], 4), round(each.end[2], 4))
        for each in path
        if each.kind < 15
    ]


def test_levels_of_a_stepped_shaft() -> None:
    """The first level lies at the start itself."""
    assert moves(STEPS + "G71 Q1 X5 Z1 D0 I1.5 R0.5\n") == [
        ("RAPID", 5, 1),
        ("RAPID", 5, 1),
        ("RAPID", 5, 1),
        ("LINE", 5, -6),
        ("RAPID", 5.5, -5.5),
        ("RAPID", 5.5, 0.5),
        ("RAPID", 5, 1),
        ("RAPID", 3.5, 1),
        ("LINE", 3.5, -3.5),
        ("RAPID", 4, -3),
        ("RAPID", 4, 0.5),
        ("RAPID", 3.5, 1),
        ("RAPID", 2, 1),
        ("LINE", 2, -2),
        ("LINE", 4, -4),
        ("LINE", 4, -6),
        ("LINE", 5, -6),
    ]


def test_diameters_and_words_from_where_the_contour_stands() -> None:
    """G7 halves X and U; W and U are words of a contour, and of nothing else."""
    steps = "O1 SUB\nG0 X4 Z1\nG1 W-3\nU4 W-2\nW-2\nU2\nO1 ENDSUB\n"
    lead_out = STEPS.replace("O1 ENDSUB", "X5\nO1 ENDSUB")
    assert moves("G7\n" + steps + "G70 Q1 X12 Z1\n") == moves(lead_out + "G70 Q1 X6 Z1\n")
    for word in "UW":
        with pytest.raises(ProgramError, match=f"the letter {word} is no word here"):
            read(HEAD + f"G1 X1 {word}2\nM2\n")


@pytest.mark.parametrize(
    ("program", "message"),
    [
        ("G71 X5 Z1\n", "G71 without Q"),
        ("G17\nG71 Q1 X5 Z1\n", "in a plane other than XZ"),
        ("G71 Q1 X5 Z1 I0\n", "I that is not above 0"),
        ("G42.1 D1\nG71 Q1 X5 Z1\n", "while the cutter's radius is compensated"),
        ("G71 Q2 X5 Z1\n", "there is no sub o<2>"),
        ("G91\nG71 Q3 X5 Z1\n", "U beside X, or with G91"),
        ("G71 Q4 X5 Z1\n", "runs back along its axis"),
        ("G71 Q5 X5 Z1\n", "both A and C"),
        ("G71 Q1 X5000 Z1 I0.000003\n", "may never end it"),
        ("G74 X5 Z1 R1\n", "a cycle without the depth Y"),
        ("G94 X5 Z1\n", "no motion word"),
        ("G90 X5 Z1 R1\n", "no motion word|nothing in the block uses"),
        ("G75 X5 Z1\n", "does not know G75"),
    ],
)
def test_refusals(program: str, message: str) -> None:
    subs = (
        "O3 SUB\nG1 U1\nO3 ENDSUB\n"
        "O4 SUB\nG0 X2 Z1\nG1 Z-5\nX3 Z-1\nX4 Z-6\nO4 ENDSUB\n"
        "O5 SUB\nG0 X2 Z1\nG1 Z-2 A0.1 C0.1\nX4 Z-4\nO5 ENDSUB\n"
    )
    with pytest.raises(ProgramError, match=message):
        read(HEAD + STEPS + subs + program + "M2\n")


class TestReferee:
    pytestmark = needs_rs274

    @pytest.mark.parametrize("cycle", ["G71", "G71.1", "G71.2", "G72", "G72.1", "G70"])
    @pytest.mark.parametrize("text", [STEPS, CORNERS])
    def test_cycle(self, cycle: str, text: str, tmp_path: Path) -> None:
        words = "E0 D0.5 P2" if cycle == "G70" else "D0.3 I0.7 R0.3"
        number = 100 if text is CORNERS else 1
        if cycle.startswith("G71"):
            text = text.replace("O1 ENDSUB", "X15\nO1 ENDSUB")
        program = HEAD + text + f"{cycle} Q{number} X15 Z3.041 {words}\nM2\n"
        outcome = agree(program, tmp_path)
        refused = number == 100 and cycle.startswith("G72")
        assert outcome.startswith("both refuse" if refused else "alike")

    def test_compensated_finish(self, tmp_path: Path) -> None:
        """G70 goes beside the contour as its moves would, from the second one on."""
        path = "G1 X3 Z-1\nZ-4\nG2 X5 Z-6 I2 K0\nG1 X9\n"
        sub = f"O2 SUB\nG0 X2 Z1\n{path}O2 ENDSUB\n"
        written = HEAD + f"G0 X15 Z3\nG42.1 D0.5 L2\nG0 X2 Z1\n{path}G40\nG0 X20\nM2\n"
        assert agree(written, tmp_path).startswith("alike")
        cycle = read(HEAD + sub + "G42.1 D0.5 L2\nG70 Q2 X15 Z3\nG40\nG0 X20\nM2\n")
        ends = read(written).end
        np.testing.assert_allclose(cycle.end[1:], ends, atol=1e-9)

    def test_random_contours(self, tmp_path: Path) -> None:
        """Contours of lines, arcs, fillets and chamfers on the four sides of an axis."""
        outcomes = [agree(random_program(seed), tmp_path) for seed in range(COUNT)]
        alike = sum(outcome.startswith("alike") for outcome in outcomes)
        assert alike > COUNT / 2


COUNT = 40
CYCLES = ("G70", "G71", "G71.1", "G71.2", "G72")


def random_program(seed: int) -> str:
    """A cycle over a contour that runs one way, in any direction, with a lead-out."""
    chance = random.Random(seed)
    x, z = chance.uniform(0.5, 2.0), 1.0
    sign_x, sign_z = chance.choice((1, -1)), chance.choice((1, -1))
    lines = [f"G0 X{sign_x * x:.3f} Z{sign_z * z:.3f}"]
    pockets = chance.random() < 0.4
    cycle, distance = chance.choice(CYCLES), chance.choice((0.0, 0.1, 0.3))
    # Beside a fillet an offset may leave an arc too small for the four decimals of rs274.
    fillet = distance == 0.0 and cycle != "G70"
    rise = 0.0
    for _ in range(chance.randint(2, 6)):
        rise = chance.choice((0.0, chance.uniform(0.2, 2.0))) if rise else chance.uniform(0.2, 2.0)
        if pockets and chance.random() < 0.4:
            rise = -min(rise, x - 0.3)
        run = chance.uniform(0.5, 3.0)
        x, z = x + rise, z - run
        corner = chance.choice(("", "", f" A{chance.uniform(0.1, 0.3):.3f}" * fillet, " C0.05"))
        if abs(rise) > 0.2 and chance.random() < 0.4:
            # An arc within its quadrant: by a radius that is large enough.
            radius = math.hypot(rise, run) * chance.uniform(1.2, 3.0)
            hollow = chance.choice((2, 3))
            lines.append(f"G{hollow} X{sign_x * x:.3f} Z{sign_z * z:.3f} R{radius:.3f}")
        else:
            lines.append(f"G1 X{sign_x * x:.3f} Z{sign_z * z:.3f}{corner}")
    # A way out; LinuxCNC before 2.9.3 adds it elsewhere than later ones where it is missing.
    way_out = f"Z{sign_z * (z - 0.5):.3f}" if cycle == "G72" else f"X{sign_x * (x + 3.0):.3f}"
    lines.append(f"G1 {way_out}")
    words = f" D{distance} I{chance.uniform(0.3, 1.5):.2f} R0.3"
    if cycle == "G70":  # arcs about corners that four decimals still describe
        words = " D0.6 E0.2 P2"
    start = f"X{sign_x * (x + 3.0):.3f} Z{sign_z * 1.5:.3f}"
    body = "\n".join(lines)
    return HEAD + f"O7 SUB\n{body}\nO7 ENDSUB\n{cycle} Q7 {start}{words}\nM2\n"


def agree(program: str, folder: Path) -> str:
    """Both read the program alike, or both refuse it."""
    path, said, calls = None, "", None
    try:
        path = read(program)
    except ProgramError as error:
        said = str(error)
    try:
        calls = interpreted(program.encode(), folder)
    except ProgramError as error:
        said += f" / {error}"
    assert (path is None) == (calls is None), f"{said}\n{program}"
    if path is None or calls is None:
        return f"both refuse: {said}"
    found = difference(path, calls)
    assert not found, f"{found}\n{program}"
    return f"alike: {len(path)} moves"
