"""Letters of DXF drawings as curves: fonts, layout, and the codes of MTEXT."""
