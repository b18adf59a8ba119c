"""The messages of ASAM OSI that are written.

Source: ASAM OSI 3.7.0.
"""

from bridgegen.base.protobuf import Schema

VERSION = (3, 7, 0)
"""The version of OSI."""

_MESSAGES = """
GroundTruth: version InterfaceVersion 1, timestamp Timestamp 2, host_vehicle_id Identifier 3,
    stationary_object Unused* 4, moving_object MovingObject* 5, traffic_sign Unused* 6,
    traffic_light TrafficLight* 7, road_marking Unused* 8, lane_boundary LaneBoundary* 9,
    lane Lane* 10, environmental_conditions EnvironmentalConditions 12, reference_line Unused* 17,
    logical_lane_boundary Unused* 18, logical_lane Unused* 19
SensorView: version InterfaceVersion 1, timestamp Timestamp 2, sensor_id Identifier 3,
    global_ground_truth GroundTruth 7, host_vehicle_id Identifier 8,
    generic_sensor_view Unused* 1000, radar_sensor_view Unused* 1001,
    lidar_sensor_view Unused* 1002, camera_sensor_view Unused* 1003,
    ultrasonic_sensor_view Unused* 1004
InterfaceVersion: version_major uint32 1, version_minor uint32 2, version_patch uint32 3
Timestamp: seconds int64 1, nanos uint32 2
Identifier: value uint64 1
Unused: id Identifier 1
ExternalReference: reference string 1, type string 2, identifier string* 3
Dimension3d: length double 1, width double 2, height double 3
Vector3d: x double 1, y double 2, z double 3
Orientation3d: roll double 1, pitch double 2, yaw double 3
BaseMoving: dimension Dimension3d 1, position Vector3d 2, orientation Orientation3d 3,
    velocity Vector3d 4, acceleration Vector3d 5, orientation_rate Orientation3d 6
BaseStationary: dimension Dimension3d 1, position Vector3d 2, orientation Orientation3d 3
MovingObject: id Identifier 1, base BaseMoving 2, type .Type 3,
    vehicle_attributes .VehicleAttributes 5, vehicle_classification .VehicleClassification 6,
    model_reference string 7, moving_object_classification .MovingObjectClassification 9,
    source_reference ExternalReference* 10
MovingObject.VehicleAttributes: bbcenter_to_rear Vector3d 4
MovingObject.VehicleClassification: type .Type 1, light_state .LightState 2, role .Role 5
MovingObject.VehicleClassification.LightState: indicator_state .IndicatorState 1,
    brake_light_state .BrakeLightState 7, emergency_vehicle_illumination .GenericLightState 9
MovingObject.MovingObjectClassification: assigned_lane_id Identifier* 1
TrafficLight: id Identifier 1, base BaseStationary 2, classification .Classification 3,
    model_reference string 4, source_reference ExternalReference* 5
TrafficLight.Classification: color .Color 1, icon .Icon 2, mode .Mode 3,
    assigned_lane_id Identifier* 5
LaneBoundary: id Identifier 1, boundary_line .BoundaryPoint* 2, classification .Classification 3
LaneBoundary.BoundaryPoint: position Vector3d 1, width double 2, height double 3
LaneBoundary.Classification: type .Type 1, color .Color 2
Lane: id Identifier 1, classification .Classification 2, source_reference ExternalReference* 3
Lane.Classification: type .Type 1, centerline Vector3d* 3, centerline_is_driving_direction bool 4,
    left_adjacent_lane_id Identifier* 5, right_adjacent_lane_id Identifier* 6,
    lane_pairing .LanePairing* 7, right_lane_boundary_id Identifier* 8,
    left_lane_boundary_id Identifier* 9, free_lane_boundary_id Identifier* 10, subtype .Subtype 12
Lane.Classification.LanePairing: antecessor_lane_id Identifier 1, successor_lane_id Identifier 2
EnvironmentalConditions: ambient_illumination .AmbientIllumination 1,
    precipitation .Precipitation 6, fog .Fog 7
"""
"""Lists of what is never written are declared, for viewers ask for them."""

_ENUMS = """
MovingObject.Type TYPE: UNKNOWN OTHER VEHICLE PEDESTRIAN ANIMAL
MovingObject.VehicleClassification.Type TYPE: UNKNOWN OTHER SMALL_CAR COMPACT_CAR MEDIUM_CAR
    LUXURY_CAR DELIVERY_VAN HEAVY_TRUCK SEMITRAILER TRAILER MOTORBIKE BICYCLE BUS TRAM TRAIN
    WHEELCHAIR SEMITRACTOR STANDUP_SCOOTER
MovingObject.VehicleClassification.Role ROLE: UNKNOWN OTHER CIVIL
MovingObject.VehicleClassification.LightState.IndicatorState INDICATOR_STATE: UNKNOWN OTHER OFF
    LEFT RIGHT WARNING
MovingObject.VehicleClassification.LightState.BrakeLightState BRAKE_LIGHT_STATE: UNKNOWN OTHER OFF
    NORMAL STRONG
MovingObject.VehicleClassification.LightState.GenericLightState GENERIC_LIGHT_STATE: UNKNOWN OTHER
    OFF ON FLASHING_BLUE
TrafficLight.Classification.Color COLOR: UNKNOWN OTHER RED YELLOW GREEN
TrafficLight.Classification.Icon ICON: UNKNOWN OTHER NONE
TrafficLight.Classification.Mode MODE: UNKNOWN OTHER OFF CONSTANT FLASHING
LaneBoundary.Classification.Type TYPE: UNKNOWN OTHER NO_LINE SOLID_LINE DASHED_LINE BOTTS_DOTS
    ROAD_EDGE SNOW_EDGE GRASS_EDGE GRAVEL_EDGE SOIL_EDGE GUARD_RAIL CURB
LaneBoundary.Classification.Color COLOR: UNKNOWN OTHER NONE WHITE
Lane.Classification.Type TYPE: UNKNOWN OTHER DRIVING NONDRIVING
Lane.Classification.Subtype SUBTYPE: UNKNOWN OTHER NORMAL BIKING SIDEWALK PARKING STOP RESTRICTED
    BORDER SHOULDER EXIT ENTRY ONRAMP OFFRAMP CONNECTINGRAMP
EnvironmentalConditions.AmbientIllumination AMBIENT_ILLUMINATION: UNKNOWN OTHER LEVEL1 LEVEL2
    LEVEL3 LEVEL4 LEVEL5 LEVEL6 LEVEL7 LEVEL8 LEVEL9
EnvironmentalConditions.Precipitation PRECIPITATION: UNKNOWN OTHER NONE VERY_LIGHT LIGHT MODERATE
    HEAVY VERY_HEAVY EXTREME
EnvironmentalConditions.Fog FOG: UNKNOWN OTHER EXCELLENT_VISIBILITY GOOD_VISIBILITY
    MODERATE_VISIBILITY POOR_VISIBILITY MIST LIGHT THICK DENSE
"""
OSI = Schema("osi3", _MESSAGES, _ENUMS)
message, VALUES = OSI.message, OSI.values
