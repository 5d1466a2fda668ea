"""Files that begin with a byte order mark, as some editors write it, and files in UTF-16."""

from pathlib import Path

import pytest

from study_app.designer.document.study import read_study
from study_app.designer.document.toml_edits import Set
from study_app.errors import ProtocolError, StudyError
from study_app.protocol.load import is_scene_file, load, load_scenes, protocol_hash, source_bytes
from study_app.protocol.source.files import shipped_file

MARK = "\ufeff"
LIQUID = 'format = 2\n[liquids.oil]\ndensity_kg_m3 = 900\nviscosity_pa_s = 0.1\neffects = ["drag"]\n'


def studies(folder: Path, mark: str) -> Path:
    """Return a study of two liquids, one of them from a file, in a folder of its own; all files begin with ``mark``."""
    folder.mkdir()
    text = shipped_file("thickness").read_text("utf-8")
    (folder / "oil.toml").write_text(mark + LIQUID, encoding="utf-8", newline="\n")
    (folder / "own.toml").write_text(
        f'{mark}{text}\n[liquids.extra]\nfile = "oil.toml"\n', encoding="utf-8", newline="\n"
    )
    return folder / "own.toml"


def test_a_mark_changes_neither_study_nor_hash(tmp_path: Path) -> None:
    marked, plain = studies(tmp_path / "marked", MARK), studies(tmp_path / "plain", "")
    assert load(marked) == load(plain)
    assert load(marked).liquids["extra"].density_kg_m3 == 900
    assert protocol_hash(source_bytes(marked)) == protocol_hash(source_bytes(plain))
    assert is_scene_file(marked.with_name("oil.toml"))
    assert load_scenes(marked.with_name("oil.toml")) == load_scenes(plain.with_name("oil.toml"))


def test_the_designer_reads_and_edits_a_file_with_a_mark(tmp_path: Path) -> None:
    marked, plain = studies(tmp_path / "marked", MARK), studies(tmp_path / "plain", "")
    study, same = read_study(marked.read_bytes(), marked.parent), read_study(plain.read_bytes(), plain.parent)
    assert (study.text, study.faults) == (same.text, ())
    edit = Set(("study", "title"), "Dick?")
    assert study.with_edits(edit)[0].text == same.with_edits(edit)[0].text


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be"])
def test_utf_16_is_named_in_one_line(encoding: str, tmp_path: Path) -> None:
    (tmp_path / "wide.toml").write_text(shipped_file("demo").read_text("utf-8"), encoding=encoding, newline="\n")
    with pytest.raises(ProtocolError) as refused:
        load(tmp_path / "wide.toml")
    assert [str(problem) for problem in refused.value.problems] == ["file: is UTF-16 text (save it as UTF-8)"]
    with pytest.raises(StudyError, match="UTF-16"):
        read_study((tmp_path / "wide.toml").read_bytes())
