"""The simulated clinic: a patient in an exoskeleton, two cameras, encoders, and the truth (extra `sim`).

What makes the truth shares no code with what is judged by it: nothing here imports vision, kinematics, sync or estimation.
"""
