"""No number that the program writes tells a liquid or a delay while the key is sealed; after unblinding they do."""

from __future__ import annotations

import csv
import re
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pytest
from scipy.stats import binomtest

from study_app.protocol.load import source_bytes
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.blinded import blinding
from study_app.store.blinded.unblinding import unblind
from study_app.store.folders import StudyFolder
from study_app.store.journals import journal
from tests.compiled import needs_servo

pytestmark = needs_servo

SESSIONS = 24
QUICK = (("min_s", "2"), ("count", "2"), ("dwell_s", "0.05"))
MORE = """
[liquids.light_oil]
density_kg_m3 = 4500
effects = ["drag", "wake"]
[liquids.light_oil.wake]
length = 125
scaling = 250
exponent = 0.25
[conditions.light_oil]
liquid = "light_oil"
"""
ABOUT_ANSWERS = frozenset({"item_shown", "choice", "responses"})
ABOUT_RECORDINGS = frozenset({"samples_recorded", "samples_unrecorded", "frames_recorded"})
TIMES_OF_ACTIONS = frozenset({"t_s", "t_task_s", "trial_started_s"})
PASSED_OVER = TIMES_OF_ACTIONS | ABOUT_RECORDINGS | {"n", "trial", "attempt", "index", "of", "part", "session"}

Numbers: TypeAlias = dict[str, float]
Trials: TypeAlias = dict[tuple[str, int], tuple[str, Numbers]]
"""By participant and trial: the condition, and every number written about the trial."""


def every_number(folder: Path, block: str) -> Trials:
    """Return what a study's folder holds about each trial of a block beside answers, times of actions, recordings."""
    study = StudyFolder(folder)
    codes = blinding.read_key(folder).codes[block]
    found: Trials = {}
    for session in study.sessions():
        lines = journal.read(session.journal)
        for line in lines:
            if line["event"] == "trial_started" and line["block"] == block:
                found[session.participant, line["trial"]] = (codes[line["code"]], {})
        for line in lines:
            trial = (session.participant, line.get("trial"))
            if trial in found and line["event"] not in ABOUT_ANSWERS:
                found[trial][1].update(numbers(line, f"{line['event']} "))
        with session.table("demo", "trials").open(encoding="utf-8", newline="") as table:
            for row in csv.DictReader(table):
                trial = (session.participant, int(row["trial"]))
                if trial in found:
                    found[trial][1].update(numbers(row, "table "))
    return found


def numbers(said: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, float]]:
    """Yield the numbers of a line or row, flags among them, and how long each text is."""
    for name, value in said.items():
        if name not in PASSED_OVER:
            try:
                yield prefix + name, float({"true": 1, "false": 0}.get(value, value))
            except (TypeError, ValueError):
                yield f"{prefix}{name}, length", float(len(str(value)))


def told(trials: Trials) -> tuple[int, int, float]:
    """Return how many conditions the nearest mean names, of how many trials, and the p of chance alone.

    By all numbers together and by each alone, whichever tells most; p is corrected for having tried all (Bonferroni).
    The means are those of the other sessions; every number counts by its standard deviation there.
    """
    names = sorted({name for _, said in trials.values() for name in said})
    values = np.array([[said.get(name, 0.0) for name in names] for _, said in trials.values()])
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


@pytest.fixture(scope="module")
def rehearsed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("told")
    text = source_bytes("demo").decode()
    changes = [(rf"^{key} = [\d.]+", f"{key} = {value}") for key, value in QUICK]
    changes.append((r'"thin", "thick"\]', '"thin", "thick", "light_oil"]'))
    for pattern, change in changes:
        text, changed = re.subn(pattern, change, text, flags=re.MULTILINE)
        assert changed == 1, pattern
    protocol = folder / "short.toml"
    protocol.write_text(text + MORE, encoding="utf-8")
    return rehearse(protocol, participants=SESSIONS, seed=5, results=folder / "results", recordings=False)


@pytest.mark.parametrize("block", ["liquids", "delays"])
def test_nothing_written_tells_a_condition_better_than_chance(rehearsed: Path, block: str) -> None:
    right, trials, p = told(every_number(rehearsed, block))
    assert p > 0.01, f"{right} of {trials} trials were told (p = {p:.2g})"


@pytest.mark.parametrize("block", ["liquids", "delays"])
def test_after_unblinding_the_same_search_tells_them(rehearsed: Path, tmp_path: Path, block: str) -> None:
    """So the search can fail, and what was sealed is there."""
    folder = tmp_path / "opened"
    shutil.copytree(rehearsed, folder)
    assert unblind(folder, "AB", "to see that it tells").left == ()
    right, trials, p = told(every_number(folder, block))
    assert p < 0.005, f"{right} of {trials} trials were told (p = {p:.2g})"
