robomosp controller 1
name fanuc_r30ib
description "FANUC R-30iB, six axes: an example; check that J3 counts from the arm, UTOOL and UFRAME, and free registers"
target "fanuc_tp"
axis J1 { }
axis J2 { joint 2 }
axis J3 { joint 3 }
axis J4 { joint 4 }
axis J5 { joint 5 }
axis J6 { joint 6 }
option first_register { value "1" }
option first_flag { value "1" }
option cnt_mm { value "100" }
