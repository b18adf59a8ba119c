"""The script that runs openpilot's planner alone on exported inputs."""

SCRIPT = '''"""openpilot's longitudinal planner on what it was told, without BridgeGen.

Run it where openpilot is installed and built (tools/op.sh build). It prints the acceleration
[m/s²] that the planner demands at each instant.
"""

import math
from types import SimpleNamespace as Message

import numpy as np

from openpilot.common.realtime import DT_MDL
from openpilot.selfdrive.controls import radard
from openpilot.selfdrive.controls.lib.longcontrol import LongCtrlState
from openpilot.selfdrive.controls.lib.longitudinal_planner import LongitudinalPlanner
from openpilot.selfdrive.controls.lib.longitudinal_mpc_lib.long_mpc import log

told = np.load({path!r}, allow_pickle=False)
car = Message(
    openpilotLongitudinalControl=True, longitudinalActuatorDelay=0.15, vEgoStopping=0.5,
    steerRatio=1.0, wheelbase=1.0,
)
planner = LongitudinalPlanner(car, init_v=float(told["v"][0]))
tracks, kalman = {{}}, radard.KalmanParams(DT_MDL)
for k, v in enumerate(told["v"].tolist()):
    for j, (there, distance, left, speed) in enumerate(told["points"][k].tolist()):
        if not there:
            tracks.pop(j, None)
            continue
        track = tracks.setdefault(j, radard.Track(j, speed, kalman))
        track.update(distance, left, speed - v, speed, True)
    leads = []
    for which, j in enumerate(told["leads"][k].tolist()):
        camera = Message(prob=0.0)
        if j >= 0:
            _, distance, left, speed = told["points"][k, j].tolist()
            camera = Message(
                prob=1.0, x=[distance + radard.RADAR_TO_CAMERA], y=[-left], v=[speed], a=[0.0],
                xStd=[1.0], yStd=[1.0], vStd=[1.0],
            )
        lead = radard.get_lead(v, True, tracks, camera, v, camera.prob, which == 0)
        leads.append(Message(**({{"modelProb": 0.0}} | lead)))
    nothing = Message(x=[])
    planner.update({{
        "carState": Message(
            vEgo=v, aEgo=float(told["a"][k]), vCruise=3.6 * float(told["set_speed"][k]),
            standstill=v < 0.01, steeringAngleDeg=math.degrees(told["curvature"][k]),
        ),
        "carControl": Message(orientationNED=[]),
        "controlsState": Message(longControlState=LongCtrlState.pid, forceDecel=False),
        "selfdriveState": Message(
            enabled=True, experimentalMode=False, personality=log.LongitudinalPersonality.standard
        ),
        "liveParameters": Message(angleOffsetDeg=0.0),
        "radarState": Message(leadOne=leads[0], leadTwo=leads[1]),
        "modelV2": Message(
            position=nothing, velocity=nothing, acceleration=nothing,
            meta=Message(disengagePredictions=Message(gasPressProbs=[])),
            action=Message(desiredAcceleration=0.0, shouldStop=False),
        ),
    }})
    demanded = float(planner.output_a_target)
    print(repr(min(-0.5, demanded) if planner.output_should_stop else demanded))
'''
