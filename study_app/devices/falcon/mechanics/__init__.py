"""Geometry, kinematics and calibration of a Falcon."""
