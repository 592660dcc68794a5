robomosp controller 1
name staubli_cs8
description "Staubli CS8 or CS9, six axes: check signs, offsets, version, and the links of signals and of the tool"
target "val3"
axis J1 { }
axis J2 { joint 2 }
axis J3 { joint 3 }
axis J4 { joint 4 }
axis J5 { joint 5 }
axis J6 { joint 6 }
option version { value "s7.11" }
option io_module { value "BasicIO-1" }
option tool_io { value "valve1" }
