"""Where on a course a recording without a camera began, found from what its colour sensor read."""
