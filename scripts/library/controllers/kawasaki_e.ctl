robomosp controller 1
name kawasaki_e
description "Kawasaki E or F controller, six axes: check signs, offsets, and the base of inputs"
target "as"
axis JT1 { }
axis JT2 { joint 2 }
axis JT3 { joint 3 }
axis JT4 { joint 4 }
axis JT5 { joint 5 }
axis JT6 { joint 6 }
option input_base { value "1000" }
option timer { value "1" }
