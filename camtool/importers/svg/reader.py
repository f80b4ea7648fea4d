"""SVG to Drawing: bytes, tree, page, walk.

    bytes ──ready──▶ UTF-8 ──parse_tree──▶ nodes ──page_of──▶ map to mm ──Walk──▶ pieces

Source: Scalable Vector Graphics 1.1 and, where it says more, 2.
"""

from __future__ import annotations

from camtool.errors import DrawingError
from camtool.geometry.drawing import Drawing
from camtool.importers.assemble import assemble
from camtool.importers.options import ReadOptions
from camtool.importers.svg.data import ready, writer_dpi
from camtool.importers.svg.page import page_of
from camtool.importers.svg.tree import parse_tree
from camtool.importers.svg.walk import Walk


def read(data: bytes, file: str, options: ReadOptions) -> Drawing:
    """The Drawing of an SVG, also a gzipped one; DrawingError naming element and line when it
    cannot be read. What is wrong in one element alone leaves that element out, and is told."""
    try:
        content = ready(data)
        root = parse_tree(content)
        page = page_of(root, options, writer_dpi(content))
        walk = Walk(root, page, options)
        walk.run()
    except DrawingError as error:
        error.file = error.file or file
        raise
    return assemble(
        walk.pieces,
        file=file,
        units=page.units,
        used=dict(walk.notes.used),
        skipped=walk.notes.skipped(),
        findings=[*page.findings, *walk.notes.findings()],
        options=options,
    )
