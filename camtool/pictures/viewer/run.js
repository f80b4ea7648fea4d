// The program along its time: which move runs when, and how far it has come.

class Run {
  /** `seconds` (N,) of each move. */
  constructor(seconds) {
    this.count = seconds.length;
    this.ends = new Float64Array(this.count);
    let sum = 0;
    for (let row = 0; row < this.count; row++) this.ends[row] = sum += seconds[row];
    this.total = sum;
    this.toEnd();
  }

  begins(row) { return row > 0 ? this.ends[row - 1] : 0; }

  toTime(time) {
    this.time = Math.min(this.total, Math.max(0, time));
    let low = 0, high = this.count - 1;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.ends[middle] > this.time) high = middle;
      else low = middle + 1;
    }
    const begin = this.begins(low), lasts = this.ends[low] - begin;
    this.row = low;
    this.share = lasts > 0 ? Math.min(1, (this.time - begin) / lasts) : 1;
  }

  /** To the end of a move. */
  toRow(row) {
    this.row = Math.min(this.count - 1, Math.max(0, row));
    this.share = 1;
    this.time = this.ends[this.row];
  }

  toStart() {
    this.toTime(0);
    this.share = this.time === this.ends[this.row] ? 1 : 0;
  }

  toEnd() { this.toRow(this.count - 1); }

  get isAtEnd() { return this.row === this.count - 1 && this.share === 1; }
}

/** Seconds as h:mm:ss.s */
function clock(seconds) {
  const tenths = Math.round(seconds * 10), whole = Math.floor(tenths / 10);
  const two = (number) => String(number).padStart(2, "0");
  const hours = Math.floor(whole / 3600), minutes = Math.floor(whole / 60) % 60;
  return `${hours}:${two(minutes)}:${two(whole % 60)}.${tenths % 10}`;
}
