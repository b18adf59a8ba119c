"""Drivers that start processes, which outlive whatever is not done to end them, for the tests.

Each process writes its number as the name of a file into the folder that FORKING_DRIVERS names.
"""

import multiprocessing
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from bridgegen.drivers.interface import Control

FOLDER = "FORKING_DRIVERS"
SLEEP = ["sleep", "300"]
PATH = {"PATH": os.environ["PATH"]}


def note(number):
    Path(os.environ[FOLDER], str(number)).touch()


def rest():
    time.sleep(300)


class Forks:
    """Has a process of `multiprocessing`, forked: it inherits all that is open."""

    def reset(self, n, scene):
        self.n = n
        self.begin()

    def begin(self):
        process = multiprocessing.get_context("fork").Process(target=rest)
        process.start()
        note(process.pid)

    def act(self, observation):
        return Control(np.zeros(self.n), np.zeros(self.n))


class Spawns(Forks):
    def begin(self):
        process = multiprocessing.get_context("spawn").Process(target=time.sleep, args=(300,))
        process.start()
        note(process.pid)


class HasPool(Forks):
    def begin(self):
        self.pool = multiprocessing.get_context("fork").Pool(2)
        for number in self.pool.map(_own_number, range(2)):
            note(number)


def _own_number(_):
    return os.getpid()


class RunsProgram(Forks):
    def begin(self):
        note(subprocess.Popen(SLEEP).pid)


class RunsProgramInSession(Forks):
    """With a session and an environment of its own: neither tells whose it is."""

    def begin(self):
        note(subprocess.Popen(SLEEP, env=PATH, start_new_session=True).pid)


class Daemonises(Forks):
    """Forks twice, so that the second one's parent ends, and it is nobody's child."""

    def begin(self):
        if os.fork():
            os.wait()
            return
        os.setsid()
        if os.fork() == 0:
            note(os.getpid())
            os.execvpe(SLEEP[0], SLEEP, PATH)
        os._exit(0)


class ForksAndDies(Forks):
    def act(self, observation):
        os._exit(4)


class ForksAndExits(Forks):
    def act(self, observation):
        sys.exit(3)


class ForksAndHangs(Forks):
    def act(self, observation):
        time.sleep(300)


class DaemonisesAndDies(Daemonises):
    act = ForksAndDies.act


class DaemonisesAndHangs(Daemonises):
    act = ForksAndHangs.act


class ForksOn(Forks):
    """Its fork goes on as the driver does, and it reads the standard input, as requests are."""

    def begin(self):
        if os.fork() == 0:
            note(os.getpid())

    def act(self, observation):
        sys.stdin.read()
        return super().act(observation)


class ForksAndDiesAtOnce(Forks):
    """Its process ends while the driver is made; what it has started does not."""

    def __init__(self):
        self.begin()
        os._exit(7)
