// Lines and arcs in columns: where they are, and how far from a point.

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
    // Each quarter that the arc passes may be its outermost point.
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

  /** [x, y] mm at a share 0 … 1 of the way. */
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
      const angle = Math.atan2(y - arc.y, x - arc.x), way = Math.sign(arc.sweep) || 1;
      const turned = (((angle - arc.angle) * way) % TURN + TURN) % TURN;
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
