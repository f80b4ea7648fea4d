"""The contract of an operation: what a kind of operation is, and which kinds are installed.

An operation is a row of a job (`camtool.planning.job.Operation`); its kind says what is done.
Everything that differs between kinds stands in one record, `OperationKind`, which an entry point
of the group `camtool.operations` names: camtool's own in `camtool/operations/`, those of others in
their packages. docs/write-an-operation.md adds one.

The record holds facts and the names of functions ("package.module:function"), which are imported
when they are first called: the flags of a command need all kinds, but no geometry. A kind that
cannot be loaded is left out; whoever uses it gets the error."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from typing import Any

from msgspec import Struct

from camtool.errors import CamtoolError, OptionError
from camtool.keys import Key
from camtool.plugins import EntryPoint, entry_points
from camtool.records import FrozenRecord

GROUP = "camtool.operations"

OWN_PACKAGE = "camtool.operations."
"""The prefix of camtool's own modules: exceptions in these are faults of camtool, not of a
plug-in."""

TAKES = ("paths", "circles", "holes", "pins", "nothing")
CUTS = ("beside", "within", "along", "at", "over")
DESCENTS = ("passes", "helix", "pecks", "slopes")
RESTS = ("", "corners", "floor")

COMMON_KEYS = ("name", "kind", "feed", "plunge_feed", "spindle", "coolant")

SELECTING_KEYS = ("layers", "colours", "select", "select_size", "select_area", "select_entities")
"""Keys by which an operation takes paths of the drawing."""

WALL_KEYS = ("direction", "allowance", "finish", "finish_feed", "finish_spindle", "finish_tool")
"""Keys of operations that leave walls."""


@dataclass(frozen=True, repr=False, eq=False)
class OperationKind(FrozenRecord):
    """A kind of operation, such as "pocket": its keys, what it takes, how it cuts, and its work.

    `name` is the value of the key `kind`; `keys` are the keys of jobs/keys.py that it knows, and
    `own` those that it alone has, whose values stand in `Operation.own`. Kinds are listed by
    `rank`, then by name.

    `work` names the function that plans: (Chosen, Setting) -> Work. `settle` names one that
    completes the operation when its job is made: (Operation, Stock | None) -> Operation;
    OptionError for what cannot be. `propose` names one that says what `camtool job new` cuts with
    it: (camtool.jobs.template.Remaining) -> list of Part. Kinds are asked by `proposal_rank`: each
    takes of a layer what those before it have left.

    The drawing: `takes` is "paths" (all that are selected), "circles" among them, "holes" (circles
    and single points), the alignment "pins" of the set-ups, or "nothing". `cuts` is where the tool
    runs: "beside" closed contours, "within" them (all inside is cleared or carved), "along" the
    lines, "at" single places, or "over" the stock. `leaves_walls`: what it cuts beside or within
    are walls, straight down.
    `rest` says what an operation with `rest` may clear after it: "corners", a "floor", or nothing.
    `path_error_mm`: its centre paths may be off the drawing's by this much.

    The tool: `tool_shape` is a name of TOOL_SHAPES where the job's tool does not say its shape;
    `descent` is how it goes down: in "passes" of one depth each, in one "helix", in
    "pecks", or along "slopes". `needs_v_bit`: it cuts with a V bit alone. `turns_work`: it cuts
    on a lathe, in the half section of the work, X along the axis and Y the radius, without any
    height; `follows_spindle`: with feeds that follow the turns of the spindle. `frees_nets`:
    what it takes are nets of copper, which are to be whole afterwards, and apart.

    Words: `cut_name` is what is cut of the stock ("" for parts and holes), `reason` why its
    contours lie on no side, as `camtool job` says it."""

    name: str
    work: str
    keys: tuple[str, ...]
    own: Mapping[str, Key] = field(default_factory=dict)
    rank: int = 100
    settle: str = ""
    propose: str = ""
    proposal_rank: int = 100
    takes: str = "paths"
    cuts: str = "along"
    leaves_walls: bool = False
    rest: str = ""
    path_error_mm: float = 0.0
    tool_shape: str = ""
    descent: str = "passes"
    needs_v_bit: bool = False
    turns_work: bool = False
    follows_spindle: bool = False
    frees_nets: bool = False
    cut_name: str = ""
    reason: str = ""

    def __post_init__(self) -> None:
        for value, words in (
            (self.takes, TAKES),
            (self.cuts, CUTS),
            (self.descent, DESCENTS),
            (self.rest, RESTS),
        ):
            if value not in words:
                raise ValueError(f"{value!r} is none of {', '.join(words)}")

    @property
    def takes_drawn(self) -> bool:
        """True if it takes something of the drawing."""
        return self.takes not in ("pins", "nothing")

    @property
    def runs_beside(self) -> bool:
        """True if the tool runs beside closed contours."""
        return self.cuts == "beside"

    @property
    def clears(self) -> bool:
        """True if all within its contours is cleared, down from walls."""
        return self.cuts == "within" and self.leaves_walls

    @property
    def breaks_edges(self) -> bool:
        """True if the flank of its bit, beside a line, breaks the edges that others cut."""
        return self.runs_beside and not self.leaves_walls

    @property
    def has_edge(self) -> bool:
        """True if a drawn line is an edge that it cuts."""
        return self.leaves_walls or self.cuts in ("along", "within")


class _Broken(Struct, frozen=True):
    """A kind of operation that cannot be loaded: its entry point, and the reason."""

    value: str
    reason: str


@cache
def _load_kinds() -> tuple[dict[str, OperationKind], dict[str, _Broken]]:
    """Return the kinds that can be loaded, in the order of lists, and the broken ones."""
    kinds: list[OperationKind] = []
    broken: dict[str, _Broken] = {}
    for point in _entry_points():
        try:
            kinds.append(_load(point))
        except Exception as error:  # a plug-in may raise anything
            broken[point.name] = _Broken(point.value, f"{type(error).__name__}: {error}")
    kinds.sort(key=lambda kind: (kind.rank, kind.name))
    return {kind.name: kind for kind in kinds}, broken


def _entry_points() -> list[EntryPoint]:
    """Return the entry points of all kinds. Camtool's own kinds are included even if the installed
    metadata lacks them, as in a checkout that was updated but not installed again."""
    points = entry_points(GROUP)
    known_names = {point.name for point in points}
    our_modules = iter_modules(import_module(GROUP).__path__)
    missing = (module.name for module in our_modules if module.name not in known_names)
    our_points = (EntryPoint(name, f"{GROUP}.{name}:{name.upper()}") for name in missing)
    return [*points, *our_points]


def _load(point: EntryPoint) -> OperationKind:
    """Return the kind that an entry point names; TypeError or ValueError if that is another
    object."""
    kind = point.load()
    if not isinstance(kind, OperationKind):
        raise TypeError(f"{point.attr} is no camtool.planning.kinds.OperationKind")
    if kind.name != point.name:
        raise ValueError(f"{point.attr} calls itself {kind.name!r}")
    return kind


def installed_kinds() -> Mapping[str, OperationKind]:
    """Return the installed kinds of operation by name, in the order of lists."""
    return _load_kinds()[0]


def broken_kinds() -> Collection[str]:
    """Return the names of installed kinds that cannot be loaded."""
    return _load_kinds()[1].keys()


def kind_named(name: str) -> OperationKind:
    """Return the kind of this name; OptionError for an unknown one, and for one that cannot be
    loaded."""
    kinds, broken = _load_kinds()
    if name in broken:
        raise OptionError(
            f"the kind of operation {name!r} cannot be loaded ({broken[name].reason})",
            where=f"plug-in {broken[name].value}",
            mend="reinstall or remove the package that brings it",
        )
    if name not in kinds:
        raise OptionError(
            f"unknown kind of operation {name!r}", mend=f"use one of {', '.join(kinds)}"
        )
    return kinds[name]


def function_of(path: str) -> Callable[..., Any]:
    """Return the function at this path, which a kind names; an unexpected exception in a third
    party's function becomes an error that names the plug-in."""
    module, _, name = path.partition(":")
    function: Callable[..., Any] = getattr(import_module(module), name)
    if module.startswith(OWN_PACKAGE):
        return function

    def guarded(*arguments: Any) -> Any:
        try:
            return function(*arguments)
        except CamtoolError:
            raise
        except Exception as error:
            raise OptionError(
                f"fails ({type(error).__name__}: {error})",
                where=f"plug-in {path}",
                mend="tell whoever made it, with the output of the same command with --debug",
            ) from error

    return guarded
