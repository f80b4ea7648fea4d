cdef extern from "wide.h":
    # The return type of a function that is compiled for several processors; such a function
    # returns nothing, because the attribute would otherwise also stand before a variable.
    ctypedef void wide "CAMTOOL_WIDE void"
