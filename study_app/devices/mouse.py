"""The mouse as a device: the liquid is seen instead of felt.

A spring and a damper connect a simulated handle to the pointer, and the liquid's force acts on that handle: it lags
behind the pointer by force / stiffness, and continues after the pointer has stopped, as the liquid moves it. In free
space it follows smoothly, 20 ms behind (two low-passes of 10 ms, which smooth the pointer's steps).
"""

from study_app.devices.simulated.hand import POINT
from study_app.devices.simulated.simulated_device import SimulatedDevice
from study_app.haptics.kernels.plant import new_handle

MASS_KG = 0.2
STIFFNESS_NPM = 400.0  # 8 N hold the handle back by 20 mm, a fifth of the workspace
DAMPING_NSPM = 27.0  # 1.5 times critical
LAG_S = 0.010


class PointedDevice(SimulatedDevice):
    """A handle connected to a pointer; the subclass moves the pointer.

    Parameters
    ----------
    workspace_m : half extents of the handle's workspace [m]
    force_limit_n : the greatest force that may be commanded [N]
    """

    def __init__(
        self, workspace_m: tuple[float, float, float] = (0.05, 0.05, 0.05), force_limit_n: float = 8.0
    ) -> None:
        handle = new_handle(mass_kg=MASS_KG, stiffness_npm=STIFFNESS_NPM, damping_nspm=DAMPING_NSPM)
        super().__init__(handle, workspace_m, force_limit_n)
        self.state.hand.lag_s = LAG_S

    def point_to(self, x_m: float, y_m: float, z_m: float) -> None:
        """Set the pointer's place [m, hand frame]; a place outside the workspace counts as its border."""
        self._post(POINT, target_m=self._inside(x_m, y_m, z_m))


class MouseDevice(PointedDevice):
    """The built-in default: a pointer and its buttons without hardware; a window sets the pointer."""

    name = "mouse"
