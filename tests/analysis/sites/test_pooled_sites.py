"""A merged study in the analysis: participants of all sites, codes that mean the same, and the site as a factor."""

import shutil
from dataclasses import replace
from itertools import count
from pathlib import Path

import pytest

from study_app.analysis.data import study_tables
from study_app.analysis.data.blocks import OtherQuestions, PlacedQuestion, PlacedScore, QuestionPlace, Setting
from study_app.analysis.data.study_tables import load_study, pool_sites
from study_app.analysis.evaluate import evaluate
from study_app.analysis.export_study import export
from study_app.analysis.planning.preregistration import FILE, Commitment, commitment_lines, deviations
from study_app.analysis.report.methods import methods
from study_app.analysis.report.sections import limits
from study_app.analysis.report.write_report import report
from study_app.analysis.report.write_report import tests as rows_of_tests
from study_app.errors import StoreError
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.exclusions import Exclusion, exclude
from study_app.store.sites.merge import merge_sites
from study_app.store.unblinding import unblind, unblind_folder
from study_app.store.withdrawals import withdraw
from tests.analysis.levels.level_studies import ADAPTIVE
from tests.analysis.made_up import delays, everybody, study
from tests.analysis.report.read_report import read
from tests.protocol.trials.level_studies import text_of_damper
from tests.studies import made_up

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("quick_pdf")]


@pytest.fixture(scope="module")
def sealed_pool(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a merged study of two sites with three participants each; do not change it."""
    root = tmp_path_factory.mktemp("labs")
    folders = {
        site: rehearse_answers("rek2024", participants=3, seed=seed, results=root / site, features=made_up("rek2024"))
        for seed, site in enumerate("AB", start=1)
    }
    merge_sites(folders, root / "pooled")
    return root / "pooled"


@pytest.fixture(scope="module")
def opened_pool(sealed_pool: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the same with both keys open."""
    folder = tmp_path_factory.mktemp("opened") / "pooled"
    merge_sites(_copied(sealed_pool, folder.parent), folder)
    unblind_folder(folder, "AK", "closed")
    return folder


def _copied(merged: Path, to: Path) -> dict[str, Path]:
    return {site: Path(shutil.copytree(merged / "sites" / site, to / site)) for site in "AB"}


@pytest.mark.nightly
def test_codes_of_sealed_sites_are_never_pooled(sealed_pool: Path, tmp_path: Path) -> None:
    study = load_study(sealed_pool)
    assert not study.revealed
    assert study.people == ("A-P001", "A-P002", "A-P003", "B-P001", "B-P002", "B-P003")
    for block in study.blocks:
        codes = [code.partition("-") for code in block.codes]
        assert {site for site, _, _ in codes} == {"A", "B"}
        for site in "AB":
            own = load_study(sealed_pool / "sites" / site)
            assert [code for site_code, _, code in codes if site_code == site] == list(
                next(site_block for site_block in own.blocks if site_block.id == block.id).codes
            )
    rows = study.responses
    assert (rows["code"].str.partition("-")[0] == rows["participant"].str.partition("-")[0]).all()
    report(sealed_pool, tmp_path, failed=pytest.fail)
    page = read(tmp_path)
    assert "Codes differ between sites until all keys are open" in page
    for condition in ("light_oil", "delay_75"):
        assert condition not in page


def test_a_study_is_sealed_until_the_last_key_is_open(sealed_pool: Path, tmp_path: Path) -> None:
    folders = _copied(sealed_pool, tmp_path)
    merge_sites(folders, tmp_path / "pooled")
    unblind(tmp_path / "pooled/sites/B", "AK", "closed")
    half = load_study(tmp_path / "pooled")
    assert not half.revealed
    assert half.trials["force_mean_n"].isna().all()
    export(tmp_path / "pooled", tmp_path / "out")
    (table,) = (tmp_path / "out").glob("*trials*.csv")
    assert "force_mean_n" not in table.read_text("utf-8").splitlines()[0]


def test_conditions_of_sealed_sites_are_not_counted_or_compared_across_sites(sealed_pool: Path, tmp_path: Path) -> None:
    merge_sites(_copied(sealed_pool, tmp_path), tmp_path / "pooled")
    unblind(tmp_path / "pooled/sites/B", "AK", "closed")
    half = load_study(tmp_path / "pooled")
    results = evaluate(half, recordings=False)
    assert [half.setting_count(block) for block in half.blocks] == [3, 7]
    assert rows_of_tests(results) == []
    assert not any(block.incomplete for block in results.blocks)
    text = methods(half, results)
    assert "at the sites A and B, each in all conditions." in text
    assert "three conditions were presented" in text
    assert "seven conditions were presented" in text
    key, *sentences = limits(half, results)
    assert key.startswith(
        "The key of A is sealed (the key of B is open): conditions appear as codes, and the report shows only counts. "
    )
    assert (
        "Codes differ between sites until all keys are open, so conditions are not counted or compared across sites."
        in sentences
    )
    assert not any("could not be tested" in sentence or "sessions" in sentence for sentence in sentences)


def test_a_site_whose_folder_is_missing_is_not_left_out(sealed_pool: Path, tmp_path: Path) -> None:
    merge_sites(_copied(sealed_pool, tmp_path), tmp_path / "pooled")
    shutil.rmtree(tmp_path / "pooled/sites/B")
    with pytest.raises(StoreError, match=r"sites/B is missing, but sites\.json lists it"):
        load_study(tmp_path / "pooled")


def test_a_site_without_the_preregistration_of_another_is_named(sealed_pool: Path, tmp_path: Path) -> None:
    merge_sites(_copied(sealed_pool, tmp_path), tmp_path / "pooled")
    study = load_study(tmp_path / "pooled")
    commitment = Commitment(
        study=study.name,
        version=study.version,
        protocol_hash=study.participants["protocol_hash"].iloc[0],
        participants=study.n,
        precision=None,
        rules=(),
    )

    def said(**others: Commitment) -> tuple[str, ...]:
        for site, own in others.items():
            (tmp_path / "pooled/sites" / site / FILE).write_text(commitment_lines(own), encoding="utf-8", newline="\n")
        compared = deviations(study)
        assert compared is not None
        return compared.found

    assert said(B=commitment) == (f"site A does not have the file {FILE}",)
    assert said(A=replace(commitment, precision=0.1)) == (
        "the preregistration at site B differs from the one at the first site, which is used here",
    )
    assert said(A=commitment) == ()


@pytest.mark.parametrize("is_revealed", [True, False])
def test_each_row_of_a_site_is_in_the_pooled_tables_once(is_revealed: bool) -> None:
    answers, settings = count(1), delays((0.0, 40.0, 90.0))
    if not is_revealed:
        settings = tuple(replace(setting, condition=None, delay_ms=None) for setting in settings)
    sites = {}
    for site in ("North", "South"):
        own = study(settings, list(everybody(settings, 2, lambda *_: next(answers))))
        row = Exclusion(
            participant="P001", session=1, trial=next(answers), rule_or_person="AB", reason=site, excluded_at=""
        )
        sites[site] = replace(own, exclusions=(row,), late=(replace(row, trial=next(answers)),), doubts=(site,))
    codes = {f"D{place}": f"delay_{place}" for place in (1, 2, 3)}

    def pooled_code(site: str, code: str) -> str:
        return codes[code] if is_revealed else f"{site}-{code}"

    pooled = pool_sites(Path("pooled"), sites, ())
    for name in ("responses", "answered", "trials"):
        rows = getattr(pooled, name)
        assert [*rows.index] == [*range(len(rows))], name
        assert [*zip(rows["participant"], rows["code"], rows["trial"], strict=True)] == [
            (f"{site}-{row.participant}", pooled_code(site, row.code), row.trial)
            for site, own in sites.items()
            for row in getattr(own, name).itertuples()
        ]
    assert [*pooled.responses["response"]] == [
        *sites["North"].responses["response"],
        *sites["South"].responses["response"],
    ]
    assert [*pooled.participants["participant"]] == [f"{site}-P{number:03d}" for site in sites for number in (0, 1)]
    assert pooled.participants.index.is_unique
    own_codes = [pooled_code(site, code) for site in sites for code in codes]
    assert list(pooled.blocks[0].codes) == list(dict.fromkeys(own_codes))
    assert {code for _, code in pooled.settings} == set(own_codes)
    for name in ("exclusions", "late"):
        assert getattr(pooled, name) == tuple(
            replace(row, participant=f"{site}-P001") for site, own in sites.items() for row in getattr(own, name)
        )
    assert pooled.doubts == ("North", "South")


def test_exclusions_and_withdrawals_of_a_site_are_those_of_the_merged_study(opened_pool: Path, tmp_path: Path) -> None:
    merge_sites(_copied(opened_pool, tmp_path), tmp_path / "pooled")
    exclude(tmp_path / "pooled/sites/B", "P001", 1, by="AK", reason="coughed")
    withdraw(tmp_path / "pooled/sites/A", "P002", by="AK", reason="asked")
    study = load_study(tmp_path / "pooled")
    assert study.people == ("A-P001", "A-P003", "B-P002", "B-P003")
    assert [row.participant for row in study.exclusions] == ["B-P001"]
    assert [(withdrawal.participant, withdrawal.by, withdrawal.reason) for withdrawal in study.withdrawn] == [
        ("P002", "AK", "asked")
    ]
    for person in ("P001", "P003"):
        withdraw(tmp_path / "pooled/sites/A", person, by="AK", reason="asked")
    assert load_study(tmp_path / "pooled").people == ("B-P002", "B-P003")


@pytest.mark.nightly
def test_a_merged_study_with_levels_is_reported_before_and_after_unblinding(tmp_path: Path) -> None:
    (tmp_path / "adaptive.toml").write_text(
        text_of_damper("adaptive", ADAPTIVE, (4, 8)), encoding="utf-8", newline="\n"
    )
    folders = {
        site: rehearse_answers(
            tmp_path / "adaptive.toml", participants=2, seed=seed, results=tmp_path / site / "adaptive", features={}
        )
        for seed, site in enumerate("AB", start=1)
    }
    merge_sites(folders, tmp_path / "pooled")
    blinded = load_study(tmp_path / "pooled")
    assert {setting.code[:2] for block in blinded.levels for setting in block.settings} == {"A-", "B-"}
    report(tmp_path / "pooled", tmp_path / "sealed", failed=pytest.fail)
    unblind_folder(tmp_path / "pooled", "AK", "closed")
    unblinded = load_study(tmp_path / "pooled")
    for block in unblinded.levels:
        site_blocks = [
            next(level_block for level_block in load_study(path).levels if level_block.id == block.id)
            for path in site_folders(tmp_path)
        ]
        assert [setting.condition for setting in block.settings] == [
            setting.condition for setting in site_blocks[0].settings
        ]
        assert {setting.condition for setting in site_blocks[1].settings} == {
            setting.condition for setting in site_blocks[0].settings
        }
    assert set(unblinded.intervals["participant"]) == {"A-P001", "A-P002", "B-P001", "B-P002"}
    report(tmp_path / "pooled", tmp_path / "opened", failed=pytest.fail)
    assert "The results from these sites are merged: A (two participants) and B (two participants)" in read(
        tmp_path / "opened"
    )


def site_folders(root: Path) -> list[Path]:
    return [root / "pooled/sites" / site for site in "AB"]


@pytest.mark.parametrize("is_open", [False, True])
def test_questions_of_sites_are_pooled_with_the_settings_of_every_site(is_open: bool) -> None:
    def asked(site: str, codes: str) -> OtherQuestions:
        settings = tuple(Setting(code=code, condition=f"c{code}" if is_open else None) for code in codes)
        placed = [
            PlacedQuestion(
                QuestionPlace(f"q{number}", f"Title {number} of {site}", number == 1, settings[number:]), *2 * [None]
            )
            for number in range(2)
        ]
        return OtherQuestions(tuple(placed), (PlacedScore(placed[1].where, "total", None, None, (placed[0],)),))

    pooled = study_tables._pooled_questions({"A": asked("A", "xy"), "B": asked("B", "yz")})
    codes = (["cx", "cy", "cz"], ["cy", "cz"]) if is_open else (["A-x", "A-y", "B-y", "B-z"], ["A-y", "B-z"])
    places = [question.where for question in (*pooled.questions, *pooled.scores, *pooled.scores[0].questions)]
    assert [[setting.code for setting in where.settings] for where in places] == [*codes, codes[1], codes[0]]
    assert [(where.id, where.title, where.is_form) for where in places[:2]] == [
        ("q0", "Title 0 of A", False),
        ("q1", "Title 1 of A", True),
    ]
