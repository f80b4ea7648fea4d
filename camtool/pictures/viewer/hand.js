// The mouse, fingers and keys on the picture.

const REACH_PX = 8;
const CLICK_PX = 4;
const WHEEL_RATE = 0.0015;
const KEY_ZOOM = 1.4;
const KEY_PAN_PX = 60;

/** Drag to move, wheel or two fingers to zoom, hover to ask, click to go there. */
class Hand {
  constructor(stage, hovered, clicked) {
    this.stage = stage;
    this.hovered = hovered;
    this.fingers = new Map();
    const { place } = stage, at = (event) => {
      const box = place.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    place.addEventListener("wheel", (event) => {
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 30 : 1;
      stage.view.zoom(Math.exp(-event.deltaY * lines * WHEEL_RATE), ...at(event));
      stage.changed();
    }, { passive: false });
    place.addEventListener("pointerdown", (event) => {
      place.setPointerCapture(event.pointerId);
      this.fingers.set(event.pointerId, at(event));
      this.travel = 0;
    });
    place.addEventListener("pointermove", (event) => {
      if (this.fingers.has(event.pointerId)) this.drag(event.pointerId, at(event));
      else this.hover(...at(event));
    });
    const lift = (event) => {
      const tapped = this.fingers.delete(event.pointerId) && this.travel < CLICK_PX;
      if (tapped && event.type === "pointerup") clicked();
    };
    place.addEventListener("pointerup", lift);
    place.addEventListener("pointercancel", lift);
    place.addEventListener("pointerleave", () => hovered(-1, -1, 0, 0));
    place.addEventListener("dblclick", () => stage.fit());
  }

  drag(id, [x, y]) {
    const { view } = this.stage, [oldX, oldY] = this.fingers.get(id);
    this.travel += Math.hypot(x - oldX, y - oldY);
    const other = [...this.fingers].find(([finger]) => finger !== id);
    if (other) {
      const [u, v] = other[1], before = Math.hypot(oldX - u, oldY - v);
      if (before > 0) view.zoom(Math.hypot(x - u, y - v) / before, u, v);
    } else view.pan(x - oldX, y - oldY);
    this.fingers.set(id, [x, y]);
    this.stage.changed();
  }

  hover(px, py) {
    const { view, layers, grids, run } = this.stage, reach = REACH_PX / view.scale;
    const x = view.mmX(px), y = view.mmY(py);
    // What has been done counts before what is still to come.
    const rank = (row) => (run.row < row ? -row : row);
    const move = grids.moves().nearest(x, y, reach, (row) => layers.shows(row), rank);
    const { drawn_layer: of } = layers.columns, shown = (row) => layers.on.get(`drawing ${of[row]}`);
    const drawn = grids.drawing().nearest(x, y, reach, shown, (row) => row);
    this.hovered(move, drawn, px, py);
  }
}

/** What each key does; false for a key that means nothing here. */
function pressed(event, { stage, player, panel }) {
  const { view } = stage, middle = [view.width / 2, view.height / 2];
  const pan = (dx, dy) => { view.pan(dx * KEY_PAN_PX, dy * KEY_PAN_PX); stage.changed(); };
  const zoom = (factor) => { view.zoom(factor, ...middle); stage.changed(); };
  const step = (way) => player && player.toRow(player.run.row + way);
  const arrows = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  if (event.shiftKey && arrows[event.key]) { pan(...arrows[event.key]); return true; }
  const deeds = {
    " ": () => player && player.toggle(),
    ArrowLeft: () => step(-1),
    ArrowRight: () => step(1),
    PageUp: () => step(-100),
    PageDown: () => step(100),
    Home: () => player && player.toStart(),
    End: () => player && player.toRow(player.run.count - 1),
    ArrowUp: () => player && player.faster(1),
    ArrowDown: () => player && player.faster(-1),
    "+": () => zoom(KEY_ZOOM),
    "=": () => zoom(KEY_ZOOM),
    "-": () => zoom(1 / KEY_ZOOM),
    0: () => stage.fit(),
    f: () => stage.fit(),
    e: () => panel.nextColour(),
    m: () => panel.nextTimes(1),
    M: () => panel.nextTimes(-1),
    "?": () => showHelp(find("help").hidden),
    Escape: () => showHelp(false),
  };
  if (deeds[event.key]) deeds[event.key]();
  else return panel.toggle(event.key);
  return true;
}
