"""The Novint Falcon.

Reading order: constants; bulk, failures, mechanics, replies; calibration, exchange, transport; boot; device.
"""
