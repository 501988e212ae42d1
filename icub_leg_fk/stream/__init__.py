"""Bytes in, bytes out: serialized joint states to serialized poses; free of rclpy."""
