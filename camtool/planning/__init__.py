"""Drawing and job to Toolpath."""
