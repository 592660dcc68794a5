robomosp controller 1
name nist_crcl
description "Controller that takes CRCL: check the names of parameters that its outputs have"
target "crcl"
option tolerance { value "0.1" }
