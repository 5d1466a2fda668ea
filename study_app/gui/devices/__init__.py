"""The haptic and input devices of this machine, and their diagnosis."""

from study_app.gui.devices.diagnosis_dialog import open_diagnosis
from study_app.gui.devices.view import DevicesPlace

__all__ = ["DevicesPlace", "open_diagnosis"]
