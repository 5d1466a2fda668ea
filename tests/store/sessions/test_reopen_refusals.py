"""What keeps a session from going on; a refusal changes no file."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from study_app.errors import StoreError
from study_app.protocol.model import Protocol
from study_app.store.sessions.folder_lock import is_open
from study_app.store.sessions.open_session import SessionStore
from study_app.store.sessions.reopen import check_can_go_on
from tests.store.conftest import SOURCE
from tests.store.sessions.conftest import Again, every_byte


def test_damaged_lines_at_the_end_are_no_torn_tail(
    tmp_path: Path, start: Callable[..., SessionStore], again: Again
) -> None:
    with start() as store:
        for text in ("one", "two"):
            store.append("note", kind="note", text=text)
    lines = store.folder.journal.read_bytes().split(b"\n")
    store.folder.journal.write_bytes(b"\n".join([lines[0], *(b"#" + line[1:] for line in lines[1:3]), b""]))
    before = every_byte(tmp_path)
    with pytest.raises(StoreError, match="line 2: damaged"):
        again()
    assert every_byte(tmp_path) == before


def test_a_finished_session_is_refused_untouched(
    tmp_path: Path, start: Callable[..., SessionStore], again: Again
) -> None:
    start().finish("withdrawn")
    before = every_byte(tmp_path)
    with pytest.raises(StoreError, match=r"is finished \(withdrawn\) and cannot be resumed; use a new session number"):
        again()
    assert every_byte(tmp_path) == before


def test_a_session_open_elsewhere_is_refused_untouched(
    tmp_path: Path, start: Callable[..., SessionStore], again: Again
) -> None:
    with start():
        before = every_byte(tmp_path)
        with pytest.raises(StoreError, match="is open in another program"):
            again()
        assert every_byte(tmp_path) == before


def changed(tables: dict[str, Any], path: str, value: Any) -> Protocol:
    *above, last = path.split(".")
    place = tables
    for name in above:
        place = place[name]
    place[last] = value
    return Protocol.model_validate(tables)


@pytest.mark.parametrize(
    ("path", "value", "told"),
    [
        (
            "pages.consent.body",
            "You must stay.",
            'pages.consent.body: "You may stop at any time." before, "You must stay." now',
        ),
        ("tasks.feel.max_s", 10, "tasks.feel.max_s: 9 before, 10 now"),
        ("sequence", ["consent", "liquids", "delays"], "sequence: "),
    ],
)
def test_another_protocol_is_refused_and_the_difference_shown(
    tmp_path: Path,
    start: Callable[..., SessionStore],
    again: Again,
    tables_of_study: Callable[..., dict[str, Any]],
    path: str,
    value: Any,
    told: str,
) -> None:
    start().close()
    before = every_byte(tmp_path)
    with pytest.raises(StoreError) as refusal:
        again(protocol=changed(tables_of_study(), path, value), source=SOURCE + b"# changed")
    assert told in str(refusal.value)
    assert "conditions differ" not in str(refusal.value)
    assert "\n" not in str(refusal.value)
    assert every_byte(tmp_path) == before


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("liquids.quagmire.density_kg_m3", 2929.2),
        ("conditions.see_tardy.delay_ms", 292.9),
        ("blocks.liquids.conditions", ["feel_mildew", "feel_quagmire"]),
    ],
)
def test_of_other_conditions_nothing_but_that_is_told(
    start: Callable[..., SessionStore],
    again: Again,
    tables_of_study: Callable[..., dict[str, Any]],
    path: str,
    value: Any,
) -> None:
    start().close()
    with pytest.raises(StoreError) as refusal:
        again(protocol=changed(tables_of_study(), path, value), source=SOURCE + b"# changed")
    assert str(refusal.value).endswith("Differences: conditions differ")


def test_a_file_that_differs_in_its_comments_alone_is_refused_and_said_to(
    start: Callable[..., SessionStore], again: Again
) -> None:
    start().close()
    with pytest.raises(StoreError, match="Differences: only comments, order or notation"):
        again(source=SOURCE + b"# changed")


@pytest.mark.parametrize("lost", ["receipt.json", "../../../blinding/key.sealed", "journal.jsonl"])
def test_what_is_missing_is_named_and_nothing_is_written(
    tmp_path: Path, start: Callable[..., SessionStore], again: Again, lost: str
) -> None:
    with start() as store:
        pass
    (store.folder.path / lost).unlink()
    before = every_byte(tmp_path)
    with pytest.raises(StoreError, match=Path(lost).name.replace(".", r"\.")):
        again()
    assert every_byte(tmp_path) == before
    assert not is_open(store.folder.path)


def finish(store: SessionStore) -> None:
    store.finish("withdrawn")


def lose_the_receipt(store: SessionStore) -> None:
    store.close()
    store.folder.receipt.unlink()


def lose_the_key(store: SessionStore) -> None:
    store.close()
    store.place.study_folder.key.unlink()


@pytest.mark.parametrize("done", [finish, lose_the_receipt, lose_the_key, SessionStore.close, None])
def test_looking_alone_refuses_what_could_not_be_opened_again(
    tmp_path: Path,
    start: Callable[..., SessionStore],
    again: Again,
    protocol: Protocol,
    done: Callable[[SessionStore], None] | None,
) -> None:
    """Of another protocol where the session was only closed; open where nothing was done."""
    with start() as store:
        if done is not None:
            done(store)
        source = SOURCE + b"# changed" if done is SessionStore.close else SOURCE
        before = every_byte(tmp_path)
        with pytest.raises(StoreError) as told:
            check_can_go_on(store.folder.path, protocol, source)
        assert every_byte(tmp_path) == before
        with pytest.raises(StoreError, match=re.escape(str(told.value))):
            again(source=source)


def test_looking_at_a_session_that_can_go_on_changes_nothing(
    tmp_path: Path, start: Callable[..., SessionStore], protocol: Protocol
) -> None:
    start().close()
    before = every_byte(tmp_path)
    check_can_go_on(tmp_path / "study" / "data" / "sub-P007" / "ses-01", protocol, SOURCE)
    assert every_byte(tmp_path) == before


def test_a_session_that_had_not_begun_cannot_go_on(
    tmp_path: Path, start: Callable[..., SessionStore], again: Again
) -> None:
    """The program was killed while it wrote the first line."""
    with start() as store:
        pass
    store.folder.journal.write_bytes(store.folder.journal.read_bytes()[:40])
    before = every_byte(tmp_path)
    with pytest.raises(StoreError, match=r"journal\.jsonl has no line: .* use a new session number"):
        again()
    assert every_byte(tmp_path) == before
