// Elements of the page. Text goes in as text, never as markup.

function element(name, text, attributes) {
  const made = document.createElement(name);
  if (text !== undefined) made.textContent = text;
  for (const [key, value] of Object.entries(attributes || {})) made.setAttribute(key, value);
  return made;
}

const find = (id) => document.getElementById(id);

const KIND_NAMES = {
  0: "rapid", 1: "line", 2: "arc, clockwise", 3: "arc, counter-clockwise", 10: "dwell",
  11: "spindle on, clockwise", 12: "spindle on, counter-clockwise", 13: "spindle off",
  14: "tool change", 15: "message", 16: "part zero here", 17: "home X and Y", 18: "home Z",
  19: "end of program",
};

/** What is known of a move, as [name, words] each. */
function moveFacts(head, columns, run, row) {
  const mm = (value) => value.toFixed(4), end = columns.move_end.subarray(3 * row, 3 * row + 3);
  const block = columns.move_block[row], source = columns.move_source[row];
  const facts = [["move", `${row + 1}, ${KIND_NAMES[columns.move_kind[row]]}`]];
  if (block >= 0) facts.push(["block", String(block + 1)]);
  if (block >= 0 && head.blocks) facts.push([head.hex ? "bytes" : "line", head.blocks[block] || ""]);
  if (source >= 0) facts.push(["from", head.texts[source]]);
  facts.push(["to", `X ${mm(end[0])}  Y ${mm(end[1])}  Z ${mm(end[2])} mm`]);
  const feed = columns.move_feed[row];
  if (feed === feed) facts.push(["feed", `${Number(feed.toPrecision(6))} mm/min`]);
  facts.push(["time", `${clock(run.begins(row))}, lasts ${Number((run.ends[row] - run.begins(row)).toPrecision(4))} s`]);
  const error = columns.move_error[row];
  if (error === error) facts.push(["error", `${error.toFixed(2)} µm at most`]);
  return facts;
}

/** What is known of a line or arc of the drawing. */
function drawnFacts(head, columns, row) {
  const path = columns.drawn_path[row], layer = head.layers[columns.drawn_layer[row]];
  const facts = [["layer", layer.name], ["drawn", `path ${path + 1}`]];
  if (head.sources[path]) facts.push(["entity", head.sources[path]]);
  return facts;
}

function factTable(facts) {
  const list = element("dl");
  for (const [name, words] of facts) list.append(element("dt", name), element("dd", words));
  return list;
}
