"""Logical scenarios made of recorded events, and new ranges proposed for scenarios of a user."""
