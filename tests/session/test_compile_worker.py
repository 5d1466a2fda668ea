"""Compilation in a worker process: afterwards a session finds everything compiled, and no process starts again."""

from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import pytest

from study_app.haptics import kernels
from study_app.haptics.kernels import compiled
from study_app.session.compile_worker import carry_out, start_compilation
from tests.compiled import needs_servo


def test_compilation_does_not_start_without_a_cache_or_with_a_full_one(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(kernels, "CACHE", None)
    assert start_compilation() is None
    monkeypatch.setattr(kernels, "CACHE", tmp_path)
    (tmp_path / "filled").touch()
    assert start_compilation() is None


def test_the_cache_is_filled_once_every_device_was_opened_and_stopped(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    calls: list[str] = []
    monkeypatch.setattr(kernels, "CACHE", tmp_path)
    monkeypatch.setattr(kernels, "following_compilation", lambda _send: nullcontext())
    monkeypatch.setattr(
        "study_app.devices.rig.open_rig", lambda name, _settings: SimpleNamespace(stop=lambda: calls.append(name))
    )
    carry_out(("scripted", "mouse"), calls.append, lambda: False)
    assert (calls, [path.name for path in tmp_path.iterdir()]) == (["scripted", "mouse"], ["filled"])


@needs_servo
@pytest.mark.nightly
def test_the_process_fills_the_cache_and_reports_its_progress(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    for module in (compiled, kernels):
        monkeypatch.setattr(module, "CACHE", tmp_path / compiled.CACHE.name)
    client = start_compilation(("scripted",))
    assert client is not None
    try:
        answers: list[object] = [0.0]
        while isinstance(answers[-1], float):
            answers += [answer for _, answer in client.answers(wait_s=1.0)]
        assert answers[-1] is None
        shares = answers[:-1]
        assert len(set(shares)) > 100
        assert shares == sorted(shares)
    finally:
        client.close()
        client.wait_until_ended()
    assert start_compilation(("scripted",)) is None
