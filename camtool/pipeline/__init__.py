"""The whole way in five calls: what the commands and batches run.

    post_drawing     Drawing + Job + target → program, read back, simulated and judged
    verify_program   bytes of a program (anybody's) → judged, against a drawing if there is one
    convert_program  bytes of one target's program → the program of another, judged as above
    picture          any of the values on the way → the scene that `camtool.preview` draws
    compare_program  one program, run several ways

Nothing here reads or writes a file.
"""

from __future__ import annotations

from camtool.pipeline.compare import Way, compare_picture, compare_program
from camtool.pipeline.judge import (
    Judging,
    Posted,
    convert_program,
    post_drawing,
    read_program,
    verify_program,
)
from camtool.pipeline.pictures import picture, posted_scene
from camtool.pipeline.viewing import listing_of, points_for

__all__ = [
    "Judging",
    "Posted",
    "Way",
    "compare_picture",
    "compare_program",
    "convert_program",
    "listing_of",
    "picture",
    "points_for",
    "post_drawing",
    "posted_scene",
    "read_program",
    "verify_program",
]
