"""The far side of a CANopen bus: encoder nodes played by the canopen package."""

import struct
import threading

import canopen

from ghest_drivers.hardware.encoders.canopen_objects import object_dictionary

NODES = (5, 6)


class Encoders:
    """Two encoder nodes that send their position every 5 ms, or at each SYNC."""

    def __init__(self, channel: str, with_speed_first: bool = False) -> None:
        self.network = canopen.Network()
        self.network.NOTIFIER_CYCLE = 0.02  # so that it ends soon
        self.network.connect(interface="virtual", channel=channel)
        self.nodes = {}
        for node_id in NODES:
            node = canopen.LocalNode(node_id, object_dictionary(node_id, 1))
            if with_speed_first:
                node.sdo[0x1A00][0].raw = 2
                node.sdo[0x1A00][1].raw = 0x6030 << 16 | 1 << 8 | 16
                node.sdo[0x1A00][2].raw = 0x6004 << 16 | 32
            self.network.add_node(node)
            self.nodes[node_id] = node
        self.prefix = b"\x11\x22" if with_speed_first else b""
        self.position = 0
        self.silent: set[int] = set()
        self.network.subscribe(0x80, lambda *_: self.send(by_sync=True))
        self.stop = threading.Event()
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def run(self) -> None:
        while not self.stop.wait(0.005):
            self.send(by_sync=False)

    def send(self, by_sync: bool) -> None:
        self.position += 1
        for node_id, node in self.nodes.items():
            synchronous = node.sdo[0x1800][2].raw == 1
            if node.nmt.state == "OPERATIONAL" and synchronous == by_sync and node_id not in self.silent:
                data = self.prefix + struct.pack("<I", 1000 * node_id + self.position)
                self.network.send_message(0x180 + node_id, data)

    def close(self) -> None:
        self.stop.set()
        self.thread.join()
        self.network.disconnect()
