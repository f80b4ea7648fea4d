"""Blocks written by columns, against literal loops over the rows."""

import numpy as np
import pytest
from camtool_postprocessors.flashcut.write import _Blocks
from camtool_postprocessors.gcode.plain import PlainRows
from camtool_postprocessors.gcode.write import BlockOrder, Events, LineNumbers, Sent, motion_words
from hypothesis import given
from hypothesis import strategies as st

from camtool.records import replace
from camtool.target.registry import load_target
from camtool.toolpath.moves import Kind
from camtool.toolpath.words import texts_of
from tests.oracles.gcode_blocks import Flashcut, Row, flashcut_blocks, modal_block

pytestmark = pytest.mark.checked

UNITS = st.sampled_from([0, 0, 1, -1, 10, 1500, -2000, 123456])
FLAGS = st.booleans()
ROWS = st.builds(
    Row,
    st.sampled_from([0, 0, 1, 1, 2, 3, int(Kind.DWELL)]),
    st.tuples(UNITS, UNITS, UNITS),
    st.tuples(UNITS, UNITS),
    st.sampled_from([1, 20, 100]),
    st.tuples(FLAGS, FLAGS, FLAGS).filter(any),
    FLAGS,
)


@given(st.lists(ROWS, max_size=20), st.booleans(), st.booleans(), st.integers(0, 2))
def test_modal_blocks(rows: list[Row], strip: bool, numbered: bool, of_feed: int) -> None:
    dialect = replace(
        load_target("grbl").machine.dialect, strip_zeros=strip, block_numbers=numbered
    )
    count = len(rows)
    kind = np.array([row.kind for row in rows], dtype=np.int64)
    written = np.array([row.written for row in rows], dtype=bool).reshape(count, 3)
    sent = Sent(
        kind=kind,
        end=np.array([row.end for row in rows], dtype=np.int64).reshape(count, 3),
        offset=np.array([row.offset for row in rows], dtype=np.int64).reshape(count, 2),
        feed=np.array([row.feed for row in rows], dtype=np.int64),
        row=np.arange(count) + 5,
        written=written & (kind <= 3)[:, None],
        forget=np.array([row.forget for row in rows], dtype=bool),
        dropped=0,
    )
    events = Events({k + 5: [f"M{k}"] for k in range(0, count, 2)}, (), False, ())
    order = BlockOrder(sent.is_motion)
    order.add(0, ["G90"])
    for at, row in sent.event_rows(events):
        order.add(at, events.blocks[row], row)
    order.add(count, ["M2"])
    of_row = order.rows(sent.row)

    wanted, their_rows = ["G90"], [-1]
    before, feed = None, -1
    for k, row in enumerate(rows):
        if row.kind <= 3:
            kept = 0 if strip else dialect.decimals
            wanted.append(modal_block(row, before, feed, (dialect.decimals, kept, of_feed)))
            before, feed = row, row.feed if row.kind else feed
        elif k % 2 == 0:
            wanted.append(f"M{k}")
        else:
            continue
        their_rows.append(k + 5)
    wanted, their_rows = [*wanted, "M2"], [*their_rows, -1]
    comments = {k: [f"(a{k})", f"(b{k})"] for k in range(0, len(wanted), 3)}
    lines: list[str] = []
    for k, block in enumerate(wanted):
        lines += comments.get(k, [])
        lines.append(f"N{k + 1} {block}" if numbered else block)
    commented = np.array([k for k, each in comments.items() for _ in each], dtype=np.int64)
    texts = [text for each in comments.values() for text in each]
    written_text = order.text(
        motion_words(sent, dialect, of_feed),
        commented,
        texts.__getitem__,
        numbers=LineNumbers() if numbered else None,
    )
    assert written_text.decode().splitlines() == lines
    assert of_row.tolist() == their_rows


@given(
    st.lists(ROWS, max_size=20),
    st.booleans(),
    st.sampled_from(["syntax", "everywhere"]),
    st.sampled_from(["one-axis", "straight"]),
    st.sampled_from(["+", "-"]),
    st.integers(0, 2),
)
def test_blocks_of_flashcut(
    rows: list[Row], zeros: bool, words: str, rapids: str, z_up: str, of_feed: int
) -> None:
    dialect = replace(
        load_target("flashcut").machine.dialect,
        trailing_zeros=zeros,
        feed_words=words,
        rapids=rapids,
        z_up=z_up,
    )
    # An event stays where it is.
    ends = [(0, 0, 0)]
    for row in rows:
        ends.append(row.end if row.kind <= 3 else ends[-1])
    rows = [
        Row(row.kind, end, row.offset, row.feed) for row, end in zip(rows, ends[1:], strict=True)
    ]
    count = len(rows)
    table = PlainRows(
        kind=np.array([row.kind for row in rows], dtype=np.int64),
        end=np.array([row.end for row in rows], dtype=np.int64).reshape(count, 3),
        offset=np.array([row.offset for row in rows], dtype=np.int64).reshape(count, 2),
        start=np.zeros(3, dtype=np.int64),
        row=np.arange(count),
        flat=0,
        recentred=0,
        lines=0,
        first=-1,
    )
    blocks = _Blocks(table, np.array([row.feed for row in rows], dtype=np.int64), dialect)
    texts = texts_of(blocks.words(dialect, of_feed), blanks=True)
    named = [k for k, row in enumerate(rows) if row.kind > 3]
    between = [(at, f"M{k}") for at, k in zip(blocks.events.tolist(), named, strict=True)]
    rules = Flashcut(
        dialect.decimals,
        dialect.decimals if zeros else 1,
        of_feed,
        words == "syntax",
        rapids == "one-axis",
        1 if z_up == "+" else -1,
    )
    wanted = flashcut_blocks(rows, {k: f"M{k}" for k in named}, rules)
    assert texts.with_lines(between).decode().splitlines() == [text for text, _ in wanted]
    moves = [k for _, k in wanted if k not in named]
    assert blocks.row.tolist() == moves
