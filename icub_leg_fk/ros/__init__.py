"""The node: JointState in, foot poses out; `joint_input`, `cdr`, `configuration` need no rclpy."""
