"""How a track is doing, in words without a level: answers, share of each button, longest run, time to answer, repeats.

It follows from what the journal holds unsealed, so that it is the same for every key. Whether an answer was correct is
never shown.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import groupby
from statistics import median
from typing import Final

from study_app.protocol.orders.schedule import Schedule, Trial
from study_app.store.progress import Progress, TrialAnswer
from study_app.viewmodels.number_words import grouped

LONG_RUN: Final = 8
"""So many equal answers in a row are marked."""
FAST_S: Final = 0.3
"""A median time to answer below this is marked [s]."""


def track_words(progress: Progress, schedule: Schedule, trial: Trial, choices: Mapping[str, str]) -> tuple[str, ...]:
    """Return lines on the track of ``trial``; ``choices`` are its answers in words.

    A line that ends in "check" deserves attention.
    """
    own = [one.number for one in schedule.trials if (one.block, one.code) == (trial.block, trial.code)]
    answers = [progress.trial_answers[number] for number in own if number in progress.trial_answers]
    reasons = Counter(reason for number in own for reason in progress.repeated.get(number, ()))
    return (
        f"Track {trial.code}: {len(answers)} of at most {grouped(len(own))} answered",
        *(_of_answers(answers, choices) if answers else ()),
        *(f"repeated {count}: {reason}" for reason, count in reasons.items()),
    )


def _of_answers(answers: Sequence[TrialAnswer], choices: Mapping[str, str]) -> list[str]:
    given = [str(one.value) for one in answers]
    shares = ", ".join(f"{words} {100 * given.count(choice) / len(given):.0f} %" for choice, words in choices.items())
    run = max(len(list(same)) for _, same in groupby(given))
    lines = [*([shares] if shares else []), f"longest run {run}" + (": check" if run >= LONG_RUN else "")]
    seconds = [one.seconds for one in answers if one.seconds is not None]
    if seconds:
        middle = median(seconds)
        lines.append(f"median answer time {middle:.2f} s" + (": check" if middle < FAST_S else ""))
    return lines
