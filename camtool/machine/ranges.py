"""Ranges of the numbers of a machine file: one for each quantity, for all machines.

A range is wide of every machine there is, from a slide on piezos to a plasma table, and narrow
enough that a number in other units, or one with a slip of the exponent, is refused where it was
written. It also keeps arithmetic on it finite: squares of positions, steps of a travel.

Every number of a machine file has one of these ranges or a narrower one of its own (its field says
why); `camtool.tables` says it when a number lies outside. A test looks at all of them."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

Step = Annotated[float, Meta(ge=1e-6, le=10.0)]
"""mm that a step or a count moves a slide: a nanometre to a centimetre."""

Length = Annotated[float, Meta(ge=1e-3, le=1e5)]
"""mm of travel, or of a height above the stock: to 100 m."""

Depth = Annotated[float, Meta(ge=1e-6, le=1e4)]
"""mm into the stock."""

Place = Annotated[float, Meta(ge=-1e5, le=1e5)]
"""mm, a coordinate of the table."""

Reading = Annotated[float, Meta(ge=0.0, le=1e5)]
"""mm as measured; 0 where nothing was."""

Lost = Annotated[float, Meta(ge=0.0, le=100.0)]
"""mm of play, of its compensation, or of scatter."""

Tolerance = Annotated[float, Meta(ge=1e-6, le=100.0)]
"""mm that a path may stray."""

Slack = Annotated[float, Meta(ge=0.0, le=100.0)]
"""mm that a path may stray, or 0."""

Radius = Annotated[float, Meta(ge=0.0, le=1e7)]
"""mm of an arc that a controller takes."""

FeedRate = Annotated[float, Meta(ge=1e-5, le=1e7)]
"""mm/min: to 167 m/s."""

Acceleration = Annotated[float, Meta(ge=1e-3, le=1e7)]
"""mm/s²: to a thousand times that of free fall."""

Rate = Annotated[float, Meta(ge=1e-3, le=1e9)]
"""Steps a second, or bits."""

Scale = Annotated[float, Meta(ge=1e-6, le=1e6)]
"""Times as many: units per millimetre."""

Part = Annotated[float, Meta(ge=1e-9, le=1.0)]
"""Fraction of a quantity."""

Angle = Annotated[float, Meta(ge=0.0, le=1.0)]
"""rad within which a turn counts as none."""

Speed = Annotated[float, Meta(ge=1e-3, le=1e7)]
"""rev/min of a spindle."""

Seconds = Annotated[float, Meta(ge=1e-6, le=1e6)]
"""s of a pause: to eleven days."""

Count = Annotated[int, Meta(ge=1, le=1_000_000)]
"""Characters, blocks, moves."""
