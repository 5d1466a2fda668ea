"""How long edits of a study take: python tests/benchmarks/windows/designer.py [EDITS] prints milliseconds of a core.

Edits are random, of every kind, over every protocol and the grown studies of the tests; each is checked as the tests do
(document, values it does not concern, comments, undo), and the first one that is written wrongly ends the run.
"""

import statistics
import sys
from itertools import count
from pathlib import Path
from random import Random

sys.path.insert(0, str(Path(__file__).parents[3]))

from tests.authoring.writer import test_edits


def main(wanted: int) -> None:
    """Make so many random edits, each checked as the tests do."""
    names, made = sorted(test_edits.TEXTS), 0
    for seed in count():
        made += test_edits.walk(Random(seed), test_edits.TEXTS[names[seed % len(names)]], 12)  # noqa: S311
        if made >= wanted:
            break
    times = test_edits.TIMES
    print("| edits | texts | median ms | 95 % ms | worst ms |")
    print("| --- | --- | --- | --- | --- |")
    ninety_five = statistics.quantiles(times, n=20)[-1]
    print(f"| {made} | {len(names)} | {statistics.median(times):.1f} | {ninety_five:.1f} | {max(times):.1f} |")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 3500)
