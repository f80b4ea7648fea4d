// The stock in depth: one mesh whose heights are a texture, its sides, the tool and the path.

/** The page holds wanted heights in this many shares of the thickness. */
const GOAL_COUNTS = 32000;
const TILE = 32;
const RIM = TILE + 1;
const TOOL_SIDES = 40;
const CUT_MS = 12;
const ORBIT_PX = 0.008;
/** Colours of the axes of X, Y and Z at part zero, and their length on the screen. */
const AXIS_TINTS = [[214, 39, 40, 255], [44, 160, 44, 255], [31, 119, 220, 255]];
const AXIS_PX = 36;
const KEY_TURN = Math.PI / 24;
/** While frames take longer than this, they are painted coarser, until the view rests: with every
 * 2nd, 4th … height, and a smaller share of the pixels. */
const SLOW_FRAME_MS = 28;
const DETAILS = [[1, 1], [2, 0.8], [4, 0.6], [8, 0.5], [8, 0.35]];
/** Then only so many ends of the latest lines of the path are drawn. */
const COARSE_ENDS = 10000;
const FULL_AFTER_MS = 250;
/** [azimuth, elevation] by key: from the front, the side, the top, and isometric, as in pictures. */
const SIDES = {
  f: [0, 0], 1: [0, 0], s: [Math.PI / 2, 0], 3: [Math.PI / 2, 0],
  t: [0, Math.PI / 2], 7: [0, Math.PI / 2], i: [-Math.PI / 4, Math.atan(Math.SQRT1_2)],
};

/** What is gouged or left is coloured from the first of these on, and fully from the second, mm. */
const BESIDE_MM = ["0.003", "0.1"];

const PLACE = `
uniform vec3 right, up, toward, centre, scales;
vec4 place(vec3 at) {
  vec3 off = at - centre;
  return vec4(vec3(dot(off, right), dot(off, up), -dot(off, toward)) * scales, 1.0);
}`;

const GROUND = `
uniform highp sampler2D heights;
uniform vec4 grid;
uniform float bottom;`;

// Vertices of the mesh, of a side or section, and of what is given by its places.
const SURFACE = `#version 300 es
precision highp float;
${PLACE}${GROUND}
in vec2 tile;
uniform int stride;
out vec3 at;
void main() {
  ivec2 last = textureSize(heights, 0) - 1;
  ivec2 node = min(ivec2(tile) + stride * ivec2(gl_VertexID % ${RIM}, gl_VertexID / ${RIM}), last);
  float high = texelFetch(heights, node, 0).r;
  at = vec3(grid.xy + vec2(node) * grid.zw, high > bottom ? high : bottom * 1.002);
  gl_Position = place(at);
}`;

const CURTAIN = `#version 300 es
precision highp float;
${PLACE}${GROUND}
uniform int across;
uniform float where;
out vec3 at;
void main() {
  ivec2 last = textureSize(heights, 0) - 1;
  if (across == 2) {
    at = vec3(grid.xy + vec2(gl_VertexID % 2 * last.x, gl_VertexID / 2 * last.y) * grid.zw, bottom);
    gl_Position = place(at);
    return;
  }
  int along = gl_VertexID / 2, low = min(int(where), (across == 0 ? last.x : last.y) - 1);
  ivec2 one = across == 0 ? ivec2(low, along) : ivec2(along, low);
  ivec2 other = one + (across == 0 ? ivec2(1, 0) : ivec2(0, 1));
  float high = mix(texelFetch(heights, one, 0).r, texelFetch(heights, other, 0).r, where - float(low));
  vec2 node = across == 0 ? vec2(where, along) : vec2(along, where);
  at = vec3(grid.xy + node * grid.zw, gl_VertexID % 2 == 0 ? bottom : max(high, bottom));
  gl_Position = place(at);
}`;

const GIVEN = `#version 300 es
precision highp float;
${PLACE}
in vec3 point;
in vec4 colour;
uniform vec3 shift;
out vec3 at;
out vec4 paint;
void main() {
  at = point + shift;
  paint = colour;
  gl_Position = place(at);
}`;

const LIT = `
uniform vec3 right, up, toward;
vec3 lit(vec3 tone, vec3 face) {
  vec3 normal = dot(face, toward) < 0.0 ? -face : face;
  vec3 light = normalize(toward * 0.75 + up * 0.45 - right * 0.55);
  vec3 sky = vec3(0.0, 0.0, 1.0);
  return tone * (0.42 + 0.5 * max(dot(normal, light), 0.0) + 0.14 * dot(normal, sky));
}`;

// `kind` 0: the mesh, 1: a side of the stock, 2: the cut face of a section, 3: its bottom.
const STUFF = `#version 300 es
precision highp float;
precision highp usampler2D;
${GROUND}${LIT}
in vec3 at;
out vec4 seen;
uniform vec4 plane;
uniform vec3 stock, cut, face;
uniform int kind, colouring;
uniform highp usampler2D bins;
uniform sampler2D map;
uniform highp sampler2D goal;
uniform vec3 gouge, rest;
uniform vec2 span;

float high(ivec2 node) {
  return texelFetch(heights, clamp(node, ivec2(0), textureSize(heights, 0) - 1), 0).r;
}

/** The direction of a wall, from the heights around it, so that it has no steps. */
vec3 wall(ivec2 node, vec3 rough) {
  vec2 fall = vec2(0.0);
  for (int k = -2; k <= 2; k++) {
    fall.x += high(node + ivec2(-2, k)) - high(node + ivec2(2, k));
    fall.x += high(node + ivec2(-1, k)) - high(node + ivec2(1, k));
    fall.y += high(node + ivec2(k, -2)) - high(node + ivec2(k, 2));
    fall.y += high(node + ivec2(k, -1)) - high(node + ivec2(k, 1));
  }
  float size = length(fall / grid.zw);
  if (size < 1e-6) return rough;
  return normalize(vec3(fall / grid.zw / size * length(rough.xy), rough.z));
}

/** The colour of what is gouged or left, beyond what the wanted heights around it allow. */
vec3 beside(ivec2 node, vec3 tone) {
  float here = high(node), low = 1e9, top = -1e9;
  for (int k = 0; k < 9; k++) {
    ivec2 near = clamp(node + ivec2(k % 3 - 1, k / 3 - 1), ivec2(0), textureSize(heights, 0) - 1);
    float height = texelFetch(goal, near, 0).r;
    low = min(low, height);
    top = max(top, height);
  }
  float under = max(low - max(here, bottom), 0.0), over = max(here - top, 0.0), size = under + over;
  if (size < ${BESIDE_MM[0]}) return tone;
  return mix(tone, under > 0.0 ? gouge : rest, 0.4 + 0.6 * min(size / ${BESIDE_MM[1]}, 1.0));
}

void main() {
  if (at.z < bottom || (kind != 2 && dot(plane.xyz, at) > plane.w)) discard;
  vec2 spot = (at.xy - grid.xy) / grid.zw;
  ivec2 node = ivec2(spot + 0.5);
  vec3 tone = cut, normal = normalize(cross(dFdx(at), dFdy(at)));
  if (normal.z < 0.0) normal = -normal;
  if (kind == 3) {
    if (high(node) <= bottom) discard;
    tone = stock;
  } else if (kind == 2) {
    float stripe = fract((at.x + at.y + at.z) / (24.0 * max(grid.z, grid.w)));
    tone = face * (stripe < 0.12 ? 0.82 : 1.0);
    normal = toward;
  } else if (kind == 1) {
    tone = stock;
    normal = face;
  } else {
    if (normal.z < 0.5) normal = wall(node, normal);
    if (at.z > -1e-4) tone = colouring == 3 ? beside(node, stock) : stock;
    else if (colouring == 1) {
      // What cut the lowest height beside a wall has cut the wall.
      ivec2 lowest = ivec2(spot);
      for (int k = 1; k < 4; k++) {
        ivec2 other = ivec2(spot) + ivec2(k & 1, k >> 1);
        if (high(other) < high(lowest)) lowest = other;
      }
      tone = texelFetch(map, ivec2(texelFetch(bins, lowest, 0).r, 0), 0).rgb;
    } else if (colouring == 3) tone = beside(node, tone);
    else if (colouring == 2) {
      float part = (span.y - at.z) / max(span.y - span.x, 1e-6), count = float(textureSize(map, 0).x - ${ENTRY + 1});
      tone = texelFetch(map, ivec2(clamp(part, 0.0, 0.9999) * count, 0), 0).rgb;
    } else tone *= 1.0 - 0.22 * clamp(at.z / bottom, 0.0, 1.0);
  }
  seen = vec4(kind == 2 ? tone : lit(tone, normal), 1.0);
}`;

const SHADED = `#version 300 es
precision highp float;
${LIT}
in vec3 at;
in vec4 paint;
out vec4 seen;
uniform int isLine;
uniform vec4 over;
void main() {
  if (paint.a < 0.01) discard;
  vec3 tone = over.a > 0.0 ? over.rgb : isLine == 1 ? paint.rgb : lit(paint.rgb, normalize(cross(dFdx(at), dFdy(at))));
  seen = vec4(tone * paint.a, paint.a);
}`;

/** Compile a program; its uniforms by name. */
function program(gl, vertex, fragment) {
  const made = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  const at = {};
  for (let k = 0; k < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); k++) {
    const { name } = gl.getActiveUniform(made, k);
    at[name] = gl.getUniformLocation(made, name);
  }
  return { made, at };
}

/** [red, green, blue] 0 … 1 of a colour #rrggbb. */
function rgb(colour) {
  return [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16) / 255);
}

class Depth {
  constructor(stage, head, columns, run) {
    this.stage = stage;
    this.run = run;
    this.layers = stage.layers;
    this.head = head;
    this.canvas = find("solid");
    this.isOn = false;
    this.section = { axis: "", share: 0.5 };
    this.detail = 0;
    this.slides = new Slides(columns.slide_at, columns.slide_count);
    this.turns = head.cutters.map(([row, ...profile]) => [row, new Cutter(profile)]);
    this.bodies = head.bodies;
    // Without a tool there is nothing else to see.
    this.hasPath = find("path-shown").checked = !this.turns.length;
    this.turn(...SIDES.i);
    // A computer that slept may have lost what it held for the picture.
    this.canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    this.canvas.addEventListener("webglcontextrestored", () => {
      this.gl = this.post = this.shaped = null;
      this.start();
      stage.soon("all");
    });
  }

  /** Start WebGL; false where the browser does not have it. */
  start() {
    if (this.gl) return true;
    const gl = this.canvas.getContext("webgl2", { antialias: false, alpha: false });
    if (!gl) return false;
    this.gl = gl;
    this.bottom = this.head.stock.bottom;
    const { begun_height: begun, begun_count: counts } = this.layers.columns;
    this.solid = new Solid(this.head.stock, this.turns, this.slides, this.heights(begun, counts));
    this.surface = program(gl, SURFACE, STUFF);
    this.curtain = program(gl, CURTAIN, STUFF);
    this.given = program(gl, GIVEN, SHADED);
    this.makeMesh();
    this.makeLines();
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    this.fit();
    return true;
  }

  texture(unit, format, kind, type, width, height) {
    const { gl } = this, made = gl.createTexture();
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, made);
    for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, side, gl.NEAREST);
    gl.texImage2D(gl.TEXTURE_2D, 0, format, width, height, 0, kind, type, null);
  }

  /** Heights on the grid, of their shares of the thickness. */
  heights(shares, counts) {
    return repeated(shares, counts).map((count) => (count * -this.bottom) / GOAL_COUNTS);
  }

  /** A tile of the mesh, drawn once for each place; level tiles are fans, with all of their edge, or they
   * would leave gaps beside others. */
  makeMesh() {
    const { gl, solid } = this, { nx, ny } = solid;
    this.texture(0, gl.R32F, gl.RED, gl.FLOAT, nx, ny);
    this.texture(1, gl.R8UI, gl.RED_INTEGER, gl.UNSIGNED_BYTE, nx, ny);
    this.texture(2, gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, 1, 1);
    this.bins = new Uint8Array(nx * ny);
    const { goal_height: goals, goal_count: counts } = this.layers.columns;
    this.texture(3, gl.R32F, gl.RED, gl.FLOAT, goals.length ? nx : 1, goals.length ? ny : 1);
    if (goals.length) {
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, nx, ny, gl.RED, gl.FLOAT, this.heights(goals, counts));
    }
    const faces = [], middle = (TILE / 2) * (RIM + 1), last = TILE * RIM;
    for (let k = 0; k < TILE; k++) {
      faces.push(middle, k, k + 1, middle, last + k + 1, last + k);
      faces.push(middle, (k + 1) * RIM, k * RIM, middle, k * RIM + TILE, (k + 1) * RIM + TILE);
    }
    this.fan = faces.length;
    for (let j = 0; j < TILE; j++) {
      for (let i = 0, a = j * RIM; i < TILE; i++, a++) faces.push(a, a + 1, a + RIM, a + RIM, a + 1, a + RIM + 1);
    }
    this.faces = faces.length - this.fan;
    this.tiles = { buffer: gl.createBuffer(), level: 0, rough: 0, size: 0 };
    this.mesh = gl.createVertexArray();
    gl.bindVertexArray(this.mesh);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint16Array(faces), gl.STATIC_DRAW);
    this.tileAt = gl.getAttribLocation(this.surface.made, "tile");
    gl.enableVertexAttribArray(this.tileAt);
    gl.vertexAttribDivisor(this.tileAt, 1);
    this.bare = gl.createVertexArray();
    solid.dirty = [0, ny - 1];
  }

  /** The path of the tips as lines: two ends of each. */
  makeLines() {
    const { at, first, count } = this.slides, lines = new Float32Array(6 * first[count]);
    for (let k = 0; k < first[count]; k++) lines.set(at.subarray(3 * k, 3 * k + 6), 6 * k);
    this.lines = this.given3d(lines);
    this.tool = this.given3d(new Float32Array(0));
    this.axes = this.given3d(new Float32Array(18));
    this.fill(this.axes.tints, Uint8Array.from(AXIS_TINTS.flatMap((tint) => [...tint, ...tint])));
    this.tints = new Uint8Array(8 * first[count]);
  }

  /** Places of triangles or lines, and their colours. */
  given3d(points) {
    const { gl } = this, made = { array: gl.createVertexArray(), points: gl.createBuffer(), tints: gl.createBuffer() };
    gl.bindVertexArray(made.array);
    for (const [name, buffer, size, type] of [["point", made.points, 3, gl.FLOAT], ["colour", made.tints, 4, gl.UNSIGNED_BYTE]]) {
      const at = gl.getAttribLocation(this.given.made, name);
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.enableVertexAttribArray(at);
      gl.vertexAttribPointer(at, size, type, type !== gl.FLOAT, 0, 0);
    }
    this.fill(made.points, points);
    return made;
  }

  fill(buffer, data) {
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
  }

  // The view: from where, at what, how large.

  turn(azimuth, elevation) {
    this.azimuth = azimuth;
    this.elevation = Math.max(-Math.PI / 2, Math.min(Math.PI / 2, elevation));
    const ca = Math.cos(azimuth), sa = Math.sin(azimuth);
    const ce = Math.cos(this.elevation), se = Math.sin(this.elevation);
    this.right = [ca, sa, 0];
    this.up = [-sa * se, ca * se, ce];
    this.toward = [sa * ce, -ca * ce, se];
  }

  /** Show all of the stock from here. */
  fit() {
    const { box: [left, low, right, high] } = this.head.stock, { bottom } = this;
    this.centre = [(left + right) / 2, (low + high) / 2, bottom / 2];
    const half = [(right - left) / 2, (high - low) / 2, -bottom / 2];
    const size = (axis) => 2 * axis.reduce((sum, value, k) => sum + Math.abs(value) * half[k], 0);
    const { clientWidth: width, clientHeight: height } = this.stage.place, room = 1 - 2 * FIT_MARGIN;
    this.scale = Math.min((width * room) / size(this.right), (height * room) / size(this.up));
    this.most = Math.hypot(...half);
    this.changed();
  }

  /** Look from one of the `SIDES`. */
  from(side) {
    this.turn(...SIDES[side]);
    this.fit();
  }

  drag(dx, dy) {
    this.turn(this.azimuth - dx * ORBIT_PX, this.elevation + dy * ORBIT_PX);
    this.changed();
  }

  pan(dx, dy) {
    for (let k = 0; k < 3; k++) this.centre[k] += (this.up[k] * dy - this.right[k] * dx) / this.scale;
    this.changed();
  }

  /** Zoom about a point of the canvas, which stays where it is. */
  zoom(factor, px, py) {
    const { clientWidth: width, clientHeight: height } = this.stage.place;
    const next = Math.min(1e5, Math.max(1e-3, this.scale * factor)), more = 1 - this.scale / next;
    const x = ((px - width / 2) / this.scale) * more, y = ((height / 2 - py) / this.scale) * more;
    for (let k = 0; k < 3; k++) this.centre[k] += this.right[k] * x + this.up[k] * y;
    this.scale = next;
    this.changed();
  }

  /** Put a place (x, y) mm of the stock in the middle, under a post. */
  look([x, y]) {
    this.centre = [x, y, this.solid.heightAt(x, y) || 0];
    this.mark = this.centre.slice();
    this.changed();
  }

  /** The place of the stock under a point of the canvas, and the move that cut it; null beside it. */
  under(px, py) {
    const { clientWidth: width, clientHeight: height } = this.stage.place, { solid, toward } = this;
    const x = (px - width / 2) / this.scale, y = (height / 2 - py) / this.scale;
    const at = this.centre.map((value, k) => value + this.right[k] * x + this.up[k] * y);
    const pace = Math.min(solid.dx, solid.dy) / Math.max(0.3, Math.hypot(toward[0], toward[1]));
    const reach = 4 * this.most, plane = this.planeNow();
    let along = toward[2] > 0.01 ? Math.min(reach, -at[2] / toward[2]) : reach;
    for (; along > -reach; along -= pace) {
      const [u, v, w] = at.map((value, k) => value + toward[k] * along);
      if (w < this.bottom) return null;
      const high = solid.heightAt(u, v);
      if (!(high >= w - pace) || high <= this.bottom || plane[0] * u + plane[1] * v > plane[3]) continue;
      const i = Math.round((u - solid.left) / solid.dx), j = Math.round((v - solid.low) / solid.dy);
      return { x: u, y: v, z: high, row: solid.by[j * solid.nx + i] };
    }
    return null;
  }

  // Painting.

  /** After a change of the view or of a style. */
  changed() {
    this.stage.soon("moved");
  }

  /** The colours of the path and of the map, after a change of the layers. */
  restyle() {
    const { gl, layers, tints, solid, slides: { first, count } } = this, colours = palette();
    const { of, styles } = layers.moveStyles(colours);
    const tones = styles.map((style) => (style ? [...rgb(style.colour).map((part) => 255 * part), 255] : [0, 0, 0, 0]));
    for (let row = 0; row < count; row++) {
      for (let at = 2 * first[row]; at < 2 * first[row + 1]; at++) tints.set(tones[of[row]], 4 * at);
    }
    this.fill(this.lines.tints, tints);
    const beyond = [...Array(ENTRY).fill(colours.pale), colours.entry];
    const map = [...layers.mapColours(), ...beyond].flatMap((colour) => [...rgb(colour).map((part) => 255 * part), 255]);
    gl.activeTexture(gl.TEXTURE2);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, map.length / 4, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(map));
    solid.dirty = [0, solid.ny - 1];
  }

  /** Upload the rows that have changed, and find the tiles that are level. */
  upload() {
    const { gl, solid, layers } = this, { nx, heights, by, dirty: [from, to] } = solid;
    if (to < from) return;
    gl.activeTexture(gl.TEXTURE0);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, from, nx, to - from + 1, gl.RED, gl.FLOAT, heights, from * nx);
    if (layers.by === "error" || layers.by === "engagement") {
      const steps = layers.binOf[layers.by], none = layers.mapColours().length, { bins } = this;
      for (let k = from * nx; k < (to + 1) * nx; k++) bins[k] = by[k] < 0 ? none : steps[by[k]];
      gl.activeTexture(gl.TEXTURE1);
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, from, nx, to - from + 1, gl.RED_INTEGER, gl.UNSIGNED_BYTE, bins, from * nx);
    }
    this.sortTiles(from, to);
    solid.clean();
  }

  /** Find the tiles that are level, of those that touch the rows from … to. */
  sortTiles(from, to) {
    const { solid: { nx, ny }, tiles } = this, size = TILE * DETAILS[this.detail][0];
    const across = Math.ceil((nx - 1) / size), upwards = Math.ceil((ny - 1) / size), anew = size !== tiles.size;
    if (anew) Object.assign(tiles, { size, isLevel: new Uint8Array(across * upwards) });
    const level = [], rough = [];
    for (let r = 0; r < upwards; r++) {
      for (let c = 0; c < across; c++) {
        const tile = r * across + c, isTouched = r * size <= to && (r + 1) * size >= from;
        if (anew || isTouched) tiles.isLevel[tile] = this.isTileLevel(c * size, r * size, size) ? 1 : 0;
        (tiles.isLevel[tile] ? level : rough).push(c * size, r * size);
      }
    }
    this.fill(tiles.buffer, new Float32Array([...level, ...rough]));
    tiles.level = level.length / 2;
    tiles.rough = rough.length / 2;
  }

  isTileLevel(i0, j0, size) {
    const { nx, ny, heights } = this.solid, i1 = Math.min(i0 + size, nx - 1), j1 = Math.min(j0 + size, ny - 1);
    const high = heights[j0 * nx + i0];
    for (let j = j0; j <= j1; j++) for (let k = j * nx + i0; k <= j * nx + i1; k++) if (heights[k] !== high) return false;
    return true;
  }

  /** [x, y, z, distance] of the plane of the section: what lies beyond it, towards the viewer, is
   * not shown. */
  planeNow() {
    const { box } = this.head.stock, k = this.section.axis === "y" ? 1 : 0;
    if (!this.section.axis) return [0, 0, 0, 1];
    const sense = this.toward[k] < -1e-9 ? -1 : 1, at = box[k] + this.section.share * (box[k + 2] - box[k]);
    return [k ? 0 : sense, k ? sense : 0, 0, sense * at];
  }

  /** Paint coarser while frames follow each other too slowly, and wholly when the view rests. */
  adapt() {
    const now = performance.now(), took = now - this.before;
    this.before = now;
    clearTimeout(this.resting);
    this.resting = 0;
    const before = this.detail;
    if (this.isResting) this.detail = 0;
    else if (took < 6 * FULL_AFTER_MS) {
      this.pace = 0.6 * (this.pace || took) + 0.4 * Math.min(took, FULL_AFTER_MS);
      if (this.pace > SLOW_FRAME_MS && this.detail < DETAILS.length - 1) {
        this.detail++;
        this.pace = SLOW_FRAME_MS;
      }
    }
    this.isResting = false;
    if (before !== this.detail) this.sortTiles(1, 0);
    if (!this.detail) return;
    this.resting = setTimeout(() => {
      this.isResting = true;
      this.changed();
    }, FULL_AFTER_MS);
  }

  /** Cut to where the program is; false while there is more to cut. */
  paint(colours) {
    this.adapt();
    const { gl, canvas, stage, run } = this, ratio = (window.devicePixelRatio || 1) * DETAILS[this.detail][1];
    const { clientWidth: width, clientHeight: height } = stage.place;
    const [wide, tall] = [width, height].map((size) => Math.max(1, Math.round(size * ratio)));
    if (canvas.width !== wide || canvas.height !== tall) [canvas.width, canvas.height] = [wide, tall];
    const isCut = this.solid.toward(run.row, run.share, performance.now() + CUT_MS);
    this.upload();
    gl.viewport(0, 0, wide, tall);
    gl.clearColor(...rgb(colours.paper), 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.disable(gl.BLEND);
    this.scales = [(2 * this.scale) / width, (2 * this.scale) / height, 0.2 / this.most];
    if (this.turns.length) this.paintSolid(colours);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    this.paintLines(colours);
    this.paintTool(colours);
    if (this.layers.on.get("zero")) this.paintAxes();
    if (this.mark) this.paintMark(colours);
    return isCut;
  }

  /** Choose a program and say from where all is seen. */
  use({ made, at }) {
    const { gl, scales } = this;
    gl.useProgram(made);
    for (const name of ["right", "up", "toward", "centre"]) gl.uniform3fv(at[name], this[name]);
    gl.uniform3fv(at.scales, scales);
    return at;
  }

  /** The mesh, the sides of the stock, its bottom and the cut face of the section. */
  paintSolid(colours) {
    const { gl, solid, tiles, surface, curtain, layers } = this, plane = this.planeNow();
    const colouring = { kind: 0, error: 1, engagement: 1, height: 2, beside: 3 }[layers.by];
    const styled = (kind, at, face) => {
      gl.uniform4f(at.grid, solid.left, solid.low, solid.dx, solid.dy);
      gl.uniform1f(at.bottom, this.bottom);
      gl.uniform4fv(at.plane, plane);
      gl.uniform3fv(at.stock, rgb(colours.stock));
      gl.uniform3fv(at.cut, rgb(colours.cut));
      gl.uniform3fv(at.face, face);
      gl.uniform1i(at.kind, kind);
      gl.uniform1i(at.colouring, colouring);
      gl.uniform2f(at.span, ...layers.heights);
      gl.uniform1i(at.heights, 0);
      gl.uniform1i(at.bins, 1);
      gl.uniform1i(at.map, 2);
      gl.uniform1i(at.goal, 3);
      gl.uniform3fv(at.gouge, rgb(colours.tool));
      gl.uniform3fv(at.rest, rgb(colours.feed));
    };
    let at = this.use(surface);
    styled(0, at, [0, 0, 1]);
    gl.uniform1i(at.stride, DETAILS[this.detail][0]);
    gl.bindVertexArray(this.mesh);
    gl.bindBuffer(gl.ARRAY_BUFFER, tiles.buffer);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1, 1);
    gl.vertexAttribPointer(this.tileAt, 2, gl.FLOAT, false, 0, 0);
    gl.drawElementsInstanced(gl.TRIANGLES, this.fan, gl.UNSIGNED_SHORT, 0, tiles.level);
    gl.vertexAttribPointer(this.tileAt, 2, gl.FLOAT, false, 0, 8 * tiles.level);
    gl.drawElementsInstanced(gl.TRIANGLES, this.faces, gl.UNSIGNED_SHORT, 2 * this.fan, tiles.rough);
    at = this.use(curtain);
    gl.bindVertexArray(this.bare);
    const side = (kind, across, where, face) => {
      styled(kind, at, face);
      gl.uniform1i(at.across, across);
      gl.uniform1f(at.where, where);
      gl.drawArrays(gl.TRIANGLE_STRIP, 0, [2 * solid.ny, 2 * solid.nx, 4][across]);
    };
    side(1, 0, 0, [-1, 0, 0]);
    side(1, 0, solid.nx - 1, [1, 0, 0]);
    side(1, 1, 0, [0, -1, 0]);
    side(1, 1, solid.ny - 1, [0, 1, 0]);
    if (this.toward[2] < 0) side(3, 2, 0, [0, 0, -1]);
    gl.disable(gl.POLYGON_OFFSET_FILL);
    const { axis, share } = this.section;
    if (axis === "x") side(2, 0, share * (solid.nx - 1), rgb(colours.section));
    if (axis === "y") side(2, 1, share * (solid.ny - 1), rgb(colours.section));
  }

  /** The moves that are done, in their colours, and those to come, pale. */
  paintLines(colours) {
    const { gl, run, slides: { first, count } } = this, at = this.use(this.given);
    if (!this.hasPath) return;
    gl.bindVertexArray(this.lines.array);
    gl.uniform3f(at.shift, 0, 0, 0);
    gl.uniform1i(at.isLine, 1);
    const done = 2 * first[run.row + (run.share === 1 ? 1 : 0)];
    gl.uniform4f(at.over, 0, 0, 0, 0);
    const from = this.detail ? Math.max(0, done - COARSE_ENDS) : 0;
    gl.drawArrays(gl.LINES, from, done - from);
    if (this.detail) return;
    gl.uniform4f(at.over, ...rgb(colours.pale), 1);
    gl.drawArrays(gl.LINES, done, 2 * first[count] - done);
  }

  /** The tool where it is, in its shape. */
  paintTool(colours) {
    const { gl, run, turns, bodies, slides } = this, now = ([row]) => row <= run.row;
    const turn = turns.findLast(now) || turns[0], body = bodies.findLast(now) || bodies[0];
    const key = `${turns.indexOf(turn)} ${bodies.indexOf(body)} ${colours.tool} ${colours.quiet}`;
    if (this.shaped !== key) this.shapeTool(turn ? turn[1] : null, body || [], colours);
    this.shaped = key;
    const at = this.use(this.given);
    gl.bindVertexArray(this.tool.array);
    gl.uniform3fv(at.shift, run.place || slides.place(run.row, run.share));
    gl.uniform1i(at.isLine, 0);
    gl.uniform4f(at.over, 0, 0, 0, 0);
    gl.enable(gl.CULL_FACE);
    gl.drawArrays(gl.TRIANGLES, 0, this.toolCount);
    gl.disable(gl.CULL_FACE);
  }

  /** The axes of the work frame at part zero. */
  paintAxes() {
    const { gl } = this, at = this.use(this.given), long = AXIS_PX / this.scale;
    this.fill(this.axes.points, Float32Array.from([0, 0, 0, long, 0, 0, 0, 0, 0, 0, long, 0, 0, 0, 0, 0, 0, long]));
    gl.bindVertexArray(this.axes.array);
    gl.uniform3f(at.shift, 0, 0, 0);
    gl.uniform4f(at.over, 0, 0, 0, 0);
    gl.uniform1i(at.isLine, 1);
    gl.drawArrays(gl.LINES, 0, 6);
  }

  /** A post on the place that a table speaks of, seen through the stock. */
  paintMark(colours) {
    const { gl, mark: [x, y, high] } = this, at = this.use(this.given);
    this.post = this.post || this.given3d(new Float32Array(0));
    const top = high + 60 / this.scale, arm = 8 / this.scale, points = [x, y, high, x, y, top];
    for (let k = 0; k < 12; k++) {
      for (const step of [k, k + 1]) points.push(x + arm * Math.cos((step * TURN) / 12), y + arm * Math.sin((step * TURN) / 12), high);
    }
    this.fill(this.post.points, new Float32Array(points));
    this.fill(this.post.tints, new Uint8Array((points.length / 3) * 4).fill(255));
    gl.bindVertexArray(this.post.array);
    gl.uniform3f(at.shift, 0, 0, 0);
    gl.uniform4f(at.over, ...rgb(colours.pick), 1);
    gl.uniform1i(at.isLine, 1);
    gl.disable(gl.DEPTH_TEST);
    gl.drawArrays(gl.LINES, 0, points.length / 3);
    gl.enable(gl.DEPTH_TEST);
  }

  /** Turn the profile of a tool round its axis, with shank and holder where they are known; a
   * needle where its shape is not. */
  shapeTool(cutter, [, cutting, shank, stickout, holder, holderLength], colours) {
    const size = 0.5 * this.most, radius = cutter ? Math.min(cutter.radius, size) : 0.02 * size;
    const ring = [[0, 0]];
    if (!cutter) ring.push([radius, 4 * radius]);
    else {
      for (let k = 0; k <= 8; k++) {
        const out = cutter.flat + (radius - cutter.flat) * Math.sin((k / 8) * QUARTER);
        ring.push([out, cutter.height(out)]);
      }
    }
    const full = ring[ring.length - 1][1], long = full + Math.max(4 * radius, 0.25 * size);
    const flutes = Math.max(full, cutting || stickout || long);
    ring.push([radius, flutes]);
    const edges = ring.length - 1;
    // A shank or holder without a length is drawn as long as can be seen.
    const top = Math.max(stickout || 0, flutes + (shank || holder ? size / 4 : 0));
    if (shank && top > flutes) ring.push([shank, flutes], [shank, top]);
    if (holder) ring.push([holder, stickout || top], [holder, (stickout || top) + (holderLength || size / 2)]);
    ring.push([0, ring[ring.length - 1][1]]);
    const points = [], tints = [], turned = ([out, z], k) => {
      const angle = (k / TOOL_SIDES) * TURN;
      return [out * Math.cos(angle), out * Math.sin(angle), z];
    };
    const [edge, body] = [colours.tool, colours.quiet].map((tone) => [...rgb(tone).map((part) => 255 * part), 150]);
    for (let k = 0; k < TOOL_SIDES; k++) {
      for (let j = 1; j < ring.length; j++) {
        const [a, b, c, d] = [turned(ring[j - 1], k), turned(ring[j - 1], k + 1), turned(ring[j], k + 1), turned(ring[j], k)];
        points.push(...a, ...b, ...c, ...a, ...c, ...d);
        for (let corner = 0; corner < 6; corner++) tints.push(...(j <= edges ? edge : body));
      }
    }
    this.toolCount = points.length / 3;
    this.fill(this.tool.points, new Float32Array(points));
    this.fill(this.tool.tints, new Uint8Array(tints));
  }
}
