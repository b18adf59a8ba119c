"""Inject faults into kernels, one at a time: does ``bridgegen credibility --validate`` see them?

    python tools/faults.py                 # writes tools/faults.json; about an hour on two cores
    python tools/faults.py --only pet-off  # some of them, printed only

Each fault is a text of a file that another one replaces, in a copy of the package with a cache of
compiled code of its own. A text that is not there exactly once is refused, so that no fault rots.
The list was written, and committed, before the suite was: none was chosen because it is found.
"""

from typing import NamedTuple


class Fault(NamedTuple):
    """A fault: in a file of the package, a text and what replaces it."""

    name: str
    file: str
    text: str
    replaced: str
    what: str


METRICS, CONFLICT = "assess/metrics", "assess/conflict"
EMBEDDED = "simulation/embedded"

FAULTS = (
    Fault("box-swapped", "simulation/_box_kernels.py",
          "    la, wa = 0.5 * box_a[0], 0.5 * box_a[1]\n",
          "    la, wa = 0.5 * box_a[1], 0.5 * box_a[0]\n",
          "distance of boxes: length and width of the ego swapped"),
    Fault("ttc-sign", f"{METRICS}/_time_kernels.py",
          "        wx = vb[k] * cb - va[k] * ca\n", "        wx = vb[k] * cb + va[k] * ca\n",
          "time to collision: sign of the ego's velocity"),
    Fault("pet-off", f"{METRICS}/_time_kernels.py",
          "                        best = abs(j - i)\n",
          "                        best = abs(j - i) + 1\n",
          "post-encroachment time: off by one step"),
    Fault("brake-half", f"{METRICS}/_brake_kernels.py",
          "        return v * v / (2.0 * s)  # it has stopped by then\n",
          "        return v * v / s\n",
          "braking threat: v² / s for v² / 2s"),
    Fault("rss-response", f"{METRICS}/_kernels.py",
          "    after = v + response * accel\n", "    after = v\n",
          "RSS: no acceleration during the response time"),
    Fault("merge-boundary", f"{METRICS}/_kernels.py",
          "k - last > merge_steps:", "k - last >= merge_steps:",
          "collisions: < for <= where two contacts are one"),
    Fault("red-off", f"{METRICS}/_kernels.py",
          "state = lights[i, light, k - 1]", "state = lights[i, light, k]",
          "red lights: the state one step late"),
    Fault("masses-swapped", f"{CONFLICT}/_severity_kernels.py",
          "    return mine / total, its / total\n", "    return its / total, mine / total\n",
          "severity: each party gets the other's share of the closing speed"),
    Fault("no-tangential", f"{CONFLICT}/_severity_kernels.py",
          "    return elementary.hypot(normal, slides)\n", "    return normal\n",
          "severity: friction of the surfaces ignored"),
    Fault("reaction", f"{CONFLICT}/_careful_driver_kernels.py",
          "            elif (m - start) * dt > REACTION + 1e-9:\n", "            elif m > start:\n",
          "careful driver of the verdict: no reaction time"),
    Fault("wet-road", f"{CONFLICT}/_careful_driver_kernels.py",
          "min(slowed + JERK * dt, braking, gives(scene, a, i, speed))",
          "min(slowed + JERK * dt, braking)",
          "careful driver of the verdict: friction of the road ignored"),
    Fault("head-on", f"{CONFLICT}/_type_kernels.py",
          "    return HEAD_ON if cosine <= -SAME_WAY else CROSSING\n",
          "    return HEAD_ON if cosine <= SAME_WAY else CROSSING\n",
          "type: crossing traffic is called head-on"),
    Fault("right-of-way", f"{CONFLICT}/_responsibility_kernels.py",
          "scene.c[0, j] * scene.s[e, j] - scene.s[0, j] * scene.c[e, j] > 0.0",
          "scene.c[0, j] * scene.s[e, j] - scene.s[0, j] * scene.c[e, j] < 0.0",
          "responsibility: left before right"),
    Fault("in-hand", f"{CONFLICT}/_conflict_kernels.py",
          "needed <= (v[k - 1] - v[k]) / dt", "needed <= (v[k] - v[k - 1]) / dt",
          "near miss: sign of the ego's own braking"),
    Fault("shared-fault", f"{CONFLICT}/_conflict_kernels.py",
          "    return responsible in (EGO, SHARED) or (", "    return responsible == EGO or (",
          "failure: shared responsibility does not count"),
    Fault("euler", f"{EMBEDDED}/_motion_kernels.py",
          "    travelled = 0.5 * (v + end) * dt\n", "    travelled = end * dt\n",
          "motion: Euler's rule for the trapezoidal one"),
    Fault("friction-unit", f"{EMBEDDED}/_motion_kernels.py",
          "    total = elementary.hypot(a + uphill, v * v * bend + aside)\n",
          "    total = elementary.hypot(a + uphill, v * bend + aside)\n",
          "motion: v for v² in the friction circle"),
    Fault("limits-swapped", f"{EMBEDDED}/_motion_kernels.py",
          "    a = min(max(demanded, -limits[2] - uphill), limits[1] - uphill)\n",
          "    a = min(max(demanded, -limits[1] - uphill), limits[2] - uphill)\n",
          "motion: limits of acceleration and deceleration swapped"),
    Fault("lane-rate", f"{EMBEDDED}/motion/_lateral_kernels.py",
          "        steepest = 1.5\n", "        steepest = 1.0\n",
          "change of lane by a rate: the mean for the steepest"),
    Fault("speed-rate", f"{EMBEDDED}/motion/_speed_kernels.py",
          "        state.rate[e] = min(abs(value), most)\n",
          "        state.rate[e] = max(abs(value), most)\n",
          "change of speed by a rate: max for min"),
    Fault("delay", f"{EMBEDDED}/conditions/_trigger_kernels.py",
          "    edge, j = conditions[c, EDGE], k - conditions[c, DELAY]\n",
          "    edge, j = conditions[c, EDGE], k - conditions[c, DELAY] - 1\n",
          "triggers: one step late"),
    Fault("un-r157-reaction", "drivers/_un_r157_kernels.py",
          "dt + 1e-9 >= CAREFUL_REACTION:", "dt + 1e-9 >= 0.5 * CAREFUL_REACTION:",
          "driver un-r157: half the reaction time"),
    Fault("fsm-sign", "drivers/_fsm_kernels.py",
          "(2.0 * COMFORT_BRAKING) - leader_stops + SAFE_MARGIN",
          "(2.0 * COMFORT_BRAKING) + leader_stops + SAFE_MARGIN",
          "driver fsm: sign of the leader's stopping distance"),
    Fault("idm", "drivers/_following_kernels.py",
          "(v - leader_speed) / (2.0 * math.sqrt(", "(v - leader_speed) / (math.sqrt(",
          "following: factor of 2 in the intelligent driver model"),
    Fault("yellow", "drivers/_lights_kernels.py",
          "at_line > YELLOW_DECELERATION:", "at_line < YELLOW_DECELERATION:",
          "drivers at yellow: those that could stop pass"),
    Fault("left-right", "drivers/_path_kernels.py",
          "        d = py * c - px * t\n", "        d = px * t - py * c\n",
          "paths: right is left"),
    Fault("bend-side", "drivers/_speed_kernels.py",
          "        bend = abs(path[i, CURVATURE])\n", "        bend = path[i, CURVATURE]\n",
          "drivers in bends: right bends ignored"),
    Fault("grip", "drivers/_weather_kernels.py",
          "    weather[FRICTION] = GRIP * weather[FRICTION_SCALE]\n",
          "    weather[FRICTION] = GRIP\n",
          "weather: friction of a wet road ignored"),
    Fault("wrap", "drivers/_tracking_kernels.py",
          "    turn -= 2.0 * math.pi * math.floor(turn / (2.0 * math.pi) + 0.5)\n", "",
          "tracking: headings are not taken modulo 2π"),
    Fault("others-reaction", "drivers/_attentive_kernels.py",
          "dt + 1e-9 >= CAREFUL_REACTION:", "dt + 1e-9 >= 2.0 * CAREFUL_REACTION:",
          "attentive traffic: twice the reaction time"),
)  # fmt: skip
