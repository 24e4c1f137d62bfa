// Coordinates and energies over time, with the cursor of the motion.
const DASHES = [[], [7, 3], [2, 3], [9, 3, 2, 3]];
const charts = [];
const TOP = 8;  // half of a label

function addPlots() {
  const box = byId("plots");
  motion.panels.forEach(function (panel) {
    const area = element("section", "", box), head = element("h2", panel.title + " ", area);
    area.className = "panel";
    if (panel.unit) { element("small", "(" + panel.unit + ")", head); }
    const canvas = element("canvas", "", area), legend = element("div", "", area);
    legend.className = "legend";
    const chart = { panel: panel, canvas: canvas, front: canvas.getContext("2d"), back: document.createElement("canvas") };
    chart.brush = chart.back.getContext("2d");
    chart.lines = panel.lines.map(function (line, i) { return addLine(chart, line, i, legend); });
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", panel.title + " over time: " + panel.lines.map(function (l) { return l.name; }).join(", "));
    if (panel.untold) { element("small", "and " + panel.untold + " more", legend); }
    listen(chart);
    charts.push(chart);
  });
  byId("plots-button").hidden = box.hidden = !charts.length;
}
function addLine(chart, line, i, legend) {
  const choice = button(legend, "", "Show or hide", flip), swatch = element("canvas", "", choice);
  element("b", line.name, choice);
  const made = { name: line.name, index: i, shown: true, swatch: swatch, output: element("span", "", choice) };
  function flip() {
    made.shown = !made.shown;
    choice.setAttribute("aria-pressed", String(made.shown));
    drawPlots();
  }
  choice.setAttribute("aria-pressed", "true");
  fillLine(chart, made, line);
  return made;
}
function fillLine(chart, made, line) {
  const largest = (made.values = floats(line.values)).reduce(function (most, x) { return Math.max(most, Math.abs(x)); }, 0);
  made.dash = line.dash;
  made.digits = chart.panel.unit === "\u00b0" ? 1 : digitsFor(largest);
}
function fillPlots() {
  charts.forEach(function (chart, k) {
    chart.lines.forEach(function (made, i) { fillLine(chart, made, motion.panels[k].lines[i]); });
  });
}
function listen(chart) {
  function seekThere(event) {
    const box = chart.canvas.getBoundingClientRect();
    setPlaying(false);
    seek((event.clientX - box.left - chart.left) / (chart.width - chart.left - 6) * span);
  }
  chart.canvas.addEventListener("pointerdown", function (event) {
    chart.canvas.setPointerCapture(event.pointerId);
    seekThere(event);
  });
  chart.canvas.addEventListener("pointermove", function (event) { if (event.buttons) { seekThere(event); } });
}
function lineStyle(brush, line) {
  const palette = look.palette;
  brush.strokeStyle = palette[line.index % palette.length];
  brush.lineWidth = 1.6;
  brush.setLineDash(line.dash.length ? [1.6 * line.dash[1], 1.6 * line.dash[2]] : DASHES[Math.floor(line.index / palette.length) % DASHES.length]);
  brush.lineDashOffset = line.dash.length ? 1.6 * line.dash[0] : 0;
}
function sharp(canvas, brush, shown) {
  // As many dots as the screen has where it is shown; returns its size there.
  const ratio = window.devicePixelRatio || 1, width = shown.clientWidth, height = shown.clientHeight;
  canvas.width = Math.max(1, Math.round(width * ratio));
  canvas.height = Math.max(1, Math.round(height * ratio));
  brush.setTransform(ratio, 0, 0, ratio, 0, 0);
  return [width, height];
}
function limits(chart) {
  let low = Infinity, high = -Infinity;
  chart.lines.forEach(function (line) {
    if (!line.shown) { return; }
    line.values.forEach(function (x) { if (x < low) { low = x; } if (x > high) { high = x; } });
  });
  if (!(high >= low)) { low = 0; high = 1; }
  const size = high - low, most = Math.max(Math.abs(low), Math.abs(high));
  const gap = size > 1e-6 * most ? 0.05 * size : 0.05 * (most || 1);
  return [low - gap, high + gap];
}
function tickMarks(low, high, count) {
  const step = roundUp((high - low) / Math.max(1, count)), marks = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k += 1) { marks.push(k * step); }
  return { values: marks, digits: Math.max(0, Math.min(9, -Math.floor(Math.log10(step) + 1e-9))) };
}
function measureChart(chart) {
  const brush = chart.brush, size = sharp(chart.back, brush, chart.canvas), range = limits(chart);
  chart.width = size[0]; chart.height = size[1]; chart.low = range[0]; chart.high = range[1];
  brush.font = "11px system-ui, sans-serif";
  chart.ticks = tickMarks(range[0], range[1], size[1] / 24);
  chart.texts = chart.ticks.values.map(function (x) { return number(x, chart.ticks.digits); });
  chart.bottom = size[1] - 17;
  return Math.max.apply(null, [14].concat(chart.texts.map(function (text) { return brush.measureText(text).width; })));
}
function drawChart(chart, left) {
  if (!(chart.width > 60)) { return; }
  chart.left = left;
  drawAxes(chart, chart.ticks, chart.texts);
  chart.lines.forEach(function (line) {
    drawSwatch(line);
    if (line.shown) { drawLine(chart, line); }
  });
  drawMarks(chart);
  sharp(chart.canvas, chart.front, chart.canvas);
  drawCursor(chart);
}
function downTo(chart, value) { return TOP + (chart.bottom - TOP) * (chart.high - value) / (chart.high - chart.low); }
function acrossTo(chart, part) { return chart.left + (chart.width - chart.left - 6) * part; }
function drawAxes(chart, ticks, texts) {
  const brush = chart.brush;
  brush.clearRect(0, 0, chart.width, chart.height);
  brush.setLineDash([]);
  brush.lineWidth = 1;
  brush.strokeStyle = look.line;
  brush.fillStyle = look.quiet;
  brush.textBaseline = "middle";
  brush.textAlign = "right";
  ticks.values.forEach(function (x, i) {
    const y = Math.round(downTo(chart, x)) + 0.5;
    brush.beginPath(); brush.moveTo(chart.left, y); brush.lineTo(chart.width - 6, y); brush.stroke();
    brush.fillText(texts[i], chart.left - 5, y);
  });
  const times = tickMarks(motion.start, motion.start + (span || 1), chart.width / 52);
  brush.textBaseline = "alphabetic";
  times.values.forEach(function (t) {
    const x = acrossTo(chart, (t - motion.start) / (span || 1));
    brush.textAlign = x > chart.width - 24 ? "right" : "center";
    brush.fillText(number(t, times.digits) + " s", Math.min(x, chart.width - 1), chart.height - 3);
  });
}
function drawLine(chart, line) {
  const brush = chart.brush, count = line.values.length;
  lineStyle(brush, line);
  brush.lineJoin = "round";
  brush.beginPath();
  for (let k = 0; k < count; k += 1) {
    const part = count < 2 ? 0 : curveTimes ? curveTimes[k] / span : k / (count - 1);
    const x = acrossTo(chart, part), y = downTo(chart, line.values[k]);
    if (k === 0) { brush.moveTo(x, y); } else { brush.lineTo(x, y); }
  }
  brush.stroke();
  brush.setLineDash([]);
}
function drawSwatch(line) {
  const brush = line.swatch.getContext("2d"), size = sharp(line.swatch, brush, line.swatch);
  lineStyle(brush, line);
  brush.lineWidth = 2.2;
  brush.beginPath(); brush.moveTo(0, size[1] / 2); brush.lineTo(size[0], size[1] / 2); brush.stroke();
}
function drawMarks(chart) {
  const brush = chart.brush;
  brush.setLineDash([2, 3]);
  brush.lineWidth = 1;
  motion.marks.forEach(function (mark) {
    const x = acrossTo(chart, (mark.t - motion.start) / (span || 1));
    brush.strokeStyle = mark.kind === "event" ? look.event : look.quiet;
    brush.beginPath(); brush.moveTo(x, 4); brush.lineTo(x, chart.bottom); brush.stroke();
  });
  brush.setLineDash([]);
}
function drawCursor(chart) {
  if (!chart.width) { return; }
  const brush = chart.front;
  brush.clearRect(0, 0, chart.width, chart.height);
  brush.drawImage(chart.back, 0, 0, chart.width, chart.height);
  const x = acrossTo(chart, span > 0 ? state.elapsed / span : 0);
  brush.strokeStyle = look.ink;
  brush.lineWidth = 1;
  brush.beginPath(); brush.moveTo(x, 2); brush.lineTo(x, chart.bottom); brush.stroke();
  chart.lines.forEach(function (line) {
    const value = curveAt(line.values, state.elapsed);
    line.output.textContent = number(value, line.digits);
    if (!line.shown) { return; }
    brush.fillStyle = look.palette[line.index % look.palette.length];
    brush.beginPath(); brush.arc(x, downTo(chart, value), 3, 0, 2 * Math.PI); brush.fill();
  });
}
function drawPlots() {
  const left = 8 + Math.max.apply(null, [0].concat(charts.map(measureChart)));  // one for all: the same times lie below each other
  charts.forEach(function (chart) { drawChart(chart, left); });
}
function moveCursors() { if (!byId("plots").hidden) { charts.forEach(drawCursor); } }
function switchPlots() {
  const plots = byId("plots");
  if (!charts.length) { return; }
  plots.hidden = !plots.hidden;
  byId("plots-button").setAttribute("aria-pressed", String(!plots.hidden));
  drawPlots();
}
themeUsers.push(drawPlots);
