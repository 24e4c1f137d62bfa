// The picture on a canvas: links, pivots and paths, seen along one direction.  A motion in space is
// turned by dragging.
const stage = byId("stage"), canvas = byId("canvas"), brush = canvas.getContext("2d");
const FADES = 24;  // pieces of the recent part of a path
const MOST_TILT = 1.5;
let low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
let turn = [0.6, 0.4], width = 0, height = 0, unit = 1, screen = null, screenPaths = null;
let dotOf = null;  // a place in the motion's coordinates as dots on the screen

function startPicture() {
  canvas.setAttribute("aria-label", motion.title + " in motion");
  canvas.classList.toggle("turns", !motion.flat);
  renewPicture();
  resize();
}
function renewPicture() {
  // There is room for all frames; it never shrinks while values change.
  tracks.forEach(function (x, i) {
    low[i % columns] = Math.min(low[i % columns], x);
    high[i % columns] = Math.max(high[i % columns], x);
  });
  project();
}
function resize() {
  [width, height] = sharp(canvas, brush, canvas);
  unit = Math.max(3.5, Math.min(9, 0.013 * Math.min(width, height)));
  project();
}
function combine(a, s, b, c) { return a.map(function (x, i) { return s * x + c * b[i]; }); }
function directions() {
  // To the right and up on the screen.
  const right = motion.right, up = motion.up, yaw = turn[0], pitch = turn[1];
  if (motion.flat) { return [right, up]; }
  const depth = [0, 1, 2].map(function (i) {
    return right[(i + 1) % 3] * up[(i + 2) % 3] - right[(i + 2) % 3] * up[(i + 1) % 3];
  });
  const away = combine(depth, Math.cos(yaw), right, -Math.sin(yaw));
  return [
    combine(right, Math.cos(yaw), depth, Math.sin(yaw)), combine(up, Math.cos(pitch), away, -Math.sin(pitch))
  ];
}
function project() {
  // Each point of all frames and paths as dots on the screen: the box of the motion fills the picture.
  const axes = directions(), half = [0, 1, 2].map(function (k) { return k < columns ? (high[k] - low[k]) / 2 : 0; });
  const middle = low.map(function (x, k) { return x + half[k]; });
  const reach = axes.map(function (axis) {
    return axis.reduce(function (sum, x, k) { return sum + Math.abs(x) * half[k]; }, 0);
  });
  const margin = Math.max(28, 0.09 * Math.min(width, height));
  const room = Math.min((width / 2 - margin) / reach[0], (height / 2 - margin) / reach[1]);
  const scale = room > 0 && room < Infinity ? room : 1;
  dotOf = function (place) { return Array.from(onScreen(place)); };
  function onScreen(points) {
    const dots = new Float32Array(2 * points.length / columns);
    for (let i = 0; 2 * i < dots.length; i += 1) {
      let across = 0, upwards = 0;
      for (let k = 0; k < columns; k += 1) {
        const x = points[columns * i + k] - middle[k];
        across += axes[0][k] * x; upwards += axes[1][k] * x;
      }
      dots[2 * i] = width / 2 + scale * across;
      dots[2 * i + 1] = height / 2 - scale * upwards;
    }
    return dots;
  }
  screen = onScreen(tracks); screenPaths = onScreen(paths);
  tellScale(room < Infinity ? scale : 0);
}
function tellScale(scale) {
  const note = byId("scale"), length = roundDown(110 / scale);
  note.hidden = !(scale > 0) || !pointCount;
  if (note.hidden) { return; }
  note.className = "bar";
  note.style.width = length * scale + "px";
  note.textContent = threeDigits(length) + " m";
  furtherNotes = wordsOfForces(length, longestArrow());
  tellNotes();
}
function longestArrow() { return 0.4 * Math.max(high[0] - low[0], high[1] - low[1]); }
function spot(point, at) {
  return [cubic(screen, 2 * pointCount, 2 * point, at), cubic(screen, 2 * pointCount, 2 * point + 1, at)];
}

// -- drawing ----------------------------------------------------------------------------------
function paint(at) {
  const joints = new Set(motion.ground);
  motion.links.forEach(function (link) { link.points.forEach(function (point) { joints.add(point); }); });
  muscles().forEach(function (muscle) { muscle.points.forEach(function (point) { joints.add(point); }); });
  brush.clearRect(0, 0, width, height);
  if (!pointCount) { sayNothingToDraw(); return; }
  motion.traced.forEach(function (point, order) { drawTrail(order, at * motion.step, colourOfTrail(order)); });
  const guides = motion.guides || [];
  guides.forEach(function (guide) { drawGuide(guide, at); });
  motion.ground.forEach(function (point) { drawPivot(spot(point, at)); });
  muscles().forEach(function (muscle) { drawMuscle(muscle, at); });
  motion.links.forEach(function (link) { drawLink(link, at, look.sky, 3); });
  motion.links.forEach(function (link, index) { drawLink(link, at, colourOf(index, motion.links.length), 0); });
  guides.forEach(function (guide) { if (guide.block) { drawBlock(guide, at); } });
  motion.points.forEach(function (_, point) {
    const isJoint = joints.has(point) || motion.links.length === 0;
    if (!isMarked(point) || !(isJoint || motion.traced.includes(point))) { return; }
    if (isJoint) { drawDisc(spot(point, at), 0.95 * unit, look.paper, look.ink, 0.32 * unit); }
    else { drawDisc(spot(point, at), 0.6 * unit, look.ink, look.paper, 1.5); }
  });
  drawForces(at);
}
function sayNothingToDraw() {
  brush.fillStyle = look.quiet;
  brush.font = "15px system-ui, sans-serif";
  brush.textAlign = "center";
  brush.fillText("No points to draw.", width / 2, height / 2);
}
function colourOfTrail(order) {
  const ends = motion.links.map(function (link) { return link.points[link.points.length - 1]; });
  const link = ends.indexOf(motion.traced[order]), palette = look.palette;
  const loose = motion.traced.slice(0, order).filter(function (point) { return !ends.includes(point); }).length;
  if (link >= 0) { return colourOf(link, motion.links.length); }
  return palette[(Math.min(motion.links.length, 3) + loose) % palette.length];
}
function drawTrail(order, now, colour) {
  const recent = Math.min(span, Math.max(12 * motion.step, 1.2 * Math.max(state.speed, 0.25)));
  Object.assign(brush, { strokeStyle: colour, lineJoin: "round", lineCap: "butt" });
  drawPath(order, 0, now, Math.max(1.2, 0.3 * unit), 0.28);
  for (let k = 1; k <= FADES; k += 1) {
    const to = now - recent * (1 - k / FADES), part = k / FADES;
    drawPath(order, Math.max(0, to - recent / FADES), to, unit * (0.3 + 0.25 * part), 0.75 * part);
  }
  brush.globalAlpha = 1;
}
function drawPath(order, from, to, thickness, opacity) {
  if (!(from < to)) { return; }
  const width = 2 * motion.traced.length, dot = [0, 0], end = firstAfter(pathTimes, to);
  Object.assign(brush, { lineWidth: thickness, globalAlpha: opacity });
  brush.beginPath();
  pathAt(screenPaths, 2, order, from, dot);
  brush.moveTo(dot[0], dot[1]);
  for (let i = firstAfter(pathTimes, from); i < end; i += 1) {
    brush.lineTo(screenPaths[i * width + 2 * order], screenPaths[i * width + 2 * order + 1]);
  }
  pathAt(screenPaths, 2, order, to, dot);
  brush.lineTo(dot[0], dot[1]);
  brush.stroke();
}
function drawLink(link, at, colour, rim) { strokeThrough(link.points, at, colour, 1.5 * unit + rim); }
function drawMuscle(muscle, at) {
  const active = activationOf(muscle, at);
  strokeThrough(muscle.points, at, colourOfMuscle(active), (0.5 + 1.3 * active) * unit);
}
function strokeThrough(points, at, colour, thickness) {
  brush.beginPath();
  points.forEach(function (point) {
    const p = spot(point, at);
    brush.lineTo(p[0], p[1]);
  });
  Object.assign(brush, { strokeStyle: colour, lineWidth: thickness, lineJoin: "round", lineCap: "round" });
  brush.stroke();
}
const arrowData = new WeakMap();  // of a motion: numbers of its arrows
function numbersOf(arrow) {
  if (!arrowData.has(arrow)) { arrowData.set(arrow, [floats(arrow.at), floats(arrow.force)]); }
  return arrowData.get(arrow);
}
function drawForces(at) {
  forcesShown.forEach(function (kind) {
    const scale = metresPerNewton(kind, longestArrow());
    forcesOf(kind).forEach(function (arrow) {
      const both = numbersOf(arrow).map(function (values) { return [0, 1].map(function (k) { return cubic(values, 2, k, at); }); });
      const tip = both[0].map(function (x, k) { return x + scale * both[1][k]; });
      const ends = [dotOf(both[0]), dotOf(tip)];
      drawArrow(ends, look.sky, 3);
      drawArrow(ends, kind === "loads" ? look.ink : look.event, 0);
    });
  });
}
function drawArrow([from, to], colour, rim) {
  const length = Math.hypot(to[0] - from[0], to[1] - from[1]), head = Math.min(2.4 * unit, 0.6 * length);
  if (!(length > 2)) { return; }
  const along = [(to[0] - from[0]) / length, (to[1] - from[1]) / length], neck = [to[0] - head * along[0], to[1] - head * along[1]];
  Object.assign(brush, { strokeStyle: colour, fillStyle: colour, lineWidth: 0.6 * unit + rim, lineCap: "round", lineJoin: "round" });
  brush.beginPath(); brush.moveTo(from[0], from[1]); brush.lineTo(neck[0], neck[1]); brush.stroke();
  brush.beginPath();
  brush.moveTo(to[0], to[1]);
  brush.lineTo(neck[0] - 0.45 * head * along[1], neck[1] + 0.45 * head * along[0]);
  brush.lineTo(neck[0] + 0.45 * head * along[1], neck[1] - 0.45 * head * along[0]);
  brush.closePath();
  brush.fill();
  if (rim) { brush.lineWidth = rim; brush.stroke(); }
}
function drawGuide(guide, at) {
  const from = spot(guide.points[0], at), to = spot(guide.points[1], at);
  Object.assign(brush, { strokeStyle: look.line, lineWidth: 0.8 * unit, lineCap: "butt" });
  brush.beginPath(); brush.moveTo(from[0], from[1]); brush.lineTo(to[0], to[1]); brush.stroke();
}
function drawBlock(guide, at) {
  const from = spot(guide.points[0], at), to = spot(guide.points[1], at), p = spot(guide.points[2], at);
  const index = motion.links.findIndex(function (link) { return link.label === guide.label; });
  brush.save();
  brush.translate(p[0], p[1]);
  brush.rotate(Math.atan2(to[1] - from[1], to[0] - from[0]));
  Object.assign(brush, { fillStyle: colourOf(index < 0 ? motion.links.length : index, motion.links.length), strokeStyle: look.ink, lineWidth: 0.32 * unit, lineJoin: "round" });
  brush.beginPath(); brush.rect(-2.4 * unit, -1.6 * unit, 4.8 * unit, 3.2 * unit); brush.fill(); brush.stroke();
  brush.restore();
}
function drawDisc(p, radius, fill, edge, thickness) {
  Object.assign(brush, { fillStyle: fill, strokeStyle: edge, lineWidth: thickness });
  brush.beginPath();
  brush.arc(p[0], p[1], radius, 0, 2 * Math.PI);
  brush.fill();
  brush.stroke();
}
function drawPivot(p) {
  const s = 2.5 * unit, y = p[1] + 1.15 * s;
  Object.assign(brush, { strokeStyle: look.quiet, fillStyle: look.paper, lineJoin: "round" });
  brush.lineWidth = Math.max(1.2, 0.22 * unit);
  brush.beginPath();
  brush.moveTo(p[0], p[1]);
  brush.lineTo(p[0] - 0.75 * s, y);
  brush.lineTo(p[0] + 0.75 * s, y);
  brush.closePath();
  brush.fill();
  brush.moveTo(p[0] - 1.25 * s, y);
  brush.lineTo(p[0] + 1.25 * s, y);
  for (let k = -2; k <= 2; k += 1) {
    brush.moveTo(p[0] + (0.5 * k + 0.2) * s, y);
    brush.lineTo(p[0] + (0.5 * k - 0.2) * s, y + 0.4 * s);
  }
  brush.stroke();
}
canvas.addEventListener("pointermove", function (event) {
  if (!event.buttons || motion.flat) { return; }
  const tilt = turn[1] + event.movementY / 150;
  turn = [turn[0] - event.movementX / 150, Math.max(-MOST_TILT, Math.min(MOST_TILT, tilt))];
  project();
  show();
});
