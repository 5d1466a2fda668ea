import itertools
import os
import random
import subprocess
import sys
import time
from pathlib import Path

import pytest

from study_app.errors import StoreError
from study_app.store.drafts import REST_S, Draft, Keeper, discard, draft_of, drafted_files, keep
from study_app.store.study_versions import kept_content, kept_versions
from study_app.user_folder import data_folder

KILLS = int(os.environ.get("LIQUID_STUDY_DRAFT_KILLS", "10"))
AT_ONCE = 10


def test_a_draft_is_found_again_until_it_is_discarded(tmp_path: Path) -> None:
    file = tmp_path / "new.toml"
    assert draft_of(file) is None
    keep(file, Draft("a = 'é'\r\n", "abc", ("blocks", "a", 1)))
    found = draft_of(file)
    assert found is not None
    assert (found.text, found.base, found.selected) == ("a = 'é'\r\n", "abc", ("blocks", "a", 1))
    assert found.kept_at
    assert draft_of(tmp_path / "other.toml") is None
    discard(file)
    discard(file)
    assert draft_of(file) is None


def test_files_with_a_draft_are_listed(tmp_path: Path) -> None:
    assert drafted_files() == ()
    for name in ("b.toml", "a.toml"):
        keep(tmp_path / name, Draft("a = 1\n", ""))
    (data_folder() / "drafts" / "broken.json").write_text("{")
    assert drafted_files() == (tmp_path.resolve() / "a.toml", tmp_path.resolve() / "b.toml")
    discard(tmp_path / "a.toml")
    assert drafted_files() == (tmp_path.resolve() / "b.toml",)


def test_keeper_writes_within_its_rest_however_fast_edits_follow(tmp_path: Path) -> None:
    keeper = Keeper(tmp_path / "a.toml", "")
    written = []
    for tick in range(300):
        now = tick / 100
        keeper.edited("x" * tick, (), now)
        if keeper.write_if_due(now):
            written.append(now)
    assert written[0] == REST_S
    assert max(later - earlier for earlier, later in itertools.pairwise(written)) <= REST_S + 0.02
    assert keeper.write()
    assert not keeper.write()
    assert not keeper.write_if_due(99)
    found = draft_of(tmp_path / "a.toml")
    assert found is not None
    assert found.text == "x" * 299
    keeper.saved("hash")
    assert draft_of(tmp_path / "a.toml") is None


def test_the_draft_of_another_program_is_kept_as_a_version_and_not_discarded(tmp_path: Path) -> None:
    file = tmp_path / "a.toml"
    one, other = Keeper(file, ""), Keeper(file, "")
    for keeper, text in ((one, "mine"), (other, "yours"), (one, "mine again")):
        keeper.edited(text, (), 0.0)
        keeper.write()
    assert [kept_content(kept.hash) for kept in kept_versions(file)] == [b"mine", b"yours"]
    assert {kept.origin for kept in kept_versions(file)} == {"draft"}
    assert (one.others, other.others) == (1, 1)
    other.saved("hash")
    assert draft_of(file) is not None
    one.saved("hash")
    assert draft_of(file) is None


def test_a_draft_that_cannot_be_written_stays_due(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    keeper = Keeper(tmp_path / "a.toml", "")
    keeper.edited("x", (), 0.0)
    monkeypatch.setenv("LIQUID_STUDY_DATA", str(tmp_path / "file"))
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(StoreError, match="cannot be made"):
        keeper.write()
    (tmp_path / "file").unlink()
    assert keeper.write()


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b'{"text": 1, "base": "", "selected": [], "kept_at": ""}'])
def test_a_broken_draft_is_none(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "a.toml"
    keep(file, Draft("x", ""))
    (path,) = Path(os.environ["LIQUID_STUDY_DATA"], "drafts").glob("*.json")
    path.write_bytes(content)
    assert draft_of(file) is None


TYPING = """
import sys, time
from pathlib import Path
from study_app.store.drafts import Keeper
keeper, letters = Keeper(Path(sys.argv[1]), "base"), 0
while True:
    letters += 1
    keeper.edited("x" * letters, ("study", "title"), time.monotonic())
    print(letters, time.time(), flush=True)
    keeper.write_if_due(time.monotonic())
    time.sleep(0.005)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="needs SIGKILL")
def test_a_kill_while_typing_loses_at_most_the_last_second(tmp_path: Path) -> None:
    draw = random.Random(1)  # noqa: S311
    drafts = 0
    for start in range(0, KILLS, AT_ONCE):
        files = [tmp_path / f"study_{number}.toml" for number in range(start, start + AT_ONCE)]
        for file in files:
            file.write_text("a = 1\n")
        outs = [file.with_suffix(".out") for file in files]
        typing = []
        for file, out in zip(files, outs, strict=True):
            with out.open("wb") as stdout:
                typing.append(subprocess.Popen([sys.executable, "-c", TYPING, str(file)], stdout=stdout))
        while not all(out.stat().st_size for out in outs):
            time.sleep(0.01)
        for process in typing:
            time.sleep(draw.uniform(0.0, 0.3))
            process.kill()
            process.wait()
        drafts += sum(_kept(file, out) for file, out in zip(files, outs, strict=True))
    assert drafts >= KILLS // 2


def _kept(file: Path, out: Path) -> bool:
    """Check what is left of a study whose typing was killed; return whether there is a draft."""
    assert file.read_text() == "a = 1\n"
    times = [float(line.split()[1]) for line in out.read_text().splitlines() if len(line.split()) == 2]
    draft = draft_of(file)
    letters = 0 if draft is None else len(draft.text)
    assert draft is None or draft.text == "x" * letters
    lost = times[letters:]
    assert not lost or lost[-1] - lost[0] <= 1.0, (letters, len(times))
    return draft is not None
