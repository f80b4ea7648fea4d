// The page's data: a head of words (JSON) and columns of numbers (base64, little-endian).

const NUMBERS = { u1: Uint8Array, f4: Float32Array };

/** name -> typed array, by the head's `columns` {name: [type, byte offset, count, unit]}. */
function readColumns(columns, base64) {
  const text = atob(base64.trim());
  const bytes = new Uint8Array(text.length);
  for (let at = 0; at < text.length; at++) bytes[at] = text.charCodeAt(at);
  const named = {};
  for (const [name, [type, offset, count, unit]] of Object.entries(columns)) {
    if (type[0] === "v") named[name] = summed(bytes, offset, count, Number(type[1]), unit);
    else named[name] = new NUMBERS[type](bytes.buffer, offset, count);
  }
  named.move_feed = repeated(named.feed_value, named.feed_count);
  return named;
}

/** Each of the values as often as its count says. */
function repeated(values, counts) {
  const all = new Float32Array(counts.reduce((sum, count) => sum + count, 0));
  for (let k = 0, at = 0; k < values.length; at += counts[k], k++) all.fill(values[k], at, at + counts[k]);
  return all;
}

/** Numbers from their differences to the number `stride` before, of 7 bits a byte; floats where
 * they have a unit. */
function summed(bytes, at, count, stride, unit) {
  const sums = new (unit ? Float64Array : Int32Array)(count);
  for (let k = 0; k < count; k++) {
    let size = 0, weight = 1, byte = 128;
    for (; byte & 128; weight *= 128) {
      byte = bytes[at++];
      size += (byte & 127) * weight;
    }
    const half = Math.floor(size / 2);
    sums[k] = (size % 2 ? -1 - half : half) + (k < stride ? 0 : sums[k - stride]);
  }
  return unit ? sums.map((sum) => sum * unit) : sums;
}

/** The straight moves of the tips, and which of them each row of the toolpath makes. */
class Slides {
  /** `at` (3 K + 3) mm: where the first begins and each ends; `counts` (N,) of each row. */
  constructor(at, counts) {
    this.at = at;
    this.count = counts.length;
    this.first = new Int32Array(this.count + 1);
    for (let row = 0; row < this.count; row++) this.first[row + 1] = this.first[row] + counts[row];
  }

  /** Call use(x, y, z, u, v, w) for each straight piece between two shares of a row's length. */
  pieces(row, from, to, use) {
    const { at, first } = this;
    const size = (k) => Math.hypot(at[3 * k + 3] - at[3 * k], at[3 * k + 4] - at[3 * k + 1], at[3 * k + 5] - at[3 * k + 2]);
    let whole = 0, passed = 0;
    for (let k = first[row]; k < first[row + 1]; k++) whole += size(k);
    for (let k = first[row]; k < first[row + 1]; k++) {
      const length = size(k);
      if (!length) continue;
      const begin = Math.max(0, (from * whole - passed) / length);
      const end = to < 1 ? Math.min(1, (to * whole - passed) / length) : 1;
      passed += length;
      if (begin >= 1 || end <= 0) continue;
      const [x, y, z, u, v, w] = at.subarray(3 * k, 3 * k + 6);
      const [dx, dy, dz] = [u - x, v - y, w - z];
      const last = end < 1 ? [x + end * dx, y + end * dy, z + end * dz] : [u, v, w];
      use(x + begin * dx, y + begin * dy, z + begin * dz, ...last);
    }
  }

  /** [x, y, z] mm of the tip at a share of a row. */
  place(row, share) {
    let found = this.at.slice(3 * this.first[row], 3 * this.first[row] + 3);
    this.pieces(row, 0, share, (x, y, z, ...end) => { found = end; });
    return found;
  }

  /** [length along X and Y, lowest Z] mm of a row; Infinity where it does not move. */
  reach(row) {
    let length = 0, low = Infinity;
    for (let k = this.first[row]; k < this.first[row + 1]; k++) {
      const [x, y, z, u, v, w] = this.at.subarray(3 * k, 3 * k + 6);
      length += Math.hypot(u - x, v - y);
      low = Math.min(low, z, w);
    }
    return [length, low];
  }
}

/** The moves of the toolpath, each of which begins where the one before ended. */
function movesTrack(columns) {
  const ends = columns.move_end, count = columns.move_kind.length;
  const from = new Float64Array(2 * count), to = new Float64Array(2 * count);
  let x = columns.move_start[0], y = columns.move_start[1];
  for (let row = 0; row < count; row++) {
    from[2 * row] = x;
    from[2 * row + 1] = y;
    to[2 * row] = x = ends[3 * row];
    to[2 * row + 1] = y = ends[3 * row + 1];
  }
  return new Track(from, to, columns.move_arc, columns.move_bend);
}

/** The wanted path: each line or arc begins at the end of the one before, except at a break. */
function wantedTrack(columns) {
  const { wanted_to: to, wanted_begin: begins, wanted_break: breaks } = columns;
  const from = new Float64Array(to.length);
  if (to.length) from.set(to.subarray(0, to.length - 2), 2);
  breaks.forEach((row, index) => from.set(begins.subarray(2 * index, 2 * index + 2), 2 * row));
  return new Track(from, Float64Array.from(to), columns.wanted_arc, columns.wanted_bend);
}

/** The lines and arcs of the drawing. */
function drawingTrack(columns) {
  return new Track(
    Float64Array.from(columns.drawn_from), Float64Array.from(columns.drawn_to),
    columns.drawn_arc, columns.drawn_bend,
  );
}

// Lines and arcs in columns, their boxes, and their distances from a point.

/** `from`, `to` (2 N) mm; `arcs` rows that are arcs, `bends` their centre x, y and sweep. */
class Track {
  constructor(from, to, arcs, bends) {
    this.count = from.length / 2;
    this.from = from;
    this.to = to;
    this.bend = new Int32Array(this.count).fill(-1);
    this.bends = bends;
    arcs.forEach((row, index) => { this.bend[row] = index; });
    this.boxes = new Float64Array(4 * this.count);
    for (let row = 0; row < this.count; row++) this.setBox(row);
  }

  /** {x, y, radius, angle, sweep} of an arc, null for a line. */
  arc(row) {
    const index = this.bend[row];
    if (index < 0) return null;
    const x = this.bends[3 * index], y = this.bends[3 * index + 1];
    const outX = this.from[2 * row] - x, outY = this.from[2 * row + 1] - y;
    const radius = Math.hypot(outX, outY);
    return { x, y, radius, angle: Math.atan2(outY, outX), sweep: this.bends[3 * index + 2] };
  }

  length(row) {
    const arc = this.arc(row), { from, to } = this;
    if (arc) return arc.radius * Math.abs(arc.sweep);
    return Math.hypot(to[2 * row] - from[2 * row], to[2 * row + 1] - from[2 * row + 1]);
  }

  setBox(row) {
    const { from, to, boxes } = this, x0 = from[2 * row], y0 = from[2 * row + 1];
    const x1 = to[2 * row], y1 = to[2 * row + 1];
    let box = [Math.min(x0, x1), Math.min(y0, y1), Math.max(x0, x1), Math.max(y0, y1)];
    const arc = this.arc(row);
    // An arc is outermost at its ends or at a multiple of 90°.
    if (arc) {
      const low = Math.min(arc.angle, arc.angle + arc.sweep), high = low + Math.abs(arc.sweep);
      for (let quarter = Math.ceil(low / QUARTER); quarter * QUARTER <= high; quarter++) {
        const x = arc.x + arc.radius * Math.cos(quarter * QUARTER);
        const y = arc.y + arc.radius * Math.sin(quarter * QUARTER);
        box = [Math.min(box[0], x), Math.min(box[1], y), Math.max(box[2], x), Math.max(box[3], y)];
      }
    }
    boxes.set(box, 4 * row);
  }

  /** [x, y] mm at a share 0 … 1 of a row's length. */
  at(row, share) {
    const { from, to } = this, arc = this.arc(row);
    if (arc && share < 1) {
      const angle = arc.angle + share * arc.sweep;
      return [arc.x + arc.radius * Math.cos(angle), arc.y + arc.radius * Math.sin(angle)];
    }
    return [0, 1].map((k) => from[2 * row + k] + share * (to[2 * row + k] - from[2 * row + k]));
  }

  /** Distance of a point from the move, mm. */
  distance(row, x, y) {
    const arc = this.arc(row), { from, to } = this;
    if (arc) {
      const angle = Math.atan2(y - arc.y, x - arc.x), sense = Math.sign(arc.sweep) || 1;
      const turned = (((angle - arc.angle) * sense) % TURN + TURN) % TURN;
      if (turned <= Math.abs(arc.sweep)) return Math.abs(Math.hypot(x - arc.x, y - arc.y) - arc.radius);
      const ends = [[from[2 * row], from[2 * row + 1]], [to[2 * row], to[2 * row + 1]]];
      return Math.min(...ends.map(([u, v]) => Math.hypot(x - u, y - v)));
    }
    const x0 = from[2 * row], y0 = from[2 * row + 1];
    const dx = to[2 * row] - x0, dy = to[2 * row + 1] - y0, square = dx * dx + dy * dy;
    const share = square ? Math.min(1, Math.max(0, ((x - x0) * dx + (y - y0) * dy) / square)) : 0;
    return Math.hypot(x - x0 - share * dx, y - y0 - share * dy);
  }

  /** [left, low, right, high] mm of all rows, null when there are none. */
  extent() {
    if (!this.count) return null;
    const whole = [Infinity, Infinity, -Infinity, -Infinity];
    for (let at = 0; at < this.boxes.length; at += 4) {
      for (let k = 0; k < 2; k++) {
        if (this.boxes[at + k] < whole[k]) whole[k] = this.boxes[at + k];
        if (this.boxes[at + k + 2] > whole[k + 2]) whole[k + 2] = this.boxes[at + k + 2];
      }
    }
    return whole;
  }
}

const QUARTER = Math.PI / 2, TURN = 2 * Math.PI;

// The rows of a track near a point, by the cells of a grid that their boxes touch.

/** A row whose box touches more cells than this is in none of them, and always examined. */
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

  /** Of the rows for which `counts` is true, the one nearest to a point within `reach` mm; −1 for
   * none. Of rows that lie on each other, the one with the highest `rank`. */
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
