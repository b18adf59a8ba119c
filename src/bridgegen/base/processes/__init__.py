"""Processes that BridgeGen starts: begun, supervised, called, and ended with all that they started."""
