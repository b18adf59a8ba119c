"""The paper's evaluation, Section V, made again: its runs, tables, figures and claims."""

from bridgegen_reproduction.reproduction import Reproduction, reproduce

__all__ = ["Reproduction", "reproduce"]
