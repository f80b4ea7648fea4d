"""Drawing files to Drawing: `read` finds the format and its reader; one package per format."""
