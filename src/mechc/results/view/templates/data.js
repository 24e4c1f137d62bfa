// The motion at any time: frames, filled in by cubics (Catmull and Rom).
let motion, span, tracks, pointCount, placed, solidCount, timeDigits;

function takeData(given) {
  motion = given;
  span = motion.step * (motion.frames - 1);
  tracks = floats(motion.tracks); pointCount = motion.points.length;
  placed = floats(motion.placed); solidCount = motion.solids.length;  // x, y, z and a quaternion
  timeDigits = span > 0 ? digitsFor(span) : 3;
}
function floats(text) {
  const raw = atob(text), bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i += 1) { bytes[i] = raw.charCodeAt(i); }
  return new Float32Array(bytes.buffer);
}
function fractionAt(elapsed) {
  return motion.step > 0 ? Math.max(0, Math.min(elapsed / motion.step, motion.frames - 1)) : 0;
}
function cubic(values, width, column, at) {
  const last = motion.frames - 1, i = Math.floor(at), s = at - i;
  const b = values[i * width + column];
  if (s === 0) { return b; }
  const a = values[Math.max(0, i - 1) * width + column];
  const c = values[Math.min(last, i + 1) * width + column];
  const d = values[Math.min(last, i + 2) * width + column];
  const first = i > 0 ? (c - a) / 2 : c - b, second = i + 1 < last ? (d - b) / 2 : c - b;
  const rise = c - b;
  return b + s * (first + s * (3 * rise - 2 * first - second + s * (first + second - 2 * rise)));
}
function place(point, at, out) {
  const width = 3 * pointCount;
  return out.set(
    cubic(tracks, width, 3 * point, at), cubic(tracks, width, 3 * point + 1, at),
    cubic(tracks, width, 3 * point + 2, at)
  );
}
function placeSolid(solid, at, position, turn) {
  const width = 7 * solidCount, column = 7 * solid;
  position.set(cubic(placed, width, column, at), cubic(placed, width, column + 1, at), cubic(placed, width, column + 2, at));
  const i = Math.floor(at), s = at - i, a = i * width + column + 3;
  const b = Math.min(motion.frames - 1, i + 1) * width + column + 3;
  turn.set(
    placed[a] + s * (placed[b] - placed[a]), placed[a + 1] + s * (placed[b + 1] - placed[a + 1]),
    placed[a + 2] + s * (placed[b + 2] - placed[a + 2]), placed[a + 3] + s * (placed[b + 3] - placed[a + 3])
  ).normalize();
}
function number(value, digits) {
  const text = Math.abs(value).toFixed(digits);
  return value < 0 && Number(text) !== 0 ? "\u2212" + text : text;
}
function digitsFor(largest) {
  return largest > 0 ? Math.max(0, Math.min(9, 3 - Math.floor(Math.log10(largest)))) : 2;
}
function timeText(elapsed) { return number(motion.start + elapsed, timeDigits) + " s"; }
function element(tag, text, parent) {
  const made = document.createElement(tag);
  made.textContent = text;  // user text is only ever set as text
  parent.appendChild(made);
  return made;
}
function found(id) { return document.getElementById(id); }
takeData(JSON.parse(found("motion").textContent));
