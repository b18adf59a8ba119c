"""Lanelet2 maps (``.osm``, Autoware's and CommonRoad's) become OpenDRIVE, when they are read."""
