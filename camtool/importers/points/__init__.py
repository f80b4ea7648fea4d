"""Points as text, JSON, NumPy files and the arrays of the Matlab router: `reader` reads them."""
