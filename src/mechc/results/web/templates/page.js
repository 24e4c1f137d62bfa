
/* --- the page: it simulates while it plays, and anew when a slider is moved -------------------- */
const SPEEDS = [0.1, 0.25, 0.5, 1, 2], MOST_READOUTS = 8;
const TRAIL = 240, APART = 0.008; /* corners of a path; the time between two, s */
const SCOUTED = 4, PATIENCE = 60; /* s of the motion that the picture has room for; ms to find it */
const LIGHT = ["#0072b2", "#d55e00", "#009e73", "#b3568c", "#b57b00", "#2f8fc4"];
const DARK = ["#56b4e9", "#f08a3c", "#35c79a", "#e091bf", "#f0c04a", "#8fd0f5"];
const byId = (id) => document.getElementById(id);
const canvas = byId("canvas"), brush = canvas.getContext("2d"), notes = byId("notes");
const darkness = matchMedia("(prefers-color-scheme: dark)");
const names = [...about.coordinates, ...about.speeds];
const mechanism = await create();

let playing = false, speed = 1, tick = null;
let start = mechanism.y, wanted = {}, trails = [], box = null, turn = null;

/* --- values and units: what people read ------------------------------------------------------ */
function shown(unit) {
  if (unit === "rad" || unit === "rad/s") {
    return { factor: 180 / Math.PI, label: unit === "rad" ? "\u00b0" : "\u00b0/s" };
  }
  return { factor: 1, label: unit && unit !== "1" ? " " + unit : "" };
}
function text(value, unit) {
  const { factor, label } = shown(unit), number = factor * value;
  const digits = Math.abs(number) < 1e-12 ? "0" : Number(number.toPrecision(4)).toString();
  return digits.replace("-", "\u2212") + label;
}
function element(tag, words, parent) {
  const made = document.createElement(tag);
  made.textContent = words;
  parent.appendChild(made);
  return made;
}

/* --- sliders --------------------------------------------------------------------------------- */
function kindOf(name) {
  const found = (list) => list.find((each) => each.name === name);
  if (found(about.parameters)) { return ["parameter", found(about.parameters).unit]; }
  if (about.inputs.includes(name)) { return ["input", ""]; }
  return ["start", found(names).unit];
}
function valueOf(name, kind) {
  if (kind === "parameter") { return mechanism.parameters[name]; }
  return kind === "input" ? 0 : mechanism.get(name);
}
function rangeOf(told, kind, value, unit) {
  if (told.range) { return told.range; }
  if (kind === "start") {
    const half = unit === "rad" ? Math.PI / 2 : Math.max(1, Math.abs(value));
    return [value - half, value + half];
  }
  return value < 0 ? [2 * value, 0.3 * value] : [0.3 * value, 2 * value];
}
const sliders = about.sliders.map((told) => {
  const [kind, unit] = kindOf(told.name), value = valueOf(told.name, kind);
  const [low, high] = rangeOf(told, kind, value, unit);
  const label = element("label", "", byId("sliders"));
  element("span", (about.labels[told.name]) + (kind === "start" ? " at the start" : ""), label);
  const output = element("output", text(value, unit), label), input = element("input", "", label);
  Object.assign(input, { type: "range", min: low, max: high, step: "any", value });
  const slider = { name: told.name, kind, unit, input, output, value };
  input.addEventListener("input", () => { moved(slider); });
  return slider;
});
function tell(slider) {
  const said = text(Number(slider.input.value), slider.unit);
  slider.output.textContent = said;
  slider.input.setAttribute("aria-valuetext", said);
}
function moved(slider) {
  tell(slider);
  const value = Number(slider.input.value);
  if (slider.kind === "input") { mechanism.give({ [slider.name]: value }); }
  else if (slider.kind === "start") { wanted = { ...wanted, [slider.name]: value }; again(); }
  else { mechanism.set({ [slider.name]: value }); again(); }
}
/* Held coordinates stay where they are wanted; the others follow from where they were. */
function again() {
  try {
    mechanism.start(wanted, { from: start });
  } catch (problem) {
    notes.textContent = problem.message + ": the last motion goes on";
    return;
  }
  start = mechanism.y;
  scout();
  mechanism.start(wanted, { from: start });
  trails = about.drawing.traced.map(() => []);
  notes.textContent = about.inputs.length ? "inputs keep the values of their sliders, or 0" : "";
  draw();
}

/* --- the picture ----------------------------------------------------------------------------- */
/* Room for the motion of the next seconds: the box grows, and never shrinks while values change. */
function scout() {
  const until = performance.now() + PATIENCE;
  take(mechanism.points());
  try {
    for (let t = 0; t < SCOUTED && performance.now() < until; t += 0.02) {
      mechanism.advance(t, 1e-5);
      take(mechanism.points());
    }
  } catch (problem) { return; }
}
function take(points) {
  box = box || { low: [Infinity, Infinity, Infinity], high: [-Infinity, -Infinity, -Infinity] };
  points.forEach((x, i) => {
    if (!Number.isFinite(x)) { return; }
    box.low[i % 3] = Math.min(box.low[i % 3], x);
    box.high[i % 3] = Math.max(box.high[i % 3], x);
  });
}
const AXES = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };
const axis = (name) => AXES[name.slice(-1)].map((x) => (name[0] === "-" ? -x : x));
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0],
];
const mixed = (a, s, b, c) => a.map((x, i) => s * x + c * b[i]);
function isFlat() {
  const size = Math.max(...box.high.map((x, i) => x - box.low[i]));
  return box.high[2] - box.low[2] <= 1e-9 * size;
}
/* The directions to the right and up on the screen; a motion in space is turned by dragging. */
function directions() {
  const flat = isFlat();
  const [across, up] = (about.drawing.view || (flat ? ["x", "y"] : ["x", "z"])).map(axis);
  if (flat) { return [across, up]; }
  turn = turn || [0.6, 0.4];
  const depth = cross(across, up), [yaw, pitch] = turn;
  const right = mixed(across, Math.cos(yaw), depth, Math.sin(yaw));
  const away = mixed(depth, Math.cos(yaw), across, -Math.sin(yaw));
  return [right, mixed(up, Math.cos(pitch), away, -Math.sin(pitch))];
}
function frame() {
  const ratio = window.devicePixelRatio || 1, place = byId("stage").getBoundingClientRect();
  canvas.width = Math.max(1, Math.round(place.width * ratio));
  canvas.height = Math.max(1, Math.round(place.height * ratio));
  brush.setTransform(ratio, 0, 0, ratio, 0, 0);
  const [right, up] = directions(), margin = Math.max(28, 0.09 * Math.min(place.width, place.height));
  const middle = box.low.map((x, i) => (x + box.high[i]) / 2);
  const half = box.low.map((x, i) => (box.high[i] - x) / 2);
  const wide = dot(half, right.map(Math.abs)), tall = dot(half, up.map(Math.abs));
  const room = Math.min((place.width - 2 * margin) / (2 * wide), (place.height - 2 * margin) / (2 * tall));
  const scale = Number.isFinite(room) && room > 0 ? room : 1;
  return {
    unit: Math.max(3.5, Math.min(9, 0.013 * Math.min(place.width, place.height))),
    at: (points, i) => {
      const from = mixed([points[3 * i], points[3 * i + 1], points[3 * i + 2]], 1, middle, -1);
      return [place.width / 2 + scale * dot(from, right), place.height / 2 - scale * dot(from, up)];
    },
  };
}
function line(places, colour, width) {
  brush.beginPath();
  places.forEach(([x, y], i) => { if (i) { brush.lineTo(x, y); } else { brush.moveTo(x, y); } });
  Object.assign(brush, { strokeStyle: colour, lineWidth: width, lineCap: "round", lineJoin: "round" });
  brush.stroke();
}
function disc([x, y], radius, fill, edge, width) {
  brush.beginPath();
  brush.arc(x, y, radius, 0, 2 * Math.PI);
  Object.assign(brush, { fillStyle: fill, strokeStyle: edge, lineWidth: width });
  brush.fill();
  brush.stroke();
}
function pivot([x, y], unit, paper, edge) {
  const s = 2.5 * unit;
  brush.beginPath();
  brush.moveTo(x, y);
  brush.lineTo(x - 0.75 * s, y + 1.15 * s);
  brush.lineTo(x + 0.75 * s, y + 1.15 * s);
  brush.closePath();
  Object.assign(brush, { fillStyle: paper, strokeStyle: edge, lineWidth: Math.max(1.2, 0.22 * unit) });
  brush.fill();
  brush.stroke();
}
function draw() {
  const style = getComputedStyle(document.documentElement);
  const [paper, ink, quiet] = ["--paper", "--ink", "--quiet"].map((n) => style.getPropertyValue(n).trim());
  const palette = darkness.matches ? DARK : LIGHT, { at, unit } = frame();
  const points = mechanism.points(), { links, ground } = about.drawing;
  brush.clearRect(0, 0, canvas.width, canvas.height);
  brush.globalAlpha = 0.45;
  trails.forEach((trail, k) => {
    line(trail.map((x) => at(x, 0)), palette[(links.length + k) % palette.length], 0.35 * unit);
  });
  brush.globalAlpha = 1;
  ground.forEach((i) => { pivot(at(points, i), unit, paper, quiet); });
  links.forEach(([, corners]) => { line(corners.map((i) => at(points, i)), paper, 1.5 * unit + 3); });
  links.forEach(([, corners], k) => {
    line(corners.map((i) => at(points, i)), palette[k % palette.length], 1.5 * unit);
  });
  const joints = new Set([...ground, ...links.flatMap(([, corners]) => corners)]);
  joints.forEach((i) => { disc(at(points, i), 0.95 * unit, paper, ink, 0.32 * unit); });
  if (!joints.size) {
    about.drawing.points.forEach((_, i) => { disc(at(points, i), unit, ink, paper, 1.5); });
  }
  read();
}

/* --- what is told ---------------------------------------------------------------------------- */
const rows = new Map();
function row(name, words) {
  if (!rows.has(name)) {
    const made = element("div", "", byId("readouts"));
    element("dt", name, made);
    rows.set(name, element("dd", "", made));
  }
  rows.get(name).textContent = words;
}
function read() {
  row("time", mechanism.t.toFixed(2) + " s");
  about.coordinates.slice(0, MOST_READOUTS).forEach((told) => {
    row(about.labels[told.name], text(mechanism.get(told.name), told.unit));
  });
  const has = (name) => about.outputs.some((each) => each.name === name);
  if (has("kinetic_energy") && has("potential_energy")) {
    const energy = mechanism.output("kinetic_energy")[0] + mechanism.output("potential_energy")[0];
    row("energy", Number(energy.toPrecision(7)) + " J");
  }
}

/* --- time ------------------------------------------------------------------------------------ */
function setPlaying(on) {
  playing = on;
  tick = null;
  byId("play").textContent = on ? "Pause" : "Play";
  if (on) { requestAnimationFrame(go); }
}
function go(now) {
  if (!playing) { return; }
  const gone = tick === null ? 0 : Math.min(0.05, (now - tick) / 1000);
  tick = now;
  try {
    goOn(mechanism.t + speed * gone);
  } catch (problem) {
    notes.textContent = "The motion ends here: " + problem.message;
    setPlaying(false);
  }
  draw();
  requestAnimationFrame(go);
}
/* Simulate to a time, and leave a trail. */
function goOn(end) {
  while (mechanism.t < end) {
    mechanism.advance(Math.min(end, mechanism.t + APART));
    const points = mechanism.points();
    about.drawing.traced.forEach((i, k) => {
      trails[k].push(points.slice(3 * i, 3 * i + 3));
      if (trails[k].length > TRAIL) { trails[k].shift(); }
    });
  }
}
const speedButtons = SPEEDS.map((choice) => {
  const button = element("button", choice + "\u00d7", byId("speeds"));
  button.type = "button";
  button.addEventListener("click", () => { setSpeed(choice); });
  return button;
});
function setSpeed(choice) {
  speed = choice;
  speedButtons.forEach((button, i) => {
    button.setAttribute("aria-pressed", String(SPEEDS[i] === choice));
  });
}

/* --- hands ----------------------------------------------------------------------------------- */
byId("title").textContent = about.title;
byId("play").addEventListener("click", () => { setPlaying(!playing); });
byId("again").addEventListener("click", again);
byId("reset").addEventListener("click", () => {
  wanted = {};
  start = Float64Array.from(about.start);
  for (const slider of sliders) {
    slider.input.value = slider.value;
    tell(slider);
    if (slider.kind === "parameter") { mechanism.set({ [slider.name]: slider.value }); }
    if (slider.kind === "input") { mechanism.give({ [slider.name]: slider.value }); }
  }
  again();
});
byId("stage").addEventListener("pointermove", (event) => {
  if (!event.buttons || turn === null) { return; }
  const tilt = turn[1] + event.movementY / 150;
  turn = [turn[0] - event.movementX / 150, Math.max(-1.5, Math.min(1.5, tilt))];
  draw();
});
document.addEventListener("keydown", (event) => {
  if (event.key !== " " || event.target !== document.body) { return; }
  setPlaying(!playing);
  event.preventDefault();
});
darkness.addEventListener("change", draw);
new ResizeObserver(draw).observe(byId("stage"));
sliders.forEach(tell);
setSpeed(1);
again();
if (!matchMedia("(prefers-reduced-motion: reduce)").matches) { setPlaying(true); }
