"""The report's section on groups: sealed until unblinding, then how many are in each and what they answered."""

from pathlib import Path

import pytest

from study_app.analysis.report.write_report import report
from study_app.analysis.tables.group_means import group_counts, group_means
from study_app.analysis.tables.study_tables import load_study
from study_app.protocol.forms.simulated_observer import NO_FEATURES
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.blinded.unblinding import unblind
from tests.protocol.groups.grouped import GROUPS, STUDY

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("figures_of_the_page")]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a sealed study of six participants in two groups."""
    path = tmp_path_factory.mktemp("grouped")
    (path / "grouped.toml").write_text(STUDY + GROUPS)
    felt = {(block, condition): (NO_FEATURES,) for block in ("thin", "thick") for condition in ("water", "honey")}
    return rehearse_answers(path / "grouped.toml", participants=6, seed=2, results=path / "r", felt=felt)


def test_groups_are_reported_after_unblinding_alone(folder: Path, tmp_path: Path) -> None:
    sealed = load_study(folder)
    assert group_counts(sealed) == {}
    assert list(group_means(sealed)) == []
    report(folder, tmp_path / "sealed")
    assert "first_thin" not in (tmp_path / "sealed" / "report.html").read_text()
    unblind(folder, "AB", "a test")
    study = load_study(folder)
    assert group_counts(study) == {"first_thick": 3, "first_thin": 3}
    rows = study.responses.merge(study.trials[["participant", "group"]].drop_duplicates(), on="participant")
    for one in group_means(study):
        here = rows[(rows["block"] == one.block) & (rows["code"] == one.code) & (rows["group"] == one.group)]
        each = here.groupby("participant")["response"].mean()
        assert (one.n, one.mean) == (len(each), pytest.approx(each.mean()))
        assert one.sd == pytest.approx(each.std())
    assert len(list(group_means(study))) == 2 * 2 * 2
    report(folder, tmp_path / "opened")
    text = (tmp_path / "opened" / "report.html").read_text()
    assert ">Groups</h2>" in text
    assert "first_thin" in text
