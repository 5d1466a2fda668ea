"""The servo's whole tick beside the thesis' force in plain C, for every scene that consists of it alone.

Batches of 1,000 ticks of all scenes alternate, so that other load affects all alike; times are medians. The forces of
both are compared first. Run it by itself:

    python tests/benchmarks/haptics/plain_c.py [--batches 400]
"""

import argparse
import sys

from study_app.errors import StudyError
from study_app.evidence.accuracy.plain_c import compare_with_plain_c
from study_app.evidence.table import Table
from study_app.protocol.load import load_scenes

SCENES = {f"{name} {liquid}": it for name in ("rek2024", "demo") for liquid, it in load_scenes(name).items()}
HEADINGS = ("scene", "plain C [ns]", "tick [ns]", "without liquids [ns]", "ratio", "difference of forces")
MOST_DIFFERENCE = 1e-9


def main() -> None:
    """Measure and print; the exit code is 1 if forces differ."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--batches", type=int, default=400)
    try:
        comparison = compare_with_plain_c(SCENES, batches=parser.parse_args().batches)
    except StudyError as error:
        print(error)
        return
    rows = [
        (
            name,
            f"{it.plain_ns:.0f}",
            f"{it.tick_ns:.0f}",
            f"{it.rest_ns:.0f}",
            f"{it.ratio:.2f}",
            f"{it.difference:.0e}",
        )
        for name, it in comparison.items()
    ]
    print(Table(HEADINGS, rows, left=1).text())
    sys.exit(any(result.difference > MOST_DIFFERENCE for result in comparison.values()))


if __name__ == "__main__":
    main()
