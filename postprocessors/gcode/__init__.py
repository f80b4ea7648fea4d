"""What dialects of G-code share."""
