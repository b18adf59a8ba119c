"""From an OpenSCENARIO file to a `Program`: tables of integers, or what cannot be run."""

from bridgegen.simulation.embedded.compiler.compile import compile_storyboard

__all__ = ["compile_storyboard"]
