"""One protocol, several simulators: rows of parameters in, rollouts out."""
