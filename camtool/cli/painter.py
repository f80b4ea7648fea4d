"""Draws the pictures of a command: of scenes that are made when the first one is asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from camtool.preview.options import Options
    from camtool.preview.scene import Scene

KIND = "closeup.svg"
"""A name that says which kind of picture a close-up is."""


@dataclass(frozen=True)
class Painter:
    """`make` makes the scenes, several stand side by side; `told` hears of them once."""

    make: Callable[[], Sequence[Scene]]
    looks: Callable[[], Options]
    told: Callable[[Sequence[Scene]], None]

    @cached_property
    def scenes(self) -> Sequence[Scene]:
        """What is drawn."""
        found = self.make()
        self.told(found)
        return found

    def __call__(self, name: str) -> bytes:
        """The picture, for a file of this name."""
        drawn, options = self.scenes, self.looks()
        if not judged(drawn):  # the findings say why; the picture shows what there is
            options = replace(options, polar=None)
        if len(drawn) > 1:
            from camtool.preview.beside import render_beside

            return render_beside(drawn, name, options)
        from camtool.preview.render import render

        return render(drawn[0], name, options)

    def closeups(self) -> Iterator[tuple[str, bytes]]:
        """Caption and SVG of what a page shows besides; of the last scene, which is the result."""
        from camtool.preview.closeups import closeups
        from camtool.preview.render import render

        for caption, options in closeups(self.scenes[-1], self.looks()):
            yield caption, render(self.scenes[-1], KIND, options)


def judged(scenes: Sequence[Scene]) -> bool:
    """Whether all have a predicted path."""
    return all(scene.trace_points is not None for scene in scenes)
