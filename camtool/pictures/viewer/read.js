// The page's data: a head of words (JSON) and columns of numbers (base64, little-endian).

const NUMBERS = { u1: Uint8Array, i2: Int16Array, i4: Int32Array, f4: Float32Array, d1: Int8Array };

/** name -> typed array, as the head's `columns` {name: [type, byte offset, count]} say. */
function readColumns(columns, base64) {
  const text = atob(base64.trim());
  const bytes = new Uint8Array(text.length);
  for (let at = 0; at < text.length; at++) bytes[at] = text.charCodeAt(at);
  const named = {};
  for (const [name, [type, offset, count]] of Object.entries(columns)) {
    const column = new NUMBERS[type](bytes.buffer, offset, count);
    named[name] = type === "d1" ? summed(column) : column;
  }
  return named;
}

/** Numbers from the steps between them. */
function summed(steps) {
  let sum = 0;
  return Int32Array.from(steps, (step) => (sum += step));
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

/** The wanted path: each piece goes on from the one before but where the path breaks. */
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
