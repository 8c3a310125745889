"""The start pose of a recording without a camera, estimated from the readings of its colour sensor."""
