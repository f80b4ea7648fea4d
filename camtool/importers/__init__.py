"""Drawing files to Drawing, one file per format."""
