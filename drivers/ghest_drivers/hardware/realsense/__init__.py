"""RealSense cameras through pyrealsense2: SR300 first, D405 and the rest of the D400 family through the same code."""
