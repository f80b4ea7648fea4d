// What lies near a point: the rows of a track by the cells of a grid that their boxes touch.

/** Rows whose boxes touch more cells than this are kept aside and always looked at. */
const WIDE_CELLS = 64;
const MOST_CELLS_ACROSS = 256;

class Grid {
  constructor(track) {
    this.track = track;
    const extent = track.extent() || [0, 0, 1, 1];
    const size = Math.max(extent[2] - extent[0], extent[3] - extent[1]) || 1;
    this.across = Math.max(1, Math.min(MOST_CELLS_ACROSS, Math.ceil(Math.sqrt(track.count))));
    this.cell = size / this.across;
    this.left = extent[0];
    this.low = extent[1];
    this.fill();
  }

  /** The columns and rows of cells that a box touches, [first, last, first, last]. */
  cells(left, low, right, high) {
    const within = (value) => Math.max(0, Math.min(this.across - 1, Math.floor(value / this.cell)));
    return [
      within(left - this.left), within(right - this.left),
      within(low - this.low), within(high - this.low),
    ];
  }

  fill() {
    const { track, across } = this, wide = [], counts = new Int32Array(across * across + 1);
    const each = (row, use) => {
      const at = 4 * row, [c0, c1, r0, r1] = this.cells(...track.boxes.subarray(at, at + 4));
      if ((c1 - c0 + 1) * (r1 - r0 + 1) > WIDE_CELLS) return false;
      for (let r = r0; r <= r1; r++) for (let c = c0; c <= c1; c++) use(r * across + c);
      return true;
    };
    for (let row = 0; row < track.count; row++) {
      if (!each(row, (cell) => { counts[cell + 1]++; })) wide.push(row);
    }
    for (let cell = 0; cell < across * across; cell++) counts[cell + 1] += counts[cell];
    const next = counts.slice(), rows = new Int32Array(counts[across * across]);
    for (let row = 0; row < track.count; row++) each(row, (cell) => { rows[next[cell]++] = row; });
    this.starts = counts;
    this.rows = rows;
    this.wide = wide;
  }

  /** The row nearest to a point within `reach` mm of those that `counts`; −1 for none. Of rows
   * that lie on each other the one is taken for which `rank` is highest. */
  nearest(x, y, reach, counts, rank) {
    let best = -1, least = reach;
    const look = (row) => {
      const at = 4 * row, { boxes } = this.track;
      if (boxes[at] > x + reach || boxes[at + 1] > y + reach) return;
      if (boxes[at + 2] < x - reach || boxes[at + 3] < y - reach || !counts(row)) return;
      const far = this.track.distance(row, x, y), tie = Math.abs(far - least) < reach * 1e-6;
      if (far > least && !tie) return;
      if (tie && best >= 0 && rank(row) <= rank(best)) return;
      best = row;
      least = Math.min(far, least);
    };
    const [c0, c1, r0, r1] = this.cells(x - reach, y - reach, x + reach, y + reach);
    for (let r = r0; r <= r1; r++) {
      for (let c = c0; c <= c1; c++) {
        const cell = r * this.across + c;
        for (let at = this.starts[cell]; at < this.starts[cell + 1]; at++) look(this.rows[at]);
      }
    }
    this.wide.forEach(look);
    return best;
  }
}
