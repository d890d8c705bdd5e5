"""From one RGB-D frame to the pose of one marker in the camera: the paper's eq. (1)-(5), our refinement of it, and ArUco as rival."""
