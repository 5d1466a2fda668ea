"""The force model: the force on a body in a liquid, and the servo that renders it.

Imports nothing, so that reading a scene (``haptics.model.scene``) never loads the compiler.
"""
