"""Modules that are loaded in a thread while the note before a session is shown."""


def load_windows() -> None:
    """Load what a session's windows need while the note is shown: modules, and versions, read from the disk once."""
    import study_app.app.devices_controller  # noqa: PLC0415
    import study_app.app.session.preflight_controller  # noqa: PLC0415
    import study_app.app.session.session_windows  # noqa: PLC0415
    import study_app.store.receipt  # noqa: PLC0415
    import study_app.store.recordings  # noqa: PLC0415 - and pyarrow, which the recorder is made with

    study_app.store.receipt.versions()
