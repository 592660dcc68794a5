robomosp controller 1
name robomosp_c
description "C program for a running ROBOMOSP"
target "c"
