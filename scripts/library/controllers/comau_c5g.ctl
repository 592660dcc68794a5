robomosp controller 1
name comau_c5g
description "Comau C5G, six axes: check signs, offsets, arm, and the timer that waits use"
target "pdl2"
axis A1 { }
axis A2 { joint 2 }
axis A3 { joint 3 }
axis A4 { joint 4 }
axis A5 { joint 5 }
axis A6 { joint 6 }
option arm { value "1" }
option timer { value "1" }
