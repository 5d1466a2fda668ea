"""What a condition shows: the drawn tank, a camera, or footage, whose hash is part of the study's."""

import hashlib
from pathlib import Path

import pytest

from study_app.errors import ProtocolError
from study_app.protocol.descriptions.protocol_text import describe
from study_app.protocol.load import load, parse
from study_app.protocol.source.files import StudySource, protocol_hash, source_bytes

FOOTAGE = b"not decoded here"
SEEN = '[conditions.{name}]\nliquid = "thin"\ndelay_ms = {delay}\n{keys}\n\n'


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """Return demo with conditions that show a camera and footage."""
    text = source_bytes("demo").decode()
    first = text.index("[conditions.")
    live = SEEN.format(name="live", delay=11, keys='view = "camera"')
    clip = SEEN.format(name="clip", delay=12, keys='view = "waves/sea.mp4"\noverlay = "hidden"')
    path = tmp_path / "mine.toml"
    path.write_text(text[:first] + live + clip + text[first:], encoding="utf-8", newline="\n")
    (tmp_path / "waves").mkdir()
    (tmp_path / "waves" / "sea.mp4").write_bytes(FOOTAGE)
    return path


def test_a_condition_shows_a_camera_or_footage(study: Path) -> None:
    protocol = load(study)
    live, clip, thin = (protocol.conditions[name] for name in ("live", "clip", "thin"))
    assert (live.view, live.overlay, live.shows_video, live.footage_sha256) == ("camera", "shown", True, None)
    assert (clip.view, clip.overlay) == ("waves/sea.mp4", "hidden")
    assert clip.footage_sha256 == hashlib.sha256(FOOTAGE).hexdigest()
    assert (thin.view, thin.shows_video) == ("tank", False)
    assert {"view", "overlay", "footage_sha256"}.isdisjoint(thin.model_dump())
    words = describe(protocol)
    assert "video: camera" in words
    assert "video: waves/sea.mp4, without the ball and the targets" in words


def test_the_studys_hash_covers_the_footage(study: Path) -> None:
    source = source_bytes(study)
    assert source.startswith(study.read_bytes())
    footage = {"waves/sea.mp4": hashlib.sha256(FOOTAGE).hexdigest()}
    assert StudySource.split(source) == (study.read_bytes(), {}, footage)
    (study.parent / "waves" / "sea.mp4").write_bytes(FOOTAGE + b".")
    changed = source_bytes(study)
    assert protocol_hash(changed) != protocol_hash(source)
    assert parse(changed, "mine.toml").conditions["clip"] != parse(source, "mine.toml").conditions["clip"]


def test_footage_and_liquid_files_are_restored_from_one_source() -> None:
    text = b'format = 2\n[liquids.a]\nfile = "a.toml"\n[conditions.a]\nview = "a.mp4"\n'
    source = StudySource(text, footage={"a.mp4": "00ff"}).with_liquids(lambda name: f"# {name}")
    assert StudySource.split(source.content) == source == (text, {"a.toml": "# a.toml"}, {"a.mp4": "00ff"})
    assert StudySource(text).with_liquids(lambda _: None).content == text


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [('view = "waves/sea.mp4"', 'view = "lost.mp4"', 'conditions.clip.view: there is no file "lost.mp4"')],
)
def test_a_view_that_cannot_be_is_named(study: Path, old: str, new: str, problem: str) -> None:
    study.write_text(study.read_text(encoding="utf-8").replace(old, new, 1), encoding="utf-8", newline="\n")
    with pytest.raises(ProtocolError) as error:
        load(study)
    assert problem in str(error.value)
