"""Credibility dossiers: what the toolchain can state of itself, in numbers, and what it cannot."""
