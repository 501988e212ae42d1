"""The node: JointState in, foot poses out. `joint_*` and `pose_*` modules need no rclpy."""
