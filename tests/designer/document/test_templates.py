"""Templates: each is a working study, and ``liquid-study new`` makes a new study from it."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from study_app.cli import commands
from study_app.designer.document.additions import localised_texts
from study_app.designer.document.document import Answers, copy_of, template, with_answers
from study_app.designer.document.fields import row_at
from study_app.designer.document.study import read_study
from study_app.designer.new_study_page import KnownAnswer, known_answers
from study_app.designer.templates import FOLDER, QUESTIONS, templates
from study_app.errors import StudyError
from study_app.protocol.descriptions.protocol_text import describe
from study_app.protocol.load import load
from study_app.protocol.model import Protocol
from study_app.protocol.warnings.expected_precision import threshold_plan
from study_app.protocol.warnings.study_warnings import level_warnings
from study_app.psychophysics.people import BETWEEN_PEOPLE
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.files.folders import StudyFolder
from study_app.store.verification.whole_study import verify_study
from tests.compiled import needs_servo


@pytest.mark.slow
@pytest.mark.parametrize("name", templates())
def test_each_template_passes_check_without_a_warning(name: str) -> None:
    protocol = load(FOLDER / f"{name}.toml")
    assert protocol == template(name).protocol
    assert "\nWarnings\n" not in describe(protocol)
    assert not list(level_warnings(protocol))
    assert protocol.study.version == "0.1"


ADAPTIVE = {"viscosity-jnd", "delay-detection"}
"""Where answers choose levels a rehearsal takes a minute."""


@pytest.mark.slow
@needs_servo
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.nightly if name in ADAPTIVE else ()) for name in templates()]
)
def test_each_template_is_rehearsed(name: str, tmp_path: Path) -> None:
    folder = rehearse(str(FOLDER / f"{name}.toml"), participants=1, seed=1, results=tmp_path / name, recordings=False)
    assert len(StudyFolder(folder).sessions()) == 1
    assert verify_study(folder).is_sound


@pytest.mark.parametrize("name", templates())
def test_no_page_of_a_template_names_a_liquid_or_a_number_that_is_easily_replaced(name: str) -> None:
    study = template(name)
    replaced = {*study.document["liquids"], "three", "four"}
    texts = {
        path[1]: str(text).lower() for path, text in localised_texts(study) if path[0] == "pages" and path[2] == "body"
    }
    later = {page: words for page, words in texts.items() if page != "welcome"}
    assert not {page: word for page, words in later.items() for word in replaced if re.search(rf"\b{word}\b", words)}


@pytest.mark.parametrize("name", templates())
def test_each_template_asks_at_most_five_questions_about_keys_that_it_has(name: str) -> None:
    document, questions = template(name).document, QUESTIONS.get(name, ())
    assert 3 + len(questions) <= 5
    for _, path in questions:
        row = row_at(document, path)
        assert row is not None
        assert row.kind in {"number", "whole number", "numbers", "vector", "either"}


@pytest.mark.parametrize("name", templates())
def test_the_texts_of_a_template_break_only_between_paragraphs(name: str) -> None:
    study = template(name)
    texts = [text for _, text in localised_texts(study) if isinstance(text, str)]
    assert any("\n\n" in text for text in texts)
    assert [text for text in texts if "\n" in text.rstrip().replace("\n\n", "")] == []


def test_the_answers_are_edits_of_the_template() -> None:
    before = template("viscosity-jnd")
    references, trials = (path for _, path in QUESTIONS["viscosity-jnd"])
    answers = Answers("Which is thicker?", ("en", "de"), ((references, [4, 8]), (trials, 60)))
    after = with_answers(before, answers)
    document = after.document
    assert document["study"]["title"] == {"en": "Which is thicker?"}
    assert document["study"]["languages"] == ("en", "de")
    assert document["stimuli"]["damping"]["standards"] == (4, 8)
    assert document["methods"]["adaptive"]["trials"] == 60
    assert {fault.message for fault in after.faults} == {"is missing in German"}
    assert after.text.count("#") == before.text.count("#")
    assert with_answers(before, Answers(languages=("en",))).text == with_answers(before, Answers()).text == before.text
    with pytest.raises(StudyError, match="must be at least"):
        with_answers(before, Answers(values=((trials, 0),)))


STUDIES, SEED = 100, 1


def simulated(protocol: Protocol, planted: float, unit: str, source: str) -> KnownAnswer:
    """Simulate studies of the first block with levels; return the known answer, as in its file.

    The threshold of each person differs from ``planted`` by a factor of `BETWEEN_PEOPLE`.
    """
    plan = next(
        block_plan for block in protocol.main_blocks if (block_plan := threshold_plan(protocol, block)) is not None
    )
    assert protocol.analysis is not None
    people, share = protocol.analysis.participants, 100.0 if unit == "%" else 1.0
    assert people is not None
    assert plan.stimulus.spacing == "log"
    rng = np.random.default_rng(SEED)
    apart = math.log10(BETWEEN_PEOPLE) * rng.standard_normal((STUDIES, people))
    estimates = plan.simulate((plan.stimulus.coordinate(planted / share) + apart).ravel(), rng)
    means = 10.0 ** estimates.medians.reshape(STUDIES, people).mean(axis=1)
    low, high = np.quantile(means, (0.05, 0.95))
    mean, low, high = (round(share * round(float(value), 4), 4) for value in (means.mean(), low, high))
    return KnownAnswer(planted=planted, unit=unit, source=source, people=people, found=mean, low=low, high=high)


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.parametrize("name", sorted(ADAPTIVE))
def test_an_adaptive_template_recovers_its_planted_threshold(name: str) -> None:
    known, protocol = known_answers()[name], template(name).protocol
    assert protocol is not None
    answer = simulated(protocol, known.planted, known.unit, known.source)
    assert answer.recovered
    assert answer == known


def run_new(*words: str) -> Result:
    return CliRunner().invoke(commands, ["new", "--no-window", *words])


@pytest.fixture
def protocols(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    return tmp_path / "protocols"


@pytest.mark.parametrize("name", templates())
def test_new_writes_a_sound_copy_with_its_comments_into_the_workspace(name: str, protocols: Path) -> None:
    assert run_new("mine", "--template", name).exit_code == 0
    text = (protocols / "mine.toml").read_text(encoding="utf-8")
    assert text.count("#") == (FOLDER / f"{name}.toml").read_text(encoding="utf-8").count("#")
    assert "liquid-study check mine" in text
    protocol = load("mine")
    assert (protocol.study.name, protocol.study.version) == ("mine", "0.1")


def test_new_refuses_to_overwrite(protocols: Path) -> None:
    assert run_new("mine").exit_code == 0
    before = (protocols / "mine.toml").read_bytes()
    again = run_new("mine", "--template", "rate-realism")
    assert isinstance(again.exception, StudyError)
    assert str(again.exception).endswith('mine.toml already exists; "mine2" is free')
    assert (protocols / "mine.toml").read_bytes() == before


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("My study",), "at most 40 lowercase letters and digits"),
        (("../mine",), "at most 40 lowercase letters and digits"),
        (("demo",), "ships with the program"),
        (("mine", "--template", "viscosity-jd"), 'did you mean "viscosity-jnd"'),
    ],
)
def test_new_refuses_impossible_studies(words: tuple[str, ...], sentence: str, protocols: Path) -> None:
    refused = run_new(*words)
    assert isinstance(refused.exception, StudyError)
    assert sentence in str(refused.exception)
    assert "\n" not in str(refused.exception)
    assert not list(protocols.glob("*"))


def test_copy_of_a_shipped_study_keeps_its_comments() -> None:
    original = load("rek2024")
    text = (FOLDER.parents[2] / "protocols" / "rek2024.toml").read_text(encoding="utf-8")
    copied = copy_of(read_study(text.encode()), "ours")
    assert copied.protocol is not None
    assert copied.protocol.liquids == original.liquids
    lines = [pair for pair in zip(text.splitlines(), copied.text.splitlines(), strict=True) if pair[0] != pair[1]]
    assert [new.split("#")[0].strip() for _, new in lines] == ['name = "ours"', 'version = "0.1"']


@pytest.mark.parametrize("name", templates())
def test_a_study_in_another_language_begins_with_the_texts_of_the_template(name: str) -> None:
    study = with_answers(template(name), Answers("Wie zäh?", ("de",)))
    assert study.faults == ()
    assert study.protocol is not None
    assert study.document["study"]["title"] == {"de": "Wie zäh?"}
    assert study.protocol.study.languages == ("de",)
    english = template(name).protocol
    assert english is not None
    assert [page.title["de"] for page in study.protocol.pages.values()] == [
        english.text(page.title, "en") for page in english.pages.values()
    ]
