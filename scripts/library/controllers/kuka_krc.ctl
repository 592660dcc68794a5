robomosp controller 1
name kuka_krc
description "KUKA KR C4 or C5, six axes: check signs, offsets and limits of your arm"
target "krl"
axis A1 { }
axis A2 { joint 2 }
axis A3 { joint 3 }
axis A4 { joint 4 }
axis A5 { joint 5 }
axis A6 { joint 6 }
option acc_cp { value "2.3" }
option advance { value "3" }
option timer { value "1" }
option until_interrupt { value "20" }
