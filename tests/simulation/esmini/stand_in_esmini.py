"""A stand-in of esmini's library: it plays what the embedded simulator makes of the file.

It goes wrong where the parameter ``fault`` says so, and takes it ill if the ego is not where it
should be when it is looked at. Run as the program of an esmini process.
"""

import os
import time
from pathlib import Path

import numpy as np
from lxml import etree

from bridgegen.base.errors import InputError
from bridgegen.drivers import DRIVERS
from bridgegen.openx.openscenario import parameters
from bridgegen.openx.openscenario.read import read
from bridgegen.openx.prepared import roads_of
from bridgegen.simulation.embedded.simulator import EmbeddedSimulator
from bridgegen.simulation.esmini import process
from bridgegen.simulation.esmini.files import ScenarioFile

LOGS, REFUSES, HANGS, DIES, NAN, HANGS_AT_ONCE = 1, 2, 3, 4, 5, 6
FAULT_AT = 10


def played(path):
    """Return what the embedded simulator makes of a file, and the entities' boxes.

    Participants that are driven from outside move as their events say: nobody is asked for them.
    """
    root = etree.parse(path).getroot()
    for private in root.iterfind("./Storyboard/Init/Actions/Private"):
        if private.get("entityRef") != "ego":
            for controller in [*private.iterfind("./PrivateAction/ControllerAction")]:
                private.remove(controller.getparent())
    storyboard = read(etree.tostring(root), path.name)
    embedded = EmbeddedSimulator(storyboard, "row", driver=DRIVERS["route-follower"])
    roads = embedded.roads([roads_of(storyboard, path)])
    return embedded.run(roads, np.zeros(1, dtype=np.int64), {}), embedded.program.box


class StandIn:
    version = "stand-in 3.0"

    def __init__(self, path):
        if not path.name.startswith("stand-in"):
            raise InputError(f"{path}: is not the stand-in")
        played(path.with_name("warm.xosc"))  # what is compiled is loaded now, in nobody's time

    def begin(self, scenario, log, began):
        storyboard = read(scenario)
        self.fault = int(parameters.numbers(storyboard).get("fault", 0))
        if self.fault == REFUSES:
            log.write_text("[] [info] Loading\n[] [error] Failed to load OpenDRIVE file\n")
            return False
        if self.fault == LOGS:
            log.write_text("[] [warn] no model\n[0.1] [error] Unexpected\n[0.2] [error] again\n")
        while self.fault == HANGS_AT_ONCE:
            time.sleep(60)
        self.rollout, self.box = played(scenario)
        self.paths = ScenarioFile(storyboard, ()).event_paths()
        self.began, self.time, self.is_over = began, 0.0, False
        self.told = {}
        return True

    def close(self):
        pass

    @property
    def k(self):
        return round(self.time / self.rollout.time_step)

    def step(self, seconds):
        k = self.k
        if self.fault and k == FAULT_AT:
            if self.fault == DIES:
                os._exit(7)
            while self.fault == HANGS:
                time.sleep(60)
        if abs(k * self.rollout.time_step - self.time) < 1e-9:  # not between two instants
            assert np.abs(np.array(self.told[0][:2]) - self.state(0)[:2]).max() < 1e-9, k
            for path, at in zip(self.paths, self.rollout.began[0], strict=True):
                if at == k:
                    self.began(path)
            if k == self.rollout.n_steps[0] - 1:
                self.is_over = True
                return
        self.time += seconds

    def number(self, name):
        return self.rollout.names.index(name)

    def state(self, number):
        arrays = (self.rollout.x, self.rollout.y, self.rollout.h, self.rollout.v)
        x, y, h, v = (float(array[0, number, self.k]) for array in arrays)
        h = (h + np.pi) % (2.0 * np.pi) - np.pi
        return (x if self.fault != NAN or self.k < FAULT_AT else float("nan")), y, h, v

    def size(self, number):
        return tuple(self.box[number, :2])

    def report(self, number, x, y, h, v, a, turn):
        self.told[number] = (x, y, h, v)


def answering(path, folder):
    library = StandIn(Path(path))
    return library.version, process.Answers(library, Path(folder)).answer


if __name__ == "__main__":
    process.main(answering)
