robomosp controller 1
name mitsubishi_pa10
description "Mitsubishi PA-10 by its C library, seven axes"
target "pa10"
