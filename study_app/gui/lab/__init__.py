"""The page of the liquid lab in the operator's main window."""

from study_app.gui.lab.lab_state import CostRow, DeviceShown, ErrorRow, LabView, Now
from study_app.gui.lab.view import LabPlace

__all__ = ["CostRow", "DeviceShown", "ErrorRow", "LabPlace", "LabView", "Now"]
