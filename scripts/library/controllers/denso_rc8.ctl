robomosp controller 1
name denso_rc8
description "DENSO RC8, six axes: an example; check max_speed, signs and offsets, and compare one pose and its figure"
target "pacscript"
axis J1 { }
axis J2 { joint 2 }
axis J3 { joint 3 }
axis J4 { joint 4 }
axis J5 { joint 5 }
axis J6 { joint 6 }
max_speed 8
option orientation { value "fixed_xyz" }
option fig_xor { value "5" }
