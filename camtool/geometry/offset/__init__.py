"""Parallel offsets of polylines in which arcs stay arcs.

Algorithm, for a distance to the left (the right is the left of the reversed path):

1. *Raw offset.* Each segment is shifted to its left; an arc keeps its centre and its sweep. About
   each outer corner a join is put: an arc, or a mitre. These pieces are the *elements*. An arc
   that would get no radius, or a negative one, has no element. Inner corners get no join.
   (`raw_offset`)
2. *Trimming.* What is surely too near to the source at both ends of an element goes. This only
   saves time. (`trim_raw`)
3. *Slices.* The elements are cut where they meet each other. A *node* is a place where ends
   or meetings coincide; a *slice* is the piece of an element between two nodes. Where the source
   meets itself, the elements of its other side cut too. (`slice_elements`)
4. *Validity.* A slice is kept when no point of it is nearer to the source than the distance, or
   within a mitre. In exact numbers that is the same for all points of a slice. (`valid_slices`)
5. *Loops.* Pairs of slices that run the same way to and fro are taken out, then all that leads
   nowhere; what is left is followed from node to node, at each to the leftmost. (`trace_loops`)
6. *Paths.* Slices of one element are joined again, slivers and loops of no width dropped.
   (`paths_of`)

A shape of many closed paths goes through the stages as one: elements of all paths cut each other,
and validity is the distance from all of them. So islands merge and holes break through with no
case of their own, and loops come out with the region on their left.

An open path is treated as the closed one that runs there and back: that has all of the boundary
of what is nearer than the distance, closed. Then the stretches on the wanted side are given.

*Mitres.* Let N be all points nearer than d to the source, and K the *kites*: for each outer corner
c with the normals n1 and n2, the points between the arc about c and the tangents at both its ends,
and those nearer to c (camtool.kernels.offset_kites). The offset with mitres is what is left of the
region without N and K. Its boundary lies on shifted segments and on outer edges of kites, since
the arc about a corner lies in its kite and the inner edges of a kite lie in N. So the elements are
the shifted segments, with lines prolonged along the edges of kites, and lines beside arcs and
across cut tips; and a slice is kept when it is neither in N nor in K. It is a boundary of both, so
that a slice along its own kite is not in it: its depth there is 0. Without kites this is the rule
of round joins. A mitre may be longer than a wall is thick, and then takes from what lies beyond.

What is past finding out is left so: of paths that cross themselves or each other, what crosses is
no boundary of one region, and only loops that close on their own side are given.

Tolerances (`OffsetOptions`), and what each decides:

- `node_eps_mm`: which ends and meetings are one node, and whether curves that hardly touch meet.
  It does not decide what is kept, and moves nothing by more than itself.
- `validity_eps_mm`: how much too near, or how deep in a kite, a slice may be. It is far above the
  rounding of all steps before, so nothing right is refused; something wrong by no more than this
  may pass, and is then mostly a dead end that stage 5 drops. It does not decide where slices begin
  or end. Where features of the result are as small as this (a ring of chords 5 µm long that bulge
  by 2e-7 mm), a loop may come with others beside it that differ by no more than this.
- `sliver_eps_mm`: the shortest segment and the narrowest loop that is given. Points move by half
  of it at most for each segment that is dropped. It does not decide how the loops run.

The result is exact up to these: each point is at the distance from the source within
`sliver_eps_mm`, and all points that are so on that side are in the result. Loops come in the order
of the first piece of the source that they run along, and begin there.

All inner loops are compiled (camtool/kernels/offset_*.py) and ask trees of boxes, so the time
grows as n log n in the number of segments, and with the number of true meetings.
"""

from camtool.geometry.offset.options import OffsetOptions
from camtool.geometry.offset.parallel import offset, offset_open
from camtool.geometry.offset.raw import RawOffset, raw_offset
from camtool.geometry.offset.shape import Stages, offset_shape, shape_stages
from camtool.geometry.offset.show import stage_drawings
from camtool.geometry.offset.slices import Slices, slice_elements, valid_slices
from camtool.geometry.offset.stitch import trace_loops
from camtool.geometry.offset.trim import trim_raw
from camtool.geometry.offset.way import Way

__all__ = [
    "OffsetOptions",
    "RawOffset",
    "Slices",
    "Stages",
    "Way",
    "offset",
    "offset_open",
    "offset_shape",
    "raw_offset",
    "shape_stages",
    "slice_elements",
    "stage_drawings",
    "trace_loops",
    "trim_raw",
    "valid_slices",
]
