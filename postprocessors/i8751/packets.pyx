"""Records of i8751 packets read from their bytes, many in a row.

Whole numbers only. Compiled, because a program has millions of bytes.
"""

from __future__ import annotations

from camtool.kernels.types cimport Int

from camtool.arrays import Ints, Octets

cpdef enum:
    # Columns of a record: the steps of its motors, signed as their senses are (03H is +), and the
    # seconds before and after Z.
    X = 0, Y, Z, BEFORE, AFTER
    COLUMNS = 5
    _FORWARD = 3, _BACKWARD = 4, _STANDS = 5, _KEY = 19, _PACKET_END = 69, _DATA_END = 84


cdef Int _motor(
    const unsigned char[::1] data, Int at, Int number, (Int, Int) pulses, Int[::1] record,
    Int column
) noexcept:
    """Read the bytes of a motor; return where they end, −1 when they are none or it turns for 0
    pulses."""
    cdef Int high_steps, lost, sense, count
    high_steps, lost = pulses
    if at < 0 or at + 2 > len(data) or data[at] != number:
        return -1
    sense = data[at + 1]
    if sense == _STANDS:
        record[column] = 0
        return at + 2
    if at + 4 > len(data) or (sense != _FORWARD and sense != _BACKWARD):
        return -1
    count = data[at + 2] * high_steps + data[at + 3]
    if count == 0:
        return -1
    record[column] = count - lost if sense == _FORWARD else lost - count
    return at + 4


cdef Int _wait(
    const unsigned char[::1] data, Int at, Int mark, Int[::1] record, Int column
) noexcept:
    """Read the bytes of a wait; return where they end, −1 when they are none."""
    if at < 0 or at + 2 > len(data) or data[at] != mark:
        return -1
    record[column] = data[at + 1]
    return at + 2


cpdef (Int, Int, Int) records_in_a_row(
    const unsigned char[::1] data, (Int, Int) place, (Int, Int, Int, Int, bint) rules,
    Int[:, ::1] records
) noexcept:
    """Read records into `records` (R, 5), at most R, up to the first that is none, or to the end
    of a packet that no packet follows. Return how many were read, where it stopped, and how many
    records of the last packet were read.

    `place`: the byte to begin at and how many records of its packet were read before; `rules`: the
    most records of a packet, the pulses that a high byte counts, those that are lost at each
    start, the byte before a wait, and whether the key stands before each packet.
    """
    cdef Int at, inside, max_records, high_steps, lost, mark, rows, size, behind, end
    cdef bint keys
    at, inside = place
    max_records, high_steps, lost, mark, keys = rules
    rows, size = 0, len(data)
    while rows < len(records):
        if inside > 0 and at < size and data[at] == _PACKET_END:
            behind = at + (2 if keys else 1)
            if behind >= size or data[behind] == _DATA_END or (keys and data[at + 1] != _KEY):
                break
            at, inside = behind, 0
        if inside == max_records:
            break
        end = _motor(data, at, 1, (high_steps, lost), records[rows], X)
        end = _motor(data, end, 2, (high_steps, lost), records[rows], Y)
        end = _wait(data, end, mark, records[rows], BEFORE)
        end = _motor(data, end, 3, (high_steps, lost), records[rows], Z)
        end = _wait(data, end, mark, records[rows], AFTER)
        if end < 0:
            break
        at, inside, rows = end, inside + 1, rows + 1
    return rows, at, inside
