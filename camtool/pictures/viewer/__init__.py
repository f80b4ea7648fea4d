"""The viewer: one HTML file that holds its own data, styles and script, and needs no network."""
