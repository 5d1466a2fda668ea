"""Take pictures of every window of the program in both themes; takes some minutes and needs no display."""

import argparse
import os
from pathlib import Path


def size(words: str) -> tuple[int, int]:
    """Return a width and a height [px] of WIDTHxHEIGHT."""
    width, height = map(int, words.split("x"))
    return width, height


parser = argparse.ArgumentParser(prog="python -m tools.screenshots", description=__doc__)
parser.add_argument("--to", type=Path, required=True, metavar="DIR", help="Folder for the pictures.")
parser.add_argument(
    "--only", choices=("places", "designer", "session", "single-blind"), help="Only these; default: all."
)
parser.add_argument(
    "--sizes", nargs="+", default=(), type=size, metavar="WxH", help="Also take each window in these, in pixels."
)
given = parser.parse_args()
os.environ["QT_QPA_PLATFORM"] = "offscreen"  # the same pictures on every machine

from study_app.store.files.atomic import make_folder  # noqa: E402 - Qt reads the platform when it is loaded
from tools.screenshots import screenshots  # noqa: E402

make_folder(given.to, waits=False)
screenshots(given.to, only=given.only, sizes=tuple(given.sizes))
