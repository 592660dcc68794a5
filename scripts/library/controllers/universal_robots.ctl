robomosp controller 1
name universal_robots
description "Universal Robots CB3 or e-Series: an example; check each signal's number and kind, speeds and accelerations"
target "urscript"
signal lamp { number 0  kind "configurable" }
option joint_speed { value "60" }
option acceleration { value "1200" }
option joint_acceleration { value "80" }
