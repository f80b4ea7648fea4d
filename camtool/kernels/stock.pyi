from camtool.arrays import Floats, Ints

class StockTree:
    top: float
    def __init__(
        self, moves: Floats, tool: Ints, number: Ints, tools: Floats, top: float
    ) -> None: ...
    def heights(
        self, points: Floats, before: Ints | None = None, grow: float = 0.0
    ) -> tuple[Floats, Ints]: ...
    def least(self, squares: Floats, grow: float = 0.0) -> Floats: ...
    def greatest(
        self, squares: Floats, tilt: Floats | None = None, grow: float = 0.0
    ) -> Floats: ...
