"""Start of the bundled program: its commands, its worker processes, and its modules that run as programs."""

from __future__ import annotations

import multiprocessing
import runpy
import sys


def _as_interpreter(words: list[str]) -> None:
    """Run ``-m MODULE …`` or ``-c CODE`` as Python would: the program starts its own modules so."""
    while words and words[0] in ("-P", "-S"):
        words = words[1:]
    if words[0] == "-c":
        sys.argv = ["-c", *words[2:]]
        exec(words[1], {"__name__": "__main__"})  # nosec B102  # noqa: S102 - as an interpreter does
    else:
        sys.argv = words[1:]
        runpy.run_module(words[1], run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    multiprocessing.freeze_support()
    if sys.argv[1:2] and sys.argv[1] in ("-P", "-S", "-m", "-c"):
        _as_interpreter(sys.argv[1:])
    else:
        from study_app.cli import main

        main()
