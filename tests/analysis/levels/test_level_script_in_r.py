"""The report's script in R computes d′, criterion, means of reversals and group means again."""

import re
import shutil
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pandas as pd
import pytest

from study_app.analysis.data.study_tables import Study
from study_app.analysis.levels.results import LevelsFound
from study_app.analysis.levels.summaries import sensitivities
from study_app.analysis.report import number_files
from study_app.analysis.report.number_files import level_lines
from study_app.protocol.trials.designs import default_design
from study_app.protocol.trials.presentation import arrangement_text
from tests.analysis.levels.level_studies import ONE, ROVING, block
from tests.analysis.report.read_report import numbers, run_in_r

pytestmark = pytest.mark.slow
LINE = re.compile(r"(.+?) +report +(\S+) +R +(\S+)")


def computed(stdout: str) -> dict[str, float]:
    return {found[1]: float(found[3]) for line in stdout.splitlines() if (found := LINE.match(line))}


def test_r_computes_the_same_numbers(reported_adaptive: Path) -> None:
    done = run_in_r(reported_adaptive)
    assert (done.returncode, done.stderr) == (0, "")
    *_, counts, verdict = done.stdout.splitlines()
    assert verdict == "every number that R computes is the report's"
    found, of = re.findall(r"\d+", counts)
    assert found == of
    staircase, quest = numbers(reported_adaptive)["results"]["levels"]
    theirs = computed(done.stdout)
    for held in (staircase, quest):
        for one in held["thresholds"]:
            if one["participant"] is None:
                what = f"{held['block']}, group at {one['standard']:g}"
                assert theirs[f"{what} random-effects mean"] == pytest.approx(one["threshold"], rel=1e-5)
                assert theirs[f"{what} interval, high"] == pytest.approx(one["high"], rel=1e-5)
            elif one["reversal_mean"] is not None:
                what = f"{held['block']}, {one['participant']} at {one['standard']:g}"
                assert theirs[f"{what} mean of reversals"] == pytest.approx(one["reversal_mean"], rel=1e-5)
    assert sum("mean of reversals" in name for name in theirs) > 0
    assert sum("criterion" in name for name in theirs) == 6


@pytest.mark.nightly
def test_r_reads_a_study_of_every_reply(reported_levels: Path) -> None:
    done = run_in_r(reported_levels)
    assert (done.returncode, done.stderr) == (0, "")
    assert "pairs, P001 with late d'" in computed(done.stdout)


def test_r_finds_a_criterion_that_was_changed(reported_adaptive: Path, tmp_path: Path) -> None:
    for name in ("report.R", *(path.name for path in reported_adaptive.glob("study-*_data.csv"))):
        shutil.copy(reported_adaptive / name, tmp_path)
    (one, *_) = (
        one for one in numbers(reported_adaptive)["results"]["levels"][0]["sensitivities"] if one["participant"]
    )
    script = (tmp_path / "report.R").read_text(encoding="utf-8")
    assert repr(one["criterion"]) in script
    (tmp_path / "report.R").write_text(script.replace(f"{one['criterion']!r})", f"{one['criterion'] + 1!r})", 1))
    done = run_in_r(tmp_path)
    assert done.returncode == 1
    assert "numbers that differ: 1" in done.stdout


@pytest.mark.nightly
@pytest.mark.parametrize("design", ["2ifc", "3ifc", "4ifc", "abx", "oddity", "samedifferent", "yesno"])
@pytest.mark.parametrize("settings", [ONE, ROVING])
def test_r_computes_d_prime_of_every_design(design: str, settings: tuple, tmp_path: Path) -> None:  # type: ignore[type-arg]
    kind, draw, held = default_design(design), np.random.default_rng(6), []
    for number in range(120):
        arrangement = number % len(kind.arrangements)
        right = str(kind.correct(arrangement))
        answer = right if draw.random() < 0.7 else str(draw.choice([one for one in kind.answers if one != right]))
        held.append(("P001", "b", 8.0, "8/1", 0.2, arrangement_text(kind, arrangement), answer, True, answer == right))
    names = ["participant", "block", "standard", "track", "level", "arrangement", "response", "analysed", "right"]
    frame = pd.DataFrame(held, columns=names)
    tested = block(design, settings=settings)
    found = LevelsFound(
        "b", "Block", design, True, (), "share", "correct", sensitivities=tuple(sensitivities(tested, frame))
    )
    lines, compared = level_lines(cast("Study", SimpleNamespace(name="s", levels=(tested,))), [found])
    table = frame.rename(columns={"level": "level_asked"}).assign(
        trial=range(len(frame)), analysed="true", right=frame["right"].map({True: "true", False: "false"})
    )
    table.to_csv(tmp_path / "study-s_description-tracks_data.csv", index=False)
    template = (Path(number_files.__file__).parent / "templates" / "report.R").read_text(encoding="utf-8")
    same = 'folder <- "."\n' + template[template.index("differing <- 0") : template.index("# Sums of")]
    (tmp_path / "report.R").write_text("\n".join([same, *lines, 'cat(compared, "numbers,", differing, "differ\\n")']))
    done = run_in_r(tmp_path)
    assert done.stderr == ""
    assert done.stdout.splitlines()[-1] == f"{compared} numbers, 0 differ"
    assert compared == (2 if found.sensitivities[1].criterion is not None else 1)
    assert computed(done.stdout)["b, P001 at 8 d'"] > 0
