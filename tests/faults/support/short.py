"""A study of seconds: the demo with tasks that are soon over, and statements that the simulated rater does not know.

So answers depend on person and trial alone, and a trial that is presented again is answered as it was.
"""

import re
from pathlib import Path

from study_app.protocol.source.files import source_bytes

QUICK = (("min_s", "0.2"), ("count", "1"), ("dwell_s", "0.05"))
STATEMENTS = ("feels_liquid", "like_honey", "harder", "comfortable")
ANSWERS = 8


def write(folder: Path, *, resume: str = "trial") -> Path:
    """Write the study's protocol into ``folder`` and return it."""
    text = source_bytes("demo").decode()
    for key, value in (*QUICK, ("resume", f'"{resume}"')):
        text, count = re.subn(rf'^{key} = ("\w+"|[\d.]+)', f"{key} = {value}", text, flags=re.MULTILINE)
        assert count == 1, key
    for number, name in enumerate(STATEMENTS, start=1):
        assert f'"{name}"' in text
        text = text.replace(f'"{name}"', f'"statement_{number}"')
    path = folder / "short.toml"
    path.write_text(text, encoding="utf-8", newline="\n")
    return path
