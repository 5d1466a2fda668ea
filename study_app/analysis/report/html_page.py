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
<meta http-equiv="Content-Security-Policy"
  content="default-src 'none'; img-src data:; font-src data:; style-src 'unsafe-inline'">
<title>{title}</title>
<style>
{faces}
body {{ font-family: Inter, "Segoe UI", "DejaVu Sans", sans-serif; font-size: 15px; line-height: 1.5; color: #13202c;
  background: #f4f6f8; max-width: 1080px; margin: 0 auto; padding: 16px 24px; }}
h1 {{ font-size: 28px; line-height: 1.2; margin: 0 0 4px; font-weight: 600; }}
h2 {{ font-size: 20px; margin: 32px 0 8px; font-weight: 600; }}
h3 {{ font-size: 16px; margin: 24px 0 4px; font-weight: 600; }}
p {{ margin: 8px 0; }}
p, li {{ max-width: 52em; }}
ul {{ margin: 8px 0; padding-left: 20px; }}
table {{ border-collapse: collapse; font-size: 13px; font-variant-numeric: tabular-nums; margin: 8px 0;
  width: max-content; }}
th, td {{ text-align: left; padding: 4px 16px 4px 0; border-bottom: 1px solid #e6ebef; vertical-align: top; }}
th {{ color: #45535f; font-weight: 600; }}
td.long {{ max-width: 28em; min-width: 12em; }}
td.n, th.n {{ text-align: right; }}
th, td {{ white-space: nowrap; }} td.long {{ white-space: normal; }}
.soft {{ color: #45535f; font-size: 13px; font-weight: 400; }}
.mark, .sealed, .chip {{ font-size: 13px; font-weight: 600; padding: 3px 10px; border-radius: 13px;
  white-space: nowrap; }}
.mark {{ background: #fff1d6; color: #8a5200; }}
.sealed, .chip {{ background: #edf1f4; color: #45535f; }}
.box {{ background: #f4f6f8; border-radius: 12px; padding: 4px 20px; margin: 12px 0; }}
.care {{ border-left: 4px solid #8a5200; padding-left: 16px; }}
.scroll {{ overflow-x: auto; }}
img {{ max-width: 100%; height: auto; }}
figure {{ margin: 12px 0; }}
.facts {{ max-width: none; }}
.contents {{ font-size: 12px; margin: 8px 0; }}
.contents a {{ color: #0b65a3; margin-right: 10px; white-space: nowrap; }}
code {{ font-size: 12px; overflow-wrap: anywhere; }}
.answer, details.part {{ background: #ffffff; border: 1px solid #dce2e8; border-radius: 12px; margin: 12px 0; }}
.answer {{ padding: 12px 24px; display: flex; flex-wrap: wrap; gap: 4px 24px; align-items: center;
  justify-content: space-between; break-inside: avoid; }}
.answer .said {{ flex: 1 1 420px; }}
.answer h2 {{ font-size: 13px; font-weight: 500; color: #45535f; margin: 0; }}
.answer .told {{ font-size: 17px; line-height: 1.4; font-weight: 600; margin: 4px 0 8px; }}
.answer ul {{ margin: 4px 0; }}
.answer li {{ font-size: 14px; font-variant-numeric: tabular-nums; }}
.first .limits {{ font-size: 17px; margin: 24px 0 8px; }}
.first .care li {{ font-size: 14px; }}
details.part {{ padding: 0 24px; }}
details.part[open] {{ padding-bottom: 16px; }}
summary {{ cursor: pointer; color: #0b65a3; font-size: 14px; }}
details.part > summary {{ padding: 12px 0; color: #13202c; }}
details.part > summary h2 {{ display: inline; font-size: 16px; margin: 0; }}
summary:focus-visible {{ outline: 2px solid #0b65a3; outline-offset: 2px; }}
@media (max-width: 600px) {{ body {{ padding: 16px 12px; }}
  .answer, details.part {{ padding-left: 16px; padding-right: 16px; }}
  .answer .said {{ flex-basis: 100%; }} h1 {{ font-size: 24px; }}
  figure img {{ max-width: none; }} }}
@media print {{ body {{ font-size: 10pt; padding: 0; max-width: none; background: #ffffff; }}
  h2, h3, figure, summary, thead {{ break-after: avoid; }} tr, figure, img {{ break-inside: avoid; }}
  .first {{ break-after: page; }} .contents {{ display: none; }}
  h1 {{ font-size: 18pt; }} p, li {{ max-width: none; }} .soft {{ font-size: 8pt; }}
  .answer {{ padding: 6px 14px; margin: 6px 0; }} .answer h2 {{ font-size: 8pt; }} .answer .told {{ font-size: 12pt; }}
  .answer .said {{ flex: 1 1 0; }} .answer img {{ width: 210px; }} .answer ul {{ margin: 2px 0; }}
  .answer li, .first .care li {{ font-size: 9pt; }}
  .scroll {{ overflow: visible; }} table {{ font-size: 7.5pt; width: auto; }}
  th, td {{ padding-right: 8px; }} th, td.words {{ white-space: normal; }}
  details::details-content {{ content-visibility: visible; block-size: auto; }} }}
</style>
</head>
<body>
{body}
</body>
</html>
"""


LONG = 32
"""Cells of more letters are broken into lines."""

SHORT = 16
"""On paper, cells of more letters are."""

SCALE = 0.4
"""Pixels of the page for one of a figure: one that is two columns of print wide is 860 wide."""


def page(title: str, body: str, faces: str = "") -> str:
    """Return the whole file; ``faces`` are rules of the style that hold the typeface."""
    return PAGE.format(title=escape(title), body=body, faces=faces)


def contents(titles: Iterable[str]) -> str:
    """Return links to the folded sections, which are numbered in the order of their titles."""
    links = [f'<a href="#part-{number}">{escape(title)}</a>' for number, title in enumerate(titles, start=1)]
    return f'<nav class="contents" aria-label="Contents">{" ".join(links)}</nav>'


def heading(level: int, words: str) -> str:
    """Return a heading."""
    return f"<h{level}>{escape(words)}</h{level}>"


def paragraph(words: str, kind: str = "") -> str:
    """Return a paragraph of ``kind`` (a class of the style)."""
    return f'<p class="{kind}">{escape(words)}</p>' if kind else f"<p>{escape(words)}</p>"


def not_there(why: str) -> str:
    """Return what stands in the place of a part that could not be computed."""
    return box([paragraph(f"Not there: {why}.")], "care")


def bullets(lines: Iterable[str]) -> str:
    """Return a list, empty where there are no lines."""
    told = "".join(f"<li>{escape(line)}</li>" for line in lines)
    return f"<ul>{told}</ul>" if told else ""


def folded(parts: Sequence[str], number: int) -> list[str]:
    """Return a section that opens on a click (and on paper): its first part, a heading, stays in sight."""
    return [f'<details class="part" id="part-{number}">', f"<summary>{parts[0]}</summary>", *parts[1:], "</details>"]


def table(head: Sequence[str], rows: Iterable[Sequence[str]], *, words: int = 1, last: int = 0) -> str:
    """Return a table whose first ``words`` and ``last`` columns are words and whose others are numbers."""
    kinds = ["" if place < words or place >= len(head) - last else ' class="n"' for place in range(len(head))]
    titles = "".join(f"<th{kind}>{escape(cell)}</th>" for kind, cell in zip(kinds, head, strict=True))
    lines = ["".join(_cell(kind, cell) for kind, cell in zip(kinds, row, strict=True)) for row in rows]
    body = "".join(f"<tr>{line}</tr>" for line in lines)
    return f'<div class="scroll"><table><thead><tr>{titles}</tr></thead><tbody>{body}</tbody></table></div>'


def _cell(kind: str, words: str) -> str:
    """Return a cell; only sentences are broken into lines."""
    broken = ' class="long"' if len(words) > LONG else ' class="words"' if len(words) > SHORT else ""
    return f"<td{kind or broken}>{escape(words)}</td>"


def box(parts: Iterable[str], kind: str = "box") -> str:
    """Return parts that belong together."""
    return f'<div class="{kind}">' + "\n".join(parts) + "</div>"


def picture(png: bytes, caption: str) -> str:
    """Return a figure with its caption, the picture inside."""
    data = base64.b64encode(png).decode("ascii")
    width = round(SCALE * int.from_bytes(png[16:20]))  # where every PNG says it
    return (
        f'<figure><div class="scroll"><img width="{width}" alt="{escape(caption)}" '
        f'src="data:image/png;base64,{data}"></div><figcaption class="soft">{escape(caption)}</figcaption></figure>'
    )
