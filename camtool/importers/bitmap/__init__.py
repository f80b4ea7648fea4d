"""Pictures of pixels (PNG, JPEG), traced to contours or centre lines: `reader` reads them."""
