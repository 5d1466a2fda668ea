"""Names that Windows reserves are refused wherever they become names of files, on every system: studies are shared."""

from pathlib import Path

import pytest
from click.testing import CliRunner
from hypothesis import example, given
from hypothesis import strategies as st

from study_app.cli import commands
from study_app.designer.document.document import check_free_name
from study_app.errors import ProtocolError, StoreError, StudyError
from study_app.ids import file_name_fault, free_short_name
from study_app.protocol.load import load, source_bytes
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.sites.merge import merge_sites
from tests.studies import made_up
from tests.windows_rules import RESERVED, is_valid_on_windows


@given(st.text(st.sampled_from("con.aux1 lpt9?:x"), min_size=1, max_size=8).filter(lambda name: set(name) != {"."}))
@example("CON")
@example("com0.txt")
@example("nul .toml")
def test_the_rule_equals_that_of_windows(name: str) -> None:
    assert bool(file_name_fault(name)) is not is_valid_on_windows(name)


def test_a_study_has_no_reserved_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    assert free_short_name((), "con") == "con2"
    assert free_short_name((), "com1") not in RESERVED
    with pytest.raises(StudyError, match='"nul" is reserved for a device on Windows; "nul2" is free'):
        check_free_name("nul")
    file = tmp_path / "control.toml"
    file.write_bytes(source_bytes("demo").replace(b'name = "demo"', b'name = "con"', 1))
    with pytest.raises(ProtocolError, match='"con" is reserved for a device on Windows'):
        load(str(file))


@pytest.mark.parametrize("name", ["aux.toml", "of lab/syrup?.toml", "syrup.toml."])
def test_a_study_names_no_file_that_windows_cannot_have(tmp_path: Path, name: str) -> None:
    study = (
        source_bytes("demo").decode().replace("[liquids.thick]", f'[liquids.syrup]\nfile = "{name}"\n\n[liquids.thick]')
    )
    file = tmp_path / "mine.toml"
    file.write_text(study, encoding="utf-8", newline="\n")
    with pytest.raises(ProtocolError, match=r"liquids\.syrup\.file.* (is reserved for|contains|ends with)"):
        load(str(file))


def test_a_site_has_no_reserved_name(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match="site 'Com3' is reserved for a device on Windows"):
        merge_sites({"Com3": tmp_path / "lab"}, tmp_path / "pooled")


@pytest.mark.slow
def test_a_condition_and_a_block_named_con_give_files_that_windows_can_have(tmp_path: Path) -> None:
    text = source_bytes("demo").decode()
    for old, new in (
        ("conditions.thin]", "conditions.con]"),
        ('["thin", "thick"]', '["con", "thick"]'),
        ("[blocks.liquids]", "[blocks.aux]"),
        ('"liquids"', '"aux"'),
    ):
        assert old in text
        text = text.replace(old, new)
    file = tmp_path / "control.toml"
    file.write_text(text, encoding="utf-8", newline="\n")
    results = rehearse_answers(
        str(file), participants=2, seed=7, results=tmp_path / "study", features=made_up(str(file))
    )
    for command in ("report", "export", "plot"):
        assert CliRunner().invoke(commands, [command, str(results), "--to", str(tmp_path / command)]).exit_code == 0
    names = {path.name for path in tmp_path.rglob("*")}
    assert len(names) > 30
    assert [name for name in names if not is_valid_on_windows(name)] == []
