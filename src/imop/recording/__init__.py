"""Recording a demonstration: raw frames to disk as they come, keyframes that a person can change, a store."""
