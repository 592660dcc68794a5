robomosp controller 1
name melfa_cr800
description "Mitsubishi CR750 or CR800, six axes: check signs, offsets and flags of one pose, and numbers of signals"
target "melfa5"
axis J1 { }
axis J2 { joint 2 }
axis J3 { joint 3 }
axis J4 { joint 4 }
axis J5 { joint 5 }
axis J6 { joint 6 }
option ptp_radius { value "50" }
