robomosp controller 1
name ros2_trajectory
description "ROS 2 controller of joint trajectories, which has no outputs: check speeds and the names of joints"
target "joint_trajectory"
option step_mm { value "5" }
option step_deg { value "2" }
option joint_speed { value "60" }
