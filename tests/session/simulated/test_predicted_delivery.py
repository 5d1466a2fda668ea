"""The trials that the safety layer lets nobody answer: as predicted, as rehearsed, and as everything says so."""

import csv
import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from study_app.analysis.data.study_tables import load_study
from study_app.analysis.export_study import export
from study_app.cli import commands
from study_app.designer.measures.simulation import run_simulation, simulation_of
from study_app.gui.sessions.session_facts import sessions, status_chip
from study_app.gui.sessions.session_page import read_record
from study_app.haptics.model.scene import Scene
from study_app.protocol.load import load, parse
from study_app.session.simulated import predicted_delivery as predicted_delivery_module
from study_app.session.simulated.predicted_delivery import predicted_delivery
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.exclusions import MISSING_RULE, exclusions, include
from study_app.store.files.folders import StudyFolder
from study_app.store.unblinding import unblind
from study_app.store.verification.whole_study import verify_study
from study_app.workers.server import Stopped
from tests.compiled import needs_servo

pytestmark = [pytest.mark.slow, needs_servo]

TRIALS = 4
ABX = """
format = 2
study.name = "abx"
scene.scale = 3
scene.velocity = {{ kind = "ewma", alpha = 0.1 }}
scene.body = {{ diameter_m = 0.068, drag_coefficient = 0.47, density_kg_m3 = 1000 }}
scene.motion = {{ speed_mps = 0.6, acceleration_mps2 = 6 }}
limits = {{ withheld_percent = 25, attempts = 2 }}
liquids.water = {{ effects = "auto", density_kg_m3 = 998.2, viscosity_pa_s = 1.0016e-3 }}
[liquids.slime]
effects = "auto"
density_kg_m3 = 1020
non_newtonian = {{ kind = "maxwell", zero_shear_viscosity_pa_s = 20, relaxation_time_s = 0.3 }}
[liquids.paste]
effects = "auto"
density_kg_m3 = 1400
non_newtonian = {{ kind = "herschel-bulkley", yield_stress_pa = 120, consistency_pa_sn = 60, flow_index = 0.4 }}
[tasks.short]
kind = "explore"
min_s = 1
max_s = 2
instruction = "Explore the liquid."
[blocks.liquids]
conditions = ["water", "{other}"]
standard = "water"
design = "abx"
repetitions = 4
task = "short"
"""
SENTENCE = "4 of 4 trials were not delivered: the safety layer held back too much force (limit 25 %)"


def study_of(other: str, folder: Path) -> Path:
    file = folder / "abx.toml"
    file.write_text(ABX.format(other=other), encoding="utf-8", newline="\n")
    return file


@pytest.fixture(scope="module")
def thick(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the file of a study with a liquid that is too thick for the loop."""
    return study_of("paste", tmp_path_factory.mktemp("thick"))


@pytest.fixture
def told() -> list[str]:
    return []


@pytest.fixture
def rehearsed(thick: Path, told: list[str], tmp_path: Path) -> Path:
    return rehearse(thick, participants=1, seed=1, results=tmp_path / "results" / "abx", progress=told.append)


@pytest.mark.parametrize("device", ["scripted", "falcon-emulated"])
def test_all_short_trials_with_slime_are_delivered_as_predicted(device: str, tmp_path: Path) -> None:
    file = study_of("slime", tmp_path)
    assert predicted_delivery(load(str(file)), 1).sentences == ()
    folder = rehearse(file, participants=1, seed=1, results=tmp_path / "results", device=device)
    (path,) = folder.glob("data/*participants_data.csv")
    (row,) = csv.DictReader(path.read_text(encoding="utf-8").splitlines())
    assert (row["status"], row["responses"], row["trials_missing"]) == ("completed", str(TRIALS), "0")


@pytest.mark.parametrize(("viscosity", "delay", "limit"), [(1.3, 0, 10), (4.7, 0, 10), (1.3, 3, 25)])
def test_the_force_of_oils_is_delivered_in_reaches(viscosity: float, delay: int, limit: int, tmp_path: Path) -> None:
    """Version 7 of the force rules lost 2, 3 and 1 of the 4 trials."""
    oil = f"[liquids.oil]\neffects = 'auto'\ndensity_kg_m3 = 1030\nviscosity_pa_s = {viscosity}\n"
    text = study_of("oil", tmp_path).read_text("utf-8").replace("[tasks.short]", oil + "[tasks.short]")
    text = text.replace('scene.velocity = { kind = "ewma", alpha = 0.1 }\n', "").replace("max_s = 2", "max_s = 6")
    text = text.replace("withheld_percent = 25", f"withheld_percent = {limit}")
    assert predicted_delivery(parse(text.encode(), "study"), delay).missing == 0


@pytest.mark.parametrize(("design", "missing"), [("3ifc", 38), ("4ifc", 48)])
def test_a_trial_is_lost_where_every_attempt_has_an_undelivered_interval(
    design: str, missing: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """One of five motions fails with the standard, two with the comparison: 100 · (1 − 0.8 · 0.8 · 0.6)² = 38."""

    def withheld_shares(_rig: object, scene: Scene, *_: object) -> list[float]:
        failing = 1 if scene.liquids[0].density_kg_m3 == 998.2 else 2
        return [0.26] * failing + [0.24] * (5 - failing)

    monkeypatch.setattr(predicted_delivery_module, "_withheld_shares", withheld_shares)
    text = study_of("slime", tmp_path).read_text("utf-8").replace('"abx"\nrep', f'"{design}"\nrep')
    prediction = predicted_delivery(parse(text.replace("repetitions = 4", "repetitions = 100").encode(), "study"), 1)
    assert (prediction.missing, prediction.asked) == (missing, 100)


@pytest.mark.parametrize(
    ("old", "new", "missing", "asked", "out", "judged"),
    [
        # 1 - 0.8 · 0.8 · 0.6 = 0.616 of the presentations fail: 100 · 0.616, and 100 · 0.616³ with the default of three
        (", attempts = 2", ", attempts = 1", 62, 100, 0, 0),
        (", attempts = 2", "", 23, 100, 0, 0),
        # of a trial without intervals, 1 of 5 motions with water and 2 with slime: 2 · 100 · 0.3
        ('standard = "water"\ndesign = "abx"\n', "", 0, 0, 60, 200),
    ],
)
def test_the_prediction_counts_trials_of_intervals_and_others_apart(
    old: str, new: str, missing: int, asked: int, out: int, judged: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def withheld_shares(_rig: object, scene: Scene, *_: object) -> list[float]:
        failing = 1 if scene.liquids[0].density_kg_m3 == 998.2 else 2
        return [0.251] * failing + [0.25] * (5 - failing)

    monkeypatch.setattr(predicted_delivery_module, "_withheld_shares", withheld_shares)
    text = study_of("slime", tmp_path).read_text("utf-8").replace('"abx"\nrep', '"3ifc"\nrep')
    text = text.replace("repetitions = 4", "repetitions = 100").replace(old.replace("abx", "3ifc"), new)
    prediction = predicted_delivery(parse(text.encode(), "study"), 1)
    assert (prediction.missing, prediction.asked, prediction.out, prediction.judged, prediction.limit_percent) == (
        missing, asked, out, judged, 25,
    )  # fmt: skip


def test_every_output_states_that_no_trial_was_delivered(
    thick: Path, rehearsed: Path, told: list[str], tmp_path: Path
) -> None:
    would = SENTENCE.replace("were", "would").replace("not delivered", "not be delivered")
    assert predicted_delivery(load(str(thick)), 1).sentences == (would,)
    ordered, sent = simulation_of(load(str(thick)), power=True), []
    with pytest.raises(Stopped):
        run_simulation(ordered, sent.append, lambda: any(results.lost for results in sent))
    assert sent[-1].lost == (would,)
    checked = CliRunner().invoke(commands, ["check", str(thick)]).output
    assert f"Note: {would}, predicted for a delay of 1 tick." in checked
    assert told[0].startswith("P001: 0 responses")
    assert told[0].endswith(f"; {SENTENCE}")
    assert [str(warning) for warning in verify_study(rehearsed).warnings] == [f"data/sub-P001/ses-01: {SENTENCE}"]
    assert verify_study(rehearsed).is_sound
    (facts,) = sessions(rehearsed.parent, {})
    assert (status_chip(facts)[2], str(facts.missing), facts.is_counted) == ("Incomplete", SENTENCE, False)
    record = read_record(facts.folder)
    assert record.limits.startswith(
        f"{SENTENCE}. These trials were not answered. The study allows up to 5 % of the trials to be"
    )
    assert "answers are kept" not in record.limits
    (row,) = exclusions(rehearsed)
    assert (row.rule_or_person, row.reason) == (MISSING_RULE, SENTENCE)


def test_an_incomplete_session_is_not_analysed_until_a_person_includes_it(rehearsed: Path, tmp_path: Path) -> None:
    assert load_study(rehearsed).n == 0
    exclusion_list = StudyFolder(rehearsed).exclusions
    content = exclusion_list.read_bytes()
    exclusion_list.unlink()  # as if the program had ended before it wrote the list
    assert load_study(rehearsed).n == 0
    exclusion_list.write_bytes(content)
    include(rehearsed, "P001", 1, by="AB", reason="the other trials are enough")
    assert load_study(rehearsed).n == 1
    (facts,) = sessions(rehearsed.parent, {})
    assert (status_chip(facts)[2], facts.is_counted) == ("Incomplete", True)


@pytest.mark.usefixtures("quick_pdf")
def test_report_and_export_state_the_lost_trials_of_each_participant(rehearsed: Path, tmp_path: Path) -> None:
    unblind(rehearsed, "AB", "a test")
    CliRunner().invoke(commands, ["report", str(rehearsed), "--to", str(tmp_path / "report")], catch_exceptions=False)
    page = re.sub(r"<[^>]+>", " ", (tmp_path / "report" / "report.html").read_text(encoding="utf-8"))
    words = " ".join(page.split())
    assert "P001, session 1 4 of 4" in words
    assert "paste: 4 the safety layer held back too much force (limit 25 %) not included" in words
    assert "1 incomplete. The analysis includes 0 participants." in words
    for path in export(rehearsed, tmp_path / "tables"):
        if path.name.endswith(("trials_data.csv", "intervals_data.csv")):
            rows = list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))
            assert {(row["session_status"], row["trials_missing"]) for row in rows} == {("incomplete", "4")}


def test_a_study_that_states_so_completes_a_session_without_a_single_trial(thick: Path, tmp_path: Path) -> None:
    file = tmp_path / "abx.toml"
    file.write_text(
        thick.read_text(encoding="utf-8").replace("attempts = 2", "attempts = 2, missing_percent = 100"),
        encoding="utf-8",
        newline="\n",
    )
    folder = rehearse(file, participants=1, seed=1, results=tmp_path / "results" / "abx")
    (facts,) = sessions(folder.parent, {})
    assert (status_chip(facts)[2], str(facts.missing), exclusions(folder)) == ("Complete", SENTENCE, ())


def test_the_shipped_slime_is_delivered_by_the_emulated_falcon(tmp_path: Path) -> None:
    folder = rehearse("slime", participants=1, seed=1, results=tmp_path / "slime", device="falcon-emulated")
    unblind(folder, "AB", "a test")
    (path,) = folder.rglob("*trials_data.csv")
    rows = list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))
    shares = [float(row["withheld_share"]) for row in rows]
    assert len(rows) == 6
    assert max(shares) < 0.15
    peaks_n = [float(row["force_peak_n"]) for row in rows]
    assert 7.9 < max(peaks_n) <= load("slime").device.force_limit_n  # whole motor units do not exceed it
    assert {row["valid"] for row in rows} == {"true"}
