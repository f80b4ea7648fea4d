// The stock as heights on a grid, cut move by move: forwards at once, backwards from copies.

/** Bytes of all copies of the grid, about. */
const COPIES_BYTES = 96e6;
/** Halvings of the place on a sloping move where a round corner is lowest. */
const HALVINGS = 32;

/** The profile of a tool: heights over its tip by the distance from its axis, mm; see
 * camtool/stock/cutters.py. */
class Cutter {
  constructor([radius, flat, corner, rise]) {
    Object.assign(this, { radius, flat, corner, rise, isFlat: !corner && !rise });
  }

  /** Height of its surface at a distance within its radius. */
  height(distance) {
    const out = distance - this.flat;
    if (out <= 0) return 0;
    if (!this.corner) return out * this.rise;
    const below = Math.min(out, this.corner);
    return this.corner - Math.sqrt(this.corner * this.corner - below * below);
  }

  /** How far from its axis it is this low, at most. */
  reach(height) {
    if (this.rise) return Math.min(this.radius, this.flat + height / this.rise);
    if (height >= this.corner) return this.radius;
    const up = this.corner - height;
    return this.flat + Math.sqrt(this.corner * this.corner - up * up);
  }
}

class Solid {
  /** `box` [left, low, right, high] mm of the stock with its top at 0; `grid` how many heights it
   * has along X and Y, the outermost on its edges; `turns` [[row, cutter]]: from which row on each
   * cuts; `slides` the moves of their tips; `begun` the heights before the first move, if not 0. */
  constructor({ box, grid }, turns, slides, begun = []) {
    [this.left, this.low] = box;
    [this.nx, this.ny] = grid;
    this.dx = (box[2] - box[0]) / (this.nx - 1);
    this.dy = (box[3] - box[1]) / (this.ny - 1);
    this.cell = Math.min(this.dx, this.dy);
    this.turns = turns;
    this.slides = slides;
    this.heights = new Float32Array(this.nx * this.ny);
    this.heights.set(begun);
    this.by = new Int32Array(this.nx * this.ny).fill(-1);
    this.row = this.share = 0;
    this.turn = 0;
    this.work = this.workOf();
    this.most = Math.max(2, Math.floor(COPIES_BYTES / (8 * this.heights.length)));
    this.copies = [this.copy()];
    this.clean();
  }

  /** Heights that are looked at before each move, about. */
  workOf() {
    const { count } = this.slides, work = new Float64Array(count + 1);
    for (let row = 0, turn = 0; row < count; row++) {
      while (turn + 1 < this.turns.length && this.turns[turn + 1][0] <= row) turn++;
      const [length, low] = this.slides.reach(row), cuts = low < 0 && this.turns.length;
      const width = cuts ? 2 * Math.min(this.turns[turn][1].radius, 50) : 0;
      work[row + 1] = work[row] + 1 + (cuts ? ((length + width) * width) / this.cell ** 2 : 0);
    }
    return work;
  }

  /** All rows of heights are as they were last uploaded. */
  clean() {
    this.dirty = [this.ny, -1];
  }

  copy() {
    const { row, share, turn } = this;
    return { row, share, turn, heights: this.heights.slice(), by: this.by.slice() };
  }

  /** Cut, or go back, towards a share of a move; true when it is there before `deadline` (ms). */
  toward(row, share, deadline = Infinity) {
    if (row < this.row || (row === this.row && share < this.share)) this.back(row, share);
    let next = this.copies[this.copies.length - 1].row;
    const every = this.work[this.slides.count] / this.most;
    while (this.row < row) {
      this.cutMove(this.row, this.share, 1);
      this.row++;
      this.share = 0;
      if (this.row > next && this.work[this.row] - this.work[next] >= every && this.copies.length < this.most) {
        this.copies.push(this.copy());
        next = this.row;
      }
      if (!(this.row & 15) && performance.now() > deadline) return false;
    }
    if (share > this.share) {
      this.cutMove(row, this.share, share);
      this.share = share;
    }
    return true;
  }

  /** To the last copy before a place. */
  back(row, share) {
    const found = this.copies.filter((one) => one.row < row || (one.row === row && one.share <= share)).pop();
    this.heights.set(found.heights);
    this.by.set(found.by);
    this.row = found.row;
    this.share = found.share;
    this.turn = found.turn;
    this.dirty = [0, this.ny - 1];
  }

  cutMove(row, from, to) {
    while (this.turn + 1 < this.turns.length && this.turns[this.turn + 1][0] <= row) this.turn++;
    if (!this.turns.length) return;
    const cutter = this.turns[this.turn][1];
    this.slides.pieces(row, from, to, (...piece) => this.cutLine(...piece, cutter, row));
  }

  /** Lower the heights below a tool that goes straight from x, y, z to u, v, w. */
  cutLine(x, y, z, u, v, w, cutter, row) {
    const lowest = Math.min(z, w);
    if (lowest >= 0 || !(cutter.radius > 0)) return;
    const reach = cutter.reach(-lowest), { nx, ny, dx, dy, heights, by } = this;
    const first = Math.max(0, Math.ceil((Math.min(y, v) - reach - this.low) / dy));
    const last = Math.min(ny - 1, Math.floor((Math.max(y, v) + reach - this.low) / dy));
    const length = Math.hypot(u - x, v - y), level = z === w || length < 1e-9;
    const ux = length ? (u - x) / length : 0, uy = length ? (v - y) / length : 0;
    const slope = level ? 0 : (w - z) / length, flat = cutter.isFlat && level, radius = cutter.radius;
    const square = reach * reach, low32 = Math.fround(lowest);
    // The sides of what the tool covers, from above.
    const sideX = -uy * reach, sideY = ux * reach;
    for (let j = first; j <= last; j++) {
      const py = this.low + j * dy;
      let left = Infinity, right = -Infinity;
      let room = square - (py - y) * (py - y);
      if (room >= 0) {
        const half = Math.sqrt(room);
        left = x - half;
        right = x + half;
      }
      room = square - (py - v) * (py - v);
      if (room >= 0) {
        const half = Math.sqrt(room);
        left = Math.min(left, u - half);
        right = Math.max(right, u + half);
      }
      if (uy) {
        for (let side = -1; side <= 1; side += 2) {
          const along = (py - y - side * sideY) / uy;
          if (along < 0 || along > length) continue;
          const at = x + side * sideX + along * ux;
          left = Math.min(left, at);
          right = Math.max(right, at);
        }
      }
      const begin = Math.max(0, Math.ceil((left - this.left) / dx - 1e-9));
      const end = Math.min(nx - 1, Math.floor((right - this.left) / dx + 1e-9));
      if (begin > end) continue;
      if (j < this.dirty[0]) this.dirty[0] = j;
      if (j > this.dirty[1]) this.dirty[1] = j;
      const base = j * nx;
      if (flat) {
        for (let k = base + begin; k <= base + end; k++) {
          if (low32 < heights[k]) {
            heights[k] = low32;
            by[k] = row;
          }
        }
        continue;
      }
      for (let i = begin; i <= end; i++) {
        const px = this.left + i * dx, k = base + i;
        const along = (px - x) * ux + (py - y) * uy;
        let height;
        if (level) {
          const on = Math.min(length, Math.max(0, along));
          const off = Math.hypot(px - x - on * ux, py - y - on * uy);
          height = lowest + cutter.height(Math.min(off, radius));
        } else {
          const aside = Math.abs((px - x) * uy - (py - y) * ux);
          height = z + lowestOn(cutter, slope, along, aside, length);
        }
        height = Math.fround(height);
        if (height < heights[k]) {
          heights[k] = height;
          by[k] = row;
        }
      }
    }
  }

  /** The height at a place, mm, between those of the grid; NaN beside the stock. */
  heightAt(x, y) {
    const across = (x - this.left) / this.dx, up = (y - this.low) / this.dy, { nx, ny, heights } = this;
    if (!(across >= 0 && up >= 0 && across <= nx - 1 && up <= ny - 1)) return NaN;
    const i = Math.min(nx - 2, Math.floor(across)), j = Math.min(ny - 2, Math.floor(up));
    const s = across - i, t = up - j, k = j * nx + i;
    return (1 - t) * ((1 - s) * heights[k] + s * heights[k + 1])
      + t * ((1 - s) * heights[k + nx] + s * heights[k + nx + 1]);
  }
}

/** The least of slope · s + profile(distance) over the places s, 0 … length, of a move from which
 * the tool covers a point that lies `along` and `aside` of its start; Infinity where none does. */
function lowestOn(cutter, slope, along, aside, length) {
  const { radius, flat, corner, rise } = cutter, room = radius * radius - aside * aside;
  if (room < 0) return Infinity;
  const half = Math.sqrt(room), from = Math.max(0, along - half), to = Math.min(length, along + half);
  if (from > to) return Infinity;
  const at = (s) => slope * s + cutter.height(Math.hypot(aside, along - s));
  const within = (s) => Math.min(to, Math.max(from, s));
  // Downhill is ahead on a falling move, behind on a rising one.
  const down = slope < 0 ? 1 : -1;
  if (cutter.isFlat) return slope * (down > 0 ? to : from);
  if (rise) {
    const tip = Math.sqrt(Math.max(flat * flat - aside * aside, 0)), steep = Math.abs(slope) / rise;
    // Beyond the flat tip the cone rises less steeply than the move falls, up to this far.
    const off = steep < 1 ? Math.max(tip, (steep * aside) / Math.sqrt(1 - steep * steep)) : half;
    return at(within(along + down * off));
  }
  if (!flat) {
    const ball = Math.max(corner * corner - aside * aside, 0);
    return at(within(along + down * Math.abs(slope) * Math.sqrt(ball / (1 + slope * slope))));
  }
  let low = from, high = to;
  for (let k = 0; k < HALVINGS; k++) {
    const one = low + (high - low) * 0.382, other = high - (high - low) * 0.382;
    if (at(one) <= at(other)) high = other;
    else low = one;
  }
  return at(0.5 * (low + high));
}
