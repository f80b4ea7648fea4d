"""The listing of a program: its blocks, numbered as the reader numbers them."""

from pathlib import Path

import numpy as np
import pytest
from camtool_postprocessors._gcode_listing import listing as lines_of
from camtool_postprocessors._gcode_words import Lexing, blocks_of

from camtool.machine.registry import LoadedTarget, load_target
from camtool.toolpath.moves import Toolpath
from camtool.toolpath.program import Listing
from tests.postprocessors.i8751_machines import loaded

GOLDEN = Path(__file__).parents[1] / "golden"

TEXTS = {
    "grbl.nc": ("grbl", ()),
    "grbl-options.nc": ("grbl", ()),
    "linuxcnc.ngc": ("linuxcnc", ()),
    "linuxcnc-options.ngc": ("linuxcnc", ("dialect.percent=true",)),
    "flashcut-part.nc": ("flashcut", ()),
    "valcnc-part.ngc": ("valcnc", ()),
    "pic-mmh-example.pic": ("pic-mmh", ()),
    "pic-mmh-annex.pic": ("pic-mmh", ("dialect.form=annex",)),
}


def listed(data: bytes, target: LoadedTarget) -> tuple[Toolpath, Listing]:
    return target.post.read(data, target.machine), target.post.listing(data, target.machine)


@pytest.mark.parametrize("name", list(TEXTS))
def test_each_move_stands_in_its_own_block(name: str) -> None:
    target, settings = TEXTS[name]
    data = (GOLDEN / name).read_bytes()
    toolpath, listing = listed(data, load_target(target, settings=settings))
    assert len(listing.blocks) == int(toolpath.block.max()) + 1
    assert not listing.binary
    words = ("X", "Y", "Z", "G0", "G1", "G2", "G3", "I", "J")
    for row in np.flatnonzero(toolpath.is_motion):
        assert any(word in listing.blocks[toolpath.block[row]].upper() for word in words)
    # Nothing but comments, blank lines and signs of ending lies between the blocks.
    text = data.decode("latin-1")
    at = 0
    for block in listing.blocks:
        at = text.index(block, at) + len(block)


def test_lines_without_a_word_are_no_blocks() -> None:
    text = b"%\n\n(a G1 X1)\r\nG1 X1 ; Y2\r N10\nN20 G0Z3\n ;X\n(x)(y) M30\n%"
    lexing = Lexing(
        letters="GMXYZ",
        parentheses=True,
        semicolon=True,
        block_numbers=True,
        percent=True,
    )
    assert lines_of(text).blocks == tuple(b.text.strip() for b in blocks_of(text, lexing))
    assert lines_of(text).blocks == ("G1 X1 ; Y2", "N20 G0Z3", "(x)(y) M30")


def test_packets_are_listed_in_hex_by_record() -> None:
    target = loaded()
    data = (GOLDEN / "i8751-part.bin").read_bytes()
    toolpath, listing = listed(data, target)
    assert listing.binary
    assert bytes.fromhex(" ".join(listing.blocks)) == data
    assert len(listing.blocks) == int(toolpath.block.max()) + 1
