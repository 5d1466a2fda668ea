"""How long edits of a study take: python tests/benchmarks/windows/designer.py [EDITS] prints milliseconds of a core.

Edits are random, of every kind, over every protocol and the grown studies of the tests; each is checked as the tests do
(document, values it does not concern, comments), and the first one that is written wrongly ends the run.
"""

import statistics
import sys
import time
from itertools import count
from pathlib import Path
from random import Random

sys.path.insert(0, str(Path(__file__).parents[3]))

from study_app.designer.document.toml_edits import apply
from study_app.designer.document.toml_text import Refused
from tests.designer.document.grown import texts
from tests.designer.document.random_edits import check_edit, edit_of


def main(wanted: int) -> None:
    """Make so many random edits, each checked as the tests do."""
    written = texts()
    names, times = sorted(written), list[float]()
    for seed in count():
        draw, text = Random(seed), written[names[seed % len(names)]]  # noqa: S311
        for _ in range(12):
            edit = edit_of(draw, text)
            began_s = time.thread_time()
            try:
                after, _splices = apply(text, edit)
            except Refused:
                continue
            times.append(1000 * (time.thread_time() - began_s))
            check_edit(text, after, edit)
            text = after
        if len(times) >= wanted:
            break
    print("| edits | texts | median ms | 95 % ms | worst ms |")
    print("| --- | --- | --- | --- | --- |")
    ninety_five = statistics.quantiles(times, n=20)[-1]
    print(f"| {len(times)} | {len(names)} | {statistics.median(times):.1f} | {ninety_five:.1f} | {max(times):.1f} |")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 3500)
