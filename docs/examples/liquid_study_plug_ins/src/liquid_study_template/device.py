"""A device: a simulated hand with a light grip. For hardware see the other template, liquid_study_device."""

from study_app.devices.descriptor import READY, Backend, DeviceDescriptor, opened


def open_light_hand(request):
    """Return the device, open; what loads the compiler is imported here."""
    from study_app.devices.simulated import SimulatedDevice
    from study_app.haptics.kernels.plant import new_handle

    class LightHand(SimulatedDevice):
        name = "light-hand"

        def __init__(self) -> None:
            handle = new_handle(mass_kg=0.2, stiffness_npm=300.0, damping_nspm=10.0)
            super().__init__(handle, request.workspace_m or (0.05, 0.05, 0.05), request.force_limit_n or 8.0)
            self._tremble(request.random, 1e-5)

    return opened(LightHand())


LIGHT_HAND = DeviceDescriptor(
    name="light-hand",
    title="Light hand",
    icon="fast_forward",
    kind="simulated",
    degrees_of_freedom=3,
    open=open_light_hand,
    probe=lambda: [Backend("light-hand", "the plug-in", state=READY, can="simulated hand with a light grip")],
    moves_by_itself=True,
)
