"""The page itself: one HTML file with its style and its pictures inside, without scripts, nothing fetched."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from html import escape

PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; style-src 'unsafe-inline'">
<title>{title}</title>
<style>
body {{ font-family: Inter, "Segoe UI", "DejaVu Sans", sans-serif; font-size: 15px; line-height: 1.5; color: #13202c;
  background: #ffffff; max-width: 62em; margin: 2em auto; padding: 0 1.5em; }}
h1 {{ font-size: 26px; line-height: 1.2; margin-bottom: 4px; }}
h2 {{ font-size: 20px; margin: 40px 0 8px; padding-top: 12px; border-top: 1px solid #dce2e8; }}
h3 {{ font-size: 16px; margin: 24px 0 4px; }}
p, li {{ max-width: 48em; }}
table {{ border-collapse: collapse; font-size: 13px; font-variant-numeric: tabular-nums; margin: 8px 0; }}
th, td {{ text-align: left; padding: 3px 12px 3px 0; border-bottom: 1px solid #e6ebef; vertical-align: top; }}
th {{ color: #45535f; font-weight: 600; }}
td.n, th.n {{ text-align: right; }}
.soft {{ color: #45535f; font-size: 13px; }}
.mark {{ background: #fff1d6; color: #8a5200; font-weight: 600; padding: 2px 8px; border-radius: 8px; }}
.sealed {{ background: #edf1f4; color: #45535f; font-weight: 600; padding: 2px 8px; border-radius: 8px; }}
.box {{ background: #f4f6f8; border-radius: 12px; padding: 4px 20px; margin: 12px 0; }}
.care {{ border-left: 4px solid #8a5200; padding-left: 16px; }}
.scroll {{ overflow-x: auto; }}
img {{ max-width: 100%; }}
code {{ font-size: 12px; overflow-wrap: anywhere; }}
@media print {{ body {{ font-size: 10pt; margin: 0; max-width: none; }} h2, h3, figure {{ break-after: avoid; }} }}
</style>
</head>
<body>
{body}
</body>
</html>
"""


def page(title: str, body: Iterable[str]) -> str:
    """Return the whole file."""
    return PAGE.format(title=escape(title), body="\n".join(body))


def heading(level: int, words: str) -> str:
    """Return a heading."""
    return f"<h{level}>{escape(words)}</h{level}>"


def paragraph(words: str, kind: str = "") -> str:
    """Return a paragraph of ``kind`` (a class of the style)."""
    return f'<p class="{kind}">{escape(words)}</p>' if kind else f"<p>{escape(words)}</p>"


def bullets(lines: Iterable[str]) -> str:
    """Return a list, empty where there are no lines."""
    told = "".join(f"<li>{escape(line)}</li>" for line in lines)
    return f"<ul>{told}</ul>" if told else ""


def table(head: Sequence[str], rows: Iterable[Sequence[str]], *, words: int = 1, last: int = 0) -> str:
    """Return a table whose first ``words`` and ``last`` columns are words and whose others are numbers."""
    kinds = ["" if place < words or place >= len(head) - last else ' class="n"' for place in range(len(head))]
    lines = ["".join(f"<th{kind}>{escape(cell)}</th>" for kind, cell in zip(kinds, head, strict=True))]
    lines += ["".join(f"<td{kind}>{escape(cell)}</td>" for kind, cell in zip(kinds, row, strict=True)) for row in rows]
    return '<div class="scroll"><table>' + "".join(f"<tr>{line}</tr>" for line in lines) + "</table></div>"


def box(parts: Iterable[str], kind: str = "box") -> str:
    """Return parts that belong together."""
    return f'<div class="{kind}">' + "\n".join(parts) + "</div>"


def picture(png: bytes, caption: str) -> str:
    """Return a figure with its caption, the picture inside."""
    data = base64.b64encode(png).decode("ascii")
    return (
        f'<figure style="margin:12px 0"><img width="860" alt="{escape(caption)}" src="data:image/png;base64,{data}">'
        f'<figcaption class="soft">{escape(caption)}</figcaption></figure>'
    )
