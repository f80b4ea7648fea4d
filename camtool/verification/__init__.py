"""Motion against what was wanted: errors, findings, report."""
