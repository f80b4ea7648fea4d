"""Pictures of drawings, toolpaths and predicted paths: a Scene as SVG, and PNG rendered from it.

`content.py` sorts the scene into chains and places, `layers.py` draws them layer by layer, and
`page.py` arranges the page; this file puts them together. Equal scenes give equal bytes: no dates,
no random ids, no fonts. Inside the group "mm" coordinates are those of the part, in mm, Y up."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import PurePath

from camtool.errors import OutputError
from camtool.pictures import text
from camtool.pictures.colours import QUIET
from camtool.pictures.content import Content, content_of
from camtool.pictures.layers import draw_layers
from camtool.pictures.options import (
    AS_USUAL,
    PNG_WIDTH_PX,
    SVG_WIDTH_PX,
    PictureOptions,
    check_width,
)
from camtool.pictures.page import (
    LATHE_AXES,
    PLANE_AXES,
    PageLayout,
    axes_around,
    colour_bar,
    ground,
    legend_rows,
    mat,
    page_of,
    scale_bar,
    scale_of,
    sheet,
)
from camtool.pictures.plot import Plot
from camtool.pictures.polar import draw_polar
from camtool.pictures.scene import Scene
from camtool.pictures.svg import Look, element, number
from camtool.pictures.text import TextStyle
from camtool.pictures.view import View, page_width
from camtool.records import replace

PNG_DPI = 96
"""Resolution for lengths in mm: with resvg's own default of 0 they would vanish."""


def draw(scene: Scene, options: PictureOptions = AS_USUAL) -> str:
    """Return the scene as SVG text; OptionError for a circle that it does not have."""
    if options.polar is not None:
        return draw_polar(scene, options.polar, options)
    if options.view != "plan":
        from camtool.pictures.solid import draw_solid

        return draw_solid(scene, options)
    content = content_of(scene, options)
    page = page_of(content, page_width(options.size_px or SVG_WIDTH_PX))
    view, sizes = page.view, (page.width, page.height)
    return sheet(
        scene.title,
        sizes,
        options,
        ground(view, page.ticks),
        element("g", {"id": "plot"}, *_plot(content, view)),
        mat(view.box, *sizes),
        page.head,
        axes_around(view, page.ticks, LATHE_AXES if scene.is_turned else PLANE_AXES),
        *_scales_and_legend(content, page),
    )


def panel(content: Content, page: PageLayout) -> list[str]:
    """Return head, plot and axes of one of several scenes as SVG; the plot is clipped, so that it
    covers none of its neighbours."""
    box = page.view.box
    sides = (box.left, box.top, box.width, box.height)
    plot: Look = dict(zip(("x", "y", "width", "height"), sides, strict=True))
    # The id names its sides: two pictures in one page share it only where the clip is the same.
    clip = "clip-" + "-".join(number(side, 0) for side in sides)
    return [
        page.head,
        ground(page.view, page.ticks),
        element("clipPath", {"id": clip}, element("rect", plot)),
        element("g", {"clip-path": f"url(#{clip})"}, *_plot(content, page.view)),
        axes_around(page.view, page.ticks),
    ]


def png(svg: str, width_px: int) -> bytes:
    """Return an SVG text rendered as a PNG of this width; OptionError for a width out of range."""
    check_width(width_px)
    import resvg_py

    image = resvg_py.svg_to_bytes(
        svg_string=svg, width=width_px, dpi=PNG_DPI, skip_system_fonts=True
    )
    return bytes(image)


def _plot(content: Content, view: View) -> list[str]:
    """Return the SVG of the layers, or a label where there is nothing to draw."""
    layers = draw_layers(content, Plot(view))
    if not content.is_empty:
        return layers
    middle = (view.box.left + view.box.right) / 2.0, (view.box.top + view.box.bottom) / 2.0
    return [*layers, text.label("nothing to draw", middle, TextStyle(16.0, QUIET, "middle"))]


def _scales_and_legend(content: Content, page: PageLayout) -> list[str]:
    """Return the SVG of the colour bar, the legend and the scale bar."""
    box, parts = page.view.box, []
    scale = scale_of(content)
    if scale is not None:
        parts.append(colour_bar(scale, box))
    parts.append(legend_rows(page.rows, box.left, page.legend_y))
    parts.append(scale_bar(page.view, box.right, page.bar_y))
    return parts


def render(scene: Scene, name: str, options: PictureOptions = AS_USUAL) -> bytes:
    """Return the SVG, PNG or HTML bytes of the scene, by the extension of `name`.

    OutputError for other extensions. HTML is the viewer's page, which takes no options."""
    if PurePath(name).suffix.lower() == ".html":
        from camtool.pictures.viewer.page import viewer_page

        return viewer_page(scene)
    return rendered(lambda sized: draw(scene, sized), name, options)


def rendered(drawn: Callable[[PictureOptions], str], name: str, options: PictureOptions) -> bytes:
    """Return SVG or PNG bytes, by the extension of `name`, of what `drawn` makes: SVG text for
    options with a width.

    OutputError for other extensions."""
    suffix = PurePath(name).suffix.lower()
    if suffix not in (".svg", ".png"):
        raise OutputError("is not a picture file", file=name, mend="use .svg or .png")
    usual = SVG_WIDTH_PX if suffix == ".svg" else PNG_WIDTH_PX
    width = options.size_px or usual
    svg = drawn(replace(options, size_px=width))
    return svg.encode() if suffix == ".svg" else png(svg, width)
