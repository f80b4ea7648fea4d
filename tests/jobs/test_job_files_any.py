"""Whatever a job file holds, it is a job or one line that names the file."""

import datetime
from pathlib import Path
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import OptionError
from camtool.jobs.build import AT_THE_TOP, OF_OPERATIONS, JobTables, build_job, tables_of
from camtool.jobs.keys import ENTRY, KEEP_OUT, LEAD, PLACE, STOCK, TABS, TOOL
from camtool.planning.job import ENTRIES, LEADS, Job
from camtool.planning.kinds import installed_kinds

_words = st.sampled_from(
    [
        *installed_kinds(),
        *ENTRIES,
        *LEADS,
        "a",
        "3",
        "3mm",
        "30deg",
        "3x2",
        "1,2",
        "4:1:1",
        "arc:1",
        "40%",
        "",
    ]
)
_plain = st.one_of(
    _words,
    st.integers(-2, 4),
    st.floats(0.1, 2.0),
    st.floats(),
    st.integers(),
    st.booleans(),
    st.text(max_size=5),
    st.just(datetime.date(2000, 1, 1)),
)


def _table(*known: str) -> st.SearchStrategy[dict[str, Any]]:
    names = st.sampled_from(known)
    parts = st.sampled_from([*ENTRY, *LEAD, *TABS])
    value = st.one_of(_plain, st.lists(_plain, max_size=3), st.dictionaries(parts, _plain))
    return st.dictionaries(names, value, max_size=4)


@st.composite
def _files(draw: st.DrawFn) -> dict[str, Any]:
    """Files whose keys are mostly known, and whose values may be anything."""
    plain = [name for name in AT_THE_TOP if name not in ("tool_table", "operations", "tools")]
    file = draw(_table(*plain))
    for name, table in (
        ("place", _table(*PLACE)),
        ("stock", _table(*STOCK)),
        ("keep_out", st.lists(_table(*KEEP_OUT), max_size=2)),
        ("tools", st.dictionaries(st.just("a"), _table(*TOOL))),
        ("operations", st.lists(_table(*OF_OPERATIONS), max_size=3)),
    ):
        if draw(st.booleans()):
            file[name] = draw(table)
    return file


@given(_files())
def test_whatever_a_file_holds_it_is_a_job_or_one_line(file: dict[str, Any]) -> None:
    try:
        made: object = build_job(tables_of(file, Path("job.toml")), JobTables())
    except OptionError as error:
        made = str(error)
    assert isinstance(made, Job) or (made.startswith("job.toml: ") and "\n" not in made)
