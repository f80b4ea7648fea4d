from camtool.arrays import Floats, Ints

QUARTERS: Floats

class StockTree:
    top: float
    def __init__(
        self, moves: Floats, tool: Ints, number: Ints, tools: Floats, top: float
    ) -> None: ...
    def heights(
        self, points: Floats, before: Ints | None = None, grow: float = 0.0
    ) -> tuple[Floats, Ints]: ...
    def min_heights(self, squares: Floats, grow: float = 0.0) -> Floats: ...
    def max_heights(
        self,
        squares: Floats,
        tilt: Floats | None = None,
        grow: float = 0.0,
        before: Ints | None = None,
    ) -> Floats: ...
    def max_heights_over(
        self,
        corners: Floats,
        values: Floats,
        grow: float = 0.0,
        before: Ints | None = None,
        enough: float = ...,
    ) -> Floats: ...
    def quarter_means(self, squares: Floats, bottom: float = ...) -> tuple[Floats, Floats]: ...

def heights_of_moves(moves: Floats, tools: Floats, points: Floats, grow: Floats) -> Floats: ...
def thinned(points: Floats, row: Ints, start: Floats, tolerance: float) -> Ints: ...
