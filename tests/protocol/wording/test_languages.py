"""With a device without force, no page of a shipped study speaks of feeling; its file and statements stay."""

import errno
import os
import re
import string
import subprocess
import sys
from pathlib import Path
from typing import NoReturn

import pytest

from study_app import api
from study_app.errors import ProtocolError, StudyError
from study_app.protocol.load import load
from study_app.protocol.model import Protocol
from study_app.protocol.without_force import SENTENCES, without_force
from study_app.protocol.wording import languages
from study_app.protocol.wording.languages import LANGUAGES, words
from study_app.store.verification.whole_study import verify_study
from study_app.store.versions.study_runs import recorded_contents


def slots(text: str) -> set[str]:
    return {name for _, name, _, _ in string.Formatter().parse(text) if name is not None}


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_word_is_there_in_every_language(language: str):
    assert words(language).language == language
    assert vars(words(language)).keys() == vars(words("en")).keys()
    for name, value in vars(words(language)).items():
        assert value, name
        assert all(part == part.strip() and part for part in ([value] if isinstance(value, str) else value))


@pytest.mark.parametrize("language", LANGUAGES)
def test_templates_have_the_same_slots_in_every_language(language: str):
    for name, value in vars(words(language)).items():
        if isinstance(value, str):
            uncounted = {"n"} if language == "ar" and name.startswith("many_") else set()  # the dual has no number
            assert slots(value) | uncounted == slots(getattr(words("en"), name)), name


def test_only_languages_written_so_run_from_right_to_left():
    assert {language for language in LANGUAGES if words(language).right_to_left} == {"ar"}


@pytest.mark.parametrize(
    ("language", "numbers", "sentence"),
    [
        ("en", [5], "One statement still needs an answer: 5."),
        ("en", [5, 8], "Two statements still need an answer: 5 and 8."),
        ("en", [1, 2, 9], "Three statements still need an answer: 1, 2 and 9."),
        ("en", list(range(1, 12)), "11 statements still need an answer: 1, 2, 3, 4, 5, 6, 7, 8, 9, 10 and 11."),
        ("nl", [5], "Eén uitspraak is nog niet beantwoord: 5."),
        ("nl", [5, 8], "Twee uitspraken zijn nog niet beantwoord: 5 en 8."),
        ("de", [5, 8], "Zwei Aussagen sind noch nicht beantwortet: 5 und 8."),
        ("fr", [5], "Une affirmation attend encore une réponse\u00a0: 5."),
        ("ar", [2, 4, 5], "عبارات بلا إجابة بعد: 2، 4 و5."),
    ],
)
def test_the_sentence_about_missing_answers(language: str, numbers: list[int], sentence: str):
    assert words(language).missing(numbers) == sentence


def test_templates_fill():
    english = words("en")
    assert english.part.format(part=1, parts=2) == "Part 1 of 2"
    assert english.setting.format(label="Liquid setting 1", of=3) == "Liquid setting 1 of 3"
    assert english.answered.format(done=7, of=9) == "7 of 9 answered"
    assert english.joined([]) == ""


def test_a_language_without_words_is_refused():
    hint = "copy languages/sv.toml from the workspace in which the study was made, or run liquid-study language sv"
    with pytest.raises(StudyError, match=rf'in "sv" \(known: ar, de, en, fr, nl; {hint}\)'):
        words("sv")


FEELING = re.compile(
    r"\b(feel\w*|felt|touch|push\w*|newtons?|voel\w*|gevoel\w*|aanvoelt|duw\w*|fühl\w*|gefühl\w*|spür\w*|sent\w*|ressent\w*)\b",
    re.IGNORECASE,
)
SHIPPED = ("rek2024", "demo", "physical_liquids", "slime")


def texts(protocol: Protocol) -> list[str]:
    """Return the texts of pages, introductions and instructions in every language."""
    localised = [page.body for page in protocol.pages.values()]
    localised += [form.intro for form in protocol.questionnaires.values()]
    localised += [task.instruction for task in protocol.tasks.values() if task.instruction is not None]
    return [protocol.text(text, language) for text in localised for language in protocol.study.languages]


@pytest.mark.parametrize("name", SHIPPED)
def test_pages_without_force_do_not_mention_feeling_except_in_statements(name: str) -> None:
    study = load(name)
    forceless = without_force(study)
    assert [text for text in texts(study) if FEELING.search(text)]
    assert [text for text in texts(forceless) if FEELING.search(text)] == []
    for key, questionnaire in study.questionnaires.items():
        assert forceless.questionnaires[key].items == questionnaire.items
    assert forceless.conditions == study.conditions
    assert (
        forceless.model_copy(update={key: getattr(study, key) for key in ("pages", "questionnaires", "tasks")}) == study
    )


def test_every_sentence_is_one_of_a_shipped_study() -> None:
    message = " ".join(" ".join(text.split()) for name in SHIPPED for text in texts(load(name)))
    assert [sentence for sentence in SENTENCES if sentence not in message] == []


@pytest.mark.parametrize(("table", "key"), [("pages", "body"), ("questionnaires", "intro"), ("tasks", "instruction")])
def test_sentences_about_force_are_replaced_in_each_table_and_language(table: str, key: str) -> None:
    study = load("demo")
    written = {"en": "Stir.\n\nPress the space bar when\nit feels familiar. It feels new.", "nl": "U voelt iets."}
    entries = {name: entry.model_copy(update={key: written}) for name, entry in getattr(study, table).items()}
    displayed = getattr(without_force(study.model_copy(update={table: entries})), table)
    replaced = {"en": "Stir.\n\nPress the space bar when you are used to it. It feels new.", "nl": "U voelt iets."}
    assert displayed == {name: entry.model_copy(update={key: replaced}) for name, entry in entries.items()}
    assert displayed


def test_a_study_of_ones_own_is_shown_as_it_is_written() -> None:
    study = load("demo")
    changes = {"intro": "What did you feel?"}
    questionnaires = {name: form.model_copy(update=changes) for name, form in study.questionnaires.items()}
    own = study.model_copy(update={"questionnaires": questionnaires})
    assert without_force(own).questionnaires == own.questionnaires


@pytest.mark.parametrize("language", LANGUAGES)
def test_the_programs_own_questions_do_not_mention_feeling(language: str) -> None:
    texts_of_program = words(language)
    assert [question for question in texts_of_program.design_questions.values() if FEELING.search(question)] == []


def spanish(folder: Path, **changed: str) -> Path:
    """Return a file of a lab's own language: the English texts with a mark, under another code."""
    text = re.sub(r'"([^"]*)"', r'"¡\1"', (Path(languages.__file__).parent / "en.toml").read_text("utf-8"))
    text = text.replace('language = "¡en"', 'language = "es"')
    for key, value in changed.items():
        text = re.sub(rf"^{key} = .*$", value, text, flags=re.MULTILINE)
    (folder / "es.toml").write_text(text, encoding="utf-8", newline="\n")
    return folder / "es.toml"


def test_a_labs_own_language_is_one_like_the_others(tmp_path: Path) -> None:
    own, refusals = languages.own_languages(spanish(tmp_path).parent)
    assert refusals == {}
    assert own["es"].continue_ == "¡Continue"
    missing_text = own["es"].missing([5, 8])
    assert missing_text != missing_text.replace("¡", "") == words("en").missing([5, 8])
    assert vars(own["es"]).keys() == vars(words("en")).keys()


@pytest.mark.parametrize(
    ("key", "line", "said"),
    [
        ("pause_title", "", "pause_title is missing"),
        ("pause_title", 'pause_title = ""', "pause_title is missing"),
        ("abx", "", "design_questions.abx is missing"),
        ("part", 'part = "Parte {parte}"', "part must contain the same placeholders as"),
        ("part", 'part = "Parte {part:d} de {parts}"', "part must contain the same placeholders as"),
        ("part", "part = 3", "part must be a string"),
        ("part", 'part = "Parte {"', "part must contain the same placeholders as"),
        ("interval_coming", 'interval_coming = ["a", "b"]', "interval_coming needs 4 strings"),
        ("small_numbers", 'small_numbers = ["Uno", 2]', "small_numbers must be a list of strings"),
        ("done", 'done = "Hecho"\nhola = "x"', "hola is unknown: remove it"),
        ("language", 'language = "en"', 'language must be "es"'),
        ("done", "done = ", "cannot be read as TOML"),
    ],
)
def test_an_incomplete_language_is_refused_with_its_errors(tmp_path: Path, key: str, line: str, said: str) -> None:
    own, refusals = languages.own_languages(spanish(tmp_path, **{key: line}).parent)
    assert own == {}
    assert said in refusals["es"]
    assert "\n" not in refusals["es"]


def test_language_files_of_shipped_languages_and_unreadable_folders_are_ignored(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "de.toml").write_bytes((Path(languages.__file__).parent / "de.toml").read_bytes())
    own, refusals = languages.own_languages(tmp_path)
    assert (own, list(refusals)) == ({}, ["de"])
    assert "remove the file" in refusals["de"]

    def fail(_folder: Path, _pattern: str) -> NoReturn:
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr(Path, "glob", fail)
    assert languages.own_languages(tmp_path)[0] == {}


def test_a_template_lacks_every_text_and_is_complete_once_each_is_written(tmp_path: Path) -> None:
    file = tmp_path / "es.toml"
    template = languages.language_template("es")
    file.write_text(template, encoding="utf-8", newline="\n")
    with pytest.raises(StudyError, match="name is missing; english_name is missing"):
        languages.read_language(file)
    file.write_text(re.sub(r'(?:""|\[\])  # ("[^"]*"|\[.*?\])', r"\1", template), encoding="utf-8", newline="\n")
    expected = vars(words("en")) | {"language": "es"}
    assert vars(languages.read_language(file)) == expected


def test_a_study_in_the_labs_language_is_checked_and_described(tmp_path: Path) -> None:
    folder = tmp_path / "lab"
    (folder / "languages").mkdir(parents=True)
    spanish(folder / "languages")
    study = tmp_path / "own.toml"
    study.write_text(STUDY, encoding="utf-8", newline="\n")
    command = [sys.executable, "-m", "study_app", "check", str(study)]
    environment = {**os.environ, "LIQUID_STUDY_WORKSPACE": str(folder)}
    process = subprocess.run(command, check=False, capture_output=True, text=True, env=environment)
    assert (process.returncode, process.stderr) == (0, "")
    assert re.search(r"Languages +es\n", process.stdout)
    spanish(folder / "languages", done="")
    process = subprocess.run(command, check=False, capture_output=True, text=True, env=environment)
    assert process.returncode == 2
    assert "es.toml: done is missing" in process.stderr
    assert "1 problem\n" in process.stderr, "texts that the study leaves out are not missing in this language"


@pytest.mark.parametrize("content", ['name = "Espa\u00f1ol"'.encode("latin-1"), 'name = "x"'.encode("utf-16")])
def test_a_language_file_in_another_encoding_is_named_with_a_remedy(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "es.toml").write_bytes(content)
    _, refusals = languages.own_languages(tmp_path)
    assert refusals["es"] == f"{tmp_path / 'es.toml'} is not UTF-8 text: save it as UTF-8"


@pytest.mark.slow
def test_results_in_the_labs_language_are_read_where_its_file_is_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own, _ = languages.own_languages(spanish(tmp_path).parent)
    study, results = tmp_path / "own.toml", tmp_path / "results"
    study.write_text(ABX, encoding="utf-8", newline="\n")
    with monkeypatch.context() as here:
        here.setitem(languages.LANGUAGES, "es", own["es"])
        with api.open_session(study, "P001", results=results, seed=1, answer=lambda _question: "like_first") as session:
            session.run()
    assert verify_study(results).errors == (), "without the file"
    monkeypatch.setitem(languages.LANGUAGES, "es", words("nl"))
    assert verify_study(results).errors == (), "with another file"
    monkeypatch.undo()
    (content,) = recorded_contents(results)
    (item,) = content.protocol["questionnaires"]["pair/answer"]["items"]
    assert item["text"] == {"es": own["es"].design_questions["abx"]}
    with pytest.raises(ProtocolError, match="1 problem"):
        load(study)


ABX = """
format = 2
study = { name = "pair", languages = ["es"] }
liquids.thin.density_kg_m3 = 1000
liquids.thick.density_kg_m3 = 1400
tasks.stir = { kind = "explore", min_s = 1, max_s = 1, instruction = "Mueva la bola." }
blocks.pair = { design = "abx", conditions = ["thin", "thick"], standard = "thin" }
"""
STUDY = """
format = 2
study.name = "own"
study.languages = ["es"]
sequence = ["feel"]
liquids.thin.density_kg_m3 = 1000
liquids.thick.density_kg_m3 = 1400
tasks.explore = { kind = "explore", min_s = 1, max_s = 2, instruction = "Explora." }
blocks.feel = { conditions = ["thin", "thick"], design = "abx", standard = "thin", repetitions = 4 }
"""
