robomosp controller 1
name abb_irc5
description "ABB IRC5 or OmniCore, six axes: check signs, offsets and limits of your arm"
target "rapid"
axis rax_1 { }
axis rax_2 { joint 2 }
axis rax_3 { joint 3 }
axis rax_4 { joint 4 }
axis rax_5 { joint 5 }
axis rax_6 { joint 6 }
max_speed 5
option main { value "main" }
option conf_j { value "On" }
option conf_l { value "Off" }
option tool_mass { value "1" }
option zone_ptp { value "200" }
option zone_pass { value "10" }
