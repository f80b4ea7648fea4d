"""Documents and layouts of ezdxf, walked as those that are read from a DXF file."""

from __future__ import annotations

from typing import Any

from camtool.errors import OptionError
from camtool.importers.assemble import Found
from camtool.importers.dxf.load import Loaded, without_collector
from camtool.importers.dxf.reader import layout_of, walk_space
from camtool.importers.options import ReadOptions

HEADER = ("$INSUNITS", "$MEASUREMENT")
"""The header variables that name the unit of a drawing."""


def read(value: Any, name: str, options: ReadOptions) -> Found:
    """Return the pieces that an ezdxf document shows in model space or `options.layout`, or the
    given layout shows; the document says the unit.

    DrawingError naming layer and entity, OptionError for other objects of ezdxf."""
    from ezdxf.document import Drawing
    from ezdxf.layouts.base import BaseLayout

    if isinstance(value, Drawing):
        document, space = value, layout_of(value, options.layout, name)
    elif isinstance(value, BaseLayout):
        document, space = value.doc, value
        if options.layout is not None:
            raise OptionError(
                f"{name} is a layout already", mend="leave layout out, or give the document"
            )
    else:
        raise OptionError(
            f"{name} is of type {type(value).__name__} of ezdxf",
            mend="give its document, or the layout that it stands in",
        )
    header = {key: document.header[key] for key in HEADER if key in document.header}
    with without_collector():
        return walk_space(Loaded(document, header), space, name, options)
