# SPDX-License-Identifier: MIT
"""The API reference: what docstrings say in plain text becomes what reStructuredText means, and names become links."""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from sphinx.addnodes import pending_xref
from sphinx.domains.python import PyObject
from sphinx.util.docstrings import prepare_docstring

DOCUMENT = re.compile(r"(?<![\w/`])docs/([\w/]+)\.md\b")
COLON = (
    "\uf001"  # stands for ":" while napoleon reads the docstring of a property, which it would split there
)
LITERAL = re.compile(r"(`+[^`]*`+)")


def plain_text(text: str) -> str:
    """Bars are absolute values, and documents are named by their path in the repository."""
    return DOCUMENT.sub(r":doc:`/\1`", text.replace("|", r"\|"))


def adapt_docstring(_app: Any, what: str, _name: str, obj: Any, _options: Any, lines: list[str]) -> None:
    if what == "data" and lines and lines == prepare_docstring(type(obj).__doc__ or ""):
        lines.clear()  # those of dict or str: a constant has none of its own
    for i, line in enumerate(lines):
        if not line.lstrip().startswith((">>>", "...")):
            parts = LITERAL.split(line)
            lines[i] = "".join(part if part.startswith("`") else plain_text(part) for part in parts)
    if what in ("property", "attribute", "data") and lines:
        lines[0] = lines[0].replace(": ", f"{COLON} ")


def restore_colons(_app: Any, _what: str, _name: str, _obj: Any, _options: Any, lines: list[str]) -> None:
    lines[:] = [line.replace(COLON, ":") for line in lines]


def unlink_prose(_app: Any, doctree: nodes.document) -> None:
    """Types in docstrings are sentences: "a mask of this shape". Only words with a capital letter can be classes."""
    for node in list(doctree.findall(pending_xref)):
        if node.get("refspecific") and node.get("reftarget", "").islower():
            node.replace_self(node.children)


def resolve_home(app: Any, env: Any, node: pending_xref, content: Any) -> Any:
    """A class is documented by its public name, sdftrack.SDF, and may be referred to by its home, sdftrack.sdf.SDF."""
    python, target = env.get_domain("py"), node.get("reftarget", "")
    if node.get("refdomain") != "py":
        return None
    parts = target.removeprefix("sdftrack.").split(".")
    for name in (f"sdftrack.{'.'.join(parts[-2:])}", f"sdftrack.{parts[-1]}"):
        if name in python.objects and name != target:
            return python.resolve_xref(env, node["refdoc"], app.builder, node["reftype"], name, node, content)
    return None


def setup(app: Any) -> dict[str, Any]:
    for field in PyObject.doc_field_types:
        if field.name == "variable":
            field.label = "Attributes"  # as docstrings call them
    app.connect("autodoc-process-docstring", adapt_docstring, priority=400)  # before napoleon
    app.connect("autodoc-process-docstring", restore_colons, priority=600)  # after it
    app.connect("doctree-read", unlink_prose)
    app.connect("missing-reference", resolve_home)
    return {"parallel_read_safe": True}
