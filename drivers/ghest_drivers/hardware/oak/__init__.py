"""OAK cameras through DepthAI 3: OAK-D SR and OAK-D (RVC2)."""
