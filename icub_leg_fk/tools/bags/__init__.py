"""Reading and writing rosbag2 recordings, and adding poses to them."""
