"""The page's typeface, inside the page: the signs of Inter that a text needs, as CSS."""

import base64
import io
from importlib import resources
from typing import Final

from fontTools.subset import Options, Subsetter, load_font, save_font

WEIGHTS: Final = {400: "Regular", 600: "SemiBold"}


def font_faces(text: str) -> str:
    """Return ``@font-face`` rules with the signs of ``text``; empty where Inter was not installed with the program."""
    folder = resources.files("study_app") / "gui" / "assets" / "fonts"
    rules = []
    for weight, name in WEIGHTS.items():
        file = folder / f"Inter-{name}.otf"
        if not file.is_file():
            return ""
        data = base64.b64encode(_subset(file.read_bytes(), text)).decode("ascii")
        rules.append(
            f'@font-face {{ font-family: "Inter"; font-weight: {weight}; src: url(data:font/woff;base64,{data}); }}'
        )
    return "\n".join(rules)


def _subset(content: bytes, text: str) -> bytes:
    """Return the signs of ``text`` as WOFF; the same signs give the same bytes."""
    options = Options(flavor="woff", layout_features=["kern", "tnum"], notdef_outline=True)
    font = load_font(io.BytesIO(content), options)
    subsetter = Subsetter(options)
    subsetter.populate(text=text)
    subsetter.subset(font)
    target = io.BytesIO()
    save_font(font, target, options)
    return target.getvalue()
