"""The rclpy node `foot_pose_publisher`."""
