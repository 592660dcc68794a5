robomosp controller 1
name linuxcnc_abc
description "Machine with three rotary axes A, B, C: an example; check that they are turns about fixed x, y, z there"
target "gcode"
option rotary { value "ABC" }
option chord_mm { value "0.01" }
