"""Every number that the program writes about a trial, and a classifier that names what was presented by them."""

import csv
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, TypeAlias

import numpy as np
from scipy.stats import binomtest

from study_app.store.files.folders import SessionFolder

ABOUT_ANSWERS = frozenset({"item_shown", "choice", "responses"})
TIMES_OF_ACTIONS = frozenset({"t_s", "t_task_s", "trial_started_s", "interval_started_s", "gap_s"})
PASSED_OVER = TIMES_OF_ACTIONS | {"n", "trial", "attempt", "index", "of", "part", "session", "interval"}

Numbers: TypeAlias = dict[str, float]
Trials: TypeAlias = dict[tuple[str, int], tuple[str, Numbers]]
"""By participant and trial: the condition, and every number written about the trial."""


def every_number(
    session: SessionFolder,
    study: str,
    lines: Iterable[dict[str, Any]],
    presented: Callable[[dict[str, Any]], str | None],
) -> Trials:
    """Return the numbers in a session's files about each trial, except answers and times of actions.

    Sizes of files are among the numbers, and of each event, by interval, how many lines it has and how far apart.

    Parameters
    ----------
    session, study
        The session's folder, and the study's name.
    lines : iterable of dict[str, Any]
        The lines of its journal, as they were written.
    presented : callable
        Returns what the trial that a line begins presented, None for a trial that is left out.
    """
    lines = list(lines)
    trials_by_condition: Trials = {}
    for line in lines:
        if line["event"] == "trial_started" and (what := presented(line)) is not None:
            trials_by_condition[session.participant, line["trial"]] = (what, {})
    interval = 0
    written_s: dict[tuple[Any, ...], float] = {}
    for line in lines:
        interval = 0 if line["event"] == "trial_started" else interval
        trial = (session.participant, line.get("trial"))
        if trial in trials_by_condition and line["event"] not in ABOUT_ANSWERS:
            trials_by_condition[trial][1].update(numbers(line, f"{line['event']} {line.get('interval', '')} "))
            interval = line.get("interval", interval)
            count = f"number of {line['event']} {interval}"
            trials_by_condition[trial][1][count] = trials_by_condition[trial][1].get(count, 0.0) + 1
            if (before := written_s.get((*trial, count))) is not None:
                trials_by_condition[trial][1][f"since the last {line['event']} {interval}"] = line["t_s"] - before
            written_s[*trial, count] = line["t_s"]
        if trial in trials_by_condition and line["event"] == "recorded":
            paths = [session.path / line[name] for name in ("recording", "recording_frames")]
            trials_by_condition[trial][1].update(
                (f"size {number}", path.stat().st_size) for number, path in enumerate(paths)
            )
    for name in ("trials", "intervals"):
        if not session.table(study, name).exists():
            continue
        with session.table(study, name).open(encoding="utf-8", newline="") as table:
            for row in csv.DictReader(table):
                trial = (session.participant, int(row["trial"]))
                if trial in trials_by_condition:
                    trials_by_condition[trial][1].update(numbers(row, f"{name} {row.get('interval', '')} "))
    return trials_by_condition


def numbers(said: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, float]]:
    """Yield the numbers of a line or row, flags among them, and how long each text is."""
    for name, value in said.items():
        if name not in PASSED_OVER:
            try:
                yield prefix + name, float({"true": 1, "false": 0}.get(value, value))
            except (TypeError, ValueError):
                yield f"{prefix}{name}, length", float(len(str(value)))


def told(trials: Trials) -> tuple[int, int, float]:
    """Return how many conditions the nearest mean predicts, the number of trials, and the p under chance.

    By all numbers together and by each alone, whichever tells most; p is corrected for having tried all (Bonferroni).
    The means are those of the other sessions; every number counts by its standard deviation there.
    """
    names = sorted({name for _, numbers_of_trial in trials.values() for name in numbers_of_trial})
    values = np.array([[numbers_of_trial.get(name, 0.0) for name in names] for _, numbers_of_trial in trials.values()])
    people = np.array([person for person, _ in trials])
    conditions = np.array([condition for condition, _ in trials.values()])
    kinds = np.unique(conditions)
    hits = np.zeros(1 + len(names), dtype=int)
    for person in np.unique(people):
        others = people != person
        scale = values[others].std(axis=0)
        scale[scale < 1e-12] = np.inf
        means = np.array([values[others & (conditions == kind)].mean(axis=0) for kind in kinds])
        each = ((values[~others][:, None] - means) / scale) ** 2
        far = np.concatenate([each.sum(axis=2, keepdims=True), each], axis=2)
        hits += (kinds[far.argmin(axis=1)] == conditions[~others][:, None]).sum(axis=0)
    right = int(hits.max())
    p = binomtest(right, len(people), 1 / len(kinds), alternative="greater").pvalue
    return right, len(people), min(float(p) * len(hits), 1.0)
