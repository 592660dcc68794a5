robomosp controller 1
name yaskawa_dx200
description "YASKAWA DX200 or YRC1000, six axes: pulses are examples; take those of your arm from its parameters"
target "inform"
axis A1 { pulses 1000 }
axis A2 { joint 2  pulses 1000 }
axis A3 { joint 3  pulses 1000 }
axis A4 { joint 4  pulses 800 }
axis A5 { joint 5  pulses 800 }
axis A6 { joint 6  pulses 500 }
option pl_mm { value "10" }
option postype { value "BASE" }
