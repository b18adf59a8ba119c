"""Processes that BridgeGen starts: supervised, called, ended with all that they started."""
