"""Events in recorded traffic: a detector per kind, and the parameters of scenarios in them.

A kind is one file with ``find(scene, changes)``, listed in `find.DETECTORS`; its rule, roles and
quantities are declared in `scenario/language/lane_event_kinds.py` or `path_event_kinds.py`.
"""
