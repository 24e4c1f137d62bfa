// The motion at any time: frames, filled in by cubics (Catmull and Rom).
let motion, span, tracks, columns, pointCount, timeDigits, curveTimes, activations;

function takeData(given) {
  motion = given;
  span = motion.step * (motion.frames - 1);
  tracks = floats(motion.tracks); pointCount = motion.points.length;
  columns = tracks.length / (motion.frames * pointCount) || 3;  // x, y and, of a motion in space, z
  curveTimes = motion.times ? floats(motion.times) : null;  // else those of the frames
  activations = new Map(muscles().map(function (muscle) { return [muscle, floats(muscle.activation)]; }));
  timeDigits = span > 0 ? digitsFor(Math.fround(span)) : 3;  // the product may be an ulp below 1 s
}
function floats(values) {
  if (typeof values !== "string") { return Float32Array.from(values); }
  return new Float32Array(Uint8Array.from(atob(values), function (letter) { return letter.charCodeAt(0); }).buffer);
}
function fractionAt(elapsed) {
  return motion.step > 0 ? Math.max(0, Math.min(elapsed / motion.step, motion.frames - 1)) : 0;
}
function cubic(values, width, column, at, rate) {
  // The value at a fraction of frames, or its rate a frame.
  const last = motion.frames - 1, i = Math.min(Math.floor(at), Math.max(0, last - 1)), s = at - i;
  const b = values[i * width + column], c = values[Math.min(last, i + 1) * width + column];
  const a = values[Math.max(0, i - 1) * width + column], d = values[Math.min(last, i + 2) * width + column];
  const first = i > 0 ? (c - a) / 2 : c - b, second = i + 1 < last ? (d - b) / 2 : c - b;
  const square = 3 * (c - b) - 2 * first - second, cube = first + second - 2 * (c - b);
  return rate ? first + s * (2 * square + 3 * s * cube) : b + s * (first + s * (square + s * cube));
}
function muscles() {
  return (motion.struts || []).filter(function (strut) { return strut.kind === "muscle"; });
}
function activationOf(muscle, at) { return Math.max(0, Math.min(1, cubic(activations.get(muscle), 1, 0, at))); }
function curveAt(values, elapsed) {
  // The value of a curve beside the picture: straight between its own times.
  if (!curveTimes) { return cubic(values, 1, 0, fractionAt(elapsed)); }
  let low = 0, high = curveTimes.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (curveTimes[middle] <= elapsed) { low = middle; } else { high = middle; }
  }
  const part = high > low ? (elapsed - curveTimes[low]) / (curveTimes[high] - curveTimes[low]) : 0;
  return values[low] + Math.max(0, Math.min(1, part)) * (values[high] - values[low]);
}
function digitsFor(largest) {
  return largest > 0 ? Math.max(0, Math.min(9, 3 - Math.floor(Math.log10(largest)))) : 2;
}
function roundUp(wished) {
  const power = Math.pow(10, Math.floor(Math.log10(wished))), lead = wished / power;
  return power * (lead > 5 ? 10 : lead > 2 ? 5 : lead > 1 ? 2 : 1);
}
function roundDown(wished) {
  const power = Math.pow(10, Math.floor(Math.log10(wished))), lead = wished / power;
  return power * (lead >= 5 ? 5 : lead >= 2 ? 2 : 1);
}
function timeText(elapsed) { return number(motion.start + elapsed, timeDigits) + " s"; }
function isMarked(point) { return motion.points[point][0] !== "."; }  // points of curves are not
function byId(id) { return document.getElementById(id); }
takeData(JSON.parse(byId("motion").textContent));
