"""Liquid files: a study's hash covers them, their values are sealed, and resume and replay use the sealed ones."""

import base64
import hashlib
import json
from dataclasses import replace
from itertools import count
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from study_app.errors import ProtocolError, StoreError
from study_app.protocol.descriptions.protocol_text import describe
from study_app.protocol.load import load, load_scenes, parse
from study_app.protocol.orders.block_orders import block_codes
from study_app.protocol.orders.schedule import Trial, build_schedule, stream
from study_app.protocol.source.files import StudySource, protocol_hash, source_bytes
from study_app.protocol.warnings.study_warnings import liquid_warnings
from study_app.session.pages import TaskPage
from study_app.session.replay import replay
from study_app.session.simulated import rehearsal
from study_app.session.start import resumed_choices
from study_app.session.transitions.page_builder import build_page
from study_app.session.transitions.state import Phase
from study_app.session.transitions.table import initial_state
from study_app.store.blinded.blinding import open_or_draw_key, read_key
from study_app.store.files.folders import StudyFolder
from study_app.store.sessions import recovery
from study_app.store.sessions.open_session import SessionStore
from study_app.store.verification.whole_study import verify_study
from tests.compiled import needs_servo
from tests.studies import begun


def test_a_session_continues_with_its_sealed_liquids(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study, now, sealed = b'[liquids.oil]\nfile = "oil.toml"\n', {"oil.toml": "now"}, {"oil.toml": "sealed"}
    monkeypatch.setattr(recovery, "locate_session", lambda _: (StudyFolder(tmp_path), None))
    for files, used in ((sealed, sealed), ({}, now)):
        monkeypatch.setattr(recovery, "read_key", lambda _, files=files: SimpleNamespace(files=files))
        source = recovery.sealed_source(tmp_path, StudySource(study, liquids=now).content)
        assert StudySource.split(source) == (study, used, {})


EARLIER = Path(__file__).parents[1] / "store" / "releases" / "0.1"
THICK = '[liquids.thick]\ndensity_kg_m3 = 1400\neffects = ["drag"]\n'
SYRUP = """format = 2

[scene]
scale = 3

[scene.body]
diameter_m = 0.068
drag_coefficient = 1.25

[liquids.from_the_lab]
density_kg_m3 = 1387.25
effects = ["drag"]
"""


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """Return demo as a study of its own whose thick liquid is a file's."""
    text = source_bytes("demo").decode()
    assert THICK in text
    path = tmp_path / "mine.toml"
    path.write_text(
        text.replace(THICK, '[liquids.thick]\nfile = "liquids/syrup.toml"\n'), encoding="utf-8", newline="\n"
    )
    (tmp_path / "liquids").mkdir()
    (tmp_path / "liquids" / "syrup.toml").write_text(SYRUP, encoding="utf-8", newline="\n")
    return path


def test_a_liquid_of_a_file_is_felt_with_its_own_ball_and_the_studys_scale(study: Path) -> None:
    protocol = load(study)
    scene = protocol.scene_for("thick")
    assert (scene.liquids[0].id, scene.liquids[0].density_kg_m3) == ("thick", 1387.25)
    assert (scene.body.drag_coefficient, scene.scale) == (1.25, 10)
    assert protocol.scene_for("thin") == load("demo").scene_for("thin")
    assert load_scenes(study)["thick"] == scene
    assert "thick" in describe(protocol)


def test_the_protocol_hash_covers_only_the_study_and_its_liquid_files(study: Path) -> None:
    source = source_bytes(study)
    assert StudySource.split(source) == (study.read_bytes(), {"liquids/syrup.toml": SYRUP}, {})
    syrup = study.parent / "liquids" / "syrup.toml"
    syrup.write_bytes(SYRUP.encode() + b"# \x7f \xf0\x9f\x8c\x8a \\ \" '''\r\n")
    assert protocol_hash(source_bytes(study)) != protocol_hash(source)
    assert StudySource.split(source_bytes(study)).liquids["liquids/syrup.toml"].encode() == syrup.read_bytes()
    syrup.write_text(SYRUP, encoding="utf-8", newline="\n")
    assert source_bytes(study) == source


@pytest.mark.parametrize("name", ["demo", "rek2024", "physical_liquids", str(EARLIER / "rek2024.toml")])
def test_a_file_without_liquid_files_is_its_own_source(name: str) -> None:
    source = source_bytes(name)
    assert StudySource.split(source) == (source, {}, {})
    assert b"liquid_files" not in source
    assert protocol_hash(source) == hashlib.sha256(source).hexdigest()


def test_the_key_of_an_earlier_study_is_drawn_again_but_for_smoothing_times_that_were_left_out(tmp_path: Path) -> None:
    open_or_draw_key(tmp_path, load("rek2024"), stream(1, "blinding").random)
    key_content, earlier = (
        json.loads(base64.b64decode(StudyFolder(folder).key.read_bytes())) for folder in (tmp_path, EARLIER / "rek2024")
    )
    for key in (key_content, earlier):
        for name, liquid in key["tables"]["liquids"].items():
            liquid["added_mass"].pop("filter_s")
            liquid["history"].pop("smoothing_s")
            key["tables"]["liquids"][name] = {field: value for field, value in liquid.items() if value is not None}
    assert key_content == earlier


@pytest.mark.parametrize(
    ("table", "file", "said"),
    [
        ('file = "gone.toml"', SYRUP, 'no UTF-8 text file "gone.toml"'),
        ('file = "liquids"', SYRUP, 'no UTF-8 text file "liquids"'),
        ('file = "/dev/zero"', SYRUP, 'no UTF-8 text file "/dev/zero"'),
        ("file = 3", SYRUP, "must be a string"),
        ('file = "liquids/syrup.toml"\ndensity_kg_m3 = 1', SYRUP, "liquids.thick.density_kg_m3"),
        ('file = "liquids/syrup.toml"', SYRUP.replace("1387.25", "0"), "density_kg_m3: is 0, but must be"),
        ('file = "liquids/syrup.toml"', SYRUP + "\n[liquids.more]\ndensity_kg_m3 = 1000\n", "contains 2 liquids"),
        ('file = "liquids/syrup.toml"', "format = 2\n[liquids", "invalid TOML"),
        ('file = "liquids/syrup.toml"', SYRUP.replace("[liquids.from", "[study]\n[liquids.from"), "study"),
    ],
)
def test_an_error_in_a_liquid_file_is_one_problem_at_its_line(study: Path, table: str, file: str, said: str) -> None:
    study.write_text(
        study.read_text("utf-8").replace('file = "liquids/syrup.toml"', table), encoding="utf-8", newline="\n"
    )
    (study.parent / "liquids" / "syrup.toml").write_text(file, encoding="utf-8", newline="\n")
    with pytest.raises(ProtocolError) as error:
        load(study)
    (problem,) = error.value.problems
    assert said in str(problem)
    lines = study.read_text("utf-8").splitlines()
    assert problem.line is not None
    assert lines[problem.line - 1].split(" = ")[0] in ("file", "density_kg_m3")


def test_liquids_of_one_condition_have_one_ball(study: Path) -> None:
    both = '[conditions.thick]\nliquids = ["thin", "thick"]'
    study.write_text(
        study.read_text("utf-8").replace('[conditions.thick]\nliquid = "thick"', both), encoding="utf-8", newline="\n"
    )
    with pytest.raises(ProtocolError, match="different balls"):
        load(study)


def test_a_drag_coefficient_may_be_a_liquids_own_and_the_rest_the_scenes() -> None:
    text = source_bytes("demo").decode().replace(THICK, THICK + "[liquids.thick.body]\ndrag_coefficient = 0.9\n")
    protocol = parse(text.encode(), "it")
    body, scenes = protocol.scene_for("thick").body, protocol.scene.body
    assert (body.drag_coefficient, body.diameter_m) == (0.9, scenes.diameter_m)
    assert protocol.scene_for("thin").body == scenes


def test_a_liquids_own_ball_is_drawn_at_its_size_with_a_warning_if_it_reveals_a_condition(study: Path) -> None:
    assert not any("sizes" in warning for warning in liquid_warnings(load(study)))
    syrup = study.parent / "liquids" / "syrup.toml"
    syrup.write_text(SYRUP.replace("diameter_m = 0.068", "diameter_m = 0.04"), encoding="utf-8", newline="\n")
    protocol = load(study)
    (warned,) = (warning for warning in liquid_warnings(protocol) if "sizes" in warning)
    assert "block liquids shows balls of different sizes (40, 68 mm)" in warned
    schedule = build_schedule(protocol, "P001", 1)
    codes = {
        block: dict(zip(block_codes(protocol, protocol.blocks[block]), protocol.blocks[block].conditions, strict=True))
        for block in protocol.blocks
    }
    ball_sizes = {}
    for index, step in enumerate(schedule.steps):
        if isinstance(step, Trial):
            state = replace(initial_state(protocol, schedule, codes, "en"), index=index, phase=Phase.TASK)
            page = build_page(state)
            assert isinstance(page, TaskPage)
            ball_sizes[codes[step.block][step.code]] = page.body_radius_m
    assert ball_sizes == pytest.approx({"thin": 0.0034, "thick": 0.002, "prompt": 0.0034, "late": 0.0034})


@pytest.mark.slow
@needs_servo
def test_values_are_sealed_and_a_replay_needs_no_file(study: Path, tmp_path: Path) -> None:
    folder = rehearsal.rehearse(str(study), participants=1, seed=3, results=tmp_path / "results")
    key = read_key(folder)
    assert key.tables["liquids"]["thick"]["density_kg_m3"] == 1387.25
    assert key.files == {"liquids/syrup.toml": SYRUP}
    for path in folder.rglob("*"):
        if path.is_file() and path.suffix != ".parquet":
            assert b"1387.25" not in path.read_bytes(), path
    (tmp_path / "liquids" / "syrup.toml").unlink()
    assert replay(StudyFolder(folder).session("P001", 1).path).proved
    assert verify_study(folder).is_sound


@pytest.mark.slow
@needs_servo
@pytest.mark.parametrize("becomes", [None, SYRUP.replace("1387.25", "1100")])
def test_an_interrupted_session_continues_with_the_sealed_liquid(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, becomes: str | None
) -> None:
    append, answered = SessionStore.append, count(1)

    def interrupted(self: SessionStore, event: Any, **about: Any) -> None:
        if event.event == "responses" and next(answered) == 2:
            raise KeyboardInterrupt
        append(self, event, **about)

    with monkeypatch.context() as patched:
        patched.setattr(SessionStore, "append", interrupted)
        with pytest.raises(KeyboardInterrupt):
            rehearsal.rehearse(str(study), participants=1, seed=3, results=tmp_path / "results")
    session = StudyFolder(tmp_path / "results").session("P001", 1).path
    syrup = tmp_path / "liquids" / "syrup.toml"
    syrup.unlink() if becomes is None else syrup.write_text(becomes, encoding="utf-8", newline="\n")
    choices = resumed_choices(session, protocol=str(study))
    assert choices.read_protocol().liquids["thick"].density_kg_m3 == 1387.25
    assert resumed_choices(session, candidates=["demo", str(study)]).source == str(study)
    rehearsal.resume_rehearsal(session, protocol=str(study))
    assert replay(session).proved
    if becomes is not None:
        with pytest.raises(StoreError, match="conditions that differ from this protocol"):
            begun(tmp_path / "results", "P002", study, simulated=True)
