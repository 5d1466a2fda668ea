"""Whether an exception leaves the evaluation or the texts of any of 2,000 random studies.

Run it by itself, at night: ``python tests/benchmarks/analysis/random_studies.py [STUDIES] [FIRST]``, on all cores. The
tests do the same with the first few. Prints each study that fails, with its number, and ends with 1 if any does.
"""

import sys
import time
import traceback

from study_app.workers.executors import open_executor
from tests.analysis.random_studies import check

STUDIES = 2000


def failure(number: int) -> str:
    """Return why a study fails, or nothing."""
    try:
        check(number)
    except Exception:  # noqa: BLE001 - any is what is looked for
        return f"study {number}:\n{traceback.format_exc()}"
    return ""


def main() -> int:
    """Check the studies, and print what was found."""
    studies, first = (int(sys.argv[at]) if len(sys.argv) > at else usual for at, usual in ((1, STUDIES), (2, 0)))
    begun, failed = time.monotonic(), 0
    with open_executor() as executor:
        for done, why in enumerate(executor.map(failure, range(first, first + studies)), start=1):
            failed += bool(why)
            if why:
                print(why)
            if done % 100 == 0 or done == studies:
                print(f"{done} of {studies} studies, {failed} failed, {time.monotonic() - begun:.0f} s", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
