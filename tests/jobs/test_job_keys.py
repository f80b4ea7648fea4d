"""The keys of job files: every field of a job has one, and the page has all of them."""

import re
from dataclasses import fields
from pathlib import Path

from camtool.jobs.keys import (
    ENTRY,
    KEEP_OUT,
    LEAD,
    OPERATION,
    PLACE,
    SETUP,
    STOCK,
    TABS,
    TOOL,
    WHOLE,
    is_known,
)
from camtool.planning.job import (
    Entry,
    Job,
    JobSetup,
    KeepOutBox,
    Lead,
    Operation,
    Placement,
    Stock,
    Tabs,
    Tool,
)
from camtool.planning.kinds import installed_kinds

PAGE = Path("docs/jobs.md").read_text(encoding="utf-8")


def test_every_field_of_a_job_has_a_key() -> None:
    def missing(record: type, keys: object) -> set[str]:
        assert isinstance(keys, dict)
        return {each.name for each in fields(record)} - {key.field for key in keys.values()}

    made_by_jobs = {"tool", "material", "preset", "stage", "may_be_long", "rest_of", "own"}
    assert missing(Operation, OPERATION) == made_by_jobs
    assert missing(Placement, PLACE) == {"turn"}
    assert missing(Stock, STOCK) == missing(JobSetup, SETUP) == set()
    assert missing(KeepOutBox, KEEP_OUT) == set()
    assert missing(Entry, ENTRY) == missing(Lead, LEAD) == missing(Tabs, TABS) == set()
    assert missing(Tool, TOOL) == {"name", "materials"}
    assert missing(Job, WHOLE) == {
        "operations",
        "placement",
        "stock",
        "keep_out",
        "setups",
        "setup_of",
    }


def test_the_page_has_every_key_and_no_other() -> None:
    parts = re.split(r"^## ", PAGE, flags=re.MULTILINE)
    tables = {"The job": WHOLE, "`[place]`": PLACE, "`[stock]`": STOCK, "`[tools": TOOL}
    tables["`[[keep_out]]`"] = KEEP_OUT
    tables["`[[setups]]`"] = SETUP
    tables["`[[operations]]`"] = {**OPERATION, "tool": None}
    for heading, keys in tables.items():
        (part,) = (part for part in parts if part.startswith(heading))
        cells = re.findall(r"^\| (`.*?) \|", part, re.MULTILINE)
        assert sorted(re.findall(r"`(\w+)`", " ".join(cells))) == sorted(keys)
    (operations,) = (part for part in parts if part.startswith("`[[operations]]`"))
    for names, kinds in re.findall(r"^\| (`.*?) \| (.*?) \|", operations, re.MULTILINE):
        for name in re.findall(r"`(\w+)`", names):
            if name != "tool":
                known = {kind for kind in installed_kinds() if is_known(name, kind)}
                told = set(re.findall("|".join(installed_kinds()), kinds))
                assert (told or set(installed_kinds())) == known, name
