"""Rollouts as traces of ASAM OSI: GroundTruth or SensorView in MCAP files."""
