"""A toolpath bent beforehand, so that the slides come out where it was wanted (`compensated`).

wanted ─linear─▶ as the motors must go: scale and squareness undone, arcs stay arcs
       ─take up─▶ play taken up at reversals, and what the controller compensates wrongly
"""

from camtool.planning.compensating.compensate import compensated

__all__ = ["compensated"]
