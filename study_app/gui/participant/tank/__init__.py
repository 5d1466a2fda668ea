"""The tank on the participant's screen: camera, glass and water, and the moving parts.

Reading order: sprites; frame; arrows, captions, glass; layers.
"""
