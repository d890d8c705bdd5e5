"""Hardware encoder links: serial, CAN, CANopen, and the exports of Armeocontrol.

Bytes or frames become raw readings in pure decoders, readings become samples in `builder`, and `link` hands samples to
whoever waits for them. Only the `*_link` modules do I/O.
"""
