"""Progress of a measurement that lasts so many seconds."""

import threading
import time
from collections.abc import Callable, Iterator


def paced(
    seconds: float, every_s: float, *, ending: threading.Event, progress: Callable[[str], object]
) -> Iterator[int]:
    """Yield 0, 1, 2 … for so many seconds, with a pause after each, and report each per cent once.

    Raises
    ------
    KeyboardInterrupt
        ``ending`` was set.
    """
    began_s, shown, number = time.monotonic(), -1, 0
    while (share := (time.monotonic() - began_s) / seconds) < 1:
        if ending.is_set():
            raise KeyboardInterrupt
        if int(100 * share) > shown:
            shown = int(100 * share)
            progress(f"{shown:3} %")
        yield number
        number += 1
        time.sleep(every_s)
