"""The servo's tick in a closed loop with a simulated device and hand, for evidence about the loop.

``simulation`` is the interface: a loop with a scripted device, and the servo's own loop with a driver.
"""

from study_app.haptics.runtime.closed_loop.arm import ARMS
from study_app.haptics.runtime.closed_loop.loop import BURST_PERIOD_S
from study_app.haptics.runtime.closed_loop.simulation import ClosedLoop, empty_trace, trace_driver

__all__ = ["ARMS", "BURST_PERIOD_S", "ClosedLoop", "empty_trace", "trace_driver"]
