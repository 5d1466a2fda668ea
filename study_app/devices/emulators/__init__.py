"""Emulated devices: the program's own drivers in front of emulated hardware. No driver imports them.

Reading order: falcon_arm, falcon_bridge, force_dimension, inverse3_stream; falcon_processor, inverse3_service;
falcon_emulator, inverse3; falcon.
"""
