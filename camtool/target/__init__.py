"""The contract of targets, the loader of machine files, and the registry of installed targets."""
