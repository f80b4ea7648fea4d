"""Letters of drawings as curves: fonts, layout, and the codes of MTEXT."""
