"""The ray path: camera, packet traversal and triangle test."""
