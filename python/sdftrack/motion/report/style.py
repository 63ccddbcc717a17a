# SPDX-License-Identifier: MIT
"""How the page looks, on a screen and on A4."""

from __future__ import annotations

__all__ = ["GAP", "GRID", "INK", "PHASES", "QUIET", "STYLE"]

INK, QUIET, GRID, GAP = "#24323d", "#6b7780", "#d9dfe3", "#b9bfc4"
PHASES = {"move": "#cfe3f5", "hold": "#f6e7c8", "return": "#d5ebd3"}

STYLE = """
:root { color: #24323d; background: white; }
body { font: 15px/1.5 system-ui, "Segoe UI", Helvetica, Arial, sans-serif; max-width: 880px; margin: 2em auto;
  padding: 0 1em; }
h1 { font-size: 1.7em; line-height: 1.2; margin: 0; }
h2 { font-size: 1.25em; margin: 2em 0 .4em; padding-top: .6em; border-top: 2px solid #24323d; }
h3 { font-size: 1em; margin: 1.4em 0 .2em; }
p { margin: .4em 0; }
.quiet { color: #6b7780; font-size: .9em; }
.open { color: #8a5a00; }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(7.6em, 1fr)); gap: .6em; margin: 1em 0; }
.tile { border: 1px solid #d9dfe3; border-radius: 6px; padding: .4em .7em; }
.tile b { display: block; font-size: 1.3em; line-height: 1.4; font-weight: 600; white-space: nowrap; }
.tile span { display: block; color: #6b7780; font-size: .82em; line-height: 1.35; }
.note { background: #fbf5e6; border-left: 4px solid #d9a520; padding: .4em .8em; margin: .6em 0; }
.key span { display: inline-block; padding: 0 .7em; margin-right: .6em; font-size: .85em; color: #24323d;
  print-color-adjust: exact; -webkit-print-color-adjust: exact; }
table { border-collapse: collapse; width: 100%; font-size: .87em; font-variant-numeric: tabular-nums; }
th { text-align: left; font-weight: 600; vertical-align: top; padding: .22em 1em .22em 0; }
td { vertical-align: top; padding: .22em 1em .22em 0; }
thead th { border-bottom: 1.5px solid #24323d; vertical-align: bottom; color: #6b7780; }
tbody th { font-weight: 400; } tbody tr { border-bottom: 1px solid #e9edf0; }
.changed { font-weight: 600; }
table.each { font-size: .78em; } table.each th { padding-right: .5em; } table.each td { padding-right: .5em; }
svg { max-width: 100%; height: auto; display: block; }
details { margin: .8em 0; } summary { cursor: pointer; font-weight: 600; }
.wide { overflow-x: auto; }
footer { margin-top: 3em; border-top: 1px solid #d9dfe3; }
@page { size: A4; margin: 14mm 13mm; }
@media print {
  body { font-size: 10.5px; max-width: none; margin: 0; padding: 0; }
  h2, h3, summary { break-after: avoid; } svg, tr, .tiles, .note { break-inside: avoid; }
  thead { display: table-header-group; } .session + .session, .page { break-before: page; }
  .wide { overflow: visible; } summary { list-style: none; }
}
"""
