"""A device moved by a simulated hand: along a given motion or in human-like reaches, with tremor and encoders."""

from random import Random
from typing import Any

from study_app.devices.simulated.simulated_device import SimulatedDevice
from study_app.haptics.kernels.plant import new_handle

MASS_KG = 0.2
VISCOUS_NSPM = 0.5
COULOMB_N = 0.1
STIFFNESS_NPM = 500.0
DAMPING_NSPM = 30.0
QUANTUM_M = 38e-6  # one count of a Falcon at the knee
TREMOR_M = 5e-5  # three waves of this amplitude an axis: 0.06 mm in the mean square root, 0.15 mm at most


def new_scripted_handle(quantum_m: float) -> Any:
    """Return the handle in a simulated participant's hand, with encoders of this count [m]."""
    return new_handle(
        mass_kg=MASS_KG,
        viscous_nspm=VISCOUS_NSPM,
        coulomb_n=COULOMB_N,
        stiffness_npm=STIFFNESS_NPM,
        damping_nspm=DAMPING_NSPM,
        quantum_m=quantum_m,
    )


class ScriptedDevice(SimulatedDevice):
    """A handle in the hand of a simulated participant; the same ``random`` moves it to the same bit anywhere.

    Parameters
    ----------
    random : random numbers for frequencies and phases of the tremor; None: always the same ones
    workspace_m : half extents of the handle's workspace [m]
    force_limit_n : the greatest force that may be commanded [N]
    tremor_m : amplitude of each of the tremor's three waves per axis [m]; 0: no tremor quantum_m : one count of the
    encoders [m]; 0: exact
    """

    name = "scripted"

    def __init__(
        self,
        random: Random | None = None,
        *,
        workspace_m: tuple[float, float, float] = (0.05, 0.05, 0.05),
        force_limit_n: float = 8.0,
        tremor_m: float = TREMOR_M,
        quantum_m: float = QUANTUM_M,
    ) -> None:
        super().__init__(new_scripted_handle(quantum_m), workspace_m, force_limit_n)
        self._tremble(random, tremor_m)
