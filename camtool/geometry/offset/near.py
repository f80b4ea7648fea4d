"""What raw elements may not come near to: the source, and what mitres cover."""

from __future__ import annotations

from dataclasses import dataclass

from camtool.geometry.offset.curves import Curves
from camtool.geometry.polylines import Floats, Segments

Arrays = tuple[Floats, Floats, Floats, Floats]


@dataclass(frozen=True, eq=False)
class Near:
    """The source as `arrays` of the kernels: rows of curves and their tree, kites and theirs."""

    arrays: Arrays

    @classmethod
    def of(cls, source: Segments, kites: Floats) -> Near:
        """The segments of the source, and the kites (J, 10) of a raw offset."""
        from camtool.kernels.box_tree import tree_of
        from camtool.kernels.offset_kites import kite_boxes

        curves = Curves.of(source)
        return cls((curves.rows, curves.tree, kites, tree_of(kite_boxes(kites))))
