// Time: play, pause, speed, step, loop, the time line.
const state = { elapsed: 0, playing: false, looping: true, speed: motion.speed };
const scrub = byId("scrub"), playButton = byId("play");
let lastTick = null;
// A page that simulates has others: it asks for frames, true if some are to come; and words for the end.
let askForMore = function () { return false; }, wordsAtEnd = "It stops at the end.";

function show() {
  paint(fractionAt(state.elapsed));
  byId("clock").textContent = timeText(state.elapsed);
  scrub.value = span > 0 ? String(state.elapsed / span) : "0";
  scrub.setAttribute("aria-valuetext", timeText(state.elapsed));
  moveCursors();
}
function seek(time) {
  state.elapsed = Math.max(0, Math.min(span, time));
  show();
}
function takeMotion(given) {
  // Another motion in the place of this one: time and what was chosen stay.
  takeData(given);
  tellNotes();
  addMarks();
  fillPlots();
  renewPicture();
  readTheme();
  seek(state.elapsed);
}
function setPlaying(on) {
  const before = state.playing;
  state.playing = on && span > 0;
  if (state.playing && state.elapsed >= span && !askForMore()) { state.elapsed = 0; }
  playButton.textContent = state.playing ? "Pause" : "Play";
  lastTick = null;
  if (state.playing && !before) { requestAnimationFrame(tick); }
  if (before !== state.playing) { say(state.playing ? "Playing from " + timeText(state.elapsed) + "." : "Paused. " + wordsOfState()); }
  if (!state.playing) { rememberTime(); }
}
function tick(now) {
  if (!state.playing) { return; }
  const before = state.elapsed;
  if (lastTick !== null) { state.elapsed += state.speed * Math.min(0.25, (now - lastTick) / 1000); }
  lastTick = now;
  sayMarks(before, Math.min(span, state.elapsed));
  const waits = askForMore(), atEnd = state.elapsed >= span;
  if (atEnd) { state.elapsed = state.looping && !waits ? state.elapsed % span : span; }
  show();
  if (atEnd && !waits && !state.looping) { setPlaying(false); return; }
  requestAnimationFrame(tick);
}
function goTo(time) { setPlaying(false); seek(time); say(wordsOfState()); }
function step(frames) { goTo((Math.round(state.elapsed / (motion.step || 1)) + frames) * motion.step); }
function setSpeed(choice) {
  state.speed = choice;
  speedButtons.forEach(function (one, i) { one.setAttribute("aria-pressed", String(motion.speeds[i] === choice)); });
  show();
}
function nextSpeed(way) {
  const i = Math.max(0, Math.min(motion.speeds.length - 1, motion.speeds.indexOf(state.speed) + way));
  setSpeed(motion.speeds[i]);
  say("Speed " + motion.speeds[i] + ".");
}
function setLooping(on) {
  state.looping = on;
  byId("loop").setAttribute("aria-pressed", String(on));
}
function switchLoop() {
  setLooping(!state.looping);
  say(state.looping ? "It starts again at the end." : wordsAtEnd);
}
const speedButtons = motion.speeds.map(function (choice) {
  return button(byId("speeds"), String(choice) + "\u00d7", "", function () { setSpeed(choice); });
});
let furtherNotes = [];  // of the picture
function tellNotes() { byId("notes").textContent = motion.notes.concat(furtherNotes).join(" \u00b7 "); }
function addMarks() {
  byId("ticks").textContent = "";
  motion.marks.forEach(function (mark) {
    if (!(span > 0)) { return; }
    const tickMark = element("i", "", byId("ticks"));
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
byId("back").addEventListener("click", function () { step(-1); });
byId("ahead").addEventListener("click", function () { step(1); });
byId("loop").addEventListener("click", switchLoop);
scrub.addEventListener("input", function () { setPlaying(false); seek(Number(scrub.value) * span); });
scrub.addEventListener("change", rememberTime);
window.addEventListener("hashchange", openAtHash);
stillSystem.addEventListener("change", function () { if (stillSystem.matches) { setPlaying(false); } });

// -- words for a screen reader ----------------------------------------------------------------
function say(text) { byId("said").textContent = text; }
function wordsOfState() {
  const chart = charts[0], at = fractionAt(state.elapsed);
  const values = (chart ? chart.lines.slice(0, 6) : []).map(function (line) {
    return line.name + " " + number(cubic(line.values, 1, 0, at), line.digits) + chart.panel.unit;
  });
  return ["Time " + timeText(state.elapsed)].concat(values).join(", ") + ".";
}
function sayMarks(from, to) {
  const passed = motion.marks.filter(function (mark) {
    return mark.t - motion.start > from && mark.t - motion.start <= to;
  })[0];
  if (passed) { say("A " + passed.label + " at " + timeText(passed.t - motion.start) + "."); }
}
