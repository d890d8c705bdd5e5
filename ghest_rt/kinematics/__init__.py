"""Where the links of the exoskeleton are: URDF, forward kinematics, and equations (6) and (7) of the paper."""
