"""The force model: the force on a body in a liquid, and the servo that renders it.

``kernels.tick`` is one tick from top to bottom, ``model.scene`` what is simulated, ``runtime.servo`` the interface of
the loop; read these first. The package imports nothing, so that reading a scene never loads the compiler.
"""
