"""What people have already becomes demonstrations: bags of ROS, LeRobot's datasets, folders of images."""
