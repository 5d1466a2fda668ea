"""One workspace per machine: the same protocols and sessions, and the same next id, wherever the program is started."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from study_app import app
from study_app import workspace as workspaces
from study_app.app.main_controller import MainController
from study_app.app.session.live_session import LiveSession
from study_app.cli import commands
from study_app.errors import StoreError
from study_app.gui.home.study_facts import known_sources, study_facts
from study_app.protocol.source.files import source_bytes
from study_app.store.workstation import keep_workspace, load_settings, recent_protocols, remember_protocol
from study_app.user_folder import settings_file
from study_app.workspace import Workspace, chosen_workspace, offered_workspace, workspace
from tests.studies import begun


@pytest.fixture
def documents(tmp_path, monkeypatch):
    """Begin as a new user: nothing is set, and the documents are the test's own."""
    monkeypatch.delenv("LIQUID_STUDY_WORKSPACE")
    documents = tmp_path / "documents"
    monkeypatch.setattr(workspaces, "user_documents_path", lambda: documents)
    return documents


def start_folder(path: Path, monkeypatch: pytest.MonkeyPatch, *subfolders: str) -> Path:
    path.mkdir(exist_ok=True)
    for name in subfolders:
        (path / name).mkdir()
    monkeypatch.chdir(path)
    return path


def test_a_chosen_workspace_counts_from_every_start_folder(documents, tmp_path, monkeypatch):
    start_folder(tmp_path / "one", monkeypatch, "results")
    assert offered_workspace().folder == documents / "Liquid Study", "a start folder is offered if it has both folders"
    clone = start_folder(tmp_path / "clone", monkeypatch, "results", "protocols")
    assert offered_workspace().folder == clone
    assert chosen_workspace() is None
    keep_workspace(offered_workspace())
    (clone / "protocols" / "mine.toml").write_bytes(source_bytes("demo"))
    start_folder(tmp_path / "elsewhere", monkeypatch)
    assert workspace().folder == clone
    assert "mine" in known_sources()
    assert source_bytes("mine") == source_bytes("demo")
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path / "for-one-run"))
    assert workspace().folder == tmp_path / "for-one-run"
    assert not documents.exists()


@pytest.mark.slow
def test_windows_show_the_same_sessions_and_suggest_the_same_id_from_two_start_folders(
    documents, tmp_path, monkeypatch, qtbot
):
    kept_workspace = Workspace(tmp_path / "kept")
    keep_workspace(kept_workspace)
    shown_sessions, ids = [], []
    for name in ("first", "second"):
        start_folder(tmp_path / name, monkeypatch)
        if name == "first":
            for participant in ("P001", "P002"):
                begin_session(kept_workspace.results / "demo", participant)
        visit = MainController()
        qtbot.addWidget(visit.window)
        home = visit.window.place("home")
        home.show_sessions()
        qtbot.waitUntil(lambda home=home: not home.is_reading)
        shown_sessions.append([facts.participant for facts in home.sessions.shown])
        home.ask_for_session(study_facts("demo"))
        ids.append(tuple(home.dialog.editors[name].value for name in ("participant", "results")))
        assert home.dialog.editors["results"].aside.text() == "in the workspace"
        home.dialog.editors["results"].show_value(str(tmp_path / "other"))
        assert home.dialog.editors["results"].aside.text().startswith("outside the workspace")
        home.dialog.reject()
        assert home.folder.accessibleName() == f"Workspace: {kept_workspace.folder}"
        visit.end()
        assert not Path("results").exists()
    assert shown_sessions[0] == shown_sessions[1]
    assert sorted(shown_sessions[0]) == ["P001", "P002"]
    assert ids[0] == ids[1] == ("P003", str(kept_workspace.results / "demo"))


def begin_session(folder: Path, participant: str) -> None:
    begun(folder, participant, operator="AK").close()


@pytest.mark.slow
def test_the_first_start_asks_once_before_creating_the_workspace(documents, tmp_path, monkeypatch, qtbot):
    start_folder(tmp_path / "start", monkeypatch)
    visit = MainController()
    qtbot.addWidget(visit.window)
    visit.open()
    assert visit.question.path.value == str(documents / "Liquid Study")
    assert not documents.exists()
    assert not settings_file().exists()
    visit.question.path.show_value(str(tmp_path / "mine"))
    visit.question.accept()
    assert (tmp_path / "mine" / "protocols").is_dir()
    assert (tmp_path / "mine" / "results").is_dir()
    assert load_settings().workspace == str(tmp_path / "mine")
    assert visit.results == tmp_path / "mine" / "results"
    visit.window.close()
    visit.end()
    again = MainController()
    qtbot.addWidget(again.window)
    again.open()
    assert again.question is None
    again.window.close()
    again.end()


@pytest.mark.slow
def test_a_file_is_refused_as_the_workspace_and_not_saved(documents, tmp_path, monkeypatch, qtbot):
    start_folder(tmp_path / "start", monkeypatch)
    (tmp_path / "file").write_text("", encoding="utf-8", newline="\n")
    visit, messages = MainController(), []
    qtbot.addWidget(visit.window)
    monkeypatch.setattr(visit.window, "show_message", lambda title, sentence: messages.append((title, sentence)))
    visit.open()
    visit.question.path.show_value(str(tmp_path / "file"))
    visit.question.accept()
    ((title, sentence),) = messages
    assert title == "This folder cannot be used as the workspace"
    assert str(tmp_path / "file") in sentence
    assert sentence.endswith(".")
    assert (visit.check, settings_file().exists()) == (None, False)
    visit.window.close()
    visit.end()


def test_an_earlier_results_folder_becomes_the_workspace(documents, tmp_path):
    settings_file().parent.mkdir(parents=True)
    settings_file().write_text(
        json.dumps({"results": str(tmp_path / "lab" / "results"), "theme": "dark"}), encoding="utf-8", newline="\n"
    )
    assert load_settings().workspace == str(tmp_path / "lab")
    assert workspace().folder == tmp_path / "lab"
    (tmp_path / "file").write_text("", encoding="utf-8", newline="\n")
    with pytest.raises(StoreError, match="file"):
        keep_workspace(Workspace(tmp_path / "file"))
    assert workspace().folder == tmp_path / "lab", "what cannot be created is not kept"


def test_recent_protocols_are_remembered_newest_first_and_only_while_they_exist(documents, tmp_path, monkeypatch):
    start_folder(tmp_path / "start", monkeypatch)
    files = [tmp_path / f"study{number}.toml" for number in range(10)]
    for file in files:
        file.write_bytes(source_bytes("demo"))
        remember_protocol(file)
    remember_protocol(files[4])
    assert recent_protocols()[:2] == (str(files[4]), str(files[9]))
    assert len(recent_protocols()) == 8
    files[9].unlink()
    assert str(files[9]) not in recent_protocols()
    assert known_sources()[0] == str(files[4])
    inside = workspace().protocols / "inside.toml"
    inside.parent.mkdir(parents=True)
    inside.write_bytes(source_bytes("demo"))
    remember_protocol(inside)
    assert str(inside) not in recent_protocols()


def test_home_shows_no_card_for_a_liquid_file(tmp_path, monkeypatch):
    start_folder(tmp_path / "start", monkeypatch, "protocols")
    Path("protocols/syrup.toml").write_text(
        "format = 2\n[liquids.syrup]\ndensity_kg_m3 = 1300\neffects = ['drag']\n", encoding="utf-8", newline="\n"
    )
    Path("protocols/broken.toml").write_text("format = 2\n[study]\n", encoding="utf-8", newline="\n")
    assert "syrup" not in known_sources()
    assert "broken" in known_sources()


def test_the_first_writing_command_saves_the_default_workspace_and_prints_it_once(documents, tmp_path, monkeypatch):
    start_folder(tmp_path / "start", monkeypatch)
    result = CliRunner().invoke(commands, ["new", "thick", "--no-window"])
    assert f"this machine's workspace: {documents / 'Liquid Study'} (" in result.stderr
    start_folder(tmp_path / "clone", monkeypatch, "results", "protocols")
    result = CliRunner().invoke(commands, ["new", "thin", "--no-window"])
    assert result.stderr == ""
    assert workspace().folder == documents / "Liquid Study"


def test_a_protocol_file_of_a_command_is_among_the_recent_ones_and_its_results_in_the_workspace(
    documents, tmp_path, monkeypatch
):
    start_folder(tmp_path / "start", monkeypatch)
    keep_workspace(Workspace(tmp_path / "kept"))
    sources = []
    monkeypatch.setattr(LiveSession, "open", lambda session: (sources.append(session.chosen), session.over.emit()))
    Path("mine.toml").write_bytes(source_bytes("demo"))
    assert app.run("mine.toml", participant="P001") == 0
    assert sources[0].results == tmp_path / "kept" / "results" / "demo"
    assert recent_protocols() == (str(tmp_path / "start" / "mine.toml"),)
