"""Many drawings: which ones, what is up to date, and processes that make the rest.

    find_tasks     folders, patterns and files → one Task for each drawing, no two to one output
    Manifest       what an output folder holds, and of what it was made
    LocalPool      processes of this computer: one may die, and the others go on
    cluster_pool   the same on a Dask cluster
    run_batch      tasks → outcomes: writes what is made, skips what is up to date

What is made of one drawing is a `Work` that the caller brings; nothing here knows of machines.
"""

from __future__ import annotations

from camtool.batch.inputs import find_tasks
from camtool.batch.manifest import Manifest
from camtool.batch.pool import LocalPool, PoolOptions
from camtool.batch.records import Made, Outcome, State, Task, Work
from camtool.batch.run import Order, run_batch

__all__ = [
    "LocalPool",
    "Made",
    "Manifest",
    "Order",
    "Outcome",
    "PoolOptions",
    "State",
    "Task",
    "Work",
    "find_tasks",
    "run_batch",
]
