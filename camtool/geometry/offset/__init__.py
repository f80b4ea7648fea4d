"""Parallel offsets of polylines in which arcs stay arcs.

Algorithm, for a distance to the left (the right is the left of the reversed path):

1. *Raw offset.* Each segment is shifted to its left; an arc keeps its centre and its sweep. About
   each outer corner an arc joins the two. These pieces are the *elements*. An arc that would get
   no radius, or a negative one, has no element. Inner corners get no join. (`raw_offset`)
2. *Trimming.* What is surely too near to the source at both ends of an element goes. This only
   saves time. (`trim_raw`)
3. *Slices.* The elements are cut where they meet each other. A *node* is a place where ends
   or meetings coincide; a *slice* is the piece of an element between two nodes. Where the source
   meets itself, the elements of its other side cut too. (`slice_elements`)
4. *Validity.* A slice is kept when no point of it is nearer to the source than the distance. In
   exact numbers that is the same for all points of a slice. (`valid_slices`)
5. *Loops.* Pairs of slices that run the same way to and fro are taken out, then all that leads
   nowhere; what is left is followed from node to node, at each to the leftmost. (`trace_loops`)
6. *Paths.* Slices of one element are joined again, slivers and loops of no width dropped.

An open path is treated as the closed one that runs there and back: that has all of the boundary
of what is nearer than the distance, closed. Then the stretches on the wanted side are given.

Tolerances (`OffsetOptions`), and what each decides:

- `node_eps_mm`: which ends and meetings are one node, and whether curves that hardly touch meet.
  It does not decide what is kept, and moves nothing by more than itself.
- `validity_eps_mm`: how much too near a slice may be. It is far above the rounding of all steps
  before, so nothing right is refused; something wrong by no more than this may pass, and is then
  mostly a dead end that stage 5 drops. It does not decide where slices begin or end.
- `sliver_eps_mm`: the shortest segment and the narrowest loop that is given. Points move by half
  of it at most for each segment that is dropped. It does not decide how the loops run.

The result is exact up to these: each point is at the distance from the source within
`sliver_eps_mm`, and all points that are so on that side are in the result.
"""

from camtool.geometry.offset.options import OffsetOptions
from camtool.geometry.offset.parallel import offset, offset_open
from camtool.geometry.offset.raw import RawOffset, raw_offset
from camtool.geometry.offset.shape import Stages, offset_shape, shape_stages
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
    "trace_loops",
    "trim_raw",
    "valid_slices",
]
