robomosp controller 1
name mitsubishi_rv_m1
description "Mitsubishi RV-M1, five axes: check the roll of the tool, its length, and speed, which is that of SP 9"
target "movemaster"
option speed { value "1000" }
option roll { value "0" }
option step_mm { value "10" }
