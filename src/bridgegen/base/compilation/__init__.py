"""Compiling kernels: how they are compiled, and where their code is kept."""
