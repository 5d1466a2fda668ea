from pathlib import Path

import pytest

from study_app.errors import StoreError
from study_app.store.folders import StudyFolder, locate, study_folder
from study_app.store.sessions.participant_ids import check_participant, check_unused, used_ids


def with_sessions(path: Path, *names: str) -> StudyFolder:
    for name in names:
        (path / "data" / name).mkdir(parents=True)
        (path / "data" / name / "checksums.sha256").touch()  # something that comes after a session's beginning
    return StudyFolder(path)


def test_pilot_sessions_have_a_folder_of_their_own() -> None:
    assert study_folder(Path("results"), "rek2024", pilot=True).path == Path("results/rek2024-pilot")


@pytest.mark.parametrize("good", ["P007", "7", "anna", "X" * 32, "Tester", "pilot2"])
def test_letters_and_digits_are_permitted(good: str) -> None:
    check_participant(good)


@pytest.mark.parametrize("bad", ["P-07", "", "P 07", "P_07", "../P07", "Pé", "P07\n", "٣", "X" * 33, "P/7"])
def test_anything_else_is_refused_with_the_id_and_what_is_permitted(bad: str) -> None:
    with pytest.raises(StoreError) as refusal:
        check_participant(bad)
    assert repr(bad) in str(refusal.value)
    assert "only letters A-Z, a-z and digits 0-9 are permitted, at most 32, no dash" in str(refusal.value)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("reserved", ["test", "pilot", "Test", "PILOT"])
def test_the_ids_of_trial_runs_are_refused_but_in_a_pilot(reserved: str) -> None:
    with pytest.raises(StoreError, match=rf"'{reserved}' is reserved for pilot sessions"):
        check_participant(reserved)
    check_participant(reserved, pilot=True)


def test_sessions_are_found_in_order_and_strangers_passed_over(tmp_path: Path) -> None:
    folder = with_sessions(tmp_path, "sub-P010/ses-01", "sub-P002/ses-02", "sub-P002/ses-01", "sub-P003/old", "notes")
    assert [(session.participant, session.number) for session in folder.sessions()] == [
        ("P002", 1),
        ("P002", 2),
        ("P010", 1),
    ]
    assert folder.ids() == ("P002", "P010")
    assert folder.sessions()[1].path == folder.session("P002", 2).path


def test_the_next_free_id_is_suggested(tmp_path: Path) -> None:
    assert used_ids(StudyFolder(tmp_path / "none")).suggested() == "P001"
    folder = with_sessions(tmp_path, "sub-P010/ses-01", "sub-anna/ses-01", "sub-p011/ses-01")
    assert used_ids(folder).suggested() == "P012"


def test_a_used_session_is_refused_with_three_ways_to_go_on(tmp_path: Path) -> None:
    folder = with_sessions(tmp_path, "sub-P002/ses-01", "sub-P002/ses-02")
    with pytest.raises(StoreError) as refusal:
        check_unused(folder, "P002", 1)
    message = str(refusal.value)
    assert "participant P002 already has session 1" in message
    assert "use a new session number (3), resume that session, or use another id (next free: P003)" in message
    assert "nothing was changed" in message
    check_unused(folder, "P002", 3)
    check_unused(folder, "P004", 1)


def test_an_id_that_differs_in_capitals_alone_is_refused(tmp_path: Path) -> None:
    """Some file systems cannot tell them apart, and neither can people."""
    folder = with_sessions(tmp_path, "sub-P002/ses-01")
    with pytest.raises(StoreError, match="'p002' differs from the used 'P002' only in capitalisation"):
        check_unused(folder, "p002", 2)


@pytest.mark.parametrize("number", [0, -1, 100])
def test_session_numbers_have_two_digits(tmp_path: Path, number: int) -> None:
    with pytest.raises(StoreError, match=f"session number {number} cannot be used: it must be from 1 to 99"):
        check_unused(StudyFolder(tmp_path), "P001", number)


def test_a_sessions_folder_is_known_from_its_path(tmp_path: Path) -> None:
    study = StudyFolder(tmp_path.resolve() / "rek2024")
    session = study.session("P007", 3)
    session.path.mkdir(parents=True)
    assert locate(session.path) == (study, session)
    (tmp_path / "link").symlink_to(session.path)
    assert locate(tmp_path / "link") == (study, session)


@pytest.mark.parametrize(
    "name",
    ["rek2024/data/sub-P007", "rek2024/data/P007/ses-01", "rek2024/data/sub-P-7/ses-01", "sub-P007/ses-01", "gone"],
)
def test_other_folders_are_no_sessions(tmp_path: Path, name: str) -> None:
    if name != "gone":
        (tmp_path / name).mkdir(parents=True)
    with pytest.raises(StoreError, match="is not a session folder: name one such as results/rek2024/data"):
        locate(tmp_path / name)
