# SPDX-License-Identifier: MIT
"""Files of the repository outside of docs/ as pages of the site, and links that lead to them.

README, CONTRIBUTING, CHANGELOG and the notebooks are copied into two folders that git ignores, for Sphinx reads one
folder only. Links are written relative to the place of a file in the repository; before a page is parsed they are
rewritten to its place in the site.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

DOCS = Path(__file__).resolve().parents[1]
ROOT = DOCS.parent
LINK = re.compile(r"\[([^\]\[]*)\]\(([^)#\s:]+)(#[^)\s]*)?\)")

PAGES = {ROOT / name: DOCS / "project" / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")}
PAGES |= {path: DOCS / "notebooks" / path.name for path in sorted((ROOT / "notebooks").glob("*.ipynb"))}
ORIGINALS = {page: original for original, page in PAGES.items()}


def copy_pages(_app: Any) -> None:
    for original, page in PAGES.items():
        page.parent.mkdir(exist_ok=True)
        if not page.exists() or page.read_bytes() != original.read_bytes():  # else Sphinx would read it again
            page.write_bytes(original.read_bytes())


def site_target(target: str, original: Path, page: Path) -> str | None:
    """Where a link of `original` leads from its `page`; None: nowhere in the site."""
    found = (original.parent / target).resolve()
    if found == ROOT / "notebooks":
        return os.path.relpath(DOCS / "index.md", page.parent) + "#notebooks"
    if found.is_dir():
        return None
    return os.path.relpath(PAGES.get(found, found), page.parent)


def site_links(text: str, original: Path, page: Path) -> str:
    def rewritten(match: re.Match[str]) -> str:
        words, target, anchor = match.groups()
        where = site_target(target, original, page)
        if where is None:
            return match[0]
        if words.endswith(".md"):  # the name of the file: the site shows the title of the page
            words = ""
        return f"[{words}]({where}{anchor or ''})"

    return LINK.sub(rewritten, text)


def rewrite_links(app: Any, docname: str, source: list[str]) -> None:
    page = Path(app.env.doc2path(docname))
    source[0] = site_links(source[0], ORIGINALS.get(page, page), page)


def setup(app: Any) -> dict[str, Any]:
    app.connect("builder-inited", copy_pages)
    app.connect("source-read", rewrite_links)
    return {"parallel_read_safe": True}
