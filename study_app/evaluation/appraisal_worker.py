"""The process that appraises scenes, from both its ends.

It begins as the least important one of the machine, before it loads anything, so that it takes nothing from a servo.
A question is a line of JSON, {"number": 3, "scene": {...}, "stroke": [5.0, 0.03], "dynamics": [0.001, 3.8e-05, 0.1]};
stroke and dynamics of the device are null or left out where no stroke is asked about. Its answers are lines with the
same number and "costs", then "errors", or with "why" nothing could be measured.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import asdict, replace
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any, Final, TextIO, TypeAlias

from study_app.errors import StudyError
from study_app.evaluation.appraisal import Costs, EffectCost, Errors
from study_app.evaluation.fastest import withheld_share
from study_app.haptics.model.device_dynamics import UNKNOWN, Dynamics
from study_app.haptics.model.scene import Scene
from study_app.protocol.trials.task import Stroke

NICEST: Final = 19
Told: TypeAlias = tuple[int, Costs | Errors | str]


class Appraiser:
    """Asks a process of its own what scenes cost and how true they are; never waits for it."""

    def __init__(self) -> None:
        root = str(Path(__file__).resolve().parents[2])
        paths = [root, *filter(None, [os.environ.get("PYTHONPATH")])]
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "study_app.evaluation.appraisal_worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=os.environ | {"PYTHONPATH": os.pathsep.join(paths)},
            text=True,
            encoding="utf-8",
        )
        self._asked = 0
        self._closed = False
        self._told: SimpleQueue[Told] = SimpleQueue()
        self._listening = threading.Thread(target=self._listen, name="appraiser", daemon=True)
        self._listening.start()

    @property
    def works(self) -> bool:
        """Whether there still is somebody to ask."""
        return not self._closed and self._process.poll() is None

    def ask(self, scene: Scene, stroke: Stroke | None = None, dynamics: Dynamics = UNKNOWN) -> int:
        """Ask about a scene, and about a stroke in it on a device of these dynamics; return the number of the answers.

        Answers to earlier questions may still come.
        """
        self._asked += 1
        question = {"number": self._asked, "scene": scene.model_dump(mode="json"), "stroke": stroke}
        question |= {"dynamics": dynamics if stroke is not None else None}
        with suppress(OSError, ValueError):  # it ended, or was closed: `works` says so
            assert self._process.stdin is not None  # noqa: S101 - made so
            self._process.stdin.write(json.dumps(question) + "\n")
            self._process.stdin.flush()
        return self._asked

    def answers(self, wait_s: float = 0.0) -> list[Told]:
        """Return what was answered since: (number, `Costs`), (number, `Errors`), or (number, a sentence why not)."""
        found: list[Told] = []
        with suppress(Empty):
            while True:
                found.append(self._told.get(timeout=wait_s) if wait_s and not found else self._told.get_nowait())
        return found

    def close(self) -> None:
        """End the process, whatever it is doing; it is not waited for here."""
        self._closed = True
        self._process.terminate()

    def _listen(self) -> None:
        """Read answers until there are no more, then see the process off: in a thread of its own."""
        with self._process as process:  # which waits for its end and closes its pipes
            assert process.stdout is not None  # noqa: S101 - made so
            for line in process.stdout:
                self._told.put(_read(json.loads(line)))


def _read(told: dict[str, Any]) -> Told:
    """Return an answer as the other end meant it."""
    number = int(told["number"])
    if "costs" in told:
        costs = told["costs"]
        effects = tuple(EffectCost(**it) for it in costs["effects"])
        return number, Costs(costs["tick_ns"], costs["rest_ns"], effects)
    if "errors" in told:
        return number, Errors(**(told["errors"] | {"left_out": tuple(told["errors"]["left_out"])}))
    return number, str(told["why"])


def serve(questions: Iterable[str], answers: TextIO) -> None:
    """Answer every question, the costs before the errors, until there are no more.

    Of several that wait, the newest is answered; one that is followed by another is told no errors.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the program; this ends when nobody asks any more
    if hasattr(os, "nice"):
        os.nice(NICEST)
    waiting: SimpleQueue[str | None] = SimpleQueue()
    threading.Thread(target=_queue, args=(questions, waiting), daemon=True).start()  # a full pipe would stop who asks
    from study_app.evaluation.appraisal_measurement import (  # noqa: PLC0415 - the compiler: only in this process
        costs,
        errors,
    )

    while (question := _newest(waiting)) is not None:
        asked = json.loads(question)
        scene = Scene.model_validate_json(json.dumps(asked["scene"]))
        try:
            _tell(answers, asked["number"], costs=asdict(costs(scene)))
            if waiting.empty():
                stroke = asked.get("stroke")
                share = withheld_share(scene, Stroke(*stroke), Dynamics(*asked["dynamics"])) if stroke else None
                _tell(answers, asked["number"], errors=asdict(replace(errors(scene), withheld=share)))
        except StudyError as error:
            _tell(answers, asked["number"], why=str(error))


def _tell(answers: TextIO, number: int, **what: object) -> None:
    answers.write(json.dumps({"number": number} | what) + "\n")
    answers.flush()


def _queue(questions: Iterable[str], waiting: SimpleQueue[str | None]) -> None:
    for question in questions:
        waiting.put(question)
    waiting.put(None)


def _newest(waiting: SimpleQueue[str | None]) -> str | None:
    """Wait for a question, and return the last one there is; None where nobody asks any more."""
    question = waiting.get()
    while question is not None and not waiting.empty():
        following = waiting.get()
        if following is None:
            waiting.put(None)
            return question
        question = following
    return question


if __name__ == "__main__":
    with suppress(BrokenPipeError):
        serve(sys.stdin, sys.stdout)
