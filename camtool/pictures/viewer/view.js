// Which part of the work frame the canvases show.

const FIT_MARGIN = 0.06;
const LEAST_MM_ACROSS = 1e-4;
const NEAR_PX = 12;

class View {
  constructor() {
    this.width = this.height = 1;
    this.x = this.y = 0;
    this.scale = 1;
  }

  /** A size in CSS pixels. */
  resize(width, height) {
    this.width = Math.max(1, width);
    this.height = Math.max(1, height);
  }

  fit([left, low, right, high]) {
    const room = 1 - 2 * FIT_MARGIN;
    const wide = Math.max(right - left, LEAST_MM_ACROSS), tall = Math.max(high - low, LEAST_MM_ACROSS);
    this.scale = Math.min((this.width * room) / wide, (this.height * room) / tall);
    this.x = (left + right) / 2;
    this.y = (low + high) / 2;
    this.isFitted = true;
  }

  px(x) { return (x - this.x) * this.scale + this.width / 2; }
  py(y) { return (this.y - y) * this.scale + this.height / 2; }
  mmX(px) { return (px - this.width / 2) / this.scale + this.x; }
  mmY(py) { return this.y - (py - this.height / 2) / this.scale; }

  pan(dx, dy) {
    this.x -= dx / this.scale;
    this.y += dy / this.scale;
    this.isFitted = false;
  }

  /** Zoom about a point of the canvas, which stays where it is. */
  zoom(factor, px, py) {
    const x = this.mmX(px), y = this.mmY(py);
    const most = this.width / LEAST_MM_ACROSS;
    this.scale = Math.min(most, Math.max(most * 1e-12, this.scale * factor));
    this.x = x - (px - this.width / 2) / this.scale;
    this.y = y + (py - this.height / 2) / this.scale;
    this.isFitted = false;
  }

  copy() { return Object.assign(new View(), this); }

  /** [left, low, right, high] mm, and so many mm more on each side. */
  box(more = 0) {
    const { width, height } = this;
    return [this.mmX(0) - more, this.mmY(height) - more, this.mmX(width) + more, this.mmY(0) + more];
  }

  /** Whether a line on the canvas lies beyond one of its edges. */
  isBeside(x0, y0, x1, y1) {
    const beyond = (a, b, size) => (a < -NEAR_PX && b < -NEAR_PX) || (a > size + NEAR_PX && b > size + NEAR_PX);
    return beyond(x0, x1, this.width) || beyond(y0, y1, this.height);
  }

  /** Whether a place on the canvas is to be seen, or not far from that. */
  shows(px, py) {
    return px > -NEAR_PX && py > -NEAR_PX && px < this.width + NEAR_PX && py < this.height + NEAR_PX;
  }
}
