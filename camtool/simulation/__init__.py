"""Controller models: Toolpath and machine to Motion."""
