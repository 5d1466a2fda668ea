"""Study and liquid files of format 1 are rewritten with the same meaning, and nothing is lost."""

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from study_app.analysis.data.study_tables import load_study
from study_app.errors import ProtocolError, StoreError
from study_app.haptics.model.estimators import Ewma
from study_app.protocol.load import load, load_scene, parse
from study_app.protocol.model import Protocol
from study_app.protocol.source.files import shipped_file
from study_app.store.files.atomic import write_file
from study_app.store.files.folders import StudyFolder
from study_app.store.integrity.folder_lock import lock_folder
from study_app.store.sessions.recovery import check_resumable
from study_app.store.tables.study_files import check_study
from study_app.store.unblinding import unblind
from study_app.store.upgrade import upgrade
from study_app.store.verification.whole_study import verify_study
from tests.store.conftest import contents

RELEASES = Path(__file__).parent / "releases"
LIQUID = "[liquids.honey] # the only one\ndensity_kg_m3 = 1420\nviscosity_pa_s = 10\neffects = 'auto'\n"


def write_text(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8", newline="")
    return path


def presented_parts(protocol: Protocol) -> dict[str, Any]:
    """Return a protocol without its version, its texts for participants and limits, which changed after the release."""
    texts = {"tasks": {"__all__": {"instruction"}}, "study": {"version"}, "pages": True, "limits": True}
    return protocol.model_dump(exclude=texts)


@pytest.mark.parametrize(("version", "name"), [("0.1", "rek2024"), ("0.2", "demo")])
def test_an_upgraded_released_study_equals_its_shipped_successor(version: str, name: str, tmp_path: Path) -> None:
    original = (RELEASES / version / f"{name}.toml").read_bytes()
    file = tmp_path / f"{name}.toml"
    file.write_bytes(original)
    with pytest.raises(ProtocolError, match=r"format: is 1, .*run liquid-study upgrade FILE"):
        load(file)
    assert upgrade(tmp_path) == [file]
    assert file.with_name(f"{name}.toml.format-1").read_bytes() == original
    assert presented_parts(load(file)) == presented_parts(load(name))
    assert load(file).scene.velocity == Ewma()
    assert upgrade(tmp_path) == []


@pytest.mark.parametrize("line_end", ["\n", "\r\n"])
@pytest.mark.parametrize("scene", ["", "[scene]\nscale = 3\n", "[scene.accuracy] # few\nrelative = 0.1\n"])
@pytest.mark.parametrize("head", ["", "format = 1 # the first\n"])
def test_defaults_of_format_1_are_stated_and_comments_stay(
    head: str, scene: str, line_end: str, tmp_path: Path
) -> None:
    text = (head + scene + LIQUID).replace("\n", line_end)
    file = write_text(tmp_path / "honey.toml", text)
    upgrade(file)
    honey = load_scene(file, "honey")
    assert (honey.velocity, honey.accuracy.without) == (Ewma(), ("unsteady_drag",))
    lines = file.read_bytes().decode().split(line_end)
    kept_lines = [line for line in text.split(line_end) if line and not line.startswith("format")]
    assert [line for line in lines if line in kept_lines] == kept_lines
    assert [line for line in lines if line.startswith("format")] == ["format = 2 # the first" if head else "format = 2"]


def test_a_study_excludes_unsteady_drag_for_its_liquid_files(tmp_path: Path) -> None:
    study = shipped_file("demo").read_text("utf-8").replace("format = 2", "format = 1")
    before, thick, after = study.partition("[liquids.thick]\n")
    rest = after[after.index("\n# ---") :]
    file = write_text(tmp_path / "mine.toml", f'{before}{thick}file = "honey.toml"\n{rest}')
    liquid = write_text(tmp_path / "honey.toml", LIQUID)
    assert upgrade(tmp_path) == [liquid, file]
    assert load(file).scene.accuracy.without == ("unsteady_drag",)
    assert load(file).liquids["thick"].density_kg_m3 == 1420


@pytest.mark.parametrize(
    ("scene", "place"), [("scene = { scale = 3 }\n", "scene"), ("[scene]\naccuracy = { relative = 0.1 }\n", "scene")]
)
def test_an_inline_table_is_refused_without_changing_a_file(scene: str, place: str, tmp_path: Path) -> None:
    other = write_text(tmp_path / "a.toml", LIQUID)
    file = write_text(tmp_path / "b.toml", scene + LIQUID)
    with pytest.raises(ProtocolError, match=f"{place}: is an inline table, which the program cannot upgrade"):
        upgrade(tmp_path)
    assert (other.read_text("utf-8"), file.read_text("utf-8")) == (LIQUID, scene + LIQUID)
    assert sorted(tmp_path.iterdir()) == [other, file]


def test_another_file_with_the_name_of_the_copy_is_kept(tmp_path: Path) -> None:
    file, other = write_text(tmp_path / "a.toml", LIQUID), write_text(tmp_path / "a.toml.format-1", "mine")
    with pytest.raises(StoreError, match=r"a\.toml\.format-1 is not a copy of a\.toml"):
        upgrade(file)
    assert (file.read_text("utf-8"), other.read_text("utf-8")) == (LIQUID, "mine")


@pytest.fixture
def results(tmp_path: Path) -> Path:
    """Return a copy of results of 0.1 with an ended session and one whose program was killed."""
    return Path(shutil.copytree(RELEASES / "0.1" / "rek2024", tmp_path / "rek2024"))


@pytest.mark.slow
def test_earlier_results_are_refused_until_they_are_upgraded(results: Path, tmp_path: Path) -> None:
    before = contents(results)
    study, source = load("rek2024"), shipped_file("rek2024").read_bytes()
    refused_calls: list[Callable[[], object]] = [
        lambda: verify_study(results),
        lambda: load_study(results),
        lambda: unblind(results, by="AB", reason="a test"),
        lambda: check_study(StudyFolder(results), "rek2024"),
        lambda: check_resumable(results / "data" / "sub-P002" / "ses-01", study, source),
    ]
    for command in refused_calls:
        with pytest.raises(
            StoreError, match=r"has tables from an earlier version.*: run liquid-study upgrade \S+rek2024$"
        ):
            command()
    assert contents(results) == before
    upgrade(tmp_path)
    after = contents(results)
    derived = ("_data.csv", "checksums.sha256", "dataset_description.json")
    assert {path for path in before if before[path] != after[path]} == {
        path for path in before if path.endswith(derived)
    }
    assert after.keys() == before.keys()
    assert verify_study(results).errors == ()
    assert set(load_study(results).answered["kind"]) == {"statement"}
    assert upgrade(tmp_path) == []


@pytest.mark.parametrize(
    ("person", "changed", "said"),
    [
        ("P001", lambda table: table.replace(b",4,", b",5,", 1), r"differs from its journal.*rebuild \S+ses-01"),
        ("P002", lambda table: table + table.splitlines(keepends=True)[-1], r"has \d+ rows, but the journal contains"),
    ],
    ids=["ended", "unfinished"],
)
def test_a_changed_table_of_an_earlier_version_is_refused_without_changing_a_file(
    results: Path, person: str, changed: Callable[[bytes], bytes], said: str
) -> None:
    table = StudyFolder(results).session(person, 1).table("rek2024", "responses")
    table.write_bytes(changed(table.read_bytes()))
    before = contents(results)
    with pytest.raises(StoreError, match=rf"responses_data\.csv {said}"):
        upgrade(results)
    assert contents(results) == before


def test_a_table_of_an_unfinished_session_that_is_behind_its_journal_is_completed(results: Path) -> None:
    table = StudyFolder(results).session("P002", 1).table("rek2024", "responses")
    whole = table.read_bytes()
    table.write_bytes(whole[: whole.rstrip(b"\n").rindex(b"\n") + 1])
    upgrade(results)
    assert verify_study(results).errors == ()
    assert len(table.read_bytes().splitlines()) == len(whole.splitlines()) > 2


def test_an_open_session_is_upgraded_only_after_it_is_closed(results: Path) -> None:
    before = contents(results)
    with lock_folder(results / "data" / "sub-P001" / "ses-01"), pytest.raises(StoreError, match="is open in another"):
        upgrade(results)
    assert contents(results) == before
    assert upgrade(results) != []
    lock_folder(results / "data" / "sub-P001" / "ses-01").release()


@pytest.mark.parametrize("step", ["replace_checksums", "write_file"])
def test_an_upgrade_that_a_full_disk_interrupts_is_completed_by_the_next(
    results: Path, monkeypatch: pytest.MonkeyPatch, step: str
) -> None:
    written_paths: list[Path] = []

    def disk_is_full(*words: Any) -> None:
        if step == "write_file" and not written_paths:
            written_paths.append(words[0])
            return write_file(*words)
        raise StoreError("the disk is full")

    with monkeypatch.context() as patched:
        patched.setattr(f"study_app.store.upgrade.{step}", disk_is_full)
        with pytest.raises(StoreError, match="the disk is full"):
            upgrade(results)
    upgraded = upgrade(results)
    assert upgraded != []
    assert written_paths == [] or written_paths[0] not in upgraded
    assert verify_study(results).errors == ()


def test_other_files_are_not_upgraded(tmp_path: Path) -> None:
    write_text(tmp_path / "pyproject.toml", "[project]\nname = 'x'\n")
    write_text(tmp_path / "new.toml", f"format = 2\n{LIQUID}")
    assert upgrade(tmp_path) == []
    assert parse(shipped_file("thickness").read_bytes(), "thickness").format == 2
