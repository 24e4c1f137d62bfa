// The motion at any time: frames, filled in by cubics (Catmull and Rom).
let motion, span, tracks, columns, pointCount, timeDigits, curveTimes, activations;
let pathTimes, paths;  // of the traced points: straight between times of their own
const BESIDE_PATH = 0.0005, MOST_PIECES = 40000;  // of the largest extent: how far from these lines a cubic may be

function takeData(given) {
  motion = given;
  span = motion.step * (motion.frames - 1);
  tracks = floats(motion.tracks); pointCount = motion.points.length;
  columns = tracks.length / (motion.frames * pointCount) || 3;  // x, y and, of a motion in space, z
  curveTimes = motion.times ? floats(motion.times) : null;  // else those of the frames
  activations = new Map(muscles().map(function (muscle) { return [muscle, floats(muscle.activation)]; }));
  takePaths();
  timeDigits = span > 0 ? digitsFor(Math.fround(span)) : 3;  // the product may be an ulp below 1 s
}
function floats(values) {
  if (typeof values !== "string") { return Float32Array.from(values); }
  return new Float32Array(Uint8Array.from(atob(values), function (letter) { return letter.charCodeAt(0); }).buffer);
}
function fractionAt(elapsed) {
  return motion.step > 0 ? Math.max(0, Math.min(elapsed / motion.step, motion.frames - 1)) : 0;
}
function takePaths() {
  // Through the points that are given, or those of the frames, cubics in the more pieces the more they bend.
  const given = motion.paths ? floats(motion.paths.times) : Float64Array.from({ length: tracks.length ? motion.frames : 0 }, function (_, i) { return i * motion.step; });
  const width = columns * motion.traced.length, points = motion.paths ? floats(motion.paths.points) : tracksOfTraced(width);
  const rates = ratesAt(given, points, width), near = BESIDE_PATH * extent(points, width), times = [], values = [];
  const most = Math.max(1, Math.min(12, Math.floor(MOST_PIECES / given.length)));
  for (let i = 0; i < given.length; i += 1) {
    const gap = i + 1 < given.length ? given[i + 1] - given[i] : 0, a = i * width, b = a + width;
    let sag = 0;
    for (let k = 0; gap > 0 && k < width; k += 1) { sag = Math.max(sag, gap * Math.abs(rates[b + k] - rates[a + k]) / 8); }
    const pieces = gap > 0 ? Math.max(1, Math.min(most, Math.ceil(Math.sqrt(sag / near)))) || 1 : 1;
    for (let piece = 0; piece < pieces; piece += 1) {
      const s = piece / pieces;
      times.push(given[i] + s * gap);
      for (let k = 0; k < width; k += 1) {
        const way = s > 0 ? points[b + k] - points[a + k] : 0, first = gap * rates[a + k], last = s > 0 ? gap * rates[b + k] : 0;
        values.push(points[a + k] + s * (first + s * (3 * way - 2 * first - last + s * (first + last - 2 * way))));
      }
    }
  }
  pathTimes = Float64Array.from(times); paths = Float32Array.from(values);
}
function tracksOfTraced(width) {
  const found = new Float32Array(width * motion.frames);
  for (let i = 0; tracks.length && i < motion.frames; i += 1) {
    motion.traced.forEach(function (point, order) {
      const from = columns * (i * pointCount + point);
      found.set(tracks.subarray(from, from + columns), i * width + columns * order);
    });
  }
  return found;
}
function ratesAt(times, points, width) {
  // Those of the parabola through each point and its neighbours.
  const last = times.length - 1;
  return Float64Array.from(points, function (x, j) {
    const i = Math.floor(j / width), before = i > 0 ? times[i] - times[i - 1] : 0, after = i < last ? times[i + 1] - times[i] : 0;
    const one = before > 0 ? (x - points[j - width]) / before : 0, other = after > 0 ? (points[j + width] - x) / after : 0;
    if (!(before > 0 && after > 0)) { return one + other; }
    return (one * after + other * before) / (before + after);
  });
}
function extent(points, width) {
  let most = 0;
  for (let k = 0; k < width; k += 1) {
    let low = Infinity, high = -Infinity;
    for (let j = k; j < points.length; j += width) { low = Math.min(low, points[j]); high = Math.max(high, points[j]); }
    most = Math.max(most, high - low);
  }
  return most;
}
function pathAt(values, dims, order, elapsed, out) {
  // A point of a path, of this order among the traced; values are its coordinates at pathTimes.
  const width = dims * motion.traced.length, next = Math.min(firstAfter(pathTimes, elapsed), pathTimes.length - 1), last = Math.max(0, next - 1);
  const gap = pathTimes[next] - pathTimes[last], part = gap > 0 ? Math.max(0, Math.min(1, (elapsed - pathTimes[last]) / gap)) : 0;
  for (let k = 0; k < dims; k += 1) {
    const a = values[last * width + dims * order + k], b = values[next * width + dims * order + k];
    out[k] = a + part * (b - a);
  }
  return out;
}
function firstAfter(times, elapsed) {
  // The number of the first time after this one.
  let low = 0, high = times.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] <= elapsed) { low = middle + 1; } else { high = middle; }
  }
  return low;
}
function cubic(values, width, column, at) {
  // The value at a fraction of frames.
  const last = motion.frames - 1, i = Math.min(Math.floor(at), Math.max(0, last - 1)), s = at - i;
  const b = values[i * width + column], c = values[Math.min(last, i + 1) * width + column];
  const a = values[Math.max(0, i - 1) * width + column], d = values[Math.min(last, i + 2) * width + column];
  const first = i > 0 ? (c - a) / 2 : c - b, second = i + 1 < last ? (d - b) / 2 : c - b;
  const square = 3 * (c - b) - 2 * first - second, cube = first + second - 2 * (c - b);
  return b + s * (first + s * (square + s * cube));
}
function muscles() {
  return (motion.struts || []).filter(function (strut) { return strut.kind === "muscle"; });
}
function activationOf(muscle, at) { return Math.max(0, Math.min(1, cubic(activations.get(muscle), 1, 0, at))); }
function curveAt(values, elapsed) {
  // The value of a curve beside the picture: straight between its own times.
  if (!curveTimes) { return cubic(values, 1, 0, fractionAt(elapsed)); }
  const high = Math.min(firstAfter(curveTimes, elapsed), curveTimes.length - 1), low = Math.max(0, high - 1);
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
