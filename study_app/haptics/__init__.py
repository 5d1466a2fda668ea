"""The force model: the force on a body in a liquid, and the servo that renders it.

``kernels.tick`` is one tick from top to bottom, ``model.scene`` what is simulated, ``runtime.servo`` the interface of
the loop; read these first. The package imports nothing, so that reading a scene never loads the compiler.

Public modules: kernels, model.device_dynamics, model.effects, model.estimators, model.force_rules, model.gate,
model.laws, model.layout, model.motion, model.overrides, model.ranges, model.scene, model.slope_limits,
runtime.clocks, runtime.closed_loop, runtime.grants, runtime.offline, runtime.pack, runtime.servo, runtime.telemetry.
"""
