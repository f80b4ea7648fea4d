"""For mkdocs: links that lead out of docs/, to files of the project, become their plain words.

On the forge they lead to the file; in the site there is no such page.
"""

import posixpath
import re
from typing import Any

LINK = re.compile(r"(?<!!)\[([^\]]+)\]\(([^)#\s]+)[^)]*\)")


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """The page's text without links out of docs/."""
    folder = posixpath.dirname(page.file.src_uri)

    def kept(match: re.Match[str]) -> str:
        place = posixpath.normpath(posixpath.join(folder, match[2]))
        return match[1] if place.startswith("..") else match[0]

    return LINK.sub(kept, markdown)
