"""From marker poses and joint angles to the glenohumeral joint: equations (8) to (10), angles, uncertainty, the pipeline."""
