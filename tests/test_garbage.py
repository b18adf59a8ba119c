import gc

from bridgegen.base.processes.child import RARELY


def test_a_command_looks_for_garbage_rarely(cli):
    gc.set_threshold(700, 10, 10)
    cli("--version")
    assert gc.get_threshold() == RARELY
