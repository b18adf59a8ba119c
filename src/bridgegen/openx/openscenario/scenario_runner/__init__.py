"""OpenSCENARIO 1.0 as CARLA's ScenarioRunner runs it."""
