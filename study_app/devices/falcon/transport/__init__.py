"""Connections to a Falcon: libusb, FTDI, socket."""
