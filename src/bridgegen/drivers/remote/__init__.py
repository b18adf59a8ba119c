"""Drivers in other processes, in any language: the protocol, and both of its ends."""

from bridgegen.drivers.remote.server import serve

__all__ = ["serve"]
