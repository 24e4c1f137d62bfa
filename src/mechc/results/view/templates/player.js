// Time: play, pause, speed, step, loop, the time line.
const state = { elapsed: 0, playing: false, looping: true, speed: motion.speed };
const scrub = found("scrub"), playButton = found("play");
let lastTick = null;

function show() {
  const at = fractionAt(state.elapsed);
  moveBodies(at);
  if (orbit) { followTo(at); moveTrails(at, state.speed); }
  found("clock").textContent = timeText(state.elapsed);
  scrub.value = span > 0 ? String(state.elapsed / span) : "0";
  scrub.setAttribute("aria-valuetext", timeText(state.elapsed));
  moveCursors();
  redraw();
}
function seek(time) {
  state.elapsed = Math.max(0, Math.min(span, time));
  show();
}
function setPlaying(on) {
  const before = state.playing;
  state.playing = on && span > 0;
  if (state.playing && state.elapsed >= span) { state.elapsed = 0; }
  playButton.textContent = state.playing ? "Pause" : "Play";
  lastTick = null;
  if (state.playing && !before) { requestAnimationFrame(tick); }
  if (before !== state.playing) { say(state.playing ? "Playing from " + timeText(state.elapsed) + "." : "Paused. " + toldState()); }
  if (!state.playing) { rememberTime(); }
}
function tick(now) {
  if (!state.playing) { return; }
  const before = state.elapsed;
  if (lastTick !== null) { state.elapsed += state.speed * Math.min(0.25, (now - lastTick) / 1000); }
  lastTick = now;
  sayMarks(before, Math.min(span, state.elapsed));
  if (state.elapsed >= span) {
    if (state.looping) { state.elapsed = state.elapsed % span; } else { state.elapsed = span; }
  }
  show();
  if (state.elapsed >= span && !state.looping) { setPlaying(false); return; }
  requestAnimationFrame(tick);
}
function step(frames) {
  setPlaying(false);
  seek((Math.round(state.elapsed / (motion.step || 1)) + frames) * motion.step);
  said();
}
function leap(part) { setPlaying(false); seek(state.elapsed + part * span); said(); }
function goTo(time) { setPlaying(false); seek(time); said(); }
function setSpeed(choice) {
  state.speed = choice;
  speedButtons.forEach(function (button, i) {
    button.setAttribute("aria-pressed", String(motion.speeds[i] === choice));
  });
  show();
}
function nextSpeed(way) {
  const i = Math.max(0, Math.min(motion.speeds.length - 1, motion.speeds.indexOf(state.speed) + way));
  setSpeed(motion.speeds[i]);
  say("Speed " + motion.speeds[i] + ".");
}
function setLoop() {
  state.looping = !state.looping;
  found("loop").setAttribute("aria-pressed", String(state.looping));
  say(state.looping ? "It starts again at the end." : "It stops at the end.");
}
const speedButtons = motion.speeds.map(function (choice) {
  const button = element("button", String(choice) + "\u00d7", found("speeds"));
  button.type = "button";
  button.addEventListener("click", function () { setSpeed(choice); });
  return button;
});
function tellNotes() { found("notes").textContent = motion.notes.join(" \u00b7 "); }
function addMarks() {
  found("ticks").textContent = "";
  motion.marks.forEach(function (mark) {
    if (!(span > 0)) { return; }
    const tickMark = element("i", "", found("ticks"));
    tickMark.className = mark.kind;
    tickMark.style.left = String(100 * (mark.t - motion.start) / span) + "%";
    tickMark.title = mark.label + ", " + timeText(mark.t - motion.start);
    tickMark.addEventListener("click", function () { goTo(mark.t - motion.start); });
  });
}
function rememberTime() {
  // The address then leads back to this moment; a sandboxed frame may not, and need not.
  try { history.replaceState(null, "", "#t=" + Number((motion.start + state.elapsed).toPrecision(6))); }
  catch (refused) { return; }
}
function openAtHash() {
  const match = /^#t=([-+0-9.eE]+)/.exec(location.hash), time = match ? Number(match[1]) : NaN;
  if (!isFinite(time)) { return false; }
  setPlaying(false);
  seek(time - motion.start);
  return true;
}
playButton.addEventListener("click", function () { setPlaying(!state.playing); });
found("back").addEventListener("click", function () { step(-1); });
found("ahead").addEventListener("click", function () { step(1); });
found("loop").addEventListener("click", setLoop);
scrub.addEventListener("input", function () { setPlaying(false); seek(Number(scrub.value) * span); });
scrub.addEventListener("change", rememberTime);
window.addEventListener("hashchange", openAtHash);
stillSystem.addEventListener("change", function () { if (stillSystem.matches) { setPlaying(false); } });

// -- words for a screen reader ----------------------------------------------------------------
function say(text) { found("said").textContent = text; }
function toldState() {
  const first = motion.panels[0] ? charts[0].lines.slice(0, 6) : [], unitText = motion.panels[0] ? motion.panels[0].unit : "";
  const values = first.map(function (line) {
    return line.name + " " + number(cubic(line.values, 1, 0, fractionAt(state.elapsed)), line.digits) + unitText;
  });
  return ["Time " + timeText(state.elapsed)].concat(values).join(", ") + ".";
}
function said() { say(toldState()); }
function sayMarks(from, to) {
  const passed = motion.marks.filter(function (mark) {
    return mark.t - motion.start > from && mark.t - motion.start <= to;
  })[0];
  if (passed) { say("A " + passed.label + " at " + timeText(passed.t - motion.start) + "."); }
}
