"""Processes that run the same task at the same moment."""

import multiprocessing
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any


def race(task: Callable[[int, int], AbstractContextManager[Any]], rounds: int, programs: int = 2) -> list[list[Any]]:
    """Enter ``task(program, round)`` in forks, together in each round; return what each yielded, by round and program.

    No fork leaves its task before all others have entered theirs.
    """
    forking = multiprocessing.get_context("fork")
    barrier, answers = forking.Barrier(programs), forking.Queue()

    def run(program: int) -> None:
        for number in range(rounds):
            barrier.wait(60)
            with task(program, number) as answer:
                answers.put((number, program, answer))
                barrier.wait(60)

    forks = [forking.Process(target=run, args=(program,)) for program in range(programs)]
    for fork in forks:
        fork.start()
    results = sorted((answers.get(timeout=120) for _ in range(rounds * programs)), key=lambda result: result[:2])
    for fork in forks:
        fork.join(30)
        assert fork.exitcode == 0
    return [
        [answer for _, _, answer in results[first : first + programs]] for first in range(0, len(results), programs)
    ]
