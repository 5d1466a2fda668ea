"""The appendix of questions, and what changed between versions: from the receipts alone."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from markupsafe import escape

from study_app.analysis.report.sections import changed_questions
from study_app.analysis.report.write_report import appendix, report
from study_app.protocol.source.files import shipped_file
from study_app.store import receipt
from study_app.store.files.folders import StudyFolder
from study_app.store.sites.merge import merge_sites
from study_app.store.versions.study_runs import RecordedContent, content_changes, recorded_contents
from study_app.store.versions.study_versions import save_study
from study_app.store.workstation import DEFAULTS, save_settings
from tests.analysis.conftest import Results
from tests.studies import begun

OLD = "This liquid behaves like honey."
NEW = "This liquid behaves like warm honey that runs slowly off a spoon."
"""A statement of rek2024, and another wording."""


@pytest.fixture
def results(tmp_path: Path) -> Path:
    """Return results of three sessions; a statement was reworded by AK, and the study's file deleted afterwards."""
    file, folder = tmp_path / "study.toml", tmp_path / "results"
    text, base = shipped_file("rek2024").read_text(encoding="utf-8"), ""
    reworded = text.replace(f'"{OLD}"', f'"{NEW}"')
    assert reworded != text
    for participant, by, content in (("P001", "BC", text), ("P002", "AK", reworded), ("P003", "BC", reworded)):
        save_settings(DEFAULTS.model_copy(update={"operator": by}))
        base = save_study(file, content, base)
        with begun(folder, participant, file) as store:
            store.finish("completed")
    file.unlink()
    return folder


def test_the_first_session_of_each_version_and_who_saved_it_are_read_from_receipts(
    results: Path, tmp_path: Path
) -> None:
    contents = recorded_contents(results)

    assert [(content.participant, content.saved_by) for content in contents] == [("P001", "BC"), ("P002", "AK")]
    for content in contents:
        session_receipt = receipt.read(StudyFolder(results).session(content.participant, 1).receipt)
        assert (content.began, content.protocol) == (session_receipt["started_at"], session_receipt["protocol"])
    ((after, sentences),) = content_changes(contents)
    assert after.participant == "P002"
    assert len(sentences) == 1
    assert sentences[0].index("previously") < sentences[0].index(OLD) < sentences[0].index("now")
    shutil.rmtree(results / "data" / "sub-P001")  # sites must have the same version
    merge_sites({"North": results}, tmp_path / "pooled")
    assert recorded_contents(tmp_path / "pooled") == (replace(contents[1], participant="North-P002"),)


def test_versions_are_listed_where_all_texts_are_in_one_language(results: Path) -> None:
    def english(content: RecordedContent) -> RecordedContent:
        without = lambda texts: {name: text for name, text in texts.items() if name != "nl"}  # noqa: E731
        return replace(content, protocol=json.loads(json.dumps(content.protocol), object_hook=without))

    page = "".join(appendix([*map(english, recorded_contents(results))]))
    assert (">versions<" in page, ">language<" in page) == (True, False)


def test_options_ends_and_labels_are_among_the_texts_and_their_rewording_is_a_caveat(results: Path) -> None:
    (content, *_) = recorded_contents(results)
    item = {
        "id": "tired", "text": "How tired?", "low": "Not at all", "high": "Extremely",
        "options": [{"id": "left", "text": {"en": "Left", "nl": "Links"}}],
    }  # fmt: skip
    scales = {"agree": {"labels": ["No", "Yes"], "cannot_judge": "I cannot say"}}
    texts = (*(item[key] for key in ("low", "high")), "Left", "Links", "No · Yes", "I cannot say")

    def reworded(old: str, new: str) -> RecordedContent:
        protocol = {**content.protocol, "questionnaires": {"about": {"items": [item]}}, "scales": scales}
        return replace(content, protocol=json.loads(json.dumps(protocol).replace(old, new)))

    page = "".join(appendix([reworded("", "")]))
    assert [text for text in texts if text not in page] == []
    for old, place in (
        ("Extremely", "about.tired, high"),
        ("Links", "about.tired, option left"),
        ("I cannot say", "scale agree, cannot judge"),
        ("Yes", "scale agree"),
    ):
        (caveat,) = changed_questions([reworded("", ""), reworded(old, "Otherwise")])
        assert caveat.startswith(f"The wording of {place} changed in version 1.1 (first session: P001"), caveat


@pytest.mark.usefixtures("png_figures_only")
def test_the_report_shows_every_wording_in_every_language_and_its_changes(rek: Results, tmp_path: Path) -> None:
    rek.add("P001", lambda _condition, _item: 4)
    later = rek.add("P002", lambda _condition, _item: 4)
    content = json.loads(later.receipt.read_text(encoding="utf-8"))
    before = content["protocol"]["questionnaires"]
    new = json.loads(json.dumps(content["protocol"]).replace(OLD, NEW))
    new["study"]["version"] = "1.2"
    facts = {"protocol_hash": "2", "started_at": "2026-01-06T10:00:00.000+01:00", "saved_by": "AK"}
    receipt.write(later.receipt, content | facts | {"protocol": new})

    page = report(rek.folder, tmp_path / "report")[0].read_text(encoding="utf-8")

    appendix = page[page.index("Questions in full</h2>") :]
    texts = [text for form in before.values() for item in form["items"] for text in item["text"].values()]
    assert len(texts) > 20
    assert [text for text in (*texts, NEW) if str(escape(text)) not in appendix] == []
    assert "Changes in version 1.2 (first session: P002, 2026-01-06; saved by AK)" in appendix
    assert (
        "The wording of liquid.like_honey changed in version 1.2 (first session: P002, 2026-01-06; saved by AK)."
        in page
    )
    assert "Changes in version 1.1" not in page
