"""What would make dimensions hold: the search against all there is, allowances against grids,
certificates by simulating anew."""

from __future__ import annotations

import itertools
import math
import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import camtool
from camtool.errors import OptionError
from camtool.inspection.inspector import Inspector
from camtool.inspection.meet import (
    FAR_ENOUGH,
    MAX_CHANGES,
    Bench,
    JobChanges,
    Meeting,
    MeetingCase,
    MeetingTrial,
    closed_form,
    find_cheapest,
    levers,
    meet,
    to_data,
    to_text,
)
from camtool.inspection.meet import _best_left as best_left
from camtool.inspection.tolerances import dimensions_of
from camtool.inspection.verdicts import Tolerances
from camtool.jobs.changes import Change, Left, job_of_tables, text_of
from camtool.jobs.tools import Shop
from camtool.records import replace
from camtool.tables import parse_table
from tests.inspection.test_verdicts import EXACT, SVG

KNOWN = (
    "uncertainty.x.backlash_mm=0.001",
    "uncertainty.y.backlash_mm=0.001",
    "uncertainty.x.scale=1e-5",
    "uncertainty.y.scale=1e-5",
    "uncertainty.squareness_rad=1e-5",
    "uncertainty.tool_diameter_mm=0.002",
    "uncertainty.runout_mm=0.0",
    "uncertainty.temperature_k=0.0",
    "uncertainty.machine_expansion_per_k=0.0",
    "uncertainty.part_expansion_per_k=0.0",
    "uncertainty.process_mm=0.001",
)
SLACK = "axes.x.backlash_mm=0.06"
BORE = {"name": "bore", "kind": "diameter", "at": [15, 20]}
WIDTH = {"name": "width", "kind": "distance", "from": [5, 20], "to": [45, 20]}
HEIGHT = {"name": "height", "kind": "distance", "from": [20, 5], "to": [20, 35]}
WINDOW = {"name": "window", "kind": "distance", "from": [25, 20], "to": [37, 20]}
PROFILE = {"name": "outline", "kind": "profile", "at": [5, 20]}
ROUND = {"name": "round", "kind": "roundness", "at": [15, 20]}


def case(
    tmp_path: Path, dimensions: list[dict[str, Any]], *settings: str, job: str = "", svg: str = SVG
) -> MeetingCase:
    """The plate of `test_verdicts`, or another part, cut by 2 mm on an exact LinuxCNC."""
    drawing = tmp_path / "plate.svg"
    drawing.write_text(svg)
    limits = tmp_path / "tolerances.toml"
    limits.write_text(text_of_rows(dimensions))
    target = camtool.load_target("linuxcnc", settings=[*EXACT, *KNOWN, *settings])
    tables = {"operations": [parse_table(f'tool_diameter = "2mm"\n{job}')]}

    def job_of(tables: dict[str, Any]) -> camtool.Job:
        return job_of_tables(tables, tmp_path / "job.toml", Shop())

    read = camtool.read_drawing(drawing)
    return MeetingCase(read, target, tables, job_of, Tolerances(*dimensions_of(read, limits)))


def text_of_rows(rows: list[dict[str, Any]]) -> str:
    from camtool.tables import toml_lines

    return "\n".join(toml_lines({"dimension": rows})) + "\n"


def limited(dimension: dict[str, Any], limits: str) -> dict[str, Any]:
    return {**dimension, "limits": limits}


# The search.

LABELS = ("a", "b", "c", "d")


@st.composite
def worlds(
    draw: st.DrawFn,
) -> tuple[list[list[JobChanges]], dict[JobChanges, MeetingTrial | None]]:
    """Choices, and how each of their proposals comes out, with and without allowances."""
    sizes = draw(st.lists(st.integers(1, 2), min_size=1, max_size=4))
    choices = [
        [JobChanges((Change(LABELS[k], value),)) for value in range(size)]
        for k, size in enumerate(sizes)
    ]
    dice = random.Random(draw(st.integers(0, 10**6)))
    often = draw(st.sampled_from([0.02, 0.1, 0.5]))
    left = (Left(0, 0.01),)

    def trial(proposal: JobChanges, more: tuple[Left, ...]) -> MeetingTrial | None:
        if dice.random() < 0.1:
            return None
        missing = 0 if dice.random() < often else dice.randint(1, 4)
        return MeetingTrial(proposal, (), (), missing, dice.random(), more if missing else ())

    world: dict[JobChanges, MeetingTrial | None] = {}
    for some in itertools.product(*([None, *each] for each in choices)):
        proposal = sum(filter(None, some), JobChanges())
        world[proposal] = trial(proposal, left if dice.random() < 0.5 else ())
        known = world[proposal]
        if known is not None and known.left:
            world[replace(proposal, left=left)] = trial(replace(proposal, left=left), ())
    world[JobChanges()] = MeetingTrial(JobChanges(), (), (), 3, 1.0, left)
    world[JobChanges(left=left)] = trial(JobChanges(left=left), ())
    return choices, world


def rank(proposal: JobChanges) -> tuple[object, ...]:
    """Fewer changes first, of as many those with allowances, then in the order of the choices."""
    own = [(LABELS.index(each.key), each.value) for each in proposal.changes]
    return proposal.count, not proposal.left, [key for key, _ in own], [value for _, value in own]


@given(worlds())
def test_the_search_finds_what_trying_everything_finds(
    world: tuple[list[list[JobChanges]], dict[JobChanges, MeetingTrial | None]],
) -> None:
    choices, known = world
    start = known[JobChanges()]
    assert start is not None
    asked: list[JobChanges] = []

    def tried(proposal: JobChanges) -> MeetingTrial | None:
        asked.append(proposal)
        return known[proposal]

    found, every = find_cheapest(start, choices, tried, 1000)
    assert every
    assert len(set(asked)) == len(asked)
    within = [each for each in known.values() if each and each.proposal.count <= MAX_CHANGES]
    holding = [each for each in within if each.holds]
    if holding:
        assert found is min(holding, key=lambda each: rank(each.proposal))
    else:
        assert found.score == min(each.score for each in within)
    # With less trials than it takes, what is found is never worse than the start.
    some, _ = find_cheapest(start, choices, lambda proposal: known[proposal], len(asked) // 2)
    assert some.score <= start.score


# Allowances.


@given(st.data())
def test_allowances_are_the_best_of_a_grid(data: st.DataObject) -> None:
    walls = data.draw(st.integers(1, 2))
    dims = data.draw(st.integers(1, 4))
    numbers = st.floats(-0.05, 0.05).map(lambda value: round(value, 4))
    slopes = np.array(
        data.draw(
            st.lists(
                st.lists(
                    st.sampled_from([-2.0, -1.0, 0.0, 1.0, 2.0]), min_size=walls, max_size=walls
                ),
                min_size=dims,
                max_size=dims,
            )
        )
    )
    off = np.array(data.draw(st.lists(numbers, min_size=dims, max_size=dims)))
    wide = np.array(data.draw(st.lists(st.floats(0.0, 0.02), min_size=dims, max_size=dims)))
    bent = np.array(data.draw(st.lists(st.booleans(), min_size=dims, max_size=dims)))
    standards = np.array(data.draw(st.lists(st.floats(1e-3, 5e-3), min_size=dims, max_size=dims)))
    are_best_of_a_grid(slopes, off, wide, bent, standards)


def test_zones_that_are_centred_at_first_do_not_mislead() -> None:
    """The second dimension is a zone that grows whatever is left on either wall."""
    slopes = np.array([[-1.0, -2.0], [-2.0, 1.0], [-2.0, -2.0], [-2.0, -1.0]])
    off, wide = np.array([0.0, 0.0, 0.0312, 0.0]), np.array([0.0, 0.0, 0.015625, 0.0])
    standards = np.array([0.00390625, 0.00390625, 0.00390625, 0.001953125])
    are_best_of_a_grid(slopes, off, wide, np.array([False, True, False, False]), standards)


def are_best_of_a_grid(
    slopes: np.ndarray, off: np.ndarray, wide: np.ndarray, bent: np.ndarray, standards: np.ndarray
) -> None:
    """Hold allowances on walls against a grid of them: `slopes` (D, C) of sizes that are `off` and
    `wide`; `bent` are zones."""
    dims, walls = slopes.shape
    limits = np.column_stack([np.full(dims, 0.03), np.where(bent, -np.inf, -0.03)])
    most = np.full(walls, 0.05)

    def sizes(left: np.ndarray) -> np.ndarray:
        """Linear ones, and zones, which are as wide as what is off on either side."""
        at = off + slopes @ left
        high = np.where(bent, np.abs(at) + wide, at + wide)
        return np.column_stack([high, np.where(bent, high, at - wide)])

    def worth(left: np.ndarray) -> float:
        high, low = sizes(left).T
        inside = np.minimum(limits[:, 0] - high, low - limits[:, 1]) / standards
        return float(np.minimum(inside, FAR_ENOUGH).sum() - 1e-3 * np.abs(left).sum())

    left = best_left(sizes, limits, standards, most)
    assert np.all(np.abs(left) <= most + 1e-9)
    axis = np.linspace(-0.05, 0.05, 41)
    best = max(worth(np.array(each)) for each in itertools.product(axis, repeat=walls))
    assert worth(left) >= best - 1e-6


def test_allowances_come_out_as_they_were_foreseen(tmp_path: Path) -> None:
    """Of each contour on its own: the hole is to be smaller, the outline larger, the window stays;
    what the edges of the first program foresee is what the next program cuts."""
    asked = [
        limited(BORE, "-0.02/-0.04"),
        limited(WIDTH, "+0.06/+0.03"),
        {**PROFILE, "zone": "0.07"},
        limited(WINDOW, "±0.02"),
    ]
    bench = Bench(case(tmp_path, asked), camtool_progress())
    first = bench.first()
    assert [each.verdict for each in first.verdicts] == ["out", "out", "in", "in"]
    run = bench.run_of(JobChanges())
    inspector = Inspector(run, bench.case.tolerances.dimensions)
    by_name = closed_form(inspector, first.verdicts, bench.contours)
    circle, outline = (by_name[name] for name in sorted(by_name))
    assert 0.01 <= circle <= 0.02
    assert 0.015 <= outline <= 0.03
    by_path = {path: by_name.get(name, 0.0) for path, name in enumerate(bench.contours.of_path)}
    foreseen = inspector.sizes(left_mm=by_path)
    second = bench.try_changes(JobChanges(left=first.left))
    assert second is not None
    assert second.holds
    for size, each in zip(foreseen, second.verdicts, strict=True):
        # Arcs are chords within 0.1 µm, whose ends lie elsewhere.
        assert each.low_mm == pytest.approx(size.low_mm, abs=1e-3)
        assert each.high_mm == pytest.approx(size.high_mm, abs=1e-3)


def camtool_progress() -> Any:
    from camtool.progress import Progress

    return Progress()


@pytest.mark.parametrize("allowance", [pytest.param(None, marks=pytest.mark.slow), '"0.1mm"'])
def test_grids_of_allowances_hold_nothing_cheaper(tmp_path: Path, allowance: str | None) -> None:
    """Every combination of two allowances on a grid, each posted: where one holds, so does the
    proposal of the closed form, and it is not worse than any of them."""
    asked = [limited(BORE, "-0.01/-0.03"), limited(HEIGHT, "+0.05/+0.02")]
    job = "" if allowance is None else f"allowance = {allowance}"
    shift = 0.0 if allowance is None else -0.1
    bench = Bench(case(tmp_path, asked, job=job), camtool_progress())
    first = bench.first()
    found, _ = find_cheapest(first, [], bench.try_changes, 10)
    assert found.holds
    names = sorted({*bench.contours.of_path})
    circle, window, outline = names
    scores = []
    for one, other in itertools.product(np.arange(0.0, 0.03, 0.0075) + shift, repeat=2):
        left = bench.contours.left({circle: float(one), outline: float(other), window: shift})
        trial = bench.try_changes(JobChanges(left=left))
        assert trial is not None
        scores.append(trial.score[2])
    # Beyond FAR_ENOUGH no closed form looks for more.
    assert found.score[2] <= max(min(scores), -FAR_ENOUGH) + 0.1


# Keys of the job, and the machine.


def test_play_is_met_by_compensation_and_the_job_says_so(tmp_path: Path) -> None:
    asked = [limited(BORE, "±0.02"), {**ROUND, "zone": "0.02"}, limited(WIDTH, "±0.02")]
    made = case(tmp_path, asked, SLACK)
    found = meet(made)
    assert not found.before.holds
    assert found.holds
    assert found.certificate is None
    assert [each.key for each in found.after.proposal.changes] == ["compensate"]
    job = tmp_path / "made.toml"
    job.write_text(found.text)
    # The file alone gives the program that was inspected.
    run = camtool.post(made.drawing, made.target, camtool.read_job(job))
    assert run.data == found.run.data
    done = camtool.inspect(run, tmp_path / "tolerances.toml", require="in")
    assert not done.failed
    assert "compensate = true, was false" in to_text(found)
    assert to_data(found)["holds"] is True


def test_nothing_is_changed_where_all_holds(tmp_path: Path) -> None:
    found = meet(case(tmp_path, [limited(BORE, "±0.02")]))
    assert found.holds
    assert not found.changed
    assert found.trials == 0


def test_two_changes_are_found_where_one_does_not_do(tmp_path: Path) -> None:
    asked = [limited(BORE, "-0.01/-0.03"), {**ROUND, "zone": "0.012"}]
    found = meet(case(tmp_path, asked, SLACK))
    assert found.holds
    proposal = found.after.proposal
    assert proposal.count == 2
    assert [each.key for each in proposal.changes] == ["compensate"]
    assert {each.entities for each in proposal.left if each.by_mm} == {("circle at line 3",)}


def test_only_what_cuts_a_short_dimension_is_changed(tmp_path: Path) -> None:
    made = case(tmp_path, [limited(BORE, "-0.01/-0.03")])
    made.tables["operations"] = [
        {"name": "holes", "tool_diameter": "2mm", "select": ["inner"], "depth": "0.5mm"},
        {"name": "rim", "tool_diameter": "2mm", "select": ["outer"], "depth": "0.5mm"},
    ]
    bench = Bench(made, camtool_progress())
    choices = levers(bench, bench.first())
    rows = {each.operation for some in choices for one in some for each in one.changes}
    assert rows == {None, 0}
    found = meet(made)
    assert found.holds
    names = [each["name"] for each in parse_table(found.text)["operations"]]
    # Of what lies as deep as each other the one with more left comes where it first is named.
    assert names == ["holes", "holes (2)", "rim"]


@pytest.mark.parametrize("kind", ["pocket", "bore"])
def test_a_pocket_is_not_divided_from_its_islands(tmp_path: Path, kind: str) -> None:
    """An operation that took the rim of a pocket alone would mill its islands away."""
    rim = {"name": "rim", "kind": "diameter", "at": [15, 20], "nominal": "16mm"}
    made = case(tmp_path, [limited(rim, "+0.03/+0.01")], svg=ISLAND)
    made.tables["operations"] = [{"kind": kind, "tool_diameter": "2mm", "depth": "0.5mm"}]
    found = meet(made)
    assert found.holds
    assert [each.entities for each in found.after.proposal.left] == [()]
    assert "operations" not in parse_table(found.text)


def test_what_a_change_makes_measurable_is_counted(tmp_path: Path) -> None:
    """The verdict of another job counts for a dimension that the original job leaves uncut, and
    the result states what the report states."""
    bench = Bench(
        case(tmp_path, [limited(BORE, "-0.01/-0.03"), limited(WIDTH, "±0.05")]), camtool_progress()
    )
    inner = bench.case.tables["operations"][0] | {"select": ["inner"]}
    bench.case.tables["operations"] = [inner]
    first = bench.first()
    assert (first.missing, [each.name for each in first.verdicts]) == (1, ["bore"])
    more = bench.try_changes(JobChanges((Change("select", ["closed"], 0),)))
    assert more is not None
    assert (more.missing, [each.name for each in more.verdicts]) == (0, ["bore", "width"])
    assert [each.verdict for each in more.verdicts] == ["out", "in"]


ISLAND = """<svg xmlns="http://www.w3.org/2000/svg" width="50mm" height="40mm" viewBox="0 0 50 40">
<g fill="none" stroke="black"><circle cx="15" cy="20" r="8"/>
<circle cx="15" cy="20" r="3"/>
<circle cx="35" cy="20" r="5"/></g></svg>"""


def held_with(found: Meeting, made: MeetingCase, setting: str) -> bool:
    """True if the part holds on another machine, with program and allowances made for it."""
    target = made.target.with_settings([setting])
    bench = Bench(replace(made, target=target), camtool_progress())
    plain = bench.try_changes(found.after.proposal)
    for _ in range(3):
        assert plain is not None
        if plain.holds:
            return True
        if not plain.left:
            return False
        plain = bench.try_changes(replace(found.after.proposal, left=plain.left))
    return plain is not None and plain.holds


def test_a_certificate_names_what_it_would_take(tmp_path: Path) -> None:
    """Nothing mends a window that is wider than the plate's bore is sure: how sure must the tool
    be? At the named value it holds, a tenth beyond it does not."""
    made = case(tmp_path, [limited(WINDOW, "±0.0045")])
    found = meet(made, max_trials=4)
    assert not found.holds
    assert found.after.score <= found.before.score
    why = found.certificate
    assert why is not None
    assert why.binding is not None
    assert why.binding.name == "window"
    assert why.exact
    needs = {each.key: each for each in why.needs}
    assert "uncertainty.tool_diameter_mm" in needs
    for need in why.needs:
        assert need.needed < need.now
        assert held_with(found, made, f"{need.key}={need.needed!r}")
        beyond = min(1.1 * need.needed, 0.5 * (need.needed + need.now))
        assert not held_with(found, made, f"{need.key}={beyond!r}")
    assert "window decides" in to_text(found)
    assert to_data(found)["certificate"]["binding"] == "window"


@pytest.mark.parametrize("apart", [True, False])
def test_contours_of_one_name_have_one_allowance(tmp_path: Path, apart: bool) -> None:
    """Of two windows of one name, one must become wider and the other narrower."""
    ways = ["M5 5h10v10h-10z", "M20 5h10v10h-10z"]
    elements = [
        f'<path id="w{k}" d="{way}"/>' for k, way in enumerate(ways if apart else ["".join(ways)])
    ]
    size = 'width="40mm" height="20mm" viewBox="0 0 40 20"'
    svg = f'<svg xmlns="http://www.w3.org/2000/svg" {size}>{"".join(elements)}</svg>'
    one = {"name": "one", "kind": "distance", "from": [5, 10], "to": [15, 10]}
    two = {"name": "two", "kind": "distance", "from": [20, 10], "to": [30, 10]}
    asked = [limited(one, "+0.06/+0.02"), limited(two, "-0.02/-0.06")]
    found = meet(
        case(tmp_path, asked, svg=svg, job='kind = "profile"\nside = "inside"'), max_trials=3
    )
    assert found.holds == apart
    if not apart:
        assert found.certificate is not None
        assert found.certificate.together == ("path w0",)
        assert "several contours are named path w0" in to_text(found)


@pytest.mark.slow  # 25 programs; test_a_certificate_names_what_it_would_take is one by day
def test_play_that_nothing_makes_up_for_is_certified(tmp_path: Path) -> None:
    """Roundness alone, without the ways that help: at most so much play."""
    made = case(tmp_path, [{**ROUND, "zone": "0.01"}], SLACK)
    bench = Bench(made, camtool_progress())
    first = bench.first()
    why = bench.certificate(first)
    needs = {each.key: each for each in why.needs}
    assert list(needs) == ["axes.x.backlash_mm"]
    needed = needs["axes.x.backlash_mm"].needed
    assert 0.0 < needed < 0.012
    found = Meeting(first, first, bench.run_of(JobChanges()), "", 0, True, why)
    assert held_with(found, made, f"axes.x.backlash_mm={needed!r}")
    assert not held_with(found, made, f"axes.x.backlash_mm={1.1 * needed!r}")


def test_what_is_not_known_is_named_first(tmp_path: Path) -> None:
    made = case(tmp_path, [limited(BORE, "±0.02")])
    machine = camtool.load_target(
        "linuxcnc", settings=[*EXACT, *(each for each in KNOWN if "process" not in each)]
    )
    found = meet(replace(made, target=machine), max_trials=3)
    assert not found.holds
    assert found.certificate is not None
    assert found.certificate.unknown == ("process_mm",)
    assert "process_mm" in to_text(found)
    assert not math.isnan(found.after.score[1])


def test_what_is_not_known_but_bounded_makes_limits_narrower(tmp_path: Path) -> None:
    """A room of which nobody says the temperature: 40 mm grow by 0.12 mm at most."""
    unsaid = ("temperature", "expansion")
    known = [each for each in KNOWN if not any(word in each for word in unsaid)]
    target = camtool.load_target("linuxcnc", settings=[*EXACT, *known])
    made = case(tmp_path, [limited(BORE, "-0.04/-0.12")])
    found = meet(replace(made, target=target))
    assert found.holds
    (bore,) = found.after.verdicts
    assert bore.unknown_um is not None
    assert bore.unknown_um > 10.0
    assert bore.high_mm + bore.unknown_um / 1000.0 < 7.96
    never = meet(replace(case(tmp_path, [limited(BORE, "±0.02")]), target=target), max_trials=1)
    assert never.certificate is not None
    assert never.certificate.unknown == ()
    assert "what [uncertainty] does not say: part_expansion_per_k" in to_text(never)


def test_no_limits_and_no_program_are_errors(tmp_path: Path) -> None:
    with pytest.raises(OptionError, match="no dimension with limits"):
        meet(case(tmp_path, [BORE]))
    with pytest.raises(OptionError, match="be inspected: X spans 46"):
        meet(case(tmp_path, [limited(BORE, "±0.1")], "axes.x.travel_mm=10.0"))


def test_python_has_it_too(tmp_path: Path) -> None:
    made = case(tmp_path, [limited(BORE, "-0.01/-0.03")])
    job = tmp_path / "job.toml"
    job.write_text(text_of(made.tables))
    limits = tmp_path / "tolerances.toml"
    found = camtool.meet(tmp_path / "plate.svg", made.target, limits, job=job)
    assert found.holds
    assert 'allowance = "' in found.text
