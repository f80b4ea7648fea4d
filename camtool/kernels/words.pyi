from camtool.arrays import Floats, Ints, Octets

FACT_COLUMNS: int
FORM: int
F_WORD: int
G_WORD: int
I_WORD: int
J_WORD: int
LINE: int
MASK: int
MAX_NUMBER_CHARS: int
ONE_BLANK: int
TWO_DIGITS: int
X_WORD: int
Y_WORD: int
Z_WORD: int

def put_words(
    values: Ints,
    written: Octets,
    fixed: Octets,
    fixed_ends: Ints,
    styles: Ints,
    blanks: bool,
    out: Octets,
    ends: Ints,
) -> None: ...
def plain_lines(
    data: Octets, at: int, line: int, most_chars: int, free: bool, numbers: Floats, facts: Ints
) -> tuple[int, int, int]: ...
