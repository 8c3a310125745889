"""A second truth world: planar equations of its own in continuous time, with laws that MuJoCo does not have."""
