"""The window: events, the camera's orbit, text over the picture, files that are watched."""
