"""The report's words follow what was decided and what was tested, in studies of several kinds."""

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from study_app.analysis.data.blocks import Setting, setting_name
from study_app.analysis.data.study_tables import Study
from study_app.analysis.evaluate import evaluate
from study_app.analysis.export.table_files import codebook_bytes
from study_app.analysis.report.methods import methods
from study_app.analysis.report.sections import block, conduct, limits
from tests.analysis.made_up import DECIDED, delays, everybody, study
from tests.analysis.outputs import GOLDEN
from tests.golden import CHANGING, compare, each_once
from tests.golden_values import page_lines

pytestmark = pytest.mark.slow


def plain(people: int, **decided: Any) -> Study:
    """Return a study of three delays whose answers rise, by as much for everybody."""

    def answer(person: int, _session: int, code: str, _item: str) -> int:
        return min(7, 1 + person % 3 + 2 * (int(code[1:]) - 1))

    settings = delays((0.0, 50.0, 100.0))
    return study(settings, list(everybody(settings, people, answer)), replace(DECIDED, **decided))


def rising(
    people: int, seed: int, delays_ms: tuple[float, ...] = (0.0, 50.0, 100.0, 150.0), shift: float = 0.0, **more: int
) -> Study:
    """Return a study whose answers rise with the delay, by ``shift`` more in later sessions."""
    rng = np.random.default_rng(seed)

    def answer(_person: int, session: int, code: str, _item: str) -> int:
        return int(np.clip(round(int(code[1:]) + shift * (session - 1) + rng.normal()), 1, 7))

    return study(delays(delays_ms), list(everybody(delays(delays_ms), people, answer, **more)))


def codes_of_participants() -> Study:
    study = plain(4)
    return replace(study, settings={}, protocol={**study.protocol, "study": {"codes": "participant"}})


def beyond_limits() -> Study:
    study = plain(4)
    gaps = [300.0, 300.0, *[1.0] * (len(study.trials) - 2)]
    limited = {**study.protocol, "limits": {"frame_gap_ms": 250.0}}
    return replace(study, trials=study.trials.assign(worst_frame_gap_ms=gaps), protocol=limited)


def versions_pooled() -> Study:
    study = plain(4)
    return replace(study, participants=study.participants.assign(protocol_version=["1", "1", "2", "2"]))


STUDIES: dict[str, Callable[[], Study]] = {
    "decided": lambda: plain(8),
    "decisions that changed": lambda: plain(8, changed=True),
    "codes of participants": codes_of_participants,
    "beyond limits": beyond_limits,
    "versions pooled": versions_pooled,
    "unanimity": lambda: plain(12),
    "repetitions": lambda: rising(10, 1, repetitions=2),
    "two sessions": lambda: rising(10, 1, shift=2.0, sessions=2),
    "three sessions": lambda: rising(10, 2, sessions=3),
    "one delay twice": lambda: rising(12, 3, (0.0, 50.0, 50.0, 100.0, 150.0)),
}


def said_of(made: Study) -> Iterator[str]:
    results = evaluate(made)
    assert results.failures == ()
    yield from (methods(made, results), *limits(made, results))
    yield from page_lines("".join((*conduct(made, results), *block(results.blocks[0], results, ()))))
    (block_table,) = json.loads(codebook_bytes(made, {}))["blocks"]
    yield f"answers per participant, setting and item: {block_table['answers_per_participant_setting_and_item']}"


def test_the_wording_of_reports_is_as_recorded(pytestconfig: pytest.Config) -> None:
    lines = (line for name, make_study in STUDIES.items() for line in (f"== {name}", *said_of(make_study())))
    compare(GOLDEN / "wording.txt", each_once(lines), pytestconfig, mask=CHANGING)


@pytest.mark.parametrize(
    ("primary", "adjustment"),
    [
        ((), ["p adjusted (Holm) across 2 tests (family “b: trend over delay”)"]),
        (
            ("harder",),
            [
                "p not adjusted (family “b: trend over delay, exploratory”)",
                "p not adjusted (family “b: trend over delay”)",
            ],
        ),
    ],
    ids=["two primary items", "one primary item"],
)
def test_p_is_adjusted_across_the_items_of_a_family(primary: tuple[str, ...], adjustment: list[str]) -> None:
    results = evaluate(plain(8, primary=primary))
    lines = page_lines("".join(block(results.blocks[0], results, ())))
    (trend_line,) = (line for line in lines if "family “b: trend" in line)
    assert [phrase for phrase in trend_line.split(".")[0].split("; ") if phrase.startswith("p ")] == adjustment


@pytest.mark.parametrize(
    ("conditions", "names"),
    [
        (["8/1", "8/2", "12/1"], ["Standard 8, track 1", "Standard 8, track 2", "Standard 12"]),
        (["calm", "stirred"], ["Honey (calm)", "Honey (stirred)"]),
    ],
)
def test_settings_with_the_same_name_have_distinct_names(conditions: list[str], names: list[str]) -> None:
    is_track = "/" in conditions[0]
    honey: dict[str, Any] = {} if is_track else {"liquid": "honey", "delay_ms": 0.0}
    settings = [Setting(code=f"L{place}", condition=name, **honey) for place, name in enumerate(conditions, start=1)]
    assert [setting_name(setting, settings) for setting in settings] == names


def test_settings_have_the_names_of_their_conditions() -> None:
    pairs = {"thin_oil": "l1", "wax": "wax", "a": "l3"}
    settings = [
        Setting(code=f"L{liquid}", condition=name, liquid=liquid, delay_ms=0.0) for name, liquid in pairs.items()
    ]
    assert [setting_name(setting, settings) for setting in settings] == ["Thin oil", "Wax", "a"]
    late = Setting(code="L9", condition="late_wax", liquid="wax", delay_ms=80.0)
    names = [setting_name(setting, [*settings, late]) for setting in (*settings, late)]
    assert names == ["Thin oil, 0 ms", "Wax, 0 ms", "a, 0 ms", "Wax, 80 ms"]
