# SPDX-License-Identifier: MIT
"""The navigation of the site from the lists of links in index.md, which are what a reader of a forge sees.

Every section of index.md becomes a part of the navigation, with its links in their order. The text of the README up to
`LANDING_END` stands before them.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from repository import PAGES, ROOT, site_links

LANDING_END = "<!-- end of the site's landing page -->"
SECTION = re.compile(r"^## (.*)$", re.MULTILINE)
PAGE_LINK = re.compile(r"\]\(([^)#\s:]+)\.(?:md|ipynb)\)")


TITLES = {"project/README": "README"}  # its own title is that of the site


def toctree(caption: str, pages: list[str]) -> str:
    entries = [f"{TITLES[page]} <{page}>" if page in TITLES else page for page in pages]
    return "\n".join(["```{toctree}", ":hidden:", f":caption: {caption}", "", *entries, "```", ""])


def with_toctrees(text: str) -> str:
    _head, *parts = SECTION.split(text)
    sections = zip(parts[::2], parts[1::2], strict=True)
    pages = [(caption, list(dict.fromkeys(PAGE_LINK.findall(section)))) for caption, section in sections]
    return "\n".join([text, *(toctree(caption, names) for caption, names in pages if names)])


def landing_page(text: str, page: Path) -> str:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    if LANDING_END not in readme:
        raise ValueError(f"README.md has no line {LANDING_END!r}: it says how far the landing page goes")
    introduction = site_links(readme.split(LANDING_END)[0], ROOT / "README.md", page)
    body = re.sub(r"^# .*\n", "", text, count=1)  # one title, the README's
    return introduction + "\n" + with_toctrees(body)


def add_navigation(app: Any, docname: str, source: list[str]) -> None:
    if docname == app.config.root_doc:
        source[0] = landing_page(source[0], Path(app.env.doc2path(docname)))


def setup(app: Any) -> dict[str, Any]:
    assert PAGES  # links of index.md to them are rewritten before this is called
    app.connect("source-read", add_navigation, priority=900)
    return {"parallel_read_safe": True}
