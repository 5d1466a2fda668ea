"""The tank that the participant looks into: its camera, its glass and water, and what moves in it.

Reading order: sprites; frame; arrows, captions, glass; layers.
"""
