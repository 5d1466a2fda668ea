"""How a track is doing, in words without a level: answers, share of each button, longest run, time to answer, repeats.

It follows from what the journal holds unsealed, so that it is the same for every key. Whether an answer was correct is
never shown.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import groupby
from statistics import median
from typing import Final

from study_app.number_text import counted
from study_app.protocol.orders.schedule import Schedule, Trial
from study_app.store.progress import Progress, TrialAnswer
from study_app.viewmodels.number_words import grouped

LONG_RUN: Final = 8
"""So many equal answers in a row are marked."""
UNDELIVERED: Final[Mapping[str, str]] = {
    "lateness_ms": "the servo was late",
    "worst_gap_ms": "the servo missed ticks",
    "delay_error_ms": "the visual delay was not kept",
    "frame_gap_ms": "frames were late or missing",
    "withheld_percent": "force was withheld for safety",
    "targets_percent": "too few targets were reached",
    "level_error_percent": "the force was not as requested",
    "level_error_ms": "the visual delays did not differ as requested",
    "pace_error_percent": "the hand did not keep the pace",
    "force_limit_n": "the force limit was reached",
}
"""Why an interval was invalid, by the key of the limit that it broke."""
FAST_S: Final = 0.3
"""A median time to answer below this is marked [s]."""


def track_words(progress: Progress, schedule: Schedule, trial: Trial, choices: Mapping[str, str]) -> tuple[str, ...]:
    """Return lines on the track of ``trial``; ``choices`` are its answers in words.

    A line that ends in "check" deserves attention.
    """
    own = [one.number for one in schedule.trials if (one.block, one.code) == (trial.block, trial.code)]
    answers = [progress.trial_answers[number] for number in own if number in progress.trial_answers]
    limits = Counter(limit for number in own for limit in progress.undelivered.get(number, ()))
    behind = [number for number in own if progress.steps.get(number, progress.here) < progress.here]
    given_up = [number for number in behind if number in progress.undelivered and number not in progress.trial_answers]
    reasons = Counter(reason for number in own for reason in progress.repeated.get(number, ()))
    return (
        f"Track {trial.code}: {len(answers)} of at most {grouped(len(own))} answered",
        *(_of_answers(answers, choices) if answers else ()),
        *(f"repeated {count}: {reason}" for reason, count in reasons.items()),
        *(f"not delivered {count}: {UNDELIVERED.get(limit, limit)}" for limit, count in limits.items()),
        *([f"{len(given_up)} unanswered: no attempt was delivered"] if given_up else []),
    )


def unanswered_words(progress: Progress) -> str:
    """Return how many trials an ended session left unanswered since no attempt was delivered; "" for none."""
    count = sum(number not in progress.trial_answers for number in progress.undelivered)
    return f"{counted(count, 'trial')} unanswered: no attempt was delivered" if count else ""


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
