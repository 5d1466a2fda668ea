"""A session that cannot begin is refused before its device is opened."""

from study_app.app.session import live_session
from study_app.app.session.live_session import LiveSession
from study_app.errors import StoreError
from study_app.gui.theme.theme import LIGHT
from study_app.protocol.load import load
from study_app.session.request import NewSession
from study_app.store.blinded.blinding import open_or_draw_key


def test_changed_conditions_are_refused_before_a_device_opens(qtbot, tmp_path, monkeypatch):
    study = load("demo")
    unused = next(iter(study.liquids.values())).model_copy(update={"id": "unused"})
    open_or_draw_key(tmp_path, study.model_copy(update={"liquids": {**study.liquids, "unused": unused}}))
    opened = []
    monkeypatch.setattr(live_session, "open_rig", lambda name, *_, **__: opened.append(name))
    live = LiveSession(NewSession("demo", "P001", 1, 7, "", "en", "mouse", True, None, tmp_path), LIGHT)
    with qtbot.waitSignal(live.over):
        live.open()
    live.wait()
    assert isinstance(live.error, StoreError)
    assert "sealed for other conditions" in str(live.error)
    assert opened == []
