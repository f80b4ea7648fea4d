from typing import NamedTuple

from camtool.arrays import Floats, Ints

class Tour(NamedTuple):
    ends: Floats
    turned: Ints
    first: Ints
    near: Ints
    near_first: Ints
    after: Ints
    after_first: Ints
    earlier: Ints
    earlier_first: Ints
    free: int
    one_way: bool
    item: Ints
    place: Ints
    row: Ints

class Tree(NamedTuple):
    points: Floats
    rows: Ints
    begin: Ints
    size: Ints
    box: Floats
    live: Ints
    leaf: Ints

def tree_of(points: Floats) -> Tree: ...
def nearest_first(
    tree: Tree,
    ends: Floats,
    first: Ints,
    after_first: Ints,
    after: Ints,
    waits: Ints,
    start: Floats,
) -> Ints: ...
def neighbours(tree: Tree, owner: Ints, count: int) -> tuple[Ints, Ints]: ...
def best_rows(ends: Floats, first: Ints, order: Ints, start: Floats, goal: Floats) -> Ints: ...
def settled(tour: Tour) -> float: ...
def kicked(tour: Tour, kicks: int, seed: int) -> float: ...
