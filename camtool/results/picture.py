"""Pictures as values, and what has one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from camtool.preview.options import AS_USUAL, Options

if TYPE_CHECKING:
    from camtool.preview.overlay import Overlay
    from camtool.preview.scene import Scene


@dataclass(frozen=True, eq=False, repr=False)
class Picture:
    """A picture of `scene` (several: beside each other, at one scale), looking as `options` say;
    the same bytes for the same values."""

    scene: Scene | Overlay | tuple[Scene, ...]
    options: Options = AS_USUAL

    @property
    def svg(self) -> str:
        """The picture as SVG text; OptionError for options that make no picture."""
        from camtool.preview.beside import draw_beside
        from camtool.preview.draw import draw
        from camtool.preview.overlay import Overlay, draw_overlay

        if isinstance(self.scene, tuple):
            return draw_beside(self.scene, self.options)
        if isinstance(self.scene, Overlay):
            return draw_overlay(self.scene, self.options)
        return draw(self.scene, options=self.options)

    def render(self, name: str) -> bytes:
        """The bytes of a file of this name: .svg, .png, or .html, which is the viewer (it has no
        options, and shows one value alone). OutputError or OptionError for any other."""
        from camtool.preview.beside import render_beside
        from camtool.preview.overlay import Overlay, render_overlay
        from camtool.preview.render import render

        if isinstance(self.scene, tuple):
            return render_beside(self.scene, name, self.options)
        if isinstance(self.scene, Overlay):
            return render_overlay(self.scene, name, self.options)
        return render(self.scene, name, self.options)

    def save(self, file: str | Path) -> None:
        """Write the file, by its extension; raises as `render` does."""
        Path(file).write_bytes(self.render(str(file)))

    def __repr__(self) -> str:
        scenes = self.scene if isinstance(self.scene, tuple) else (self.scene,)
        titles = " and ".join(scene.title for scene in scenes if scene.title)
        return f"<Picture of {titles}>" if titles else "<Picture>"

    def _repr_svg_(self) -> str:
        return self.svg


class Shown(ABC):
    """A value that has a picture, and shows it in a notebook."""

    @abstractmethod
    def _scene(self) -> Scene | Overlay:
        """What its picture is of."""

    def _repr_svg_(self) -> str:
        return Picture(self._scene()).svg
