"""What a target must offer, the loader of machine files, and how targets are found."""
