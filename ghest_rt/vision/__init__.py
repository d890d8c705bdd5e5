"""From one RGB-D frame to the pose of one marker: the paper's eq. (1)-(5), our refinement of them, and ArUco as the rival."""
