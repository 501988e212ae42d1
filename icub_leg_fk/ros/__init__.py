"""The node: JointState in, foot poses out. `joint_*` and `*_cdr` modules need no rclpy."""
